"""Free parameters: paths of a model file, their bounds, and their exponents in the matrices.

Every coefficient of the linear system - an inertia, a drag, a slope, a damping - is a product of powers of the
parameters, so in logarithms x_p = ln(p / start) it is linear,

    ln k_k = ln k_k(start) + sum_p S_kp x_p.

The exponents S are found by asking the model itself: each path is doubled and tripled with ``Model.with_``, the system
assembled again, and the coefficients compared. What is no such factor (a clearance, a radius, an order) is refused.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.statics import slopes
from gearrattle.assembly import assemble
from gearrattle.errors import ModelError, Problem
from gearrattle.measured.identification.measured_modes import State
from gearrattle.model import Model
from gearrattle.model.paths import expanded, value_at
from gearrattle.model.table import did_you_mean, listed, shown

Array = NDArray[np.float64]

Refused = Callable[[str], "tuple[str, str] | None"]

_EXPONENT = 1e-9


@dataclass(frozen=True)
class Parameters:
    """The free parameters.

    Attributes
    ----------
    start
        (P,) values in the model given, SI.
    lower, upper
        (P,) bounds, SI.
    """

    paths: tuple[str, ...]
    start: Array
    lower: Array
    upper: Array

    def values(self, x: Array) -> Array:
        """(P,) values at logarithms x; at a bound exactly the bound."""
        return np.asarray(np.clip(self.start * np.exp(x), self.lower, self.upper))

    @property
    def box(self) -> tuple[Array, Array]:
        """(P,) lowest and highest logarithms."""
        return np.log(self.lower / self.start), np.log(self.upper / self.start)

    def fitted(self, model: Model, x: Array) -> Model:
        """Return the model at logarithms x."""
        return model.with_(dict(zip(self.paths, self.values(x).tolist(), strict=True)))


@dataclass(frozen=True)
class Coefficients:
    """One state's coefficients at the start, and their exponents.

    Attributes
    ----------
    inertia, drag
        (n,).
    stiffness, damping
        (m,).
    rows
        (m, n).
    of_inertia, of_drag
        (n, P) exponents.
    of_stiffness, of_damping
        (m, P) exponents.
    basis
        (n, r) coordinates left free by rigid elements, orthonormal.
    """

    inertia: Array
    drag: Array
    stiffness: Array
    damping: Array
    rows: Array
    of_inertia: Array
    of_drag: Array
    of_stiffness: Array
    of_damping: Array
    basis: Array


def of_friction(path: str) -> tuple[str, str] | None:
    """Return why friction cannot be a parameter of a linear system; None for any other value."""
    if path.rsplit(".", 1)[-1] not in ("hysteresis", "stick_stiffness"):
        return None
    return "friction enters neither modes nor linear responses", "leave it out of free"


def free_parameters(
    model: Model,
    free: Sequence[str],
    bounds: Mapping[str, tuple[Any, Any]],
    factor: float,
    refused: Refused = of_friction,
) -> Parameters:
    """Look up paths, values and bounds.

    Parameters
    ----------
    free
        paths; ``*`` stands for any text, as in ``inertia.*.J``.
    factor
        bounds of the others: start / factor and start * factor.

    Raises
    ------
    ModelError
        no path, a path that leads nowhere or to no positive number, bounds that do not hold the start.
    """
    # check the arguments
    if not factor > 1.0 or not np.isfinite(factor):
        raise ModelError(Problem("factor", f"{factor:g}", "must be a finite number greater than 1"))
    if isinstance(free, str):
        free = [free]
    tables = model.to_tables()
    if not free:
        rule = "no parameter is free: at least one path is needed"
        raise ModelError(Problem("free", "", rule, 'such as "coupling.clutch.stiffness"; "inertia.*.J" frees all J'))
    # paths without their patterns; refuse what cannot be a parameter, and bounds of what is not free
    paths = expanded(tables, free)
    problems = [
        Problem(f"free: {path}", shown(value), rule, remedy)
        for path in paths
        for value in [value_at(tables, path)]
        for rule, remedy in [refused(path) or _not_positive(value)]
        if rule
    ]
    unknown = [path for path in bounds if path not in paths]
    problems += [
        Problem(f"bounds: {p}", "", f"is not free; free are {listed(paths)}", did_you_mean(p, paths)) for p in unknown
    ]
    if problems:
        raise ModelError(problems)
    # start and bounds
    start = np.array([float(value_at(tables, path)) for path in paths])
    lower = start / factor
    upper = start * factor
    for p, path in enumerate(paths):
        if path in bounds:
            lower[p], upper[p] = _bounds(model, path, bounds[path], float(start[p]))
    return Parameters(tuple(paths), start, lower, upper)


def coefficients(model: Model, parameters: Parameters, state: State) -> Coefficients:
    """Return a state's coefficients, and their exponents in each parameter.

    A ModelError refuses a parameter that is no factor of them, and rigid elements that leave nothing to move.
    """
    # exponents: double every parameter, and compare the coefficients
    base = _values(model, state)
    exponents = []
    for path, value in zip(parameters.paths, parameters.start.tolist(), strict=True):
        two, three = (_values(model.with_({path: factor * value}), state) for factor in (2.0, 3.0))
        powers = [np.round(_logarithm(new, old) / np.log(2.0), 6) for new, old in zip(two[:4], base[:4], strict=True)]
        # tripled, the coefficients must follow the same power
        check = [
            np.max(np.abs(_logarithm(new, old) - s * np.log(3.0)), initial=0.0)
            for new, old, s in zip(three[:4], base[:4], powers, strict=True)
        ]
        if max(check) > _EXPONENT or any(np.any(new[4] != base[4]) for new in (two, three)):
            rule = "must be a factor of inertias, stiffnesses, dampings or drags; this is none"
            raise ModelError(Problem(f"free: {path}", f"{value:g}", rule, "leave it out of free"))
        exponents.append(powers)
    # exponents by coefficient; slopes and dampings of rigid elements vanish
    by_inertia, by_drag, by_stiffness, by_damping = (np.column_stack([row[k] for row in exponents]) for k in range(4))
    names = assemble(model).layout.element_names
    held = [names.index(name) for name in state.rigid]
    stiffness = base[2].copy()
    damping = base[3].copy()
    stiffness[held] = 0.0
    damping[held] = 0.0
    return Coefficients(
        inertia=base[0],
        drag=base[1],
        stiffness=stiffness,
        damping=damping,
        rows=base[4],
        of_inertia=by_inertia,
        of_drag=by_drag,
        of_stiffness=by_stiffness,
        of_damping=by_damping,
        basis=_left_free(base[4][held], state),
    )


def unused(parameters: Parameters, states: Sequence[Coefficients]) -> list[str]:
    """Return the paths that enter no coefficient of any state."""
    used = np.zeros(len(parameters.paths), dtype=bool)
    for c in states:
        for exponents in (c.of_inertia, c.of_drag, c.of_stiffness, c.of_damping):
            used |= np.any(exponents != 0.0, axis=0)
    return [path for path, enters in zip(parameters.paths, used.tolist(), strict=True) if not enters]


def _not_positive(value: object) -> tuple[str, str]:
    """Return why a value cannot be a parameter; empty if it can."""
    if value is None:
        return "has no value in the model: a start is needed", "give it one in the model file"
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return "must be a number", ""
    if not value > 0.0:
        return "must be greater than zero: parameters are varied by factors", "give it a rough value, or leave it out"
    return "", ""


def _bounds(model: Model, path: str, bounds: tuple[Any, Any], start: float) -> tuple[float, float]:
    """Read two bounds as the model file would."""
    location = f"bounds: {path}"
    if isinstance(bounds, str) or len(tuple(bounds)) != 2:
        raise ModelError(Problem(location, shown(bounds), "must be two values, the lowest and the highest"))
    low, high = (float(value_at(model.with_({path: end}).to_tables(), path)) for end in bounds)
    if not 0.0 < low < high:
        raise ModelError(Problem(location, f"{low:g} ... {high:g}", "must be greater than zero and in ascending order"))
    if not low <= start <= high:
        raise ModelError(Problem(location, f"{low:g} ... {high:g}", f"must hold the start, {start:g}"))
    return low, high


def _values(model: Model, state: State) -> tuple[Array, Array, Array, Array, Array]:
    """Return J, d, k, c and W of a state."""
    driveline = assemble(model)
    system = driveline.system
    stiffness, damping = slopes(driveline, dict(state.contact_ratio), dict(state.region))
    return system.inertia, system.drag, stiffness, damping, system.rows


def _logarithm(new: Array, old: Array) -> Array:
    """Return ln(new / old), 0 where both are zero."""
    both = (new > 0.0) & (old > 0.0)
    ratio = np.divide(new, old, out=np.ones_like(old), where=both)
    ratio[(new > 0.0) != (old > 0.0)] = np.inf
    return np.asarray(np.log(ratio))


def _left_free(held: Array, state: State) -> Array:
    """(n, r) an orthonormal basis of the motions in which rigid elements do not deflect."""
    if not len(held):
        return np.eye(held.shape[1])
    scaled = held / np.linalg.norm(held, axis=1)[:, None]
    values, vectors = np.linalg.svd(scaled, full_matrices=True)[1:]
    rank = int(np.count_nonzero(values > 1e-9))
    if rank == held.shape[1]:
        raise ModelError(Problem("rigid", ", ".join(state.rigid), "leaves nothing to move"))
    return np.asarray(vectors[rank:].T)
