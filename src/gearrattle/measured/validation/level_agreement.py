"""Peak to peak and rms of every channel, with sigma and its interval from the scatter of the cycles.

rms over all cycles; peak to peak as the mean over the cycles of the largest less the smallest sample in each, since
the extremes of a whole record grow with its length. ln(simulated / measured) is taken for normal: sigma's interval is
100 (1 - exp(...)) of its ends.
"""

from __future__ import annotations

import numpy as np

from gearrattle.measured.paper_sigma import sigma
from gearrattle.measured.validation.block_bootstrap import Draws, factor
from gearrattle.measured.validation.cycles import Cycles
from gearrattle.measured.validation.validation_records import Level
from gearrattle.trajectory import Array

MEASURES = ("peak-to-peak", "rms")


def mean_squares(cycles: Cycles) -> Array:
    """(N, C) of every cycle."""
    return np.asarray(np.mean(cycles.values**2, axis=1))


def swings(cycles: Cycles) -> Array:
    """(N, C) largest less smallest sample of every cycle."""
    return np.asarray(np.ptp(cycles.values, axis=1))


def levels_of(cycles: Cycles) -> Array:
    """(2, C) peak to peak, rms."""
    return np.stack([swings(cycles).mean(axis=0), np.sqrt(mean_squares(cycles).mean(axis=0))])


def log_errors(cycles: Cycles, drawn: Draws) -> Array:
    """(2, C) standard errors of the logarithms of peak to peak and rms; zero for a channel at rest."""
    swing = drawn.means(swings(cycles))
    square = drawn.means(mean_squares(cycles))
    tiny = np.finfo(float).tiny
    replicates = np.stack([np.log(np.maximum(swing, tiny)), 0.5 * np.log(np.maximum(square, tiny))])
    return np.stack([drawn.error(replicate) for replicate in replicates])


def compare_levels(measured: Cycles, simulated: Cycles, draws: tuple[Draws, Draws]) -> list[tuple[Level, ...]]:
    """Return both levels of every channel."""
    one = levels_of(measured)
    other = levels_of(simulated)
    errors = log_errors(measured, draws[0]), log_errors(simulated, draws[1])
    both = np.hypot(*errors)
    reach = factor(errors, (draws[0].freedom, draws[1].freedom)) * both
    levels = []
    for c in range(one.shape[1]):
        rows = []
        for m, measure in enumerate(MEASURES):
            a = float(one[m, c])
            b = float(other[m, c])
            ratio = b / a if a > 0.0 else float("nan")
            nan = float("nan")
            ends = (100.0 * (1.0 - ratio * float(np.exp(s * reach[m, c]))) for s in (1.0, -1.0))
            low, high = (end if a > 0.0 else nan for end in ends)
            rows.append(Level(measure, a, b, sigma(a, b), low, high, 100.0 * ratio * float(both[m, c])))
        levels.append(tuple(rows))
    return levels
