"""Advice on computing: algorithm and step, cost of the run, and how long the motion is predictable point by point."""

from __future__ import annotations

import math

import numpy as np

from gearrattle.advice.advice_record import Line
from gearrattle.advice.pilot import Pilot
from gearrattle.model import Model
from gearrattle.simulation.fixed_steps import step_limits
from gearrattle.wording import counted, engineering, measured


def algorithm_line(model: Model, pilot: Pilot, *, quiet: bool) -> Line:
    """Recommend exact; name the largest stable steps of other algorithms; warn if the planned step is unstable.

    ``quiet`` is True if the linear response crosses no corner.
    """
    # friction, clipped damping and alternation: exact alone supports them
    if pilot.run.trajectory.auxiliaries is not None:
        return Line(
            "algorithm", "Use exact: no other algorithm supports friction, clipped contact damping or alternation."
        )
    # largest stable step of every algorithm in the regions visited
    visited = pilot.visited
    where = "the regions visited" if len(visited.regions) == visited.count else visited.words
    limits = step_limits(model, visited.regions, model.simulation.step)
    unit = "s" if model.units == "SI" else ""
    evidence = [
        f"{limit.algorithm}: largest stable step {measured(limit.largest_step, unit, 4)} in {where}" for limit in limits
    ]
    # the alternative without corner crossings
    no_crossing = quiet and not len(pilot.run.trajectory.events)
    other = (
        "any algorithm with error control is suitable too, because no corner is crossed."
        if no_crossing
        else "the alternative is rkv-events, which restarts at every corner."
    )
    # an unstable step that is planned
    planned = model.simulation.algorithm
    for limit in limits:
        if limit.algorithm == planned and limit.growth > 1.0 + 1e-9:
            shown_step = measured(limit.step, unit, 4)
            evidence.insert(0, _unstable(planned, shown_step, limit.growth, limit.labels))
            step = f"Do not use {planned} with the planned step of {shown_step}: it is unstable. "
            return Line("algorithm", f"{step}Use exact: it has no step; {other}", tuple(evidence))
    return Line("algorithm", f"Use exact: it has no step to choose; {other}", tuple(evidence))


def _unstable(algorithm: str, step: str, growth: float, labels: dict[str, int]) -> str:
    region = ", ".join(f"{name} {label}" for name, label in labels.items())
    return (
        f"{algorithm} with a step of {step} multiplies a mode by {growth:.4g} per step in region {region}: its "
        "motion there is a numerical artefact"
    )


def cost_line(pilot: Pilot) -> Line:
    """Line on cost: function calls and computing time of the planned run with exact."""
    t = pilot.run.trajectory
    cost = pilot.run.cost
    calls = cost.function_calls * pilot.stretched
    seconds = cost.wall_time * pilot.stretched
    crossings = pilot.of("crossings a cycle")[""]
    time = engineering(seconds, "s", 1)
    return Line(
        "cost",
        f"About {_rounded(calls)} function calls and {time} for {counted(pilot.planned, 'cycle')} by exact.",
        (
            f"{pilot.name}: {counted(cost.function_calls, 'call')}, {counted(len(t.events), 'crossing')}, "
            f"{crossings:.3g} per cycle at its end",
        ),
    )


def predictability_line(pilot: Pilot) -> Line:
    """Line on predictability: cycles for which the motion is predictable, and quantities to compare after these."""
    cycles = pilot.predictable_cycles
    rate = pilot.exponent
    period = pilot.run.trajectory.layout.period
    unit = " 1/s" if pilot.run.model.units == "SI" else ""
    evidence = (
        f"largest Lyapunov exponent over the second half of the {pilot.name}: {rate:.3g}{unit}, "
        f"a factor of {np.exp(min(rate * period, 700.0)):.3g} per cycle",
    )
    if math.isinf(cycles):
        return Line("predictability", "The motion is predictable point by point to the end of the run.", evidence)
    words = (
        f"The motion is predictable point by point for about {cycles:.2g} cycles. After that, compare only statistics: "
        "rates and shares, not single impacts."
    )
    return Line("predictability", words, evidence)


def _rounded(value: float) -> str:
    """Two significant digits, with a no-break space between groups of three."""
    if not value:
        return "0"
    digits = 1 - math.floor(math.log10(value))
    return f"{round(value, digits):,.0f}".replace(",", "\u00a0")
