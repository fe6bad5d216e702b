"""``fit_motion``: a rough model and a recorded motion in, the model whose motion agrees with it best out.

One motion is simulated at every start; those that fit best and lie apart are followed by the search that modes and
responses are fitted by. Where the simulated motion does not repeat itself, what the search ends with is settled on a
response surface (``surface``).

Takes a Model, a Recording and how they are compared; gives a ``Fit``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.measured.fitting.choice import Chosen, of_both
from gearrattle.measured.fitting.problem import ROUGH, MotionProblem
from gearrattle.measured.fitting.recorded import Recorded, in_band
from gearrattle.measured.fitting.recording_table import RecordingTable
from gearrattle.measured.fitting.simulated import Simulator, cycles_of
from gearrattle.measured.fitting.surface import Surface, settle
from gearrattle.measured.identification.estimates import (
    FACTOR,
    STARTS,
    DataProblem,
    Progress,
    Searched,
    check_settings,
    estimates,
)
from gearrattle.measured.identification.fitted import Fit
from gearrattle.measured.identification.parameters import free_parameters
from gearrattle.measured.identification.search import Effort, Minimum, search, spread_out
from gearrattle.measured.validation import levels, orders
from gearrattle.measured.validation.cycles import Setting, Source, samples_for, source_of
from gearrattle.measured.validation.measured_cycles import check_names, check_period, measured_cycles
from gearrattle.measured.validation.pairing import Pairing, paired
from gearrattle.measured.validation.scatter import draws
from gearrattle.measured.validation.simulated import to_be_recorded
from gearrattle.measured.validation.wanted import Wanted, problems_of
from gearrattle.model import Model
from gearrattle.model.table import listed
from gearrattle.recording import Recording
from gearrattle.results import Run
from gearrattle.signals.conditioning import PASSED
from gearrattle.simulation.simulate import simulate
from gearrattle.wording import counted

Array = NDArray[np.float64]

FOLLOWED = 3
"""Starts that are followed, of those that were tried."""
_SMOOTH = Effort(40, 1e-4, 1e-2)
_JUMPING = Effort(10, 1e-2, None, settles=False)
_NEARBY = Effort(40, 1e-4, None, settles=False)
_WORSE = 10.0  # times the best chi-square: a start of a motion that does not settle is not followed
_APART = 0.15  # of the width of the bounds: starts nearer to a better one are in its valley
_EXPECTED = 10  # evaluations of a local search, for the progress alone


def fit_motion(
    model: Model,
    recording: Recording,
    table: RecordingTable,
    free: Sequence[str],
    *,
    bounds: Mapping[str, tuple[float | str, float | str]] | None = None,
    factor: float = FACTOR,
    starts: int = STARTS,
    seed: int = 0,
    prior: float | None = None,
    profile: bool = False,
    progress: Progress | None = None,
) -> Fit:
    """Find the parameters with which the simulated motion agrees with a recorded one best; arguments as of ``fit``.

    Parameters
    ----------
    model
        the rough start.
    recording
        the motion.
    table
        how it is compared.

    Raises
    ------
    ModelError
        as of ``fit``.
    ConvergenceError
        no start converged, or the start has no motion.
    """
    check_settings(starts, seed, prior)
    wanted = table.wanted(seed)
    problems = list(problems_of(wanted))
    if problems:
        raise ModelError(problems)
    check_period(model)
    parameters = free_parameters(model, free, bounds or {}, factor, sets_the_period)
    pairing = paired(recording, to_be_recorded(model), wanted.match)
    check_names(pairing, wanted)
    steps = Steps(starts, len(parameters.paths), progress)
    run = simulate(model, **table.settings, audit=False, progress=steps.watch)
    recorded, how, notes = _recorded(run, recording, (pairing, wanted), table)
    simulator = Simulator(table.settings, *how, watched=steps.watch)
    problem = MotionProblem(recorded, simulator, model, parameters, prior, steps.count)
    steps.count()
    searched, judged, said = _searched(problem, starts, seed)
    is_smooth = not isinstance(judged, Surface)
    if profile and not is_smooth:
        said = [
            *said,
            "no profiles: of a motion that does not repeat itself only slopes are known, over a small range.",
        ]
    said = [*notes, *pairing.notes, *said, *recording.notes]
    has_profile = profile and is_smooth
    fitted = estimates(model, judged, parameters, searched, notes=said, profile=has_profile, progress=progress)
    if progress is not None:
        progress(1.0)
    return fitted


def sets_the_period(path: str) -> tuple[str, str] | None:
    """Say why a value cannot be fitted to a motion; None for any other."""
    if path.startswith("simulation."):
        return "is a setting of the simulation, not of the driveline", "leave it out of free"
    if path.startswith("excitation.") or path.rsplit(".", 1)[-1] == "order":
        return "sets the period that both motions are cut by", "leave it out of free"
    return None


class Steps:
    """What of a fit is done, in simulations.

    Parameters
    ----------
    starts
        that are tried.
    count
        of parameters.
    progress
        called with the share; what it raises ends the fit.
    """

    def __init__(self, starts: int, count: int, progress: Progress | None) -> None:
        self._done, self._progress = 0, progress
        self._all = starts + min(starts, FOLLOWED) * (1 + 2 * count) * _EXPECTED

    def count(self) -> None:
        """Count one more simulation."""
        self._done += 1
        self._all = max(self._all, int(1.1 * self._done) + 1)
        self.watch(0.0)

    def watch(self, _share: float) -> None:
        """Tell the share."""
        if self._progress is not None:
            self._progress(self._done / self._all)


def _recorded(
    run: Run, recording: Recording, asked: tuple[Pairing, Wanted], table: RecordingTable
) -> tuple[Recorded, tuple[tuple[str, ...], tuple[float, float], int, str], tuple[str, ...]]:
    """Cut the measured record into cycles and choose what is compared; with the simulator's arguments and notes."""
    pairing, wanted = asked
    names = tuple(channel.name for channel in pairing.simulated)
    source, notes = source_of(recording, pairing.measured)
    period = run.trajectory.layout.period
    own = cycles_of(run, names, wanted.trend)
    grid = Source(np.zeros((2, len(names))), period / own.values.shape[1], 0.0, "the simulation")
    setting = Setting(samples_for((source, grid), period, wanted.band[1]), 0.0, wanted.trend)
    cycles = measured_cycles(source, period, setting, wanted)
    lowest = wanted.band[0]
    band = lowest, PASSED * setting.samples / period
    how = draws(levels.mean_squares(cycles), np.random.default_rng(wanted.seed), lines=orders.strong(cycles))
    simulator = names, band, int(PASSED * setting.samples), wanted.trend
    start = Simulator({}, *simulator).motion_of(own)
    by_rms = np.array([i for i, c in enumerate(pairing.measured) if c.name in wanted.noise], dtype=np.int64)
    line, channel = of_both(orders.lines_of(cycles, how), start.lines, in_band(cycles, lowest))
    delay = None if wanted.clock == "cycle" else 0.0 if wanted.clock == "none" else float(wanted.clock)
    recorded = Recorded(
        channels=pairing.measured,
        cycles=cycles,
        lowest=lowest,
        period=period,
        base=2.0 * np.pi / (period * run.trajectory.layout.omega),
        chosen=Chosen(line, channel, by_rms, table.phases, delay),
        draws=how,
        noise=np.array([wanted.noise[pairing.measured[i].name] ** 2 for i in by_rms.tolist()]),
        calibration=_calibration(wanted, pairing),
    )
    _check_levels(recorded)
    said = [*notes, *_off(cycles.period, period)]
    return recorded, simulator, tuple(said)


def _check_levels(recorded: Recorded) -> None:
    """Refuse a record in which nothing stands out, and noise that is louder than what was measured."""
    by_rms = recorded.chosen.by_rms
    power = recorded.motion.power[by_rms]
    names = [channel.name for channel in recorded.channels]
    if not recorded.chosen.line.size and not by_rms.size:
        rule = "no order of the model's period stands out of the scatter of the cycles, neither measured nor simulated"
        raise ModelError(Problem("recording", listed(names), rule, "check speed, band and channels"))
    problems = [
        Problem(f"recording.noise.{names[i]}", f"{level**0.5:.6g}", f"must be below the rms in the band, {rms:.6g}")
        for i, level, rms in zip(by_rms.tolist(), recorded.noise.tolist(), np.sqrt(power).tolist(), strict=True)
        if level >= rms**2
    ]
    if problems:
        raise ModelError(problems)


def _off(measured: float, period: float) -> list[str]:
    """Say that the record has a period of its own."""
    off = measured / period - 1.0
    way = "longer" if off > 0.0 else "shorter"
    return [f"the measured cycle is {100.0 * abs(off):.3g} % {way} than the model's."] if off else []


def _calibration(wanted: Wanted, pairing: Pairing) -> Array:
    """(C,) relative standard uncertainty of every channel."""
    stated = wanted.calibration
    if not isinstance(stated, Mapping):
        return np.full(len(pairing.measured), 0.01 * (stated or 0.0))
    return np.array([0.01 * stated.get(channel.name, 0.0) for channel in pairing.measured])


def _searched(problem: MotionProblem, starts: int, seed: int) -> tuple[Searched, DataProblem, list[str]]:
    """Return the minima, the problem by which the best of them is judged, and what must be said of the search."""
    origin = np.zeros(len(problem.parameters.paths))
    if problem.jitter(origin) > ROUGH:
        problem = problem.scattering(origin, seed)
    points, failed, reason = _tried(problem, starts, seed)
    if not points:
        raise ConvergenceError(f"none of {counted(starts, 'start')} has a motion: {reason}", remedy="narrower bounds")
    rough = problem.jitter(points[0][1]) > ROUGH
    if rough:
        problem = problem.scattering(points[0][1], seed)
        points = sorted(((problem.chi_square(point), point) for _, point in points), key=lambda one: one[0])
        points = [(chi, point) for chi, point in points if chi <= _WORSE * points[0][0]]
    followed = _apart(points, problem.parameters.box)
    differences = problem.differences(problem.jitter(followed[0]))
    effort = _JUMPING if rough else _SMOOTH
    minima, lost = search(differences.residuals, followed, problem.parameters.box, effort)
    said = [f"{counted(starts, 'start')} tried, the {len(followed)} that fit best followed."] if len(points) > 1 else []
    if failed:
        said.append(f"{counted(failed, 'start')} had no motion that could be compared: {reason}")
    searched = problem
    problem = problem.judged_at(minima[0].x)
    after = problem.jitter(minima[0].x)
    if after > ROUGH:
        problem = problem.scattering(minima[0].x, seed)
        best, judged = settle(problem.differences(problem.jitter(minima[0].x)), minima[0])
        return Searched((best, *_anew(judged.of, minima[1:])), len(followed), lost), judged, said
    jumped = rough or differences.step > 3.0 * problem.step(after)  # the start's motion jumps, the best one's does not
    if jumped or not problem.recorded.compares_as(searched.recorded):
        differences = problem.differences(after)
        effort = _SMOOTH if jumped else _NEARBY
        again, _ = search(differences.residuals, [minima[0].x], problem.parameters.box, effort)
        minima = (replace(again[0], times=minima[0].times), *_anew(problem, minima[1:]))
    return Searched(minima, len(followed), lost, _SMOOTH), differences, said


def _anew(problem: MotionProblem, minima: Sequence[Minimum]) -> list[Minimum]:
    """Return minima with their chi-square in the standard errors that the best one is judged by."""
    judged = [replace(minimum, chi_square=problem.level(minimum.x)) for minimum in minima]
    return sorted(judged, key=lambda minimum: minimum.chi_square)


def _tried(problem: MotionProblem, starts: int, seed: int) -> tuple[list[tuple[float, Array]], int, str]:
    """Return chi-square at every start that has a motion, the best first; how many have none, and why."""
    tried: list[tuple[float, Array]] = []
    reason = ""
    for point in spread_out(problem.parameters.box, starts, seed):
        try:
            tried.append((problem.chi_square(point), point))
        except ConvergenceError as error:
            reason = str(error)
    return sorted(tried, key=lambda one: one[0]), starts - len(tried), reason


def _apart(tried: Sequence[tuple[float, Array]], box: tuple[Array, Array]) -> list[Array]:
    """Return the best starts that are not in one valley."""
    chosen: list[Array] = []
    for _, point in tried:
        if len(chosen) == FOLLOWED:
            break
        if all(np.max(np.abs(point - other) / (box[1] - box[0])) > _APART for other in chosen):
            chosen.append(point)
    return chosen
