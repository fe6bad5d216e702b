"""Sec. 9: whether higher-order methods are inefficient under light load, by their function calls at an equal error.

Case 3 under light (0.05) and moderate (0.5) mean load, from the start until perturbations have grown by a factor 1000.
The calls at an error are interpolated, log over log, between the two runs with a larger and a smaller error.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from gearrattle.comparison.pointwise import pointwise
from gearrattle.report.plots.chart import Chart, Key, Line, Panel
from gearrattle.report.plots.palette import COLOURS
from gearrattle.reproduction.measurements import Measurements, Scope, Setup
from gearrattle.reproduction.number_formats import counted
from gearrattle.reproduction.paper_coherence import KINDS
from gearrattle.reproduction.printed_values import LIGHT, MODERATE
from gearrattle.reproduction.reproduction_record import DIFFERS, REPRODUCED, Row, Section, row

CYCLES = 5
ORDERS = {"rk2": 2, "rk4": 4, "rkf": 5, "rkv": 6}
_STEPS = tuple(0.004 / 2.0**k for k in range(7))
_TOLERANCES = tuple(10.0**-k for k in range(3, 10))
_QUICK = 3  # runs of each method in a quick reproduction
_CLEARLY = 1.1  # ratio of calls from which a method counts as worse
Points = list[tuple[float, float]]
Curves = dict[tuple[str, float], dict[str, Points]]


def setups_of(scope: Scope, name: str, ratio: float, *, loaded: bool) -> tuple[Setup, ...]:
    """Runs of one algorithm, coarse to fine."""
    base = Setup(3, loaded, name, CYCLES, ratio=ratio, samples=256)
    if name == "exact":
        return (base,)
    if name in ("rk2", "rk4"):
        return tuple(base.at(step=step) for step in _STEPS[: _QUICK if scope.quick else None])
    return tuple(base.at(tolerance=tolerance) for tolerance in _TOLERANCES[: _QUICK if scope.quick else None])


def needs(scope: Scope) -> Iterator[Setup]:
    """All curves."""
    for loaded in KINDS.values():
        for ratio in (LIGHT, MODERATE):
            for name in ("exact", *ORDERS):
                yield from setups_of(scope, name, ratio, loaded=loaded)


def section(measurements: Measurements) -> Section:
    """Compare calls for the same error."""
    curves = {
        (kind, ratio): {name: _curve(measurements, name, ratio, KINDS[kind]) for name in ORDERS}
        for kind in KINDS
        for ratio in (LIGHT, MODERATE)
    }
    words = (
        f"Function calls for the same error over the predictable part of {CYCLES} cycles: the smallest power of ten "
        "that all four methods reach at both loads. The paper compares times, at errors that differ and are not known."
    )
    rows = tuple(row for kind in KINDS for row in _rows(kind, curves))
    return Section("work", "Section 9: order and efficiency", words, rows, charts=(_chart(curves),))


def _curve(measurements: Measurements, name: str, ratio: float, loaded: bool) -> Points:
    """(error, calls) of every run that came to its end."""
    truth = measurements.run(setups_of(measurements.scope, "exact", ratio, loaded=loaded)[0])
    if truth is None:
        return []
    window = min(float(truth.variation.horizon(1e3)), truth.trajectory.end)
    runs = [measurements.run(setup) for setup in setups_of(measurements.scope, name, ratio, loaded=loaded)]
    return [
        (max(pointwise(run.trajectory, truth.trajectory, window).worst, 1e-16), run.cost.function_calls)
        for run in runs
        if run is not None
    ]


def calls_for(points: Points, error: float) -> float:
    """Return the calls at which a curve first passes an error.

    Those of its first run if that is already good enough; NaN if none is.
    """
    for (above, few), (below, many) in pairwise(points):
        if below <= error < above:
            share = np.log(above / error) / np.log(above / below)
            return float(few * (many / few) ** share)
    return float(points[0][1]) if points and points[0][0] <= error else float("nan")


def _rows(kind: str, curves: Curves) -> Iterator[Row]:
    """Higher against lower order, and variable against fixed steps, at both loads."""
    # error that every algorithm reaches
    pair = [curves[kind, ratio] for ratio in (LIGHT, MODERATE)]
    error = max(max(min(e for e, _ in points) for points in curves.values()) for curves in pair)
    error = 10.0 ** np.ceil(np.log10(error))
    # calls for this error
    calls = [{name: calls_for(points, error) for name, points in curves.items()} for curves in pair]
    summary = "; ".join(
        f"at {ratio:g}: {', '.join(f'{name} {counted(round(n))}' for name, n in call.items())}"
        for ratio, call in zip((LIGHT, MODERATE), calls, strict=True)
    )
    # higher against lower order, under light and moderate load
    for how, high, low in (("fixed steps", "rk4", "rk2"), ("variable steps", "rkv", "rkf")):
        light, moderate = (call[high] / call[low] for call in calls)
        worse = light > _CLEARLY * max(1.0, moderate)
        yield row(
            f"Sec. 9, higher order is inefficient when lightly loaded, {how}, {kind}",
            "more time and calls",
            f"calls for {error:.0e} half-gaps, {summary}",
            REPRODUCED if worse else DIFFERS,
            f"{high} over {low}: {light:.2f} light, {moderate:.2f} moderate",
            error=error,
            light=light,
            moderate=moderate,
        )
    # fixed against variable steps
    ratio = [call["rk2"] / call["rkf"] for call in calls]
    yield row(
        f"Sec. 9, fixed steps of low order are faster, {kind}",
        "in nearly every case",
        f"RK2 over RKF for the same error: {ratio[0]:.2g} light, {ratio[1]:.2g} moderate",
        REPRODUCED if min(ratio) < 1.0 else DIFFERS,
        "shortening the step only at corners saves more than the rejected steps cost",
        light=ratio[0],
        moderate=ratio[1],
    )


def _chart(curves: Curves) -> Chart:
    # error over calls, under either load
    colour = dict(zip(ORDERS, COLOURS, strict=False))
    panels = []
    for (kind, ratio), curve in curves.items():
        lines = tuple(
            Line(np.array([p[1] for p in points], dtype=float), np.array([p[0] for p in points]), name, colour[name])
            for name, points in curve.items()
            if points
        )
        panels.append(
            Panel(
                f"Error, {kind}, mean {ratio:g}",
                "half-gaps",
                "function calls",
                lines,
                x_range=(1e3, 1e6),
                y_range=(1e-12, 1e1),
                x_log=True,
                y_log=True,
            )
        )
    # caption and legend
    legend = tuple(Key(name, colour[name]) for name in ORDERS)
    caption = "Error against function calls; down and to the left is better."
    return Chart(
        "work", "Work and precision", caption, tuple(panels), columns=2, panel_height=240, share_x=False, legend=legend
    )
