"""What remains of a motion when its moments are forgotten: levels, spectra, rates of impacts and their impulses.

Two right motions beyond the predictability horizon have nothing else in common. A portrait is small beside the motion
it is taken of, so that many can be kept.

Takes a Trajectory; gives a Portrait.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearrattle.comparison.pair import cycles_beyond
from gearrattle.comparison.transmissibility import CYCLES, ratios
from gearrattle.signals import find_impacts, psd, rms
from gearrattle.trajectory import Array, Layout, Trajectory


@dataclass(frozen=True)
class Portrait:
    """The statistics of a motion over whole cycles.

    Attributes:
        layout: its name plate, for names and units.
        start, end: of these cycles [s].
        cycles: how many.
        deflection: (K,) rms of every clearance's deflection [rad or m].
        acceleration: (n,) rms of every inertia's [rad/s^2].
        density: (n, f) one-sided power spectral density of every acceleration.
        rate: (K,) impacts a cycle.
        impulses: K arrays (I_k,) of every impact that is known whole, ascending [N m s or N s].
        tr_rms, tr_peak: (n,) transmissibilities of the last eight cycles [1]; NaN where the reference inertia rests.
    """

    layout: Layout
    start: float
    end: float
    cycles: int
    deflection: Array
    acceleration: Array
    density: Array
    rate: Array
    impulses: tuple[Array, ...]
    tr_rms: Array
    tr_peak: Array


def portrait(trajectory: Trajectory, start: float | None = None) -> Portrait:
    """Return the statistics of a motion.

    Args:
        trajectory: the motion.
        start: over the whole cycles that begin at or after it [s], such as the predictability horizon; None: over the
            steady part. Discarded cycles never count.

    Raises:
        ModelError: no whole cycle left, or too few samples in one for a spectrum.
    """
    plate, window = trajectory.layout, cycles_beyond(trajectory, start)
    acceleration = window.closed(trajectory.acceleration)
    impacts = find_impacts(trajectory)
    found = [impacts.of(k).within(window) for k in range(len(plate.corners))]
    ratio = ratios(trajectory, min(CYCLES, window.cycles))
    known = [each.impulse[~each.censored & np.isfinite(each.impulse)] for each in found]
    return Portrait(
        layout=plate,
        start=window.start,
        end=window.end,
        cycles=window.cycles,
        deflection=rms(window.closed(trajectory.deflection)),
        acceleration=rms(acceleration),
        density=psd(window.periodic(trajectory.acceleration), plate.period, trajectory.samples_per_cycle).density.T,
        rate=np.array([each.time.size / window.cycles for each in found]),
        impulses=tuple(np.sort(impulse) for impulse in known),
        tr_rms=ratio.rms,
        tr_peak=ratio.peak,
    )
