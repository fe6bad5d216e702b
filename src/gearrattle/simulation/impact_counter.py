"""Impacts and regimes of a motion under way, from the crossings of one step after the other."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from gearrattle.signals import reduced_inertias
from gearrattle.signals.regions import clearance_arrays
from gearrattle.trajectory import Array, IntArray, Layout

_DRIVE = 1
_COAST = 2
_SIDES = (0, 1, 1, 2)
"""Number of sides among none, the drive side, the coast side, both."""


class ImpactCounter:
    """Counts the impacts of every clearance that are no touches, and knows the sides on which they come.

    Attributes
    ----------
    count
        impacts of each so far.
    energy
        sum of m_eff v^2 / 2 of each [J].
    """

    def __init__(self, layout: Layout) -> None:
        clearances = layout.clearance
        limits = layout.negligible
        # the slowest impact that is none of the touches
        mass = reduced_inertias(layout, clearances.tolist())
        slowest = np.where(layout.is_mesh[clearances], limits.speed, limits.angular_speed)
        self._mass = mass.tolist()
        self._slowest = np.maximum(slowest, np.sqrt(2.0 * limits.energy / mass)).tolist()
        # of every corner: whether a crossing is an impact, upward and downward, and its side
        judged = clearance_arrays(layout)
        pieces = [slice(a, b) for a, b in zip(judged.pieces[:-1], judged.pieces[1:], strict=True)]
        inner = [judged.inner[part] > 0 for part in pieces]
        self._begins = [_impacts(label, is_inner) for label, is_inner in zip(_labels(layout), inner, strict=True)]
        self._sides = [_sides(is_inner, bool(gap)) for is_inner, gap in zip(inner, judged.gap, strict=True)]
        # sums so far; the sides crossed in the period before, and in this one
        self.count = [0] * clearances.size
        self.energy = [0.0] * clearances.size
        self._before = [0] * clearances.size
        self._now = [0] * clearances.size
        self._period = 0

    def add(self, crossings: Iterable[tuple[int, int, int, float]], period: int) -> None:
        """Add the crossings of a step: clearance, piece before and after, rate [rad/s or m/s].

        period: number of the period in which the step ends.
        """
        if period != self._period:
            none = [0] * len(self._now)
            self._before = self._now if period == self._period + 1 else none
            self._now = none.copy()
            self._period = period
        for k, before, after, rate in crossings:
            corner = min(before, after)
            self._now[k] |= self._sides[k][corner]
            if self._begins[k][corner][after > before] and abs(rate) >= self._slowest[k]:
                self.count[k] += 1
                self.energy[k] += 0.5 * self._mass[k] * rate**2

    def regime(self) -> list[int]:
        """Sides of every clearance on which corners were crossed in this period or the one before: 0 is quiet."""
        return [_SIDES[before | now] for before, now in zip(self._before, self._now, strict=True)]

    def sums(self) -> dict[str, Array]:
        """All sums."""
        return {name: np.array(value, dtype=float) for name, value in self._sums().items()}

    def take(self, sums: Mapping[str, Array]) -> None:
        """Go on with other sums."""
        self.count = sums["count"].astype(int).tolist()
        self.energy = sums["energy"].tolist()
        self._before = sums["before"].astype(int).tolist()
        self._now = sums["now"].astype(int).tolist()
        self._period = int(sums["period"])

    def _sums(self) -> dict[str, list[float] | list[int] | int]:
        return {
            "count": self.count,
            "energy": self.energy,
            "before": self._before,
            "now": self._now,
            "period": self._period,
        }


def _labels(layout: Layout) -> list[IntArray]:
    """Labels of the pieces of every clearance."""
    sizes = [stiffness.size for stiffness in layout.stiffness_of_piece]
    return [first + np.arange(size) for first, size in zip(layout.region_of_first_piece, sizes, strict=True)]


def _impacts(label: IntArray, is_inner: NDArray[np.bool_]) -> list[tuple[bool, bool]]:
    """Of every corner, whether a crossing downward, and one upward, leads into contact, from the centre or outward."""
    lower = slice(None, -1)
    upper = slice(1, None)
    downward, upward = (
        ~is_inner[after] & (is_inner[before] | (np.abs(label[after]) > np.abs(label[before])))
        for before, after in ((upper, lower), (lower, upper))
    )
    return list(zip(downward.tolist(), upward.tolist(), strict=True))


def _sides(is_inner: NDArray[np.bool_], is_gap: bool) -> list[int]:
    """The side of every corner that counts, else 0; of a gap those of the centre count."""
    inside = is_inner[:-1].astype(int) + is_inner[1:]
    counts = (inside == 1) | ((inside == 0) & (not is_gap))
    last = np.flatnonzero(is_inner)[-1]
    side = np.where(np.arange(len(inside)) >= last, _DRIVE, _COAST)
    counted: list[int] = np.where(counts, side, 0).tolist()
    return counted
