"""Mean torques given as "balance": the rigid motion of the train that such a torque balances, and its value.

A free train can turn as a rigid whole, its bodies by the angles phi_i q (``engine.system.free_trains``). The train does
not accelerate if the mean torques T_i on its bodies do no work on this motion. So for a torque on body b, with
phi_b = 1, the sum of all mean torques on b must be

    T_b = -sum_i phi_i T_i

over the mean torques on the other bodies, drag torques and means of records included. The balancing torque is T_b minus
all other torques on b. Every product is rounded, and the products are summed with twice the digits (T. Ogita, S. M.
Rump, S. Oishi, SIAM J. Sci. Comput. 26 (2005) 1955, algorithm 4.4), by the same operations for numbers and for columns
of variants. A train with several rigid motions has one further condition for every motion in which b is at rest; no
torque on b can satisfy these.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from gearrattle.assembly.prescribed_motion import free_of
from gearrattle.assembly.unloaded import unloaded
from gearrattle.derived_values import kept
from gearrattle.engine.kernels.equilibrium_kernel import NEGLIGIBLE
from gearrattle.engine.system.equilibrium import elastic_elements
from gearrattle.engine.system.free_trains import Train, refined, trains
from gearrattle.errors import ModelError, Problem
from gearrattle.model import GROUND, Model
from gearrattle.model.balance import BALANCE
from gearrattle.wording import counted, measured

_Number = Any
"""A float, or a column of floats, one for every variant."""


class Balance(NamedTuple):
    """A torque that balances its train: the indices of the torque, of its inertia, and of all inertias of the train in
    ascending order.

    Attributes
    ----------
    motion
        rigid motion of the train on which the torque works: angles of all bodies, 1 for ``body``.
    others
        all other rigid motions of the train: ``body`` is at rest, and the body with most energy has the angle 1.
    """

    torque: int
    body: int
    bodies: tuple[int, ...]
    motion: tuple[float, ...]
    others: tuple[tuple[float, ...], ...]

    def total(self, loads: Sequence[_Number] | Mapping[int, _Number]) -> _Number:
        """Return T_b, the sum of all mean torques on the body [N m], from the loads on all inertias, by index."""
        works = [phi * loads[i] for i, phi in zip(self.bodies, self.motion, strict=True) if i != self.body]
        return 0.0 - _sum([0.0 * loads[self.body], *works])

    def left_over(self, loads: Sequence[float]) -> Iterator[tuple[float, int]]:
        """Yield the residual torques that no torque on the body can balance, with the indices of their inertias."""
        for motion in self.others:
            works = [phi * loads[i] for i, phi in zip(self.bodies, motion, strict=True)]
            left = _sum(works)
            if abs(left) > NEGLIGIBLE * sum(map(abs, works)):
                yield left, self.bodies[motion.index(1.0)]


def _sum(terms: Sequence[_Number]) -> _Number:
    """Return a sum computed as if with twice the digits and then rounded."""
    total = terms[0]
    error = 0.0 * total
    for term in terms[1:]:
        more = total + term
        part = more - total
        error = error + ((total - (more - part)) + (term - part))
        total = more
    return total + error


@kept
def balances_of(model: Model) -> tuple[Balance, ...]:
    """The torques that balance their trains, in file order.

    ModelError for two such torques in one train, or for a train that is not free to turn.
    """
    wanted = [i for i, torque in enumerate(model.torques) if torque.mean == BALANCE]
    if not wanted:
        return ()
    train_of = {i: k for k, train in enumerate(trains(unloaded(model))) for i in free_of(model)[train.bodies].tolist()}
    first_of: dict[int, int] = {}  # index of the torque that balances a train, by the train
    balances: list[Balance] = []
    problems: list[Problem] = []
    for i in wanted:
        train = train_of.get(_body(model, i))
        if train is None:
            problems.append(_held(model, i))
        elif train in first_of:
            rule = f"torque.{first_of[train]}.mean balances this train already, and one torque alone can"
            problems.append(_problem(i, rule, "give one of them a number"))
        else:
            first_of[train] = i
            balances.append(_balance(model, i, trains(unloaded(model))[train]))
    if problems:
        raise ModelError(problems)
    return tuple(balances)


def check_freedoms(model: Model, balance: Balance, loads: Sequence[float]) -> None:
    """Refuse a train that one torque cannot balance under all other loads (n,) on the inertias [N m].

    The ModelError states the residual torque and its inertia.
    """
    unit = "N m" if model.units == "SI" else ""
    names = [inertia.name for inertia in model.inertias]
    left = [
        f"{measured(abs(torque), unit, 6)} are {'left over' if torque > 0.0 else 'lacking'} at {names[i]}"
        for torque, i in balance.left_over(loads)
    ]
    if left:
        own = names[balance.body]
        ways = counted(1 + len(balance.others), "way")
        rule = f"the train of {own} turns in {ways}, and one torque balances one of them: with {own} at rest, "
        remedy = "balance that by other torques, or hold one more body of the train"
        raise ModelError(_problem(balance.torque, rule + " and ".join(left), remedy))


def _balance(model: Model, torque: int, train: Train) -> Balance:
    """The balance of a torque: the motion in which its body turns by 1, and the motions in which the body rests."""
    bodies = free_of(model)[train.bodies].tolist()
    body = _body(model, torque)
    motions = refined(unloaded(model), train)
    at_body = motions[bodies.index(body)]
    chosen = int(np.argmax(np.abs(at_body)))
    motion = motions[:, chosen] / at_body[chosen]
    others = []
    for column in np.delete(np.arange(train.freedoms), chosen):
        other = motions[:, column] - at_body[column] * motion
        other[bodies.index(body)] = 0.0
        energy = unloaded(model).inertia[train.bodies] * other**2
        others.append(tuple((other / other[np.argmax(energy)]).tolist()))
    return Balance(torque, body, tuple(bodies), tuple(motion.tolist()), tuple(others))


def _body(model: Model, torque: int) -> int:
    """Index of the inertia that a torque acts on."""
    return [inertia.name for inertia in model.inertias].index(model.torques[torque].on)


def _held(model: Model, torque: int) -> Problem:
    """The problem that the train of a torque is not free, with the elements or motions that hold it."""
    on = model.torques[torque].on
    moved = {motion.on for motion in model.motions}
    joined, paths = _joined(model, on)
    if held := sorted(moved & joined):
        rule = f"the prescribed motion of {held[0]} holds the train of {on}: it takes up what the means leave over"
    elif paths:
        rule = f"{paths[0]} holds the train of {on} to ground, which takes up what the means leave over"
    else:
        rule = f"the ratios of its elements let the train of {on} turn in no way"
    return _problem(torque, rule, "give a number, or leave mean out: 0")


def _problem(torque: int, rule: str, remedy: str) -> Problem:
    return Problem(f"torque.{torque}.mean", f'"{BALANCE}"', rule, remedy, ("torque", torque, "mean"))


def _joined(model: Model, on: str) -> tuple[set[str], list[str]]:
    """Names of the bodies that elements connect with body ``on``, but not across a body with prescribed motion; and
    the paths of the elements to ground.
    """
    paths = dict.fromkeys(model.elements[k].path for k in elastic_elements(unloaded(model)))
    ends = {
        path: {str(body.name) for body in model.components[path].bodies(model.components[path].to_plain())}
        for path in paths
    }
    moved = {motion.on for motion in model.motions} | {GROUND}
    joined = {on}
    while more := {name for bodies in ends.values() if bodies & (joined - moved) for name in bodies} - joined:
        joined |= more
    grounded = [path for path, bodies in ends.items() if GROUND in bodies and bodies & (joined - moved)]
    return joined, grounded
