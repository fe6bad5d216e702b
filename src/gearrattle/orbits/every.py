"""All periodic motions of a model: settled from many starts, followed through folds, and counted.

Newton's method from a grid of starts misses motions: on piecewise-linear maps it goes round in circles. So

1. states spread over the reach of the driveline are followed until they settle: this finds attracting motions,
2. Newton's method begins from all of them as well: this finds some motions that do not attract,
3. of a symmetric driveline the symmetric motions are sought by the half-period map, and every other motion has a mirror
   image,
4. every motion is followed over the speed, up and down, through folds: where its branch comes back to the speed of the
   model, it gives other motions,
5. the fixed points of the n-period map are counted. If all motions end in a bounded set and none is free,
   the sum of the signs of det(I - M) over them is 1 (Brouwer's degree): a sum that differs says that one is missing.
   Then Newton's method goes on from further starts, repelled by what is known.

Takes a Model; gives Orbits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from gearrattle.assembly import assemble
from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.period_map import Pass, PeriodMap
from gearrattle.engine.periodic.symmetry import HalfPeriodMap, is_symmetric
from gearrattle.errors import ConvergenceError
from gearrattle.model import Model
from gearrattle.orbits.family import family_of
from gearrattle.orbits.orbit import Orbit, settled_state
from gearrattle.orbits.search import Known, deflated, free_directions, search, search_symmetric, starts_of

_STARTS = 32
_FURTHER = 64  # starts of the deflated Newton method
_PATH = "excitation.speed"
_SPAN = 0.6  # of the speed, to both sides
_STEP = 0.05
_POINTS = 600  # of a branch over the speed


def every_orbit(model: Model, cycles: int) -> list[Orbit]:
    """Return all motions that repeat after ``cycles`` periods, those with the largest swings last.

    ``cycles`` of an orbit are the fewest periods after which it repeats. A note on each says where the count of fixed
    points shows that a motion is missing, or that it cannot show it.
    """
    period_map = PeriodMap(assemble(model).system, cycles)
    known = Known(period_map)
    for state in (settled_state(model, period_map), *starts_of(period_map, _STARTS)):
        search(known, state)
    if cycles % 2 == 1 and is_symmetric(period_map.system):
        search_symmetric(known, HalfPeriodMap(period_map.system, cycles), starts_of(period_map, _STARTS))
    _follow_all(model, known, 0)
    is_free = any(free_directions(period_map, motion) for motion in known.passes)
    for state in () if is_free else starts_of(period_map, _FURTHER, seed=1):
        if known.index() == 1:
            break
        motion = deflated(known, state)
        if motion is not None and known.add(motion):
            _follow_all(model, known, len(known.passes) - 1)
    notes = _notes(known, is_free)
    orbits = [_orbit(model, known, i, notes) for i in range(len(known.passes))]
    return sorted(orbits, key=lambda orbit: float(np.ptp(orbit.run.trajectory.deflection, axis=0).max(initial=0.0)))


def _follow_all(model: Model, known: Known, first: int) -> None:
    """Follow the motions from index ``first`` on over the speed; keep what their branches give at the model's speed."""
    speed = model.excitation.omega
    curve = Continuation(family_of(model, _PATH, speed, known.period_map.cycles, speed * _SPAN), longest=_STEP)
    for motion in known.passes[first:]:  # what is added lies on the branch of one of these
        if not free_directions(known.period_map, motion):
            for upward in (True, False):
                for other in _met_again(curve, motion, speed, upward):
                    known.add(other)


def _met_again(curve: Continuation, motion: Pass, value: float, upward: bool) -> Iterator[Pass]:
    """Yield the further motions of a branch at the parameter value of the first one."""
    span = _SPAN * value
    try:
        points = [curve.begin(motion.start, value, upward=upward)]
        for point in curve.follow(points[0], value - span, value + span):
            before = points[-1]
            if len(points) > 1 and (before.parameter - value) * (point.parameter - value) < 0.0:
                yield curve.at_parameter(before, point, value).motion
            points.append(point)
            if len(points) > _POINTS:
                return
    except ConvergenceError:
        return


def _notes(known: Known, is_free: bool) -> tuple[str, ...]:
    """What the count of fixed points says."""
    if is_free:
        return ("Whether all motions were found cannot be counted: the driveline has a free direction.",)
    index = known.index()
    if index == 1:
        return ()
    return (f"A motion is missing: the signs of det(I - M) add up to {index} instead of 1.",)


def _orbit(model: Model, known: Known, i: int, notes: Sequence[str]) -> Orbit:
    """An orbit with the fewest periods after which it repeats."""
    period_map, motion, cycles = known.period_map, known.passes[i], len(known.shifts[i])
    orbit = shooting.shoot(PeriodMap(period_map.system, cycles), motion.start)
    return Orbit(model, cycles, orbit.motion, orbit.residual, orbit.free.shape[1], tuple(notes))
