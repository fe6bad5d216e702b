"""Branch and bound: a box is divided until its parts are proven quiet, refuted, or shown to be neither.

The largest part is looked at next. Where bounds decide a slice of it along one parameter, the slice is cut off, and
what is left is looked at again (a contractor: L. Jaulin, M. Kieffer, O. Didrit, E. Walter, Applied Interval Analysis,
2001, sec. 4.2); else it is halved across the parameter that matters most.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from time import monotonic
from typing import NamedTuple

import numpy as np

from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.engine.system.equilibrium import Runaway, elastic_elements, equilibrium
from gearrattle.engine.system.free_trains import trains
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.errors import ConvergenceError
from gearrattle.studies.quiet.bounds import Bounds, Phases, bounds_of
from gearrattle.studies.quiet.coefficients import Family
from gearrattle.studies.quiet.rest_state import CLIP, GAP, SLIP, STAGE, State
from gearrattle.studies.quiet.taylor_forms import Array

PROVEN, REFUTED, OPEN = range(3)
UNDECIDED = "undecided"
STAGES = "stage"
SLIPS = "friction"
CLIPS = "damping"
FLOATS = "gap"
ENDURES = "undamped"
"""Why a part is open: it would have to be divided further; the linear motion leaves a stage, makes friction slip, has
its damping clipped; a body floats in a gap; not all that moves is shown to decay."""
_REASONS = {STAGE: STAGES, SLIP: SLIPS, CLIP: CLIPS}
_CUT = 0.15  # of a part: a slice this large is cut off
_INWARD = 1e-9  # of a part: what a slice is made smaller by
_ELSEWHERE = (0.21, 0.83)
_SMALLEST = 1e-12  # of the box: a part this small is left as it is


class Slice(NamedTuple):
    """Ends along one parameter of a part, -1 to 1, and the status, reason and element in between; see ``Part``."""

    low: float
    high: float
    status: int = OPEN
    reason: str = UNDECIDED
    element: int = -1


@dataclass(frozen=True)
class Part:
    """A part of the box: PROVEN, REFUTED, or OPEN with the reason.

    Attributes
    ----------
    low, high
        (d,) its ends; the box is from -1 to 1.
    element
        that leaves its piece where it is refuted, or open for such a reason; -1 for none.
    """

    low: Array
    high: Array
    status: int = OPEN
    reason: str = UNDECIDED
    element: int = -1

    @property
    def share(self) -> float:
        """Its volume as a share of the box."""
        return float(np.prod(0.5 * (self.high - self.low)))

    def across(self, axis: int, piece: Slice) -> Part:
        """Return the part of it that a slice across one parameter is."""
        middle = 0.5 * (self.low[axis] + self.high[axis])
        half = 0.5 * (self.high[axis] - self.low[axis])
        lower = self.low.copy()
        upper = self.high.copy()
        if piece.low > -1.0:
            lower[axis] = middle + piece.low * half
        if piece.high < 1.0:
            upper[axis] = middle + piece.high * half
        return Part(lower, upper, *piece[2:])


@dataclass
class Search:
    """Search under way.

    ``parts`` are decided, or no division decides them; with those still to be examined they fill the box at any time.
    """

    family: Family
    parts: list[Part] = field(default_factory=list)
    looked_at: int = 0
    _queue: list[tuple[float, int, Part, State]] = field(default_factory=list)
    _phases: Phases = field(init=False)
    _states: dict[tuple[int, ...], State] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = len(self.family.numbers.linear)
        self._phases = Phases(self.family.system.inputs.cycles)
        whole = Part(-np.ones(count), np.ones(count))
        starts = (self._state_at(np.full(count, share)) for share in (0.0, -0.37, 0.61))
        state = next((start for start in starts if start is not None), None)
        if state is None:
            self.parts.append(replace(whole, reason=FLOATS))
        else:
            self._add(whole, state)

    @property
    def undecided(self) -> float:
        """Share of the box that is still to be looked at."""
        return sum(-entry[0] for entry in self._queue)

    def every(self) -> list[Part]:
        """All parts, with those that are still to be looked at."""
        return [*self.parts, *(part for _, _, part, _ in self._queue)]

    def run(self, share: float, most: int, until: float, progress: Callable[[float], None]) -> None:
        """Go on until no more than a share of the box is undecided, so many parts were looked at, or it is time.

        Parameters
        ----------
        until
            when to stop, by ``time.monotonic`` [s].
        progress
            called with the finished share; what it raises ends the search, which can go on.
        """
        begin = monotonic()
        left = self.undecided
        while self._queue and left > share and self.looked_at < most and monotonic() < until:
            _, _, part, state = self._queue[0]
            divided = list(self._divided(part, state))
            heapq.heappop(self._queue)
            self.looked_at += 1
            for piece, next_state in divided:
                if next_state is None or piece.share < _SMALLEST:
                    self.parts.append(piece)
                else:
                    self._add(piece, next_state)
            if self.looked_at % 16 == 1:
                left = self.undecided
                spent = (monotonic() - begin) / (until - begin) if until > begin else 1.0
                progress(min(1.0, max((1.0 - left) / max(1.0 - share, 1e-9), self.looked_at / most, spent)))

    def _add(self, part: Part, state: State) -> None:
        heapq.heappush(self._queue, (-part.share, self.looked_at * 16 + len(self._queue), part, state))

    def _divided(self, part: Part, state: State) -> Iterator[tuple[Part, State | None]]:
        """Yield the pieces of a part, with the state in which those that are undecided are examined next."""
        # coefficients over the part, and its state of rest
        centre = 0.5 * (part.low + part.high)
        radius = 0.5 * (part.high - part.low)
        numbers = self.family.over(centre, radius)
        resting = self._resting(state, centre)
        # no state of rest for the whole part: halve
        if resting is None or not resting.is_held:
            if self._floats(part):
                yield replace(part, reason=FLOATS), None
            else:
                yield from ((half, state) for half in _halves(part, int(np.argmax(radius))))
            return
        state = resting
        # linear motion over the part
        motion, bent = state.motion(numbers)
        if motion is None:
            yield from ((half, state) for half in _halves(part, int(np.argmax(bent))))
            return
        # bounds that the motion must keep
        bounds = bounds_of(state, motion, numbers, self._phases)
        if bounds is None:
            yield _proven(part, state), None
            return
        # cut off slices that the bounds decide
        if slices := _best(bounds, state, part):
            yield from ((piece, state if piece.reason == UNDECIDED else None) for piece in slices)
            return
        # halve across the parameter of most influence
        weight = bounds.influence()
        bent = bent / (bent.sum() + 1e-300)
        yield from ((half, state) for half in _halves(part, int(np.argmax(weight[:-1] + weight[-1] * bent))))

    def _resting(self, state: State, centre: Array) -> State | None:
        """Return the state of rest at a point: the one at hand if its mean lies within its pieces there."""
        numbers = self.family.over(centre, np.zeros(centre.size))
        at_rest = state.rest_at(numbers) if state.is_held else None
        if at_rest is not None and _is_within(state, at_rest.real, self.family.at(centre)):
            return state
        return self._state_at(centre)

    def _floats(self, part: Part) -> bool:
        """Whether a body floats in a gap, or nothing rests, at some further points of a part as well."""
        for share in _ELSEWHERE:
            state = self._state_at(part.low + share * (part.high - part.low))
            if state is not None and state.is_held:
                return False
        return True

    def _state_at(self, point: Array) -> State | None:
        """Return the state of rest at a point; None for none."""
        system = system_at(self.family, point)
        try:
            pieces = equilibrium(system).pieces
        except (Runaway, ConvergenceError):
            return None
        if pieces not in self._states:
            self._states[pieces] = State(self.family, pieces)
        return self._states[pieces]


def _halves(part: Part, axis: int) -> Iterator[Part]:
    yield part.across(axis, Slice(-1.0, 0.0))
    yield part.across(axis, Slice(0.0, 1.0))


def _proven(part: Part, state: State) -> Part:
    """A part in which every bound is kept."""
    return replace(part, status=PROVEN, reason="") if state.decays else replace(part, reason=ENDURES)


def _best(bounds: Bounds, state: State, part: Part) -> list[Part]:
    """Return the slices along the parameter that decides most; none where it decides too little."""
    best: list[Part] = []
    most = _CUT
    for axis in range(part.low.size):
        pieces = list(_slices(bounds, state, axis))
        decided = sum(0.5 * (piece.high - piece.low) for piece in pieces if piece.reason != UNDECIDED)
        if decided >= most:
            most = decided
            best = [part.across(axis, piece) for piece in pieces]
    return best


def _slices(bounds: Bounds, state: State, axis: int) -> Iterator[Slice]:
    """Yield the slices of a part along one parameter, one after the other."""
    known = sorted(_known(bounds, state, axis))
    cuts = sorted({-1.0, 1.0, *(end for piece in known for end in piece[:2])})
    slices: list[Slice] = []
    for low, high in pairwise(cuts):
        holds = (piece for piece in known if piece.low <= low and high <= piece.high)
        best = next(holds, Slice(low, high))._replace(low=low, high=high)
        if slices and slices[-1][2:] == best[2:]:
            best = best._replace(low=slices.pop().low)
        slices.append(best)
    yield from slices


def _known(bounds: Bounds, state: State, axis: int) -> Iterator[Slice]:
    """Yield the slices of which something is known; they may overlap where several bounds are exceeded."""
    status, reason = (PROVEN, "") if state.decays else (OPEN, ENDURES)
    yield from _inward(Slice(*bounds.kept(axis), status, reason))
    # contact is lost while all else is kept: then nothing that stays in this state is quiet
    gap = bounds.kind == GAP
    intervals = bounds.kept(axis, ~gap), bounds.at_rest(axis)
    low = max(first for first, _ in intervals)
    high = min(last for _, last in intervals)
    for kind, element in sorted(set(zip(bounds.kind.tolist(), bounds.element.tolist(), strict=True))):
        below, above = bounds.exceeded(axis, (bounds.kind == kind) & (bounds.element == element))
        if kind == GAP and state.stuck:  # a motion that slips may be quiet
            piece = Slice(low, high, OPEN, SLIPS, state.stuck[0][1])
        elif kind == GAP:
            piece = Slice(low, high, REFUTED, "", element)
        else:
            piece = Slice(-1.0, 1.0, OPEN, _REASONS[kind], element)
        yield from _inward(piece._replace(high=min(below, piece.high)))
        yield from _inward(piece._replace(low=max(above, piece.low)))


def _inward(piece: Slice) -> Iterator[Slice]:
    """Yield each slice made a little smaller, for rounding, where anything of it is left."""
    low = piece.low + (_INWARD if piece.low > -1.0 else 0.0)
    high = piece.high - (_INWARD if piece.high < 1.0 else 0.0)
    if low < high:
        yield piece._replace(low=low, high=high)


def _is_within(state: State, mean: Array, numbers: dict[str, Array]) -> bool:
    """Whether a mean state lies within its pieces."""
    size = state.family.system.size
    inner = numbers["inner"][state.piece_numbers]
    deflection = mean[size:] + inner
    return all(
        corner.side * (deflection[corner.element] - numbers["corner"][corner.number]) < 0.0 for corner in state.corners
    )


def system_at(family: Family, point: Array) -> PiecewiseSystem:
    """Return the driveline at a point under its mean loads, drag included where it brings a train to a steady rate."""
    system = family.system
    numbers = family.at(point)
    laws = []
    piece = 0
    corner = 0
    for law in system.laws:
        own = slice(piece, piece + law.pieces)
        stiffness = numbers["stiffness"][own]
        offset = numbers["force"][own] - stiffness * numbers["inner"][own]
        ends = numbers["corner"][corner : corner + law.corners.size]
        laws.append(replace(law, corners=ends, stiffness=stiffness, damping=numbers["damping"][own], offset=offset))
        piece += law.pieces
        corner += law.corners.size
    mean = numbers["mean"] - numbers["drag"] * steady_rate(family, numbers)
    inputs = replace(system.inputs, mean=mean)
    return replace(system, inertia=numbers["inertia"], laws=tuple(laws), inputs=inputs, auxiliaries=(), clock=None)


def steady_rate(family: Family, numbers: dict[str, Array]) -> Array:
    """(n,) rates to which drag brings free trains whose means do not balance; zero for trains without drag."""
    system = family.system
    rate = np.zeros(system.size)
    motions = relative_coordinates(system, elastic_elements(system)).angle_from_reference
    for bodies, _ in trains(system):
        own = motions[:, np.any(motions[bodies] != 0.0, axis=0)]
        loss = own.T @ (numbers["drag"][:, None] * own)
        if numbers["drag"][bodies].any():
            rate += own @ np.linalg.lstsq(loss, own.T @ numbers["mean"], rcond=None)[0]
    return rate
