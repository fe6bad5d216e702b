"""Parts of branches over which the value only grows, or only falls, and deflections along them.

A run beside a branch is compared with its motions part by part of a period, at the same phases of the inputs. The
distance is the root mean square of the difference of the deflections, without its mean over the part, in which motions
of a family differ. A motion that repeats after n periods may be shifted by a whole number of them, whichever is
nearest.
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
from gearrattle.orbits.stability import courses_of, halfway

if TYPE_CHECKING:
    from gearrattle.orbits.branch import Branch

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
_REACHED = 1e-6  # of a value: an end that is nearer is reached
_ROUNDING = 1e-13  # of a value: a smaller step does not turn back
_FINE = 2e-4  # of the swing: the mean of two motions is as near to the one between
_NARROWEST = 1e-9  # of a value: no motion is added between two that are nearer


@dataclass(frozen=True)
class BranchPart:
    """A part of a branch of one stability over which its value only grows, or only falls."""

    is_stable: bool  # whether its motions are
    line: int  # a number: parts of one line follow each other with no fold in between
    value: Array  # (N,) growing [SI]
    peak_to_peak: Array  # (N, K) deflections of the K clearances [rad or m]
    branch: int  # number of the branch
    nodes: tuple[Point, ...]  # N motions, those of events included
    events: tuple[int, int]  # those at its two ends: rows of ``Branch.events``, or -1

    def at(self, value: float | Array) -> Array:
        """(..., K) peak-to-peak deflections at values; those of the end beyond it."""
        swings: Array = np.stack([np.interp(value, self.value, column) for column in self.peak_to_peak.T], axis=-1)
        return swings

    def reaches(self, value: float) -> bool:
        """Whether there is a motion at a value; ends except for rounding included."""
        rounding = _REACHED * abs(value)
        return bool(self.value[0] - rounding <= value <= self.value[-1] + rounding)


def branch_parts(branch: Branch) -> Sequence[BranchPart]:
    """The parts of all branches of one stability, ends at events included."""
    swings = branch.data["peak_to_peak"].values
    event_swings = branch.event_levels[:, 1] - branch.event_levels[:, 0]
    located = [event.point for events in branch.events_of_curves for event in events]
    motions = list[BranchPart]()
    first_line = 0
    for number, course in enumerate(courses_of(branch)):
        # steps of the course, by stability and by the line between two folds
        lines = first_line + _turns(course.value)
        first_line = int(lines[-1]) + 1 if course.stable else first_line
        steps = enumerate(zip(course.stable, lines.tolist(), strict=True))
        for (is_stable, line), group in groupby(steps, key=lambda step: step[1]):
            # the nodes of the part, by their value
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
    """(N - 1,) how often (N,) values have turned back before each of their steps."""
    steps = np.diff(value)
    signs = np.sign(np.where(np.abs(steps) <= _ROUNDING * np.abs(value[1:]), 0.0, steps))
    moved = np.maximum.accumulate(np.where(signs != 0.0, np.arange(len(signs)), 0))
    filled = signs[moved]
    return np.concatenate([[0], np.cumsum(filled[1:] * filled[:-1] < 0.0)])[: len(steps)]


class DeflectionsAlong:
    """Motions along the parts of a line, over (N,) values that only grow [SI]; beyond its ends those of the ends.

    ``grid`` says how many parts a period is compared in, and at how many instants every part.
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
        """Whether there are motions at values."""
        return np.asarray((self.value[0] <= value) & (value <= self.value[-1]))

    def off(self, deflection: Array, value: Array, part: IntArray, scale: Array) -> Array:
        """Return the (B,) squared distances of parts of a run, deflections measured by a (K,) scale [rad or m].

        A part has (B, M, K) deflections at M instants [rad or m], a (B,) value [SI], and a (B,) number in its period.
        """
        difference = (deflection[:, None] - self.at(value, part)) / scale
        difference -= difference.mean(axis=2, keepdims=True)
        squares: Array = np.mean(difference**2, axis=2).sum(axis=-1).min(axis=1)
        return squares

    def at(self, value: Array, part: IntArray) -> Array:
        """Return (B, n, M, K) deflections at B values in parts of each of the n periods."""
        k = np.clip(np.searchsorted(self.value, value) - 1, 0, max(len(self.value) - 2, 0))
        then = np.minimum(k + 1, len(self.value) - 1)
        width = self.value[then] - self.value[k]
        share = np.clip((value - self.value[k]) / np.where(width > 0.0, width, 1.0), 0.0, 1.0)
        needed = np.unique(np.concatenate([k[share < 1.0], then[share > 0.0]]))
        motions = np.stack([self._motion(int(i)) for i in needed])
        last = len(needed) - 1  # a motion that is not needed has no share: another one may stand for it
        before, after = (motions[np.minimum(np.searchsorted(needed, i), last), :, part] for i in (k, then))
        weight = share[:, None, None, None]
        return np.asarray((1.0 - weight) * before + weight * after)

    def refine(self, value: Array) -> bool:
        """Add motions around values, where the mean of two is not near to the one between; return whether it did."""
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
        """(n, P, M, K) deflections of a motion in the parts of its periods."""
        known = self._known[i]
        if known is None:
            orbit = self._branch.orbit_at(self._points[i], self._curve.cycles)
            deflection = sampled(orbit, self._grid[0] * self._grid[1]).trajectory.deflection[:-1]
            known = deflection.reshape(self._curve.cycles, *self._grid, deflection.shape[-1])
            self._known[i] = known
        return known
