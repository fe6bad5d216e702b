"""Assembly of many variants of a model at once: varied paths are columns, and so are the coefficients.

Every number of a model is one *leaf*. A varied path replaces its leaf by a column of values, one for every variant. The
same sums and products as in ``assembly.system``, in the same order, give columns of coefficients. They agree to the
last bit with the coefficients of variants that are written, checked and assembled one by one
(``tests/assembly/test_variants.py``).

Variants may differ in numbers only. A variant with another structure (a gap that closes, a slope that becomes zero), or
one that ``Model`` might refuse, is marked; the caller must assemble it separately. The same is true for variants of
paths that are no such number.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.drag_columns import OIL_TEMPERATURE, drag_columns
from gearrattle.assembly.mean_balance import balances_of
from gearrattle.assembly.period import period_of
from gearrattle.assembly.prescribed_motion import carried_along, free_names, free_of, motion_errors
from gearrattle.assembly.ripple import load_ripples
from gearrattle.assembly.sines import sum_of
from gearrattle.assembly.system import assemble
from gearrattle.derived_values import kept
from gearrattle.engine.kernels.laws import Laws
from gearrattle.engine.kernels.variant_arrays import Coefficients
from gearrattle.engine.system.plain_arrays import coefficients_of
from gearrattle.model import Element, Harmonic, Model
from gearrattle.model.components.component import PieceColumns
from gearrattle.model.drag_points import has_drag_parts
from gearrattle.model.over_speed import AtSpeed

Array = NDArray[np.float64]
Number = float | Array

_POSITIVE = "positive"
_NOT_NEGATIVE = "non-negative"
_FINITE = "finite"
_ZERO = "zero"  # a closed gap must stay closed: an open gap has more pieces
_BOUNDS = {
    "inertia": {"J": _POSITIVE, "drag": _NOT_NEGATIVE, "drag_torque": _NOT_NEGATIVE},
    "coupling": {
        "stiffness": _NOT_NEGATIVE,
        "damping": _NOT_NEGATIVE,
        "clearance": _NOT_NEGATIVE,
        "preload": _FINITE,
        "stiffness_ratio": _NOT_NEGATIVE,
        "damping_ratio": _NOT_NEGATIVE,
    },
    "stages": {"stiffness": _NOT_NEGATIVE, "damping": _NOT_NEGATIVE, "until": _POSITIVE},
    "mesh": {"stiffness": _NOT_NEGATIVE, "damping": _NOT_NEGATIVE, "backlash": _NOT_NEGATIVE},
    "torque": {"mean": _FINITE},
    "harmonics": {"amplitude": _FINITE, "phase": _FINITE},
    "excitation": {"speed": _POSITIVE, "frequency": _POSITIVE},
    "oil": {"temperature": _FINITE},
}
"""Leaves that may vary, and their bounds in the model."""
_ERRORS = ("transmission_error", "kinematic_error")


def bound_of(model: Model, path: str) -> str | None:
    """Bound of the number at a path in the model; None where it is no number that may vary here."""
    parts = path.split(".")
    kind = parts[0]
    key = parts[-1]
    if kind in ("excitation", "oil") and len(parts) == 2:
        return _BOUNDS[kind].get(key)
    if len(parts) == 3 and kind in ("inertia", "coupling", "mesh", "torque"):
        owner = _owner(model, kind, parts[1])
        staged = kind == "coupling" and owner is not None and owner.stages is not None and key != "preload"
        if owner is None or staged:
            return None
        is_closed = key in ("clearance", "backlash") and getattr(owner, key) == 0.0
        return _ZERO if is_closed else _BOUNDS[kind].get(key)
    if len(parts) == 5 and parts[2] in ("stages", "coast_stages", "harmonics", *_ERRORS):
        rows = getattr(_owner(model, kind, parts[1]), parts[2], None) or ()
        if not (parts[3].isdecimal() and int(parts[3]) < len(rows)):
            return None
        is_last = key == "until" and int(parts[3]) == len(rows) - 1
        return None if is_last else _BOUNDS["stages" if "stages" in parts[2] else "harmonics"].get(key)
    return None


def _owner(model: Model, kind: str, name: str) -> Any:
    """The table at the begin of a path; None if it does not exist."""
    if kind in ("torque", "motion"):
        tables = {"torque": model.torques, "motion": model.motions}[kind]
        return tables[int(name)] if name.isdecimal() and int(name) < len(tables) else None
    if kind == "inertia":
        return next((inertia for inertia in model.inertias if inertia.name == name), None)
    return model.components.get(f"{kind}.{name}")


@dataclass
class Columns:
    """The leaves of a model, of which some are columns over the variants.

    Attributes
    ----------
    varied
        values (V,) of every varied path.
    good
        (V,) whether a variant has the structure of the model and satisfies its rules for certain.
    has_tables
        whether one of the leaves read so far is a table over speed.
    """

    model: Model
    varied: Mapping[str, Array]
    count: int
    good: NDArray[np.bool_] = field(init=False)
    has_tables: bool = field(init=False, default=False)

    def __post_init__(self) -> None:
        self.good = np.ones(self.count, dtype=np.bool_)
        for path, values in self.varied.items():
            bound = bound_of(self.model, path)
            fits = np.isfinite(values) if bound else np.zeros(self.count, dtype=np.bool_)
            if bound in (_POSITIVE, _NOT_NEGATIVE):
                fits &= (values > 0.0) if bound == _POSITIVE else (values >= 0.0)
            elif bound == _ZERO:
                fits &= values == 0.0
            self.good &= fits
        if {"excitation.speed", "excitation.frequency"} <= set(self.varied):
            self.good[:] = False
        self.omega = self._speed()
        self.drag = drag_columns(self.model, self.varied.get(OIL_TEMPERATURE), self.omega, self.count)
        self.good &= self.drag.good

    def _speed(self) -> Number:
        if "excitation.speed" in self.varied:
            return self.varied["excitation.speed"]
        if "excitation.frequency" in self.varied:
            frequency = self.varied["excitation.frequency"]
            return frequency if self.model.units == "dimensionless" else 2.0 * math.pi * frequency
        return self.model.excitation.omega

    def of(self, path: str, value: Any) -> Number:
        """The leaf at a path, ``value`` in the model; a table over speed is evaluated at the speed of every variant."""
        if path in self.varied:
            return self.varied[path]
        if not isinstance(value, AtSpeed):
            return float(value)
        self.has_tables = True
        if isinstance(self.omega, float):
            return float(value)
        speeds = np.array(value.speeds)
        values = np.array(value.values)
        covered = (self.omega >= speeds[0]) & (self.omega <= speeds[-1])
        self.good &= covered
        omega = np.where(covered, self.omega, speeds[0])
        k = np.searchsorted(speeds[1:], omega, side="left")
        share = (omega - speeds[k]) / (speeds[k + 1] - speeds[k])
        return np.where(share != 0.0, values[k] + share * (values[k + 1] - values[k]), values[k])

    def sides(self, element: Element) -> tuple[Sequence[PieceColumns], Sequence[PieceColumns]]:
        """Drive and coast side of an element's law."""
        component = self.model.components.get(element.path)
        if component is None:  # a drag part
            side = ((0.0, self.drag.damping[element.name], None),)
            return side, side
        return component.sides(lambda key, value: self.of(f"{element.path}.{key}", value), element)


def coefficients(
    model: Model, varied: Mapping[str, Array], count: int, shared: Coefficients | None = None
) -> tuple[Coefficients, NDArray[np.bool_]]:
    """Assemble V variants of a model.

    Parameters
    ----------
    model
        one of the variants, with laws and harmonics only (``system.is_plain``); it holds all values that are not
        varied.
    varied
        values (V,) of every varied path [SI].
    shared
        the model repeated V times (``repeated``): arrays that no path varies are taken from there, not copied.

    Returns
    -------
    tuple[Coefficients, NDArray[np.bool_]]
        Coefficients with a leading axis (V, ...), and (V,) whether a variant may be used; the others must be assembled
        separately.
    """
    columns = Columns(model, varied, count)
    if load_ripples(model) or _moves_drag(model, varied):  # they depend on mean loads or speeds, which may vary
        columns.good[:] = False
    parts = varied_parts(model, varied)
    out = _separate(shared, parts) if shared else repeated(coefficients_of(assemble(model).system), count)
    out.period[:, 0] = 2 * math.pi / columns.omega / period_of(model).turns
    columns.good &= np.isfinite(out.period[:, 0])
    if "laws" in parts:
        _write_laws(columns, out)
        _check_laws(columns, out)
    if "loads" in parts:
        _write_inertias(columns, out)
        _write_inputs(columns, out, {order: j for j, order in enumerate(period_of(model).orders)})
        for values in out[:-2]:
            columns.good &= np.isfinite(values).reshape(count, -1).all(axis=1)
    return out, columns.good


def _moves_drag(model: Model, varied: Iterable[str]) -> bool:
    """Whether a varied path may move the mean speeds of drag parts."""
    return has_drag_parts(model) and any(".radii" in path for path in varied)


def varied_parts(model: Model, varied: Iterable[str]) -> set[str]:
    """Return which coefficients besides the period depend on the paths: "laws", and "loads" for all others."""
    parts = set()
    for path in varied:
        kind, *keys = path.split(".")
        if path == OIL_TEMPERATURE or (kind == "excitation" and has_drag_parts(model)):
            parts |= {"laws", "loads"}
        elif kind != "excitation":
            is_law = kind in ("coupling", "mesh") and not set(keys[1:]) & set(_ERRORS)
            parts.add("laws" if is_law else "loads")
        elif has_tables(model):
            parts |= {"laws", "loads"}
    return parts


@kept
def has_tables(model: Model) -> bool:
    """Return whether a leaf that may vary is a table over speed."""
    columns = Columns(model, {}, 1)
    system = assemble(model).system
    out = repeated(coefficients_of(system), 1)
    _write_inertias(columns, out)
    _write_inputs(columns, out, {order: j for j, order in enumerate(period_of(model).orders)})
    _write_laws(columns, out)
    return columns.has_tables


def _check_laws(columns: Columns, out: Coefficients) -> None:
    """Mark the variants whose laws have another structure or are not finite."""
    laws = assemble(columns.model).system.laws
    base = coefficients_of(assemble(columns.model).system).laws
    limp = np.array([not law.stiffness.any() for law in laws for _ in range(law.pieces)], dtype=bool)
    for array, pattern in ((out.laws.stiffness, base.stiffness), (out.laws.upper, base.upper)):
        columns.good &= np.all((array != 0.0) == (pattern != 0.0), axis=1)
    pushes = (out.laws.offset != 0.0) == (base.offset != 0.0)
    columns.good &= np.all(pushes, axis=1, where=limp)  # push, or push nothing
    for values in (*out.laws[1:-2], out.laws.upper[:, np.isfinite(base.upper)]):
        columns.good &= np.isfinite(values).all(axis=1)


def repeated(base: Coefficients, count: int) -> Coefficients:
    """Return the coefficients of ``count`` drivelines with the same numbers."""
    *arrays, laws = base
    many = [array[None].repeat(count, axis=0) for array in (*arrays, *laws)]
    return Coefficients._make([*many[: len(arrays)], Laws._make(many[len(arrays) :])])


def _separate(shared: Coefficients, parts: set[str]) -> Coefficients:
    """Return new arrays for the period and for the coefficients in ``parts``, and the shared arrays for all others."""
    out = shared._replace(period=shared.period.copy())
    if "laws" in parts:
        out = out._replace(laws=Laws._make(array.copy() for array in out.laws))
    if "loads" in parts:
        *loads, period, laws = out
        out = Coefficients._make([*(array.copy() for array in loads), period, laws])
    return out


def _write_inertias(columns: Columns, out: Coefficients) -> None:
    added = {b: m for c in columns.model.components.values() for b, m in c.added_inertia().items()}
    drag = columns.drag
    for i, at_file in enumerate(free_of(columns.model).tolist()):
        body = columns.model.inertias[at_file]
        at = f"inertia.{body.name}"
        out.inertia[:, i] = columns.of(f"{at}.J", body.J) + added.get(body.name, 0.0)
        out.drag[:, i] = columns.of(f"{at}.drag", body.drag) + drag.drags[:, at_file]
        out.mean[:, i] = -(columns.of(f"{at}.drag_torque", body.drag_torque) + drag.torques[:, at_file])


def _write_inputs(columns: Columns, out: Coefficients, column: Mapping[float, int]) -> None:
    """Mean torques, torque harmonics, transmission errors, and harmonics of prescribed motions."""
    model = columns.model
    names = list(free_names(model))
    for array in (out.torque_sine, out.torque_cosine, out.error_sine, out.error_cosine):
        array[:] = 0.0
    for t, table in enumerate(model.torques):
        on = names.index(table.on)
        if not isinstance(table.mean, str) or f"torque.{t}.mean" in columns.varied:
            out.mean[:, on] += columns.of(f"torque.{t}.mean", table.mean)
        for i, harmonic in enumerate(table.harmonics):
            sine, cosine = _wave(columns, f"torque.{t}.harmonics.{i}", harmonic)
            out.torque_sine[:, on, column[harmonic.order]] += sine
            out.torque_cosine[:, on, column[harmonic.order]] += cosine
    _balance(columns, out)
    for k, element in enumerate(model.elements):
        for i, error in enumerate(element.errors):
            sine, cosine = _wave(columns, f"{element.path}.{element.error_key}.{i}", error)
            out.error_sine[:, k, column[error.order]] += sine
            out.error_cosine[:, k, column[error.order]] += cosine
    for k, factor, moving, path in motion_errors(model):
        sine, cosine = _wave(columns, path, moving)
        out.error_sine[:, k, column[moving.order]] += factor * sine
        out.error_cosine[:, k, column[moving.order]] += factor * cosine


def _balance(columns: Columns, out: Coefficients) -> None:
    """Write the means given as "balance"; mark the variants whose trains one torque may not balance."""
    free = free_of(columns.model).tolist()
    for balance in balances_of(columns.model):
        if f"torque.{balance.torque}.mean" in columns.varied:
            continue
        if balance.others:
            columns.good[:] = False
        loads = dict(zip(free, out.mean[:, : len(free)].T, strict=True))
        with np.errstate(all="ignore"):  # of numbers that are not finite, and marked
            out.mean[:, free.index(balance.body)] = balance.total(loads)


def static_velocities(model: Model, varied: Mapping[str, Array], count: int) -> tuple[Array, NDArray[np.bool_]]:
    """Return (V, N) velocities of a static start [rad/s], and (V,) whether the angles are those of the equilibrium.

    The free inertias turn along with the prescribed ones. The angles differ from those of the equilibrium if a
    prescribed angle is not zero at the start.
    """
    velocity = np.zeros((count, assemble(model).system.size))
    level = np.ones(count, dtype=np.bool_)
    if not model.motions:
        return velocity, level
    columns = Columns(model, varied, count)
    waves = [
        [_sine_terms(columns, f"motion.{i}.harmonics.{j}", harmonic) for j, harmonic in enumerate(motion.harmonics)]
        for i, motion in enumerate(model.motions)
    ]
    for v in range(count):
        terms = [[wave[v] for wave in of_motion] for of_motion in waves]
        angle, rate = (np.array([sum_of(sines, np.zeros(1), d)[0] for sines in terms]) for d in (0, 1))
        level[v] = not angle.any()
        velocity[v] = carried_along(model, rate)
    return velocity, level


def _sine_terms(columns: Columns, at: str, harmonic: Harmonic) -> list[tuple[float, float, float]]:
    """(V,) rate, amplitude and phase of a harmonic."""
    amplitude = columns.of(f"{at}.amplitude", harmonic.amplitude)
    phase = columns.of(f"{at}.phase", harmonic.phase)
    leaves = (
        np.broadcast_to(leaf, columns.count).tolist() for leaf in (harmonic.order * columns.omega, amplitude, phase)
    )
    return list(zip(*leaves, strict=True))


def _wave(columns: Columns, at: str, harmonic: Any) -> tuple[Number, Number]:
    """Sine and cosine part of a harmonic, computed from the phase by the same functions as in ``assembly.system``."""
    amplitude = columns.of(f"{at}.amplitude", harmonic.amplitude)
    phase = columns.of(f"{at}.phase", harmonic.phase)
    if isinstance(phase, float):
        return amplitude * math.cos(phase), amplitude * math.sin(phase)
    safe = np.where(np.isfinite(phase), phase, 0.0).tolist()
    cosine = np.array([math.cos(angle) for angle in safe])
    sine = np.array([math.sin(angle) for angle in safe])
    return amplitude * cosine, amplitude * sine


def _write_laws(columns: Columns, out: Coefficients) -> None:
    """Write slopes, damping, corners and offsets of every element, in the order of ``system.law.staged``."""
    first = 0
    model = columns.model
    laws = assemble(columns.model).system.laws
    for element, law in zip(model.elements, laws, strict=True):
        drive, coast = columns.sides(element)
        same = law.first_label == 1 - len(coast)
        columns.good &= np.asarray((drive[0][0] == coast[0][0]) & (drive[0][1] == coast[0][1])) == same
        for side in (drive, coast):
            for (_, _, sooner), (_, _, later) in pairwise([stage for stage in side if stage[2] is not None]):
                columns.good &= np.asarray(later > sooner)  # type: ignore[operator]
        stages = [*reversed(coast), *(drive[1:] if same else drive)]
        ends: list[Any] = [-stage[2] for stage in reversed(coast[:-1])]  # type: ignore[operator]
        ends += [*([] if same else [0.0]), *(stage[2] for stage in drive[:-1])]
        for p, stage in enumerate(stages):
            out.laws.stiffness[:, first + p] = stage[0]
            out.laws.damping[:, first + p] = stage[1]
        for c, end in enumerate(ends):
            out.laws.upper[:, first + c] = end
            out.laws.lower[:, first + c + 1] = end
        _write_offsets(columns, out, element, (first, len(coast) - 1, len(stages)))
        first += len(stages)


def _write_offsets(columns: Columns, out: Coefficients, element: Element, span: tuple[int, int, int]) -> None:
    first, centre, count = span
    pieces = slice(first, first + count)
    stiffness = out.laws.stiffness[:, pieces]
    offset = out.laws.offset[:, pieces]
    corners = out.laws.upper[:, pieces]
    offset[:, centre] = columns.of(f"{element.path}.preload", element.preload)
    outward = [(piece, piece - 1, piece - 1) for piece in range(centre + 1, count)]
    for piece, inner, corner in [*outward, *((piece, piece + 1, piece) for piece in range(centre - 1, -1, -1))]:
        offset[:, piece] = offset[:, inner] + (stiffness[:, inner] - stiffness[:, piece]) * corners[:, corner]
