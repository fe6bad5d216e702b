"""The coefficients of a driveline over a box of parameters.

Every number that the linear driveline is made of - inertias, drags, means, amplitudes, stiffness, damping, corners,
friction, the rate of the inputs - is a polynomial of second degree of the box's parameters in [-1, 1]: inertia and
stiffness are proportional to their paths, the force at the corner of a stage is a product of two of them. Values at the
middle, at both ends of every parameter and at the ends of every two give the polynomial exactly. It is compared with
the driveline at further points; a path that enters in another way is refused.

    F_k = K_k (delta - B_k) + P_k

in a piece: B_k is the corner at its inner end (0 in the piece at the centre) and P_k the force there. In contact behind
a gap P_k is 0, and K_k multiplies the depth of contact alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate, combinations
from typing import Any

import numpy as np

from gearrattle.assembly import assemble
from gearrattle.assembly.system import Driveline
from gearrattle.engine.system.auxiliary import STICK
from gearrattle.engine.system.law import PiecewiseLaw
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.studies.quiet.edges import Edge
from gearrattle.studies.quiet.taylor_forms import Array, Form, Quadratic

_SAME = 1e-9  # of the largest number of its kind: more is another dependence than a polynomial of second degree
_ROUNDING = 1e-13
_CHECKED = 5
_REMEDY = "vary inertias, drags, stiffness, damping, clearances, means, amplitudes or the speed"


@dataclass(frozen=True)
class Family:
    """All drivelines of a box, and the one in the middle.

    ``numbers`` are all their coefficients, one after the other; ``blocks`` say where every kind of them stands.
    """

    driveline: Driveline
    numbers: Quadratic
    blocks: dict[str, slice]

    @property
    def system(self) -> PiecewiseSystem:
        """The system in the middle, whose rows, pieces and orders all of them have."""
        return self.driveline.system

    def over(self, centre: Array, radius: Array) -> dict[str, Form]:
        """Return the coefficients over a box inside, by kind."""
        form = self.numbers.over(centre, radius)
        return {name: form.part(block) for name, block in self.blocks.items()}

    def at(self, point: Array) -> dict[str, Array]:
        """Return the coefficients at a point, by kind."""
        numbers = self.numbers.at(point)
        return {name: numbers[block] for name, block in self.blocks.items()}


def family_of(model: Model, edges: Sequence[Edge]) -> Family:
    """Return the drivelines of a box.

    ModelError: a value that the model refuses, a structure that is not the same in the whole box, a path on which the
    coefficients depend in another way than by polynomials of second degree.
    """
    count = len(edges)
    middle = np.zeros(count)

    def driveline_at(point: Array) -> Driveline:
        changes: dict[str, Any] = {}
        for edge, share in zip(edges, point.tolist(), strict=True):
            changes |= edge.at(0.5 + 0.5 * share)
        return assemble(model.with_(changes))

    # the driveline at the middle of the box: its structure, and where its coefficients stand in one vector
    central = driveline_at(middle)
    parts = dict(_parts(central.system))
    ends = list(accumulate(part.size for part in parts.values()))
    blocks = {name: slice(end - part.size, end) for (name, part), end in zip(parts.items(), ends, strict=True)}
    structure = _structure(central.system)

    def numbers_at(point: Array) -> Array:
        system = driveline_at(point).system
        if _structure(system) != structure:
            names = ", ".join(edge.name for edge, share in zip(edges, point.tolist(), strict=True) if share)
            rule = "gaps, stages and friction must be the same in the whole range: none may vanish or appear"
            raise ModelError(Problem(f"range {names}", "", rule, "let the range begin above zero"))
        return np.concatenate([part for _, part in _parts(system)])

    # the coefficients as polynomials over the box
    numbers = _polynomial(numbers_at, count)
    _check(numbers, numbers_at, edges)
    return Family(central, numbers, blocks)


def _polynomial(numbers_at: Callable[[Array], Array], count: int) -> Quadratic:
    """Polynomials of second degree through the values at the middle, the ends, and the ends of every two."""
    unit = np.eye(count)
    value = numbers_at(np.zeros(count))
    linear = np.zeros((count, value.size))
    square = np.zeros((count, count, value.size))
    for i in range(count):
        low = numbers_at(-unit[i])
        high = numbers_at(unit[i])
        linear[i] = 0.5 * (high - low)
        square[i, i] = 0.5 * (high + low) - value
    for i, j in combinations(range(count), 2):
        alone = linear[i] + square[i, i] + linear[j] + square[j, j]
        square[i, j] = 0.5 * (numbers_at(unit[i] + unit[j]) - value - alone)
        square[j, i] = square[i, j]
    # what rounding makes of zeros
    size = _size(Quadratic(value, linear, square))
    linear[np.abs(linear) < _ROUNDING * size] = 0.0
    square[np.abs(square) < _ROUNDING * size] = 0.0
    return Quadratic(value, linear, square)


def _size(numbers: Quadratic) -> Array:
    """(L,) a bound on the numbers in the whole box."""
    return np.asarray(np.abs(numbers.value) + np.abs(numbers.linear).sum(axis=0) + np.abs(numbers.square).sum((0, 1)))


def _check(numbers: Quadratic, numbers_at: Callable[[Array], Array], edges: Sequence[Edge]) -> None:
    """Raise a ModelError that names the paths on which coefficients depend in another way."""
    count = len(edges)
    size = _size(numbers)

    def is_wrong(point: Array) -> bool:
        return bool(np.any(np.abs(numbers_at(point) - numbers.at(point)) > _SAME * size))

    alone = [edge.name for edge, unit in zip(edges, np.eye(count), strict=True) if is_wrong(0.37 * unit)]
    spread = np.random.default_rng(0).uniform(-1.0, 1.0, (_CHECKED, count))
    wrong = alone or ([edge.name for edge in edges] if any(map(is_wrong, spread)) else [])
    if wrong:
        rule = "the coefficients of the driveline must be polynomials of second degree of what a range varies"
        raise ModelError([Problem(f"range {name}", "", rule, _REMEDY) for name in wrong])


def inner_corner(law: PiecewiseLaw, piece: int) -> float:
    """The corner at the inner end of a piece; 0 in the piece at the centre."""
    label = piece + law.first_label
    if label == 0:
        return 0.0
    return float(law.corners[piece - 1] if label > 0 else law.corners[piece])


def _force_at(law: PiecewiseLaw, corner: Array) -> Array:
    """(P,) force of every piece at its inner corner, zeros free of rounding."""
    force = law.stiffness * corner + law.offset
    return np.where(np.abs(force) > _ROUNDING * (np.abs(law.stiffness * corner) + np.abs(law.offset)), force, 0.0)


def _parts(system: PiecewiseSystem) -> Iterator[tuple[str, Array]]:
    """Yield the coefficients of one driveline, by kind."""
    # inertias, drags and inputs: mean, and amplitudes by order
    inputs = system.inputs
    turning = inputs.cycles > 0.0
    still = ~turning
    yield "inertia", system.inertia
    yield "drag", system.drag
    yield "mean", inputs.mean + inputs.torque_cosine[:, still].sum(axis=1)
    yield "lasting_error", inputs.error_cosine[:, still].sum(axis=1)
    yield "torque_cosine", inputs.torque_cosine[:, turning].T.ravel()
    yield "torque_sine", inputs.torque_sine[:, turning].T.ravel()
    yield "error_cosine", inputs.error_cosine[:, turning].T.ravel()
    yield "error_sine", inputs.error_sine[:, turning].T.ravel()
    # laws, piece by piece
    none = np.zeros(0)
    laws = system.laws
    corners = [np.array([inner_corner(law, piece) for piece in range(law.pieces)]) for law in laws]
    forces = [_force_at(law, corner) for law, corner in zip(laws, corners, strict=True)]
    yield "stiffness", np.concatenate([none, *(law.stiffness for law in laws)])
    yield "damping", np.concatenate([none, *(law.damping for law in laws)])
    yield "corner", np.concatenate([none, *(law.corners for law in laws)])
    yield "inner", np.concatenate([none, *corners])
    yield "force", np.concatenate([none, *forces])
    # friction, and the rate of the inputs
    sliders = [auxiliary for auxiliary in system.auxiliaries if auxiliary.kind == "slider"]
    yield "spring", np.array([slider.memory[STICK] for slider in sliders], dtype=float)
    yield "limit", np.array([slider.offset[1] for slider in sliders], dtype=float)
    yield "rate", np.array([2.0 * np.pi / inputs.period])


def _structure(system: PiecewiseSystem) -> tuple[Any, ...]:
    """Structure that all drivelines of a box must share."""
    return (
        tuple((law.pieces, law.first_label) for law in system.laws),
        tuple((part.kind, part.element, part.follow.tobytes()) for part in system.auxiliaries),
        system.inputs.cycles.tobytes(),
        system.rows.tobytes(),
    )
