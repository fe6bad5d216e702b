"""Negligible impacts: touches by the thresholds of a layout, and the words for the other impacts.

The energy m_eff v^2 / 2 of an element and its speed |v| rise together, so the fastest impact decides for all.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from gearrattle.signals.crossing_sums import Sums
from gearrattle.signals.impact_sums import measure_impacts
from gearrattle.signals.impacts import Impacts
from gearrattle.trajectory import Array, Layout, NegligibleImpacts
from gearrattle.wording import engineering, listed

Severity = Literal["quiet", "touches", "rattles"]
SEVERITIES: tuple[Severity, ...] = get_args(Severity)
"""From the mildest on; codes in this order."""
RANKS: Mapping[Severity, int] = {word: rank for rank, word in enumerate(SEVERITIES)}


def are_negligible(state: Sums, layout: Layout, clearance: int) -> Array:
    """Return whether all impacts of a clearance are touches, of one motion or of many along leading axes."""
    limits = layout.negligible
    hardness = measure_impacts(state, layout, clearance)
    is_hit = state["count"][..., clearance] > 0.0
    speed = np.where(is_hit, hardness.largest_speed, 0.0)
    energy = np.where(is_hit, hardness.largest_energy, 0.0)  # NaN without a free body: no threshold applies
    slowest = limits.speed if layout.is_mesh[layout.clearance[clearance]] else limits.angular_speed
    return np.asarray((speed < slowest) | (energy < limits.energy))


def are_touches(impacts: Impacts, layout: Layout) -> NDArray[np.bool_]:
    """Return (I,) whether impacts are touches."""
    limits = layout.negligible
    is_mesh = layout.is_mesh[layout.clearance[impacts.clearance]]
    slowest = np.where(is_mesh, limits.speed, limits.angular_speed)
    touches: NDArray[np.bool_] = (np.abs(impacts.velocity) < slowest) | (impacts.energy < limits.energy)
    return touches


def limits_words(limits: NegligibleImpacts, *, is_si: bool = True) -> str:
    """Return the limits of negligible impacts in words."""
    sizes = (
        ("energy", limits.energy, "J", ""),
        ("approach speed", limits.speed, "m/s", " of a mesh"),
        ("approach speed", limits.angular_speed, "rad/s", " of a coupling"),
    )
    words = [
        f"{what} below {engineering(value, unit if is_si else '')}{of}" for what, value, unit, of in sizes if value
    ]
    return f"negligible is an impact with an {listed(words, 'or')}" if words else "no impact is negligible"
