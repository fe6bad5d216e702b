"""Fig. 7: case 3, relative displacements by RK2 and RKV, spectra by RK2 and GRS; our results, drawn in the same way.

It is unknown which displacement and which cycles the paper shows, because only its text is available, not its figures.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gearrattle.comparison.motion_statistics import portrait
from gearrattle.comparison.nearby_motions import MANY, exact_portraits
from gearrattle.comparison.pointwise import pointwise
from gearrattle.comparison.statistics_comparison import compare_statistics
from gearrattle.report.plots.chart import Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.palette import COLOURS, INK
from gearrattle.reproduction.mean_load import setup_of as of_load
from gearrattle.reproduction.measurements import Measurements, Scope, Setup
from gearrattle.reproduction.number_formats import figure
from gearrattle.reproduction.paper_cases import load_case
from gearrattle.reproduction.paper_coherence import CYCLES, KINDS
from gearrattle.reproduction.printed_values import LIGHT
from gearrattle.reproduction.reproduction_record import DIFFERS, REPRODUCED, UNAVAILABLE, Row, Section, row
from gearrattle.results import Run
from gearrattle.signals import Spectrum, last_cycles, psd, steady

HIGH_ORDER = 50.0
"""Order above which there are only impacts and their ringing, but no torques, mesh order or its first overtone."""
SHOWN = 8
BLOCK = 12
_SMOOTHING = 0.05
_SLIGHT = 0.1
_SLOW = 2.0


def setup_of(scope: Scope, algorithm: str, *, loaded: bool) -> Setup:
    """A run of case 3 under light load."""
    return of_load(scope, algorithm, LIGHT, loaded=loaded)


def needs(scope: Scope) -> Iterator[Setup]:
    """The figure's three algorithms and exact."""
    for loaded in KINDS.values():
        for algorithm in ("exact", "rk2", "rkv", "gear"):
            yield setup_of(scope, algorithm, loaded=loaded)
        yield setup_of(scope, "exact", loaded=loaded).at(nearby=True)


def section(measurements: Measurements) -> Section:
    """Compare both halves of the figure."""
    rows = [row for kind in KINDS for row in (_histories(measurements, kind), _spectra(measurements, kind))]
    charts = [
        chart
        for kind in KINDS
        for chart in (_history_chart(measurements, kind), _spectrum_chart(measurements, kind))
        if chart
    ]
    words = f"Case 3 under light load, {CYCLES if not measurements.scope.quick else 'fewer'} cycles."
    return Section("figure-7", "Figure 7: histories and spectra", words, tuple(rows), charts=tuple(charts))


def _run(measurements: Measurements, algorithm: str, kind: str) -> Run | None:
    return measurements.run(setup_of(measurements.scope, algorithm, loaded=KINDS[kind]))


def _histories(measurements: Measurements, kind: str) -> Row:
    # runs, and the instants up to which they agree
    item = f"Fig. 7(a), (b), RK2 and RKV, {kind}"
    printed_claim = "slight variations between the two solutions"
    rk2, rkv, exact = (_run(measurements, name, kind) for name in ("rk2", "rkv", "exact"))
    if rk2 is None or rkv is None or exact is None:
        return row(item, printed_claim, "a run did not come to an end", DIFFERS, "a run did not come to an end")
    period = rk2.trajectory.layout.period
    apart = float(pointwise(rkv.trajectory, rk2.trajectory).passed[-1]) / period
    horizon = exact.predictability_horizon / period
    # statistics against those of exact motions begun nearby
    near = measurements.run(setup_of(measurements.scope, "exact", loaded=KINDS[kind]).at(nearby=True))
    judged = (("RK2", rk2), ("RKV", rkv), ("exact begun 1e-12 away", near))
    off = _different(measurements, kind, exact, {name: run for name, run in judged if run is not None})
    # difference of RK2 and RKV over the motion
    parts = _difference(rkv, rk2)
    summary = (
        f"rms of the difference over rms of the motion, last {SHOWN} cycles: "
        f"{', '.join(f'{name} {figure(value, 2)}' for name, value in parts.items())}; "
        f"statistics outside those of {MANY} exact motions begun nearby: "
        f"{', '.join(f'{name} {a} of {b}' for name, (a, b) in off.items())}"
    )
    # slight in all bodies, or the reasons why not
    slight = max(parts.values()) < _SLIGHT
    why = (
        f"slight in {', '.join(name for name, v in parts.items() if v < _SLIGHT) or 'none'} only: they are a tenth "
        f"of a half-gap apart from cycle {figure(apart, 2)} and the motion is predictable for {figure(horizon, 2)}; "
        f"beyond, two algorithms share statistics at best"
    )
    if (wander := _wander(exact)) > _SLOW:
        why += (
            f", and these wander slowly: in exact itself the hub's rms acceleration varies {figure(wander, 2)}-fold "
            f"between blocks of {BLOCK} cycles"
        )
    return row(
        item,
        printed_claim,
        summary,
        REPRODUCED if slight else DIFFERS,
        "" if slight else why,
        apart=apart,
        horizon=horizon,
        **parts,
    )


def _different(measurements: Measurements, kind: str, exact: Run, runs: dict[str, Run]) -> dict[str, tuple[int, int]]:
    """How many statistics of each lie outside those of exact motions begun nearby, of how many."""
    setup = setup_of(measurements.scope, "exact", loaded=KINDS[kind])
    t = exact.trajectory
    grid = {"cycles": t.cycles, "discard": t.discard, "samples_per_cycle": t.samples_per_cycle}
    others = exact_portraits(load_case(setup.case, setup.ratio, loaded=setup.loaded), t, grid, None)
    comparisons = {name: compare_statistics(portrait(run.trajectory), others) for name, run in runs.items()}
    return {name: (comparison.different, len(comparison.items)) for name, comparison in comparisons.items()}


def _wander(run: Run, inertia: str = "hub") -> float:
    """Largest over smallest rms acceleration of blocks of cycles in the steady part."""
    t = run.trajectory
    samples = steady(t).periodic(t.acceleration)[:, t.layout.inertia_names.index(inertia)]
    length = BLOCK * t.samples_per_cycle
    blocks = samples[: max(1, samples.size // length) * length].reshape(-1, min(length, samples.size))
    levels = np.sqrt(np.mean(blocks**2, axis=1))
    return float(levels.max() / levels.min())


def _difference(run: Run, reference: Run) -> dict[str, float]:
    """By clearance: rms difference of deflections over the last cycles, over the motion's rms about its mean."""
    t = reference.trajectory
    window = last_cycles(t, SHOWN)
    mine, theirs = (window.periodic(motion.trajectory.deflection) for motion in (run, reference))
    share = np.sqrt(np.mean((mine - theirs) ** 2, axis=0)) / np.std(theirs, axis=0)
    return {name: float(value) for name, value in zip(t.layout.clearance_names, share, strict=True)}


def density(run: Run, inertia: str = "output_gear") -> Spectrum:
    """Power spectral density of an acceleration over the steady part."""
    t = run.trajectory
    samples = steady(t).periodic(t.acceleration)[:, t.layout.inertia_names.index(inertia)]
    return psd(samples, t.layout.period, t.samples_per_cycle)


def high_share(run: Run) -> float:
    """Mean square of the output gear's acceleration above HIGH_ORDER [rad^2/s^4]."""
    spectrum = density(run)
    order = spectrum.frequency * 2.0 * np.pi / run.trajectory.layout.omega
    return float(np.sum(spectrum.density[order > HIGH_ORDER]) * spectrum.resolution)


def _spectra(measurements: Measurements, kind: str) -> Row:
    # runs, and mean square above the high order against exact
    item = f"Fig. 7(c), (d), GRS smooths high frequencies, {kind}"
    printed_claim = "a tendency to smooth them out"
    rk2, gear, exact = (_run(measurements, name, kind) for name in ("rk2", "gear", "exact"))
    if rk2 is None or exact is None:
        return row(item, printed_claim, "a run did not come to an end", DIFFERS, "a run did not come to an end")
    base = high_share(exact)
    own = high_share(rk2) / base - 1.0
    # without GRS: RK2 alone
    if gear is None:
        status = measurements.result(setup_of(measurements.scope, "gear", loaded=KINDS[kind])).status
        summary = f"gear: {status}. RK2 against exact above order {HIGH_ORDER:g}: {100 * own:+.1f} % of mean square"
        return row(item, printed_claim, summary, UNAVAILABLE, rk2=own)
    # change by chance, and by GRS
    near = measurements.run(setup_of(measurements.scope, "exact", loaded=KINDS[kind]).at(nearby=True))
    chance = abs(high_share(near) / base - 1.0) if near is not None else 0.0
    change = high_share(gear) / base - 1.0
    summary = (
        f"above order {HIGH_ORDER:g}, mean square against exact: GRS {100 * change:+.0f} %, RK2 {100 * own:+.0f} %, "
        f"exact begun 1e-12 away {100 * chance:.0f} % off"
    )
    # smoother than chance and RK2
    smooths = change < min(own, 0.0) - max(_SMOOTHING, chance)
    why = (
        "the damping of backward differences at steps too long for the mode"
        if smooths
        else "at tolerance 1e-6 ours smooths nothing beyond what chance moves; the paper's tolerance is not printed"
    )
    return row(
        item, printed_claim, summary, REPRODUCED if smooths else DIFFERS, why, gear=change, rk2=own, chance=chance
    )


def _history_chart(measurements: Measurements, kind: str) -> Chart | None:
    runs = {name: _run(measurements, name, kind) for name in ("rk2", "rkv")}
    panels = []
    colour = dict(zip(runs, COLOURS, strict=False))
    for name, run in runs.items():
        if run is None:
            return None
        t = run.trajectory
        gear = run.trajectory.layout.clearance_names.index("gear")
        window = last_cycles(t, SHOWN)
        index = window.first + np.arange(window.closed(t.time).size)
        x, y = index / t.samples_per_cycle, t.deflection[index, gear] / (0.5 * np.ptp(t.layout.corners[gear]))
        panels.append(
            Panel(
                name,
                "half-gaps",
                "time / T  [cycles]",
                (Line(x, y, name, colour[name], width=0.8),),
                rules=(Rule(1.0), Rule(-1.0)),
                x_range=(float(x[0]), float(x[-1])),
                y_range=(-2.0, 2.0),
            )
        )
    caption = f"Mesh deflection of case 3, {kind}, over the last {SHOWN} cycles; dashed: the gap's ends."
    return Chart(f"fig-7ab-{kind}", f"Figure 7(a), (b), {kind}", caption, tuple(panels))


def _spectrum_chart(measurements: Measurements, kind: str) -> Chart | None:
    # densities at flywheel and output gear, by algorithm
    names = {"exact": INK, "rk2": COLOURS[0], "gear": COLOURS[1]}
    panels = []
    for inertia in ("flywheel", "output_gear"):
        lines = []
        for name, colour in names.items():
            run = _run(measurements, name, kind)
            if run is None:
                continue
            spectrum = density(run, inertia)
            order = spectrum.frequency * 2.0 * np.pi / run.trajectory.layout.omega
            lines.append(Line(order[1:], spectrum.density[1:], name, colour, width=1.0))
        if not lines:
            return None
        top = max(float(line.y.max()) for line in lines)
        panels.append(
            Panel(
                inertia,
                "(rad/s²)²/Hz",
                "order",
                tuple(lines),
                x_range=(0.0, 256.0),
                y_range=(1e-9 * top, 10.0 * top),
                y_log=True,
            )
        )
    # caption and legend
    caption = f"Power spectral densities of accelerations, case 3, {kind}, steady part."
    legend = tuple(Key(line.name, line.colour) for line in panels[0].lines)
    return Chart(f"fig-7cd-{kind}", f"Figure 7(c), (d), {kind}", caption, tuple(panels), legend=legend)
