"""Parts of branches over which the parameter only grows, or only falls; deflections of the motions along them.

A run is compared with the motions of a branch part by part of a period, at the same phases of the inputs. The distance
is the root mean square of the difference of the deflections. The mean of the difference over the part is subtracted
first, because motions of one family differ by a constant. A motion that repeats after n periods is shifted by the whole
number of periods that gives the least distance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.point import Point
from gearrattle.orbits.orbit import sampled
from gearrattle.orbits.stability_ranges import courses_of, halfway

if TYPE_CHECKING:
    from gearrattle.orbits.branch import Branch

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
_REACHED = 1e-6  # share of a parameter value: a part reaches a value so near to its end
_ROUNDING = 1e-13  # share of a parameter value: the sign of a smaller step is rounding
_FINE = 2e-4  # share of the swing: error of interpolation between two motions that is small enough
_NARROWEST = 1e-9  # share of a parameter value: no motion is added to a smaller interval


@dataclass(frozen=True)
class BranchPart:
    """A part of a branch, with one stability, over which the parameter only grows, or only falls."""

    is_stable: bool  # whether the motions are stable
    line: int  # number of the line between two folds to which the part belongs
    value: Array  # (N,) parameter, ascending [SI]
    peak_to_peak: Array  # (N, K) deflections of the K clearances [rad or m]
    branch: int  # number of the branch
    nodes: tuple[Point, ...]  # N motions: points of the branch, and motions at events
    events: tuple[int, int]  # rows in ``Branch.events`` of the events at the two ends; -1: none

    def at(self, value: float | Array) -> Array:
        """(..., K) peak-to-peak deflections at parameter values; beyond an end, the deflections at the end."""
        swings: Array = np.stack([np.interp(value, self.value, column) for column in self.peak_to_peak.T], axis=-1)
        return swings

    def reaches(self, value: float) -> bool:
        """Whether the part has a motion at a value; the ends are widened by rounding."""
        rounding = _REACHED * abs(value)
        return bool(self.value[0] - rounding <= value <= self.value[-1] + rounding)


def branch_parts(branch: Branch) -> Sequence[BranchPart]:
    """Return the parts of one stability of all branches."""
    swings = branch.data["peak_to_peak"].values
    event_swings = branch.event_levels[:, 1] - branch.event_levels[:, 0]
    located = [event.point for events in branch.events_of_curves for event in events]
    motions = list[BranchPart]()
    first_line = 0
    for number, course in enumerate(courses_of(branch)):
        # steps from node to node, grouped by stability and by the line between two folds
        lines = first_line + _turns(course.value)
        first_line = int(lines[-1]) + 1 if course.stable else first_line
        steps = enumerate(zip(course.stable, lines.tolist(), strict=True))
        for (is_stable, line), group in groupby(steps, key=lambda step: step[1]):
            # the nodes of the part, by ascending parameter
            own = [step for step, _ in group]
            part = slice(own[0], own[-1] + 2)
            value = course.value[part]
            nodes = course.nodes[part]
            swing = np.array([swings[i] if e < 0 else event_swings[e] for i, e in nodes])
            order = np.argsort(value, kind="stable")
            points = tuple(branch.points[i] if e < 0 else located[e] for i, e in (nodes[k] for k in order))
            motions.append(
                BranchPart(
                    is_stable=is_stable,
                    line=line,
                    value=value[order],
                    peak_to_peak=swing[order],
                    branch=number,
                    nodes=points,
                    events=(nodes[0][1], nodes[-1][1]),
                )
            )
    return motions


def _turns(value: Array) -> NDArray[np.int64]:
    """(N - 1,) number of times that (N,) values have turned back before each of their steps."""
    steps = np.diff(value)
    signs = np.sign(np.where(np.abs(steps) <= _ROUNDING * np.abs(value[1:]), 0.0, steps))
    moved = np.maximum.accumulate(np.where(signs != 0.0, np.arange(len(signs)), 0))
    filled = signs[moved]
    return np.concatenate([[0], np.cumsum(filled[1:] * filled[:-1] < 0.0)])[: len(steps)]


class DeflectionsAlong:
    """Deflections of the motions on a line between two folds, over (N,) ascending parameter values [SI].

    Beyond an end of the line they are the deflections at the end. ``grid`` holds the number of parts in a period and
    the number of instants in a part.
    """

    def __init__(self, branch: Branch, line: Sequence[BranchPart], grid: tuple[int, int]) -> None:
        ordered = sorted(line, key=lambda one: float(one.value[0]))
        self.value = np.concatenate([one.value for one in ordered])
        self._branch = branch
        self._curve = branch.curves[ordered[0].branch]
        self._points = [node for one in ordered for node in one.nodes]
        self._grid = grid
        self._known = list[Array | None]([None] * len(self._points))
        self._is_fine = [bool(width <= _NARROWEST * abs(self.value[-1])) for width in np.diff(self.value)]

    def reaches(self, value: Array) -> NDArray[np.bool_]:
        """Whether the line has motions at parameter values."""
        return np.asarray((self.value[0] <= value) & (value <= self.value[-1]))

    def off(self, deflection: Array, value: Array, part: IntArray, scale: Array) -> Array:
        """Return the (B,) squared distances between B parts of a run and the motions at the same parameter values.

        The parts have deflections (B, M, K) at M instants [rad or m], parameter values (B,) [SI] and numbers (B,) in
        their period. Deflections are divided by a scale (K,) [rad or m].
        """
        difference = (deflection[:, None] - self.at(value, part)) / scale
        difference -= difference.mean(axis=2, keepdims=True)
        squares: Array = np.mean(difference**2, axis=2).sum(axis=-1).min(axis=1)
        return squares

    def at(self, value: Array, part: IntArray) -> Array:
        """Return (B, n, M, K) deflections at B parameter values, in a part of each of the n periods of the motion."""
        k = np.clip(np.searchsorted(self.value, value) - 1, 0, max(len(self.value) - 2, 0))
        then = np.minimum(k + 1, len(self.value) - 1)
        width = self.value[then] - self.value[k]
        share = np.clip((value - self.value[k]) / np.where(width > 0.0, width, 1.0), 0.0, 1.0)
        needed = np.unique(np.concatenate([k[share < 1.0], then[share > 0.0]]))
        motions = np.stack([self._motion(int(i)) for i in needed])
        last = len(needed) - 1  # the index of a motion with weight 0 may be any
        before, after = (motions[np.minimum(np.searchsorted(needed, i), last), :, part] for i in (k, then))
        weight = share[:, None, None, None]
        return np.asarray((1.0 - weight) * before + weight * after)

    def refine(self, value: Array) -> bool:
        """Add motions around values where interpolation is too coarse; return whether an interval was checked."""
        around = np.unique(np.searchsorted(self.value, value) - 1)
        coarse = [k for k in around.tolist() if 0 <= k < len(self._is_fine) and not self._is_fine[k]]
        for k in coarse[::-1]:
            self._is_fine[k] = True
            between = halfway(
                self._branch.follower(self._curve), *sorted(self._points[k : k + 2], key=lambda one: one.length)
            )
            if between is None or not self.value[k] < between.parameter < self.value[k + 1]:
                continue
            self.value = np.insert(self.value, k + 1, between.parameter)
            self._points.insert(k + 1, between)
            self._known.insert(k + 1, None)
            before, own, after = (self._motion(i) for i in (k, k + 1, k + 2))
            share = (self.value[k + 1] - self.value[k]) / (self.value[k + 2] - self.value[k])
            off = np.abs(before + share * (after - before) - own).max()
            self._is_fine[k : k + 1] = [bool(off <= _FINE * np.ptp(own, axis=(0, 1, 2)).max())] * 2
        return bool(coarse)

    def _motion(self, i: int) -> Array:
        """(n, P, M, K) deflections of a motion at M instants in the P parts of its n periods."""
        known = self._known[i]
        if known is None:
            orbit = self._branch.orbit_at(self._points[i], self._curve.cycles)
            deflection = sampled(orbit, self._grid[0] * self._grid[1]).trajectory.deflection[:-1]
            known = deflection.reshape(self._curve.cycles, *self._grid, deflection.shape[-1])
            self._known[i] = known
        return known
