"""Advice on stiffness and scaling: eigenvalue ratios over the regions visited, and the condition number."""

from __future__ import annotations

import math
from collections.abc import Mapping

from gearrattle.advice.advice_record import Line
from gearrattle.advice.pilot import Pilot
from gearrattle.analysis.stiffness import stiffness
from gearrattle.model import Model

_SHOWN = 3  # number of regions listed one by one


def scaling_line(model: Model) -> Line:
    """Condition numbers of the Jacobian by formulation."""
    conditions = stiffness(model).condition
    best = min(("torsional", "mixed", "translational"), key=lambda name: conditions[name])
    conditions_text = ", ".join(f"{name} {value:.2g}" for name, value in conditions.items())
    return Line(
        "scaling",
        "Nothing to do: exact scales for itself. For an integrator of your own use "
        f"the {best} non-dimensional form (gearrattle scale).",
        (
            f"condition number of the Jacobian: {conditions_text}",
            "no scaling changes the eigenvalues' ratio R_lambda: it is a similarity transform",
        ),
    )


def stiffness_line(model: Model, pilot: Pilot) -> Line:
    """Line on R_lambda and its class over the regions that the pilot visits.

    The regions with the longest stay are listed one by one.
    """
    visited = pilot.visited
    known = [region for region in visited.regions if region.eigenvalues.elastic.size]
    per_second = " 1/s" if model.units == "SI" else ""
    shown = [
        f"{_region(region.labels)}, {100.0 * region.share:.3g} % of the time: "
        f"{_ratio(region.eigenvalues.r_lambda)}, largest |lambda| {region.eigenvalues.fastest:.4g}{per_second}"
        for region in visited.regions[:_SHOWN]
    ]
    slopes = {name: float(value) for name, value in pilot.of("mean slope").items()}
    ratios = {name: slope for name, slope in slopes.items() if not math.isnan(slope)}
    linear = stiffness(model, contact_ratio=ratios)
    shown.append(f"with the pilot's mean slopes: {_ratio(linear.r_lambda)} ({linear.stiffness_class})")
    if not known:
        return Line("stiffness", "No elastic motion in any region visited.", tuple(shown))
    worst = max(known, key=lambda region: region.eigenvalues.r_lambda).eigenvalues
    words = f"{worst.stiffness_class.capitalize()}: R_lambda up to {worst.r_lambda:.4g} in {visited.words}."
    return Line("stiffness", words, tuple(shown))


def _region(labels: Mapping[str, int]) -> str:
    return f"region ({', '.join(map(str, labels.values()))})" if labels else "linear"


def _ratio(r_lambda: float) -> str:
    return "no R_lambda" if math.isnan(r_lambda) else f"R_lambda {r_lambda:.4g}"
