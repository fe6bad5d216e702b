"""Initial states by some of their coordinates: deflections and rates of elements, angles and velocities of inertias.

A few such coordinates do not fix a state. The rest stays as near as possible to the model's own start q_0: the angles q
are those with C q = c for which the change, weighted by the inertias, is smallest,

    q = q_0 + J^-1 C^T (C J^-1 C^T)^-1 (c - C q_0),

rows of C being W_k for a deflection (c then is delta + e(0)) and a unit row for an angle; likewise the velocities with
rates and e'(0). So a rate is set by an impulse between the two bodies of an element, which leaves their angular
momentum (with a mesh, that of the train) as it was, and an angle moves one inertia alone. Inertias of prescribed motion
have no initial value: in a state they stand as the motion has them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import StartTable, assemble, free_names, start_table
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model, units
from gearrattle.model.table import did_you_mean, shown
from gearrattle.model.value_kinds import Plain, Quantity, checked
from gearrattle.simulation.simulate import prepare

Array = NDArray[np.float64]

_SINGULAR = 1e-10
_LEVELS = (("angle", "deflection"), ("velocity", "rate"))


@dataclass(frozen=True)
class Half:
    """Coordinates of the system, or their rates, from values of some quantities: base + gain (c - c_0).

    Attributes
    ----------
    names
        (q,) quantities.
    base
        (N,) the model's own.
    gain
        (N, q) least change for a unit of every quantity.
    zero
        (q,) quantities of the base.
    """

    names: tuple[str, ...]
    base: Array
    gain: Array
    zero: Array

    def at(self, values: Mapping[str, float]) -> Array:
        """Return (N,) coordinates of the system, or their rates."""
        wanted = np.array([values[name] for name in self.names])
        return np.asarray(self.base + self.gain @ (wanted - self.zero))


@dataclass(frozen=True)
class Starts:
    """Initial states by values of coordinates."""

    model: Model
    angle: Half
    velocity: Half

    def state(self, values: Mapping[str, float]) -> StartTable:
        """Return the state, as ``simulation.initial`` takes it, from values of every coordinate by name [SI]."""
        return start_table(self.model, self.angle.at(values), self.velocity.at(values))


def starts_of(model: Model, names: Sequence[str]) -> Starts:
    """Choose coordinates of initial states: "deflection.ELEMENT", "rate.ELEMENT", "angle.INERTIA", "velocity.INERTIA".

    A ModelError has all names there are not, and all coordinates that follow from each other.
    """
    parts = [e.name for e in model.elements]
    inertias = free_names(model)
    known = [f"{kind}.{name}" for name in parts for kind in ("deflection", "rate")]
    known += [f"{kind}.{name}" for name in inertias for kind in ("angle", "velocity")]
    moving = {motion.on for motion in model.motions}
    problems = [_unknown(name, known, moving) for name in names if name not in known]
    if not names:
        problems.append(Problem("over", "", "needs an initial value at least", f'for example "{known[0]}"'))
    if problems:
        raise ModelError(problems)
    task = prepare(model, {}, audit=False).task
    bases = (task.angle, task.velocity)
    halves = [
        _half(model, [name for name in names if name.partition(".")[0] in kinds], bases[level], level)
        for level, kinds in enumerate(_LEVELS)
    ]
    return Starts(model, *halves)


def _unknown(name: str, known: Sequence[str], moving: Set[str]) -> Problem:
    """Problem of a name that names no initial value."""
    kind, _, subject = str(name).partition(".")
    if kind in ("angle", "velocity") and subject in moving:
        rule = "the motion of this inertia is prescribed: it has no initial value"
        return Problem("over", f'"{name}"', rule, "deflections and rates of the elements at it have one")
    rule = "there is no such initial value; there are deflection and rate of elements, angle and velocity of inertias"
    return Problem("over", f'"{name}"', rule, did_you_mean(name, known))


def _half(model: Model, names: list[str], base: Array, level: int) -> Half:
    system = assemble(model).system
    parts = [e.name for e in model.elements]
    inertias = free_names(model)
    rows = np.zeros((len(names), system.size))
    error = np.zeros(len(names))
    for i, name in enumerate(names):
        kind, _, subject = name.partition(".")
        if kind in ("angle", "velocity"):
            rows[i, inertias.index(subject)] = 1.0
        else:
            k = parts.index(subject)
            rows[i] = system.rows[k]
            error[i] = _error(system, k, level)
    weighted = (rows / system.inertia).T
    matrix = rows @ weighted
    size = np.sqrt(np.diagonal(matrix))
    if names and np.linalg.svd(matrix / np.outer(size, size), compute_uv=False)[-1] < _SINGULAR:
        rule = "follow from each other: they cannot be chosen freely"
        raise ModelError(Problem("over", ", ".join(names), rule, "leave one out"))
    gain = np.zeros((system.size, len(names)))
    if names:
        gain[:] = np.linalg.solve(matrix, weighted.T).T
    zero = rows @ base - error
    return Half(tuple(names), base, gain, zero)


def _error(system: PiecewiseSystem, k: int, level: int) -> float:
    """Transmission error of an element, or its rate, at t = 0."""
    inputs = system.inputs
    if level == 0:
        return float(inputs.error_cosine[k].sum())
    return float(inputs.error_sine[k] @ (2.0 * np.pi * inputs.cycles / inputs.period))


def read_value(name: str, value: Any, model: Model) -> float:
    """Read an initial value as a model file does: a plain number in SI or a text with a unit.

    ModelError: neither, or the wrong unit.
    """
    kind, _, subject = name.partition(".")
    length = any(e.name == subject and e.along_line for e in model.elements)
    if isinstance(value, Real) and not isinstance(value, bool):
        return float(checked(Plain(), value, name))
    on_a_line = length and kind in ("deflection", "rate")
    dimension = {"deflection": units.LENGTH if on_a_line else units.ANGLE, "angle": units.ANGLE}.get(
        kind, None if on_a_line else units.ANGULAR_VELOCITY
    )
    if not isinstance(value, str) or dimension is None or model.units == "dimensionless":
        also = "" if dimension is None or model.units == "dimensionless" else f' or a text as "{dimension.example}"'
        raise ModelError(Problem(name, shown(value), f"must be a finite number in SI{also}"))
    return float(checked(Quantity(dimension), value, name, dimensionless=False))
