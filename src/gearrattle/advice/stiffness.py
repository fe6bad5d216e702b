"""How stiff the driveline is, and what scaling does about it.

Takes a Model and its pilot; gives lines.
"""

from __future__ import annotations

import math

from gearrattle.advice.pilot import Pilot
from gearrattle.advice.record import Line
from gearrattle.analysis.stiffness import stiffness
from gearrattle.model import Model

_SHOWN = 3


def scaling_line(model: Model) -> Line:
    """Condition numbers of the Jacobian by formulation."""
    found = stiffness(model).condition
    best = min(("torsional", "mixed", "translational"), key=lambda name: found[name])
    told = ", ".join(f"{name} {value:.2g}" for name, value in found.items())
    return Line(
        "scaling",
        "Nothing to do: exact scales for itself. For an integrator of your own use "
        f"the {best} non-dimensional form (gearrattle scale).",
        (
            f"condition number of the Jacobian: {told}",
            "no scaling changes the eigenvalues' ratio R_lambda: it is a similarity transform",
        ),
    )


def stiffness_line(model: Model, pilot: Pilot) -> Line:
    """R_lambda and class over the regions the pilot visits, those it stays in longest told one by one."""
    visited = pilot.visited
    known = [each for each in visited.regions if each.eigenvalues.elastic.size]
    per_second = " 1/s" if model.units == "SI" else ""
    shown = [
        f"region ({', '.join(str(label) for label in each.labels.values())}), {100.0 * each.share:.2g} % of the time: "
        f"R_lambda {each.eigenvalues.r_lambda:.4g}, largest |lambda| {each.eigenvalues.fastest:.4g}{per_second}"
        for each in visited.regions[:_SHOWN]
    ]
    slopes = {name: float(value) for name, value in pilot.of("mean slope").items()}
    ratios = {name: slope for name, slope in slopes.items() if not math.isnan(slope)}
    linear = stiffness(model, contact_ratio=ratios)
    shown.append(f"with the pilot's mean slopes: R_lambda {linear.r_lambda:.4g} ({linear.stiffness_class})")
    if not known:
        return Line("stiffness", "No elastic motion in any region visited.", tuple(shown))
    worst = max(known, key=lambda each: each.eigenvalues.r_lambda).eigenvalues
    words = f"{worst.stiffness_class.capitalize()}: R_lambda up to {worst.r_lambda:.4g} in {visited.words}."
    return Line("stiffness", words, tuple(shown))
