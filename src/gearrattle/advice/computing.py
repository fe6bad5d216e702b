"""Which algorithm and step, what it will cost, and how long single instants can be predicted.

Takes the model planned and its pilot; gives lines.
"""

from __future__ import annotations

import math

import numpy as np

from gearrattle.advice.pilot import Pilot
from gearrattle.advice.record import Line
from gearrattle.model import Model
from gearrattle.simulation.steps import step_limits
from gearrattle.wording import counted


def algorithm_line(model: Model, pilot: Pilot, *, quiet: bool) -> Line:
    """Exact; and what any other algorithm must heed, the one planned first of all."""
    if pilot.run.trajectory.auxiliaries is not None:
        return Line(
            "algorithm", "Use exact: no other algorithm takes friction, clipped contact damping or alternation."
        )
    visited = pilot.visited
    where = "the regions visited" if len(visited.regions) == visited.count else visited.words
    limits = step_limits(model, visited.regions, model.simulation.step)
    unit = " s" if model.units == "SI" else ""
    evidence = [f"{limit.algorithm}: stable steps end at {limit.largest_step:.4g}{unit} in {where}" for limit in limits]
    calm = quiet and not len(pilot.run.trajectory.events)
    other = (
        "any algorithm with an error test will do beside it: no corner is crossed."
        if calm
        else "if it must be another one, rkv-events, which restarts at every corner."
    )
    planned = model.simulation.algorithm
    for limit in limits:
        if limit.algorithm == planned and limit.growth > 1.0 + 1e-9:
            evidence.insert(0, _unstable(planned, limit.step, limit.growth, limit.labels))
            step = f"Not {planned} with the step of {limit.step:.4g} s that is planned: it is unstable. "
            return Line("algorithm", f"{step}Use exact: it has no step; {other}", tuple(evidence))
    return Line("algorithm", f"Use exact: it has no step to choose; {other}", tuple(evidence))


def _unstable(algorithm: str, step: float, growth: float, labels: dict[str, int]) -> str:
    region = ", ".join(f"{name} {label}" for name, label in labels.items())
    return (
        f"{algorithm} with {step:.4g} s multiplies a mode by {growth:.4g} a step in region {region}: what it shows "
        "there is its own invention"
    )


def cost_line(pilot: Pilot) -> Line:
    """Calls and time of the planned run by exact."""
    t, cost = pilot.run.trajectory, pilot.run.cost
    calls, seconds = cost.function_calls * pilot.stretched, cost.wall_time * pilot.stretched
    crossings = pilot.of("crossings a cycle")[""]
    return Line(
        "cost",
        f"About {_rounded(calls)} function calls and {seconds:.1g} s for {counted(pilot.planned, 'cycle')} by exact.",
        (
            f"{pilot.name}: {counted(cost.function_calls, 'call')}, {counted(len(t.events), 'crossing')}, "
            f"{crossings:.3g} a cycle at its end",
        ),
    )


def predictability_line(pilot: Pilot) -> Line:
    """How long, and what to compare after that."""
    cycles, rate = pilot.predictable_cycles, pilot.exponent
    period = pilot.run.trajectory.layout.period
    unit = " 1/s" if pilot.run.model.units == "SI" else ""
    evidence = (
        f"largest Lyapunov exponent over the second half of the {pilot.name}: {rate:.3g}{unit}, "
        f"a factor of {np.exp(min(rate * period, 700.0)):.3g} a cycle",
    )
    if math.isinf(cycles):
        return Line("predictability", "Single instants are predicted to the end of the run.", evidence)
    words = (
        f"Single instants are predicted for about {cycles:.2g} cycles. Beyond, compare statistics only, and judge by "
        "rates and shares, not by single impacts."
    )
    return Line("predictability", words, evidence)


def _rounded(value: float) -> str:
    """Two digits, thousands apart."""
    if not value:
        return "0"
    digits = 1 - math.floor(math.log10(value))
    return f"{round(value, digits):,.0f}".replace(",", "\u00a0")
