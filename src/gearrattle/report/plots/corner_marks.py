"""The common drawing of a clearance in all figures: its corners, the shading of its two sides, its units.

A clearance is in contact beyond its corners: blue on the drive side, vermilion on the coast side.
"""

from __future__ import annotations

import numpy as np

from gearrattle.model import Model
from gearrattle.report.plots.chart import Band, Key, Rule
from gearrattle.report.plots.chosen_parts import Judged
from gearrattle.report.plots.palette import COAST, DRIVE
from gearrattle.signals import centre
from gearrattle.trajectory import Array, Layout

SIDES = (Key("drive side", DRIVE), Key("coast side", COAST))
"""Legend of every figure in which both sides have their own colours."""


def shading(layout: Layout, clearance: int, factor: float) -> tuple[tuple[Band, ...], tuple[Rule, ...]]:
    """Return the shading of one clearance's contact sides, and a rule at each of its corners.

    ``clearance`` is an index into ``layout.clearance``, and ``factor`` multiplies deflections for display.
    """
    corners = layout.corners[clearance]
    first = int(layout.region_of_first_piece[clearance])
    inner = centre(layout, clearance)
    bands = []
    for position, corner in enumerate(corners):
        above = first + position + 1
        if above > max(inner):
            bands.append(Band(float(corner) * factor, None, DRIVE))
        if above - 1 < min(inner):
            bands.append(Band(None, float(corner) * factor, COAST))
    return tuple(bands), tuple(Rule(float(corner) * factor) for corner in corners)


def reach(values: Array, corners: Array) -> tuple[float, float]:
    """Return axis limits that show all values and the corners near them.

    The nearest corner is always shown; other corners only if they are within one span of the values, because with a
    distant corner the motion would look like a line.

    Parameters
    ----------
    values
        (N,) deflections.
    corners
        (c,) corner positions in the same unit.
    """
    low = float(values.min())
    high = float(values.max())
    away = np.maximum(np.maximum(low - corners, corners - high), 0.0)
    shown = corners[away <= max(high - low, float(away.min()))]
    low = min(low, float(shown.min()))
    high = max(high, float(shown.max()))
    margin = 0.08 * (high - low or 1.0)
    return low - margin, high + margin


def units(findings: Judged, clearance: int) -> dict[str, str]:
    """Return the units of ``deflection``, ``rate``, ``force`` and ``energy`` of a clearance; none if dimensionless.

    ``clearance`` is an index into ``layout.clearance``.
    """
    return units_of(findings.model, findings.motion.trajectory.layout, clearance)


def units_of(model: Model, layout: Layout, clearance: int) -> dict[str, str]:
    """Return these units for a clearance of a model and its layout."""
    if model.units != "SI":
        return {"deflection": "", "rate": "", "force": "", "energy": ""}
    if layout.is_mesh[layout.clearance[clearance]]:
        return {"deflection": "m", "rate": "m/s", "force": "N", "energy": "J"}
    return {"deflection": "rad", "rate": "rad/s", "force": "N m", "energy": "J"}
