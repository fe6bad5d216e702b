"""Sec. 9, case 3: cost of variable-step algorithms, and coherence with RK2, under light and moderate mean load."""

from __future__ import annotations

from collections.abc import Iterator

from gearrattle.report.tables import Table
from gearrattle.reproduction import printed_values
from gearrattle.reproduction.measurements import Measurements, Scope, Setup
from gearrattle.reproduction.number_formats import counted, figure
from gearrattle.reproduction.paper_coherence import CYCLES, KINDS, SAMPLES, kappa
from gearrattle.reproduction.paper_stiffness import natural
from gearrattle.reproduction.printed_values import LIGHT, LOAD_SAVING, MODERATE
from gearrattle.reproduction.reproduction_record import DIFFERS, REPRODUCED, UNAVAILABLE, Row, Section, row
from gearrattle.signals import find_impacts, steady

CASE = 3
FASTEST = float(natural(1.0, 1.0)[-1])  # rad/s
_NEAR = 0.1
VARIABLE = {"RKF": "rkf", "RKV": "rkv", "GRS": "gear", "ADM": "adams", "BUS": "bulirsch-stoer"}


def setup_of(scope: Scope, algorithm: str, ratio: float, *, loaded: bool) -> Setup:
    """A run of case 3 under a mean load."""
    step = printed_values.RK2_STEP if algorithm == "rk2" else None
    return Setup(CASE, loaded, algorithm, scope.coherent(CYCLES), ratio=ratio, step=step, samples=SAMPLES)


def needs(scope: Scope) -> Iterator[Setup]:
    """Both loads, rattling and loaded, with every algorithm that chooses its steps."""
    for loaded in KINDS.values():
        for ratio in (LIGHT, MODERATE):
            for algorithm in ("exact", "rk2", *VARIABLE.values()):
                yield setup_of(scope, algorithm, ratio, loaded=loaded)


def section(measurements: Measurements) -> Section:
    """Compare light and moderate load."""
    rows = [_cost(measurements, kind, label) for kind in KINDS for label in VARIABLE]
    rows += [_coherence(measurements, kind) for kind in KINDS]
    motions = [
        f"{kind} at {ratio:g}: {_motion(measurements, kind, ratio)}" for kind in KINDS for ratio in (LIGHT, MODERATE)
    ]
    words = (
        "Case 3, mean over largest harmonic 0.05 and 0.5; which inertia carries the mean is our assumption. The exact "
        f"motion after the start-up: {'; '.join(motions)}. Cost is counted in function calls, which do not "
        "depend on the "
        "machine."
    )
    return Section("load", "Section 9: light and moderate load", words, tuple(rows), (_table(measurements),))


def crossings(measurements: Measurements, kind: str, ratio: float) -> int | None:
    """Crossings of the exact motion in its steady part."""
    run = measurements.run(setup_of(measurements.scope, "exact", ratio, loaded=KINDS[kind]))
    if run is None:
        return None
    return int(steady(run.trajectory).contains(run.trajectory.events.time).sum())


def _motion(measurements: Measurements, kind: str, ratio: float) -> str:
    run = measurements.run(setup_of(measurements.scope, "exact", ratio, loaded=KINDS[kind]))
    number = crossings(measurements, kind, ratio)
    if run is None or number is None:
        return "no run"
    if number == 0:
        return "smooth, no corner is crossed"
    impacts = find_impacts(run.trajectory).of(run.trajectory.layout.clearance_names.index("gear"))
    mesh = len(impacts.within(steady(run.trajectory)).time)
    return f"{counted(number)} crossings, {counted(mesh)} impacts in the mesh"


def _pair(measurements: Measurements, kind: str, algorithm: str) -> tuple[int, int] | None:
    runs = [
        measurements.run(setup_of(measurements.scope, algorithm, ratio, loaded=KINDS[kind]))
        for ratio in (LIGHT, MODERATE)
    ]
    if runs[0] is None or runs[1] is None:
        return None
    return runs[0].cost.function_calls, runs[1].cost.function_calls


def _cost(measurements: Measurements, kind: str, label: str) -> Row:
    item = f"Sec. 9, load, {label}, {kind}"
    printed_claim = "about 30 % less computing at 0.5 than at 0.05"
    pair = _pair(measurements, kind, VARIABLE[label])
    if pair is None:
        return row(item, printed_claim, UNAVAILABLE, UNAVAILABLE)
    change = pair[1] / pair[0] - 1.0
    summary = f"{100 * change:+.0f} %: {counted(pair[0])} and {counted(pair[1])} calls"
    near = abs(change + LOAD_SAVING) < _NEAR
    return row(
        item,
        printed_claim,
        summary,
        REPRODUCED if near else DIFFERS,
        _why(measurements, kind, VARIABLE[label], change),
        change=change,
    )


def _why(measurements: Measurements, kind: str, algorithm: str, change: float) -> str:
    """Say what limits the step at either load."""
    runs = [
        measurements.run(setup_of(measurements.scope, algorithm, ratio, loaded=KINDS[kind]))
        for ratio in (LIGHT, MODERATE)
    ]
    costs = [run.cost for run in runs if run is not None]
    crossed = [c.events for c in costs]
    rejected = [c.rejected_steps for c in costs]
    steps = [figure(FASTEST * c.average_step, 2) for c in costs]
    fewer = (
        f"crossings go from {counted(crossed[0])} to {counted(crossed[1])}, rejected steps from "
        f"{counted(rejected[0])} to {counted(rejected[1])}"
    )
    if change < -_NEAR:
        return f"the direction is the paper's, its size depends on loads and tolerance: {fewer}"
    return (
        f"{fewer}, but the average step is held by the mesh in contact: times its frequency it is {steps[0]} at 0.05 "
        f"and {steps[1]} at 0.5"
    )


def _coherence(measurements: Measurements, kind: str) -> Row:
    """Sec. 9: solution coherences are also better for moderately loaded systems."""
    means = []
    until = []
    for ratio in (LIGHT, MODERATE):
        exact = measurements.run(setup_of(measurements.scope, "exact", ratio, loaded=KINDS[kind]))
        if exact is not None:
            until.append(figure(exact.predictability_horizon / exact.trajectory.layout.period, 2))
        setup, judge = (setup_of(measurements.scope, name, ratio, loaded=KINDS[kind]) for name in ("rkv", "rk2"))
        values = kappa(measurements, setup, judge)
        means.append(float("nan") if values is None else sum(values) / len(values))
    better = means[1] > means[0] + 0.01
    return row(
        f"Sec. 9, coherence is better at moderate load, {kind}",
        "better at 0.5",
        f"RKV with RK2, mean of four inertias: {means[0]:.2f} at 0.05, {means[1]:.2f} at 0.5",
        REPRODUCED if better else DIFFERS,
        f"the exact motion is predictable for {' and '.join(until)} cycles; harmonics follow the excitation",
        light=means[0],
        moderate=means[1],
    )


def _table(measurements: Measurements) -> Table:
    lines: list[tuple[str, ...]] = []
    for kind in KINDS:
        for label, algorithm in VARIABLE.items():
            pair = _pair(measurements, kind, algorithm)
            if pair is not None:
                lines.append(
                    (label, kind, counted(pair[0]), counted(pair[1]), f"{figure(100 * (pair[1] / pair[0] - 1), 2)} %")
                )
        numbers = [crossings(measurements, kind, ratio) for ratio in (LIGHT, MODERATE)]
        lines.append(("crossings, exact, steady part", kind, *("–" if n is None else counted(n) for n in numbers), "–"))
    return Table(("", "load", "at 0.05", "at 0.5", "change"), tuple(lines), frozenset({0, 1}), "Function calls")
