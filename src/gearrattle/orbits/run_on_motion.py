"""Whether a run was on a motion of a branch.

It is looked at where a run can be compared with a periodic motion: at the starts of its periods, with the motion at the
speed of that instant, which Newton's method gives. So neither how many points a branch has, nor where they lie, nor the
direction in which it was followed decides anything. Of the starts in a part of the branch the last one that the run
passes is tried, and earlier ones, ever farther apart. Where a part has no start, because the run passes it within a
period, motions at shares of its width before that end are compared with the state at the start of the period.

The run was on a motion if its state is nearer to it than to any other motion there, stable or not, and would settle in
it, held at that speed.

Takes a run and a part of a Branch; gives whether it was.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from gearrattle.engine.periodic.point import Point
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.attractors import Attractor, passes_to_settle
from gearrattle.orbits.branch_members import Followed
from gearrattle.orbits.orbit import Orbit
from gearrattle.orbits.run_parts import BranchPart, RunParts

_SAME_STATE = 1e-4  # of the units of a motion: states that differ by less are one
_MOST_PASSES = 2000  # of a motion in which a run is held, where another motion of the part needs no more
_SHARES = (0.125, 0.25, 0.5)  # of the width of a part, from the end that the run passes last


class _Compared(NamedTuple):
    """What a run is compared with at a value.

    Attributes
    ----------
    value
        of the branch [SI].
    own
        the motion of the part.
    passes
        after which motions have settled in it.
    all
        motions of all branches.
    """

    value: float
    own: Orbit
    passes: int
    all: tuple[Orbit, ...]


def was_on(branch: Followed, run: RunParts, part: BranchPart, beyond: float | None = None) -> bool:
    """Return whether a run was on a motion of a part, beyond a value.

    Motions that settle too slowly are left out, unless all of those that are tried do.
    """
    slowly = list[_Compared]()
    is_slow = True
    for value in _values_tried(run, part, beyond):
        compared = _compared_at(branch, part, value)
        if compared is None:
            continue
        if compared.passes > _MOST_PASSES:
            slowly.append(compared)
        elif _is_on(run, compared):
            return True
        else:
            is_slow = False
    fastest = min(slowly, key=lambda one: one.passes, default=None)
    return is_slow and fastest is not None and _is_on(run, fastest)


def _values_tried(run: RunParts, part: BranchPart, beyond: float | None) -> Iterator[float]:
    """Values in a part beyond a value, at starts of periods if it has any: the last, and each next one twice as far."""
    low, high = float(part.value[0]), float(part.value[-1])
    if beyond is not None:
        low, high = (max(low, beyond), high) if run.upward else (low, min(high, beyond))
    if low >= high:
        return
    starts = run.starts[(low <= run.starts) & (run.starts <= high)][::-1]
    if not starts.size:
        last, first = (high, low) if run.upward else (low, high)
        yield from (last + share * (first - last) for share in _SHARES)
    for n in range(len(starts).bit_length()):
        yield float(starts[2**n - 1])


def _compared_at(branch: Followed, part: BranchPart, value: float) -> _Compared | None:
    """The motion of a part at a value, and all that are known there; None: Newton's method gives none."""
    lengths = sorted((part.nodes[0].length, part.nodes[-1].length))
    own, orbits = list[tuple[Orbit, Point]](), list[Orbit]()
    for number, curve in enumerate(branch.curves):
        for _, point in curve.motions_at(branch.follower(curve), value):
            orbits.append(branch.orbit_at(point, curve.cycles))
            if number == part.branch and lengths[0] <= point.length <= lengths[1]:
                own.append((orbits[-1], point))
    if not own:
        return None
    orbit, point = own[0]
    return _Compared(value, orbit, passes_to_settle(point.multipliers, point.free), tuple(orbits))


def _is_on(run: RunParts, compared: _Compared) -> bool:
    """Whether a run is nearest to a motion, and settles there."""
    motion = Attractor(compared.own)
    state = run.state_before(compared.value, motion.orbit.period_map)
    try:
        if not motion.attracts(state, compared.passes):
            return False
    except ConvergenceError:
        return False
    rivals = [Attractor(other) for other in compared.all if not motion.is_near(other.motion.start, _SAME_STATE)]
    return all(motion.distance(state) < rival.distance(state) for rival in rivals)
