"""Mean slope: the time average of df/d(delta), the second route of Padmanabhan et al. 1995, sec. 6.

    mean slope = (1/t_w) sum over pieces of (time in the piece x its slope) / largest slope

from the event times of the steady part, not from samples: exact to the accuracy of the crossings. For a two-stage law
of ratio alpha it is alpha + (1 - alpha) x the share of time in contact.
"""

from __future__ import annotations

import numpy as np

from gearrattle.analysis.contact_ratios.contact_ratio_record import ContactRatio, clearances, without_error
from gearrattle.signals import dwell_times, steady
from gearrattle.trajectory import Trajectory


def mean_slope(trajectory: Trajectory) -> ContactRatio:
    """Return the mean slope of every clearance over the steady part.

    ModelError if no cycle remains after the discarded ones, GearRattleError if the log of crossings has a gap.
    """
    window = steady(trajectory)
    value = np.full(trajectory.layout.clearance.size, np.nan)
    for k in clearances(trajectory):
        slope = trajectory.layout.stiffness_of_piece[k]
        dwell = dwell_times(trajectory, k, window)
        if slope.max() > 0.0:
            value[k] = float(dwell @ (slope / slope.max())) / float(dwell.sum())
    return without_error("mean-slope", "mean slope", value)
