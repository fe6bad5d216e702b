"""Transmissibilities of two motions, by inertia, by frequency band, and by distance from the driving point.

TR_rms and TR_peak are the criterion's (Padmanabhan et al. 1995, eqs. (23)-(25), last eight T). Their bandwidth: the
same ratio of rms accelerations within the band around each of the first five harmonics of the excitation
(``signals.band_rms``), over the same cycles. The paper finds that algorithms agree near the driving point and part
further down the train (sec. 9); so the errors are ordered by the number of elements between an inertia and the
reference inertia.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearrattle.comparison.comparison_record import Record
from gearrattle.comparison.pair_checks import fundamental_order, same_grid
from gearrattle.signals import band_rms, last_cycles, peak_to_peak, rms
from gearrattle.trajectory import Array, IntArray, Layout, Trajectory

HARMONICS = 5
CYCLES = 8


@dataclass(frozen=True)
class Ratios(Record):
    """Transmissibilities of one motion [1].

    Attributes
    ----------
    rms, peak
        (n,) ratio of rms and of peak-to-peak accelerations to those of the reference inertia; NaN where
        that one shows none.
    band
        (h, n) ratio of rms accelerations in the band around each harmonic; NaN where the samples do not reach.
    """

    rms: Array
    peak: Array
    band: Array


@dataclass(frozen=True)
class TransmissibilityComparison(Record):
    """Transmissibilities of two motions, and their relative differences given / reference - 1.

    Attributes
    ----------
    distance
        (n,) number of elements between the inertia and the reference inertia, on the shortest way that does
        not lead through ground; -1 where there is none.
    frequency
        (h,) harmonics of the lowest excited order, the middles of the bands [Hz].
    rms_error, peak_error
        (n,) relative differences.
    band_error
        (h, n) relative differences.
    """

    inertias: tuple[str, ...]
    distance: IntArray
    frequency: Array
    candidate: Ratios
    reference: Ratios
    rms_error: Array
    peak_error: Array
    band_error: Array

    @property
    def outward(self) -> IntArray:
        """Return (n,) the inertias from the driving point outward; those out of reach come last."""
        far = np.where(self.distance < 0, np.iinfo(np.int64).max, self.distance)
        return np.argsort(far, kind="stable")

    def by_distance(self) -> dict[int, tuple[float, float]]:
        """Return the largest |rms_error| and |peak_error| at every distance, from the driving point outward."""
        steps = dict.fromkeys(self.distance[self.outward].tolist())
        at = {step: self.distance == step for step in steps}
        return {k: (_largest(self.rms_error[rows]), _largest(self.peak_error[rows])) for k, rows in at.items()}


def compare_transmissibility(
    candidate: Trajectory, reference: Trajectory, *, cycles: int = CYCLES, harmonics: int = HARMONICS
) -> TransmissibilityComparison:
    """Return the transmissibilities of two motions side by side.

    Parameters
    ----------
    cycles
        periods T at the end of the motion, fewer where fewer remain after the discarded ones.

    Raises
    ------
    ModelError
        other driveline, other grid, or no cycle left.
    """
    same_grid(candidate, reference)
    layout = reference.layout
    mine, theirs = (ratios(trajectory, cycles, harmonics) for trajectory in (candidate, reference))
    fundamental = fundamental_order(reference) * layout.omega / (2.0 * np.pi)
    frequency: Array = fundamental * np.arange(1.0, harmonics + 1)
    return TransmissibilityComparison(
        inertias=layout.inertia_names,
        distance=elements_from(layout, layout.reference),
        frequency=frequency,
        candidate=mine,
        reference=theirs,
        rms_error=_relative(mine.rms, theirs.rms),
        peak_error=_relative(mine.peak, theirs.peak),
        band_error=_relative(mine.band, theirs.band),
    )


def elements_from(layout: Layout, start: int) -> IntArray:
    """Return (n,) the number of elements between each inertia and ``start``; -1 without a way, ground left out."""
    distance = np.full(len(layout.inertia_names), -1, dtype=np.int64)
    distance[start] = 0
    touches = layout.rows != 0.0
    for step in range(1, distance.size):
        reached = touches[:, distance >= 0].any(axis=1)
        new = touches[reached].any(axis=0) & (distance < 0)
        if not new.any():
            break
        distance[new] = step
    return distance


def ratios(trajectory: Trajectory, cycles: int = CYCLES, harmonics: int = HARMONICS) -> Ratios:
    """Return the transmissibilities of the last cycles of one motion, of its samples; ModelError if no cycle is left.

    Algorithms that step have nothing between their samples, so the exact motion is judged by its samples as well. There
    are fewer cycles where fewer remain after the discarded ones.
    """
    layout = trajectory.layout
    window = last_cycles(trajectory, cycles)
    acceleration = window.closed(trajectory.acceleration)
    periods = round(window.cycles * layout.period * fundamental_order(trajectory) * layout.omega / (2.0 * np.pi))
    level = band_rms(window.periodic(trajectory.acceleration), max(1, periods), harmonics)
    return Ratios(*(_over(part, layout.reference) for part in (rms(acceleration), peak_to_peak(acceleration), level)))


def _over(level: Array, reference: int) -> Array:
    """(..., n) levels over that of one of them; NaN where that one is zero."""
    base = level[..., [reference]]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(base > 0.0, level / base, np.nan))


def _relative(candidate: Array, reference: Array) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(candidate / reference - 1.0, dtype=np.float64)


def _largest(errors: Array) -> float:
    known = np.abs(errors[~np.isnan(errors)])
    return float(known.max()) if known.size else float("nan")
