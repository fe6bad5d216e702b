"""Thresholds below which an impact is a touch, from the model or by default."""

from __future__ import annotations

from gearrattle.model import ASSUMED_ENERGY, Model, Negligible
from gearrattle.trajectory import NegligibleImpacts


def negligible_of(model: Model) -> NegligibleImpacts:
    """Return the thresholds of a model; a model in SI without thresholds has an assumed one for the energy."""
    written = model.criteria.negligible or Negligible()
    is_assumed = model.units == "SI" and written.impact_energy is None
    return NegligibleImpacts(
        energy=ASSUMED_ENERGY if is_assumed else written.impact_energy or 0.0,
        speed=written.approach_speed or 0.0,
        angular_speed=written.angular_approach_speed or 0.0,
        is_assumed=is_assumed,
    )
