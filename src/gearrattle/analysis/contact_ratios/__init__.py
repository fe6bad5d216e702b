"""Contact ratios: the routes from a motion to one slope for every clearance.

To add a route: its file, its line in ``ROUTES``, its test page.
"""

from __future__ import annotations

from collections.abc import Callable

from gearrattle.analysis.contact_ratios.contact_ratio_record import ContactRatio
from gearrattle.analysis.contact_ratios.describing import describing
from gearrattle.analysis.contact_ratios.mean_slope import mean_slope
from gearrattle.analysis.contact_ratios.spectral_gain import spectral
from gearrattle.trajectory import Trajectory

ROUTES: dict[str, Callable[[Trajectory], ContactRatio]] = {
    "mean-slope": mean_slope,
    "spectral": spectral,
    "describing": describing,
}
"""Name of the route -> Trajectory to ContactRatio."""

__all__ = ["ROUTES", "ContactRatio"]
