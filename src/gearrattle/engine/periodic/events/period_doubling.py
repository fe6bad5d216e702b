"""Period doublings: a multiplier passes -1, where det(I + M) = 0, M the gradient of the period map.

This file has the test function; ``events_of_step`` finds where it changes its sign, and ``location`` locates the event.
"""

from __future__ import annotations

import numpy as np

from gearrattle.engine.periodic.multiplier_counts import nearest_to
from gearrattle.engine.periodic.point import Point


def det_plus(point: Point) -> float:
    """Return det(I + M): zero where a multiplier is -1."""
    return float(np.prod(1.0 + point.multipliers).real)


def nearest_to_minus_one(point: Point) -> tuple[complex, float]:
    """Return the multiplier nearest to -1, and how near it is."""
    return nearest_to(-1.0, point.multipliers)
