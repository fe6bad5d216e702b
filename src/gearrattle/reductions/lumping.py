"""Lumping: bodies with no relative motion in the modes that matter are merged through their kinematic ratios.

The step of Padmanabhan et al. 1995, sec. 3, where a person did it from mode shapes: gears that move alike are lumped
onto their shaft, I3 + I5 + I7 + I6 (R5/R6)^2 + I8 (R7/R8)^2. Here every element has its share of the strain energy,

    s_k = k_k delta_k^2 / sum_j k_j delta_j^2,

in every elastic mode up to margin x up_to of every contact state. An element made rigid takes its flexibility away, and
by Rayleigh's quotient raises that mode by about s_k / 2. Elements are merged in the order of their largest share while
the sum predicts no error beyond half the limit; then the error is measured (``accuracy``), and the merges with the
largest shares are taken back while it is beyond the limit. Elements with a clearance that is kept are never merged, nor
is one to the ground, nor one whose transmission error excites the band.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.linear.matrices import linearised
from gearrattle.reductions.accuracy import Worst, error_within
from gearrattle.reductions.grouping import SAME, Grouping, grouped
from gearrattle.reductions.reduction_request import Request, Subspace
from gearrattle.reductions.states import contact_states

Array = NDArray[np.float64]

LIMIT = 0.05
"""Largest relative error of a natural frequency in the band."""
_PREDICTED = (
    0.5  # share of the limit that merging may use up by prediction: s/2 is the first order of a convex function
)


class Refused(Exception):
    """Refusal to merge a forced element: its index, and a key of ``REASONS``."""

    def __init__(self, element: int, reason: str) -> None:
        self.element = element
        self.reason = reason
        super().__init__(f"element {element}: {reason}")


@dataclass(frozen=True)
class Fate:
    """Whether the two bodies of an element are one now, and why.

    Attributes
    ----------
    reason
        a key of ``REASONS``.
    share
        its largest share of strain energy; NaN if no elastic mode lies within margin x up_to.
    at
        the frequency of that mode [rad/s].
    """

    merged: bool
    reason: str
    share: float
    at: float


REASONS = {
    "kept": "asked to be kept",
    "clearance": "has a clearance",
    "friction": "has dry friction",
    "ground": "is tied to the ground",
    "sideways": "is at a body that moves sideways, which stays a body of its own",
    "own": "its component keeps its bodies, as a planetary set or a Hooke joint does",
    "soft": "has no stiffness",
    "error": "its transmission error excites the band",
    "locks": "a closed loop of meshes would lock",
    "silences": "an element beside it that is kept would never deflect again",
    "speeds": "a staged coupling would stand between shafts of different speeds, which a model file cannot say",
    "strain": "holds too much of the strain energy",
    "measured": "was merged at first; the measured error was too large",
    "asked": "asked to be merged",
    "stiff": "hardly deflects",
    "parallel": "joins two bodies that are one already",
}
"""Every reason, in words."""


@dataclass(frozen=True)
class Lumps:
    """Groups of bodies, the fate of every element (m,), and the largest error of a frequency, where it was measured."""

    grouping: Grouping
    fates: tuple[Fate, ...]
    error: Worst | None = None

    @property
    def subspace(self) -> Subspace:
        """The same as a subspace."""
        return Subspace(self.grouping.basis, self.grouping.kept)


@dataclass(frozen=True)
class _Rules:
    request: Request
    level: frozenset[int]  # elements whose two ends must keep equal speeds
    own: frozenset[int]  # elements whose bodies must stay apart, at their own speeds

    def grouping(self, merged: tuple[int, ...]) -> Grouping:
        """Group the bodies by a set that is known to be allowed."""
        grouping = self.bodies(merged)
        assert isinstance(grouping, Grouping)
        return grouping

    def bodies(self, merged: tuple[int, ...]) -> Grouping | str:
        """Group the bodies, or return the reason why not."""
        # groups of bodies; a closed loop must not lock
        rows = self.request.system.rows
        grouping = grouped(rows, merged)
        if grouping is None:
            return "locks"
        grouping = self._settled(grouping)
        # kept clearances must keep a deflection
        reduced = rows @ grouping.basis
        size = np.abs(rows) @ np.abs(grouping.basis)
        silent = np.all(np.abs(reduced) <= SAME * size, axis=1)
        if any(silent[k] and k not in merged for k in self.request.kept):
            return "silences"
        # no other element with both ends in one group may be strained
        for row in rows[~silent]:
            ends = np.flatnonzero(row)
            if ends.size == 2 and grouping.owner[ends[0]] == grouping.owner[ends[1]]:
                return "locks"
        # elements between bodies of their own
        for k in self.own:
            bodies = np.flatnonzero(rows[k]).tolist()
            alike = all(abs(grouping.ratio[i] - 1.0) <= SAME for i in bodies)
            if not alike or len({grouping.owner[i] for i in bodies}) < len(bodies):
                return "own"
        # elements between equal speeds
        for k in self.level:
            entries = np.abs(reduced[k][np.abs(reduced[k]) > SAME * size[k]])
            if not silent[k] and np.ptp(entries) > SAME * entries.max():
                return "speeds"
        return grouping

    def _settled(self, grouping: Grouping) -> Grouping:
        """Keep the body of a group at whose speed most couplings are tied; of equals a driven one, then the first."""
        # weight of bodies by the couplings at them
        rows = self.request.system.rows
        weight = np.zeros(rows.shape[1])
        for k, row in enumerate(rows):
            ends = np.flatnonzero(row)
            if k in self.own:
                weight[ends] += 1000.0
            elif (
                ends.size == 2
                and abs(row.sum()) <= SAME * np.abs(row).max()
                and len({grouping.owner[i] for i in ends}) > 1
            ):
                weight[ends] += 1000.0 if k in self.level else 1.0
        # couplings that stay couplings if a body is kept
        ratios = np.array(grouping.ratio)

        def tied(body: int) -> float:
            """Couplings tied to the body's group at the body's speed, for they stay couplings if it is kept."""
            same = (np.array(grouping.owner) == grouping.owner[body]) & (np.abs(ratios / ratios[body] - 1.0) <= SAME)
            return float(weight[same].sum())

        # body of the largest weight in every group
        for body in grouping.kept:
            members = [i for i, o in enumerate(grouping.owner) if o == body]
            best = max(members, key=lambda i: (tied(i), i in self.request.driven, -i))
            if best != body:
                grouping = grouping.turned(body, best)
        return grouping


def lump(
    request: Request,
    *,
    forced: tuple[int, ...] = (),
    level: frozenset[int] = frozenset(),
    own: frozenset[int] = frozenset(),
    sideways: frozenset[int] = frozenset(),
    limit: float = LIMIT,
) -> Lumps:
    """Choose the elements to merge; Refused if a forced one cannot be merged.

    Parameters
    ----------
    level
        elements that must stay between equal speeds, because their law cannot be written otherwise.
    own
        elements that must stay between bodies of their own, at the speeds these have.
    sideways
        elements at a body that moves sideways, which must stay.
    """
    # elements that may not be merged, and those that must
    rules = _Rules(request, level, own)
    shares, frequencies = _shares(request)
    reasons = _barred(request, forced, own, sideways)
    merged = _forced(rules, forced, reasons)
    # merge by rising share of strain energy while Rayleigh's quotient predicts half the limit at most
    largest = shares.max(axis=0, initial=0.0)
    used = shares[:, list(merged)].sum(axis=1)
    for k in sorted((k for k, reason in enumerate(reasons) if not reason), key=lambda k: (largest[k], k)):
        answer = rules.bodies((*merged, k))
        if isinstance(answer, str):
            reasons[k] = answer
        elif 0.5 * np.max(used + shares[:, k], initial=0.0) > _PREDICTED * limit:
            reasons[k] = "strain"
        else:
            merged = (*merged, k)
            used = used + shares[:, k]
            reasons[k] = "stiff"
    # measured error: take back the largest shares while it is beyond the limit
    grouping = rules.grouping(merged)
    error: Worst | None = None
    while merged[len(forced) :] and (error := error_within(request, grouping.basis, limit)) is None:
        reasons[merged[-1]] = "measured"
        merged = merged[:-1]
        grouping = rules.grouping(merged)
    # elements between bodies that now turn as one
    for k, row in enumerate(request.system.rows):
        if k not in merged and np.max(np.abs(row @ grouping.basis)) <= SAME * np.max(
            np.abs(row) @ np.abs(grouping.basis)
        ):
            reasons[k] = "parallel"
    # reasons by element
    fates = tuple(_fate(reason, shares[:, k], frequencies) for k, reason in enumerate(reasons))
    return Lumps(grouping, fates, error)


def subspace(request: Request) -> Subspace:
    """The subspace of lumping by its own choice, as in ``REDUCTIONS``."""
    return lump(request).subspace


def _fate(reason: str, shares: Array, frequencies: Array) -> Fate:
    merged = reason in ("asked", "stiff", "parallel")
    if not shares.size:
        return Fate(merged, reason, np.nan, np.nan)
    k = int(np.argmax(shares))
    return Fate(merged, reason, float(shares[k]), float(frequencies[k]))


def _shares(request: Request) -> tuple[Array, Array]:
    """(p, m) share of every element in every elastic mode within margin x up_to of every contact state; their (p,)."""
    shares = [np.zeros((0, len(request.system.laws)))]
    at = [np.zeros(0)]
    for state in contact_states(request.system, request.clearances, request.up_to):
        linear = linearised(request.system, state.stiffness, state.damping)
        omega, shapes = linear.natural()
        inside = (omega > 0.0) & (omega <= request.margin * request.up_to)
        energy = (linear.elastic @ shapes[:, inside]).T ** 2
        shares.append(energy / energy.sum(axis=1, keepdims=True))
        at.append(omega[inside])
    return np.vstack(shares), np.concatenate(at)


def _barred(request: Request, forced: tuple[int, ...], own: frozenset[int], sideways: frozenset[int]) -> list[str]:
    """Return the reason why an element cannot be merged at all; empty where it may be."""
    system = request.system
    order = 2.0 * np.pi * system.inputs.cycles / system.inputs.period
    inside = order <= request.margin * request.up_to
    excites = np.any((system.inputs.error_sine != 0.0) | (system.inputs.error_cosine != 0.0), where=inside, axis=1)
    reasons = []
    for k, law in enumerate(system.laws):
        reason = ""
        if k in sideways:
            reason = "sideways"
        elif k in own:
            reason = "own"
        elif np.count_nonzero(system.rows[k]) != 2:
            reason = "ground"
        elif law.stiffness[-1] <= 0.0:
            reason = "soft"
        elif excites[k]:
            reason = "error"
        elif k in request.kept:
            rubs = any(auxiliary.element == k for auxiliary in system.auxiliaries)
            reason = "clearance" if k in request.clearances else "friction" if rubs else "kept"
        if reason and k in forced:
            raise Refused(k, reason)
        reasons.append(reason)
    return reasons


def _forced(rules: _Rules, forced: tuple[int, ...], reasons: list[str]) -> tuple[int, ...]:
    """Merge what was asked to be merged, one after another."""
    merged: tuple[int, ...] = ()
    for k in forced:
        answer = rules.bodies((*merged, k))
        if isinstance(answer, str):
            raise Refused(k, answer)
        merged = (*merged, k)
        reasons[k] = "asked"
    return merged
