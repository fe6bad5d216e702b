"""Statistics of a motion: levels, spectra, rates of impacts and their impulses.

Beyond the predictability horizon two correct motions have only these in common. A portrait needs much less memory than
its motion, so many can be kept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearrattle.comparison.pair_checks import cycles_beyond
from gearrattle.comparison.transmissibility_comparison import CYCLES, ratios
from gearrattle.signals import find_impacts, psd, rms
from gearrattle.trajectory import Array, Layout, Trajectory

ROUNDING = 1e-9
"""Accelerations this small against those of the elements' torques, which cancel at rest, are rounding."""


@dataclass(frozen=True)
class Portrait:
    """The statistics of a motion over whole cycles.

    Attributes
    ----------
    start, end
        of these cycles [s].
    deflection
        (K,) rms of every clearance's deflection [rad or m].
    acceleration
        (n,) rms of every inertia's [rad/s^2].
    density
        (n, f) one-sided power spectral density of every acceleration.
    resolution
        its bin width [Hz].
    largest_deflection, largest_acceleration
        (K,), (n,) rms in the loudest cycle of the whole motion, start-up
        included; for accelerations no less than ``ROUNDING`` times what the elements' torques alone would give.
    rate
        (K,) impacts per cycle.
    impulses
        K arrays (I_k,) of every impact that is known whole, ascending [N m s or N s].
    tr_rms, tr_peak
        (n,) transmissibilities of the last eight cycles [1]; NaN where the reference inertia rests.
    """

    layout: Layout
    start: float
    end: float
    cycles: int
    deflection: Array
    acceleration: Array
    density: Array
    resolution: float
    largest_deflection: Array
    largest_acceleration: Array
    rate: Array
    impulses: tuple[Array, ...]
    tr_rms: Array
    tr_peak: Array


def portrait(trajectory: Trajectory, start: float | None = None) -> Portrait:
    """Return the statistics of a motion.

    Parameters
    ----------
    start
        over the whole cycles that begin at or after it [s], such as the predictability horizon; None: over the
        steady part. Discarded cycles never count.

    Raises
    ------
    ModelError
        no whole cycle left, or too few samples in one for a spectrum.
    """
    # whole cycles, and the impacts in them
    layout = trajectory.layout
    window = cycles_beyond(trajectory, start)
    acceleration = window.closed(trajectory.acceleration)
    impacts = find_impacts(trajectory)
    by_clearance = [impacts.of(k).within(window) for k in range(len(layout.corners))]
    # transmissibilities, impulses known whole, and densities
    ratio = ratios(trajectory, min(CYCLES, window.cycles))
    known = [hits.impulse[~hits.censored & np.isfinite(hits.impulse)] for hits in by_clearance]
    spectrum = psd(window.periodic(trajectory.acceleration), layout.period, trajectory.samples_per_cycle)
    return Portrait(
        layout=layout,
        start=window.start,
        end=window.end,
        cycles=window.cycles,
        deflection=rms(window.closed(trajectory.deflection)),
        acceleration=rms(acceleration),
        density=spectrum.density.T,
        resolution=spectrum.resolution,
        largest_deflection=_loudest(trajectory, trajectory.deflection),
        largest_acceleration=np.maximum(_loudest(trajectory, trajectory.acceleration), ROUNDING * _strain(trajectory)),
        rate=np.array([hits.time.size / window.cycles for hits in by_clearance]),
        impulses=tuple(np.sort(impulse) for impulse in known),
        tr_rms=ratio.rms,
        tr_peak=ratio.peak,
    )


def _loudest(trajectory: Trajectory, signal: Array) -> Array:
    """The largest rms within a cycle."""
    length = trajectory.samples_per_cycle
    cycles = [rms(signal[i : i + length + 1]) for i in range(0, signal.shape[0] - 1, length)]
    return np.asarray(np.max(cycles, axis=0))


def _strain(trajectory: Trajectory) -> Array:
    """(n,) the largest sum of the magnitudes of the elements' torques on each inertia, over J [rad/s^2]."""
    layout = trajectory.layout
    largest = np.max(np.abs(trajectory.element_torque), axis=0, initial=0.0)
    turns = ~layout.is_bearing
    force = largest[turns] / layout.radii[turns, 0]
    return np.asarray(force @ np.abs(layout.rows[turns]) / layout.inertia)
