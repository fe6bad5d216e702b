"""The procedure of a validation: pairs, cycles, one clock, levels, orders, bands, impacts, budgets, sentences."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.validation import band_densities, budget, cycle_clock, level_agreement, order_agreement
from gearrattle.measured.validation.block_bootstrap import Draws, draws
from gearrattle.measured.validation.cycles import Cycles, Setting, Source, cut, samples_for, source_of
from gearrattle.measured.validation.effects import Explained
from gearrattle.measured.validation.explained_by_parameters import SPARE, explained, sentences
from gearrattle.measured.validation.impact_agreement import compare_impacts, counted_of
from gearrattle.measured.validation.mean_cycle_curves import curves_of
from gearrattle.measured.validation.measured_cycles import check_names, check_period, measured_cycles
from gearrattle.measured.validation.pairing import Pairing, paired
from gearrattle.measured.validation.parameter_uncertainty import Drawn, correlations, repeated, standard_errors
from gearrattle.measured.validation.simulated_recording import recorded, to_be_recorded
from gearrattle.measured.validation.validation_arguments import Wanted
from gearrattle.measured.validation.validation_records import Clock, Level, Pair, Validation
from gearrattle.measured.validation.validation_sentences import findings_of, verdict_of
from gearrattle.model import Model
from gearrattle.model.table import listed
from gearrattle.recording import Recording
from gearrattle.results import Run
from gearrattle.signals.conditioning import PASSED
from gearrattle.trajectory import Array
from gearrattle.wording import counted

_AS_GOOD = 0.1  # correlations this near to the highest: the delay that scatters least is taken
_FOLDED = 5.0  # %: more is reported
_EXACT_TOLERANCE = 1e-12  # of the contract, where the run's model does not say another


@dataclass(frozen=True)
class _Matter:
    """Inputs of all parts of the comparison: measured first, simulated second; the band's ends are in Hz."""

    run: Run
    pairing: Pairing
    wanted: Wanted
    setting: Setting
    sources: tuple[Source, Source]
    cycles: tuple[Cycles, Cycles]
    drawn: tuple[Draws, Draws]
    band: tuple[float, float]


def compared(run: Run, recording: Recording, wanted: Wanted, progress: Callable[[float], None] | None) -> Validation:
    """Return the validation of a run by a recording; ModelError as of ``validate``."""
    # pairs, cycles and their scatter
    check_period(run.model)
    errors = standard_errors(run.model, wanted.parameters)
    matter, notes = _matter(run, recording, wanted)
    # one clock for both records
    clock, lines = _clock(matter)
    # sources of uncertainty, parameters by repeated runs
    known = _known(matter)
    repeats = _repeated(matter, errors, progress) if errors else None
    if repeats is not None:
        told_apart = "" if isinstance(wanted.parameters, Mapping) else ", correlated as fitted"
        words = f"{counted(wanted.draws, 'run')}, seed {wanted.seed}: {listed(errors)}{told_apart}"
        known = replace(known, parameters=repeats.uncertainty(known.scatter[1]), parameters_words=words)
    # levels, orders and bands of every pair; impacts
    pairs = _pairs(matter, known, clock, lines)
    cycles = matter.cycles
    drawn = matter.drawn
    pairing = matter.pairing
    by_parameters = None if repeats is None else explained(repeats, pairs, cycles, drawn)
    impacts = compare_impacts(run.trajectory, cycles, drawn, pairing.measured, wanted.thresholds)
    # the result, with verdict, findings and notes
    return Validation(
        model=run.model.name or "driveline",
        source=recording.source,
        algorithm=run.cost.algorithm,
        measured_cycles=cycles[0].count,
        simulated_cycles=cycles[1].count,
        measured_block=drawn[0].block,
        simulated_block=drawn[1].block,
        rate=cycles[1].rate,
        band=matter.band,
        trend=wanted.trend,
        clock=clock,
        pairs=pairs,
        impacts=impacts,
        unmatched_measured=pairing.measured_alone,
        unmatched_simulated=pairing.simulated_alone,
        verdict=verdict_of(pairs),
        findings=(
            *findings_of(pairs, impacts, clock),
            *([] if by_parameters is None else sentences(by_parameters)),
        ),
        notes=(
            *notes,
            *pairing.notes,
            *_notes(matter, clock, pairs),
            *_few(repeats, by_parameters),
            *recording.notes,
            *run.notes,
        ),
        parameters=by_parameters,
    )


def check_asked(model: Model, recording: Recording, wanted: Wanted) -> None:
    """Refuse, before a model is simulated, all arguments that its run cannot have.

    The ModelError is that of ``compared``, where the samples of the run play no part.
    """
    check_period(model)
    simulation = to_be_recorded(model)
    pairing = paired(recording, simulation, wanted.match)
    check_names(pairing, wanted)
    standard_errors(model, wanted.parameters)
    clearances = [channel.subject for channel in simulation.channels if channel.quantity == "deflection"]
    counted_of(clearances, pairing.measured, wanted.thresholds)


def _matter(run: Run, recording: Recording, wanted: Wanted) -> tuple[_Matter, tuple[str, ...]]:
    """Pair channels, and cut both records into cycles; with notes."""
    simulation = recorded(run)
    pairing = paired(recording, simulation, wanted.match)
    check_names(pairing, wanted)
    measured, notes = source_of(recording, pairing.measured)
    simulated, _ = source_of(simulation, pairing.simulated)
    period = run.trajectory.layout.period
    low, high = wanted.band
    setting = Setting(samples_for((measured, simulated), period, high), low, wanted.trend)
    top = PASSED * setting.samples / period
    if not low < top:
        raise ModelError(Problem("band", f"from {low:g} Hz", f"must begin below {top:.6g} Hz, where it ends"))
    steady = run.trajectory.discard * period, simulated.last
    sim = cut(simulated, period, setting, steady, whole_start=True)
    cycles = measured_cycles(measured, period, setting, wanted), sim
    drawn = _drawn(cycles, wanted.seed)
    return _Matter(run, pairing, wanted, setting, (measured, simulated), cycles, drawn, (low, top)), notes


def _drawn(cycles: tuple[Cycles, Cycles], seed: int) -> tuple[Draws, Draws]:
    generator = np.random.default_rng(seed)
    first, second = (
        draws(level_agreement.mean_squares(cycle), generator, lines=order_agreement.strong(cycle)) for cycle in cycles
    )
    return first, second


def _clock(matter: _Matter) -> tuple[Clock, tuple[order_agreement.Lines, order_agreement.Lines]]:
    """Return the clock, and the lines of both records on it."""
    # lines of both mean cycles
    cycles = matter.cycles
    drawn = matter.drawn
    wanted = matter.wanted
    own = order_agreement.lines_of(cycles[0], drawn[0]), order_agreement.lines_of(cycles[1], drawn[1])
    z = own[0].mean
    x = own[1].mean
    period = cycles[1].period
    nan = float("nan")
    replicates = len(own[0].replicates)
    # a given delay, or one clock
    if wanted.clock == "none" or not isinstance(wanted.clock, str):
        delay = 0.0 if isinstance(wanted.clock, str) else float(wanted.clock)
        alignment = Clock("given" if delay else "none", "", delay, 0.0, nan, nan, period, cycles[0].period)
        return alignment, (order_agreement.moved(own[0], delay, np.full(replicates, delay), period), own[1])
    # the delay of every channel; of those that agree best, the one with the least scatter
    names = [channel.name for channel in matter.pairing.measured]
    tried = []
    for c in [names.index(wanted.clock_by)] if wanted.clock_by else range(len(names)):
        used = cycle_clock.chosen_lines(x[:, c], z[:, c], wanted.clock)
        tried.append((cycle_clock.delay_of(x[:, c], z[:, c], period, used), c, used))
    highest = max(trial[0].agreement for trial in tried)
    near = [trial for trial in tried if trial[0].agreement >= highest - _AS_GOOD]
    timed = [(order_agreement.delays(own[1], own[0], c, used, (at.delay, period)), at, c) for at, c, used in near]
    sampled_delays, best, c = min(timed, key=lambda one: float(np.std(one[0])))
    # refuse cycles that do not agree
    if best.agreement < cycle_clock.LEAST and wanted.clock == "cycle":
        rule = f"the mean cycles do not agree at any delay: a correlation of {cycle_clock.LEAST:g} is needed"
        remedy = 'check sign, unit and speed; clock = "none" if the clocks are one: phases then mean nothing else'
        raise ModelError(Problem(f"clock: {names[c]}", f"a correlation of {best.agreement:.3g}", rule, remedy))
    # standard error of the delay, and lines on one clock
    error = float(np.hypot(*(one.error(sampled_delays) for one in drawn)) / np.sqrt(2.0))
    alignment = Clock(wanted.clock, names[c], best.delay, error, best.agreement, best.rival, period, cycles[0].period)
    return alignment, (order_agreement.moved(own[0], best.delay, sampled_delays, period), own[1])


def _known(matter: _Matter) -> budget.Known:
    """Return the uncertainties of every channel."""
    # change of the levels between samples, and by a coarser output grid
    run = matter.run
    sources = matter.sources
    cycles = matter.cycles
    drawn = matter.drawn
    setting = matter.setting
    shape = (2, cycles[0].values.shape[2])
    between = [budget.between_samples(source, cycle, setting) for source, cycle in zip(sources, cycles, strict=True)]
    end = cycles[1].start, sources[1].last
    # the numerical error, which the exact algorithm certifies
    exact = run.cost.algorithm == "exact"
    tolerance = run.model.simulation.tolerance or _EXACT_TOLERANCE
    words = (
        f"certified: every crossing within {tolerance:g} of its corner; beyond the predictability horizon a level of "
        "a right motion, its scatter counted above"
        if exact
        else f"not known: {run.cost.algorithm} certifies nothing; compare with exact"
    )
    # all together, parameters not yet known
    return budget.Known(
        scatter=budget.known_scatter(cycles, drawn),
        freedoms=(drawn[0].freedom, drawn[1].freedom),
        between=np.asarray(np.hypot(*between)),
        grid=budget.half_grid(sources[1], cycles[1], setting, end),
        numerical=np.full(shape, tolerance if exact else np.nan),
        numerical_words=words,
        parameters=np.full(shape, np.nan),
        parameters_words="no standard errors were given: the uncertainty of the model is in the remainder",
    )


def _repeated(
    matter: _Matter, errors: dict[str, tuple[float, float]], progress: Callable[[float], None] | None
) -> Drawn:
    """Repeat the simulation with drawn parameters."""
    wanted = matter.wanted
    together = correlations(errors, wanted.parameters)
    return repeated(
        matter.run,
        errors,
        together,
        lambda run: _levels(run, matter),
        runs=wanted.draws,
        seed=wanted.seed,
        progress=progress,
    )


def _few(drawn: Drawn | None, explanation: Explained | None) -> list[str]:
    """Return a note where nothing is reported for each parameter separately."""
    if drawn is None or explanation is not None:
        return []
    count, free = drawn.standard.shape
    if count >= free + SPARE:
        return ["parameters: no channel has an rms in both records, so their effects cannot be separated"]
    return [f"parameters: {count} runs are too few for the effects of {free}; draws={free + SPARE} or more are needed"]


def _levels(run: Run, matter: _Matter) -> Array:
    """(2, C) levels of another run of the same driveline, compared in the same way."""
    recording = recorded(run)
    source, _ = source_of(recording, tuple(recording[channel.name] for channel in matter.pairing.simulated))
    period = run.trajectory.layout.period
    steady = run.trajectory.discard * period, source.last
    return level_agreement.levels_of(cut(source, period, matter.setting, steady, whole_start=True))


def _pairs(
    matter: _Matter, known: budget.Known, clock: Clock, lines: tuple[order_agreement.Lines, order_agreement.Lines]
) -> tuple[Pair, ...]:
    """Return every channel with its levels, orders, bands and budget."""
    layout = matter.run.trajectory.layout
    spectra = band_densities.densities(*matter.cycles)
    base = 2.0 * np.pi / (layout.period * layout.omega)
    levelled = level_agreement.compare_levels(*matter.cycles, matter.drawn)
    ordered = order_agreement.compare_orders(*lines, base, 1.0 / layout.period)
    banded = band_densities.compare_bands(spectra, matter.band)
    curves = curves_of(matter.cycles, spectra, clock.delay)
    made = []
    for c, (one, other) in enumerate(zip(matter.pairing.measured, matter.pairing.simulated, strict=True)):
        stated = _stated(matter, one.name)
        rows = tuple(budget.with_budget(level, row, c, known, stated) for row, level in enumerate(levelled[c]))
        z = lines[0].mean[:, c]
        x = lines[1].mean[:, c]
        scale = float(np.sqrt(np.sum(np.abs(z) ** 2) * np.sum(np.abs(x) ** 2)))
        agreement = float(np.sum(np.conj(x) * z).real) / scale if scale > 0.0 else float("nan")
        what = other.quantity, other.subject, other.unit
        made.append(Pair(one.name, other.name, *what, rows, ordered[c], banded[c], agreement, curves[c]))
    return tuple(made)


def _stated(matter: _Matter, name: str) -> tuple[float, float, int]:
    """Return noise and calibration as stated for a channel, NaN where they are not, and the samples in a cycle."""
    calibrations = matter.wanted.calibration
    nan = float("nan")
    calibration = (
        calibrations.get(name, nan)
        if isinstance(calibrations, Mapping)
        else nan
        if calibrations is None
        else calibrations
    )
    return matter.wanted.noise.get(name, nan), float(calibration), matter.setting.samples


def _notes(matter: _Matter, clock: Clock, pairs: tuple[Pair, ...]) -> list[str]:
    """Return notes for the reader: motions that are not steady, signs, clocks that repeat."""
    # motions that are not steady: their halves differ
    notes = []
    for cycle, how, whose in zip(matter.cycles, matter.drawn, ("measured", "simulated"), strict=True):
        half = cycle.count // 2
        square = level_agreement.mean_squares(cycle)
        error = how.error(how.means(square)) * 2.0  # of a difference of halves
        moving = np.abs(square[:half].mean(axis=0) - square[-half:].mean(axis=0)) > 3.0 * error + 1e-3 * square.mean(
            axis=0
        )
        names = [
            pair.name if whose == "measured" else pair.partner for pair, off in zip(pairs, moving, strict=True) if off
        ]
        if names:
            notes.append(f"{listed(names)}: the {whose} motion is not steady, its halves differ by more than chance")
    # channels with the sign turned
    inverted = [pair.name for pair in pairs if pair.agreement < -0.5]
    if inverted:
        notes.append(f"{listed(inverted)}: the mean cycle is that of the simulation with its sign turned")
    # output grids that are too coarse
    folded = [pair.name for pair in pairs if any(_grid(level) > _FOLDED for level in pair.levels)]
    if folded:
        notes.append(
            f"{listed(folded)}: the run's output grid is too coarse, on half of it levels change by more than "
            f"{_FOLDED:g} %; raise samples_per_cycle"
        )
    # delays that agree nearly as well
    if clock.rival > 0.95 * clock.agreement:
        notes.append(f"clock: a delay elsewhere agrees nearly as well ({clock.rival:.4g})")
    return notes


def _grid(level: Level) -> float:
    """Contribution of the output grid to the uncertainty of a level [%]."""
    return next(term.value for term in level.budget if term.source == "output grid")
