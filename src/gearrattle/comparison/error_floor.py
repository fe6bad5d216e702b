"""Differences of a motion's statistics that its own measured error explains.

Let x be a signal of the reference (a deflection, an acceleration), e the error of the given motion in it, sample by
sample over the cycles compared, and sigma the standard deviation of x there. The error counts up to a hundredth of the
signal:

    c = min(1, RESOLVED sigma / rms(e)).

A motion whose error is c e may differ from the reference by no more than

    level                 c rms(e)                                                      (Minkowski)
    density in a bin      |sqrt S - sqrt S_ref| <= c sqrt S_e                           (Minkowski, over the segments)
    peak to peak          min(c pp(e), max(RESOLVED, halving) pp(x))
    ratio of two levels   (x + a) / (x_0 - a_0) - x / x_0,  a and a_0 the bounds of both
    impact rate           one impact: it may lie on either side of the edge of the cycles compared
    impulse               RESOLVED of their rms

``halving`` is the change of pp(x) when every second sample is left out: a peak is known only as well as the samples
show it. So a motion whose error is below a hundredth of every signal has no different level, spectrum or ratio of
levels: it is the same motion, and only its error is given. Of a larger error only that hundredth counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearrattle.comparison.motion_statistics import Portrait, portrait
from gearrattle.comparison.pair_checks import cycles_beyond, same_grid
from gearrattle.comparison.transmissibility_comparison import CYCLES
from gearrattle.signals import last_cycles, peak_to_peak, psd, rms
from gearrattle.trajectory import Array, Trajectory

RESOLVED = 1e-2
"""Errors below this share of a signal's standard deviation leave its statistics the same."""


@dataclass(frozen=True)
class Floor:
    """Largest differences of statistics that a motion's own error explains.

    Attributes
    ----------
    deflection
        (K,) of every clearance's rms [rad or m].
    acceleration
        (n,) of every inertia's rms [rad/s^2].
    density
        (n, f) power spectral density of the error that counts.
    rate
        (K,) of the impacts per cycle [1/cycle].
    impulse
        (K,) shift of the impulses [N m s or N s].
    tr_rms, tr_peak
        (n,) of the transmissibilities [1]; infinite where the reference inertia is lost in its error.
    """

    reference: Portrait
    deflection: Array
    acceleration: Array
    density: Array
    rate: Array
    impulse: Array
    tr_rms: Array
    tr_peak: Array


def floor_of(candidate: Trajectory, reference: Trajectory, start: float | None = None) -> Floor:
    """Return the differences of statistics that the error of a motion explains.

    Parameters
    ----------
    start
        as in ``portrait``, whose statistics are compared.

    Raises
    ------
    ModelError
        other driveline, other grid, no whole cycle left, or too few samples in one for a spectrum.
    """
    # errors of deflections and accelerations over the cycles compared
    same_grid(candidate, reference)
    statistics = portrait(reference, start)
    window = cycles_beyond(reference, start)
    deflection = candidate.deflection - reference.deflection
    acceleration = candidate.acceleration - reference.acceleration
    # the part of the errors that counts
    counted = _counted(window.closed(acceleration), window.closed(reference.acceleration))
    own = _counted(window.closed(deflection), window.closed(reference.deflection))
    # density of the error, and bounds of the transmissibilities
    spectrum = psd(window.periodic(acceleration), reference.layout.period, reference.samples_per_cycle)
    last = last_cycles(reference, min(CYCLES, window.cycles))
    tr_rms, tr_peak = _ratios(
        last.closed(acceleration), last.closed(reference.acceleration), reference.layout.reference
    )
    # rms of the impulses
    squares = [float(np.sqrt(np.mean(impulse**2))) if impulse.size else 0.0 for impulse in statistics.impulses]
    return Floor(
        reference=statistics,
        deflection=own * rms(window.closed(deflection)),
        acceleration=counted * rms(window.closed(acceleration)),
        density=counted[:, None] ** 2 * spectrum.density.T,
        rate=np.full(statistics.rate.shape, 1.0 / window.cycles),
        impulse=RESOLVED * np.array(squares),
        tr_rms=tr_rms,
        tr_peak=tr_peak,
    )


def _counted(error: Array, signal: Array) -> Array:
    """(k,) the share c of each error that counts."""
    size = rms(error)
    most = RESOLVED * np.std(signal, axis=0)
    return np.asarray(np.minimum(1.0, np.divide(most, size, out=np.ones_like(most), where=size > 0.0)))


def _ratios(error: Array, signal: Array, base: int) -> tuple[Array, Array]:
    """(n,) bounds of the ratios of rms and of peak-to-peak values to those of one column."""
    counted = _counted(error, signal)
    whole = peak_to_peak(signal)
    halved = np.minimum(peak_to_peak(signal[::2]), peak_to_peak(signal[1::2]))
    swing = np.minimum(counted * peak_to_peak(error), np.maximum(RESOLVED * whole, whole - halved))
    return _ratio(rms(signal), counted * rms(error), base), _ratio(whole, swing, base)


def _ratio(level: Array, moved: Array, base: int) -> Array:
    """(n,) bounds of the change of levels over that of ``base`` if each level changes by ``moved``."""
    if level[base] <= moved[base]:
        return np.full(level.size, np.inf)
    return np.asarray((level + moved) / (level[base] - moved[base]) - level / level[base])
