"""The period map of a model as a function of one of its values: the range that users give, and what follows motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from numbers import Integral

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble
from gearrattle.assembly.variant_assembly import bound_of, coefficients, repeated
from gearrattle.engine.kernels.variant_arrays import Coefficients
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.families import (
    CompiledFamily,
    Family,
    GeneralFamily,
    HalfPeriodFamily,
    are_symmetric,
    half_of,
)
from gearrattle.engine.solvers.scheme_choice import MANY_INERTIAS, is_large_for_periods
from gearrattle.engine.solvers.variants import is_supported
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.plain_arrays import coefficients_of as coefficients_of_system
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.balance import BALANCE
from gearrattle.model.factors import Written, factor_in, is_factor
from gearrattle.model.path_labels import shown_value
from gearrattle.model.path_values import in_si
from gearrattle.model.paths import path_names, value_at
from gearrattle.model.table import shown
from gearrattle.wording import listed

_WIDTHS = 1e3  # of a range: the unit of its value is no larger
_LEAST = 1e-9  # of the larger end: the ends must differ by more
Array = NDArray[np.float64]

_POINTS = 60.0  # steps at least along a range
_NEXT_TO = 1e-6  # of a range: so far inside its driveline is of the kind that it has along the branch
_TOGETHER = 3  # drivelines whose coefficients are asked for at once: one and two beside it
_HARMONICS = ("torque_sine", "torque_cosine", "error_sine", "error_cosine")


def ends_of(model: Model, path: str, ends: Sequence[Written], argument: str = "path") -> tuple[float, float]:
    """Read the two ends of a range [SI]; ``argument`` is what names the path, for messages.

    Raises ModelError: the path leads nowhere or to an order, an end the model refuses, or ends that are the same.
    """
    if isinstance(ends, str) or not isinstance(ends, Sequence | np.ndarray) or len(ends) != 2:
        raise ModelError(Problem("range", shown(ends), "must be two values", "such as (100.0, 200.0)"))
    # the path
    if not isinstance(path, str):
        raise ModelError(Problem(argument, shown(path), "must be text", "such as excitation.speed"))
    if path.partition(".")[0] == "simulation":
        rule = "is a setting of simulations, on which motions do not depend"
        raise ModelError(Problem(path, "", rule, "follow a value of the driveline"))
    if "." not in path:
        names = [name for name in ("excitation.speed", *path_names(model.to_tables())) if name.endswith(f".{path}")]
        remedy = f'did you mean "{names[0]}"?' if names else "such as excitation.speed"
        raise ModelError(Problem(argument, path, "leads to no number", remedy))
    own = value_at(model.to_tables(), path)
    if isinstance(own, str | bool) and own != BALANCE:
        raise ModelError(Problem(argument, path, "leads to no number", "follow a number of the driveline"))
    # the units of both ends
    values = [in_si(path, end, model) for end in ends]
    if len({is_factor(end) for end in ends}) > 1:
        rule = "one end is a factor, the other none"
        remedy = "give both, such as (gr.factor(0.5), gr.factor(2))"
        raise ModelError(Problem("range", f"{_shown(ends[0])} to {_shown(ends[1])}", rule, remedy))
    has_unit = [isinstance(end, str) for end in ends if end != 0]
    if model.units == "SI" and len(set(has_unit)) > 1:
        rule = "one end has a unit, the other none"
        remedy = 'give both, such as ("1 deg", "2 deg")'
        raise ModelError(Problem("range", shown(list(ends)), rule, remedy))
    if path.rpartition(".")[2] == "order":
        rule = "cannot be followed: between two orders there are others without a common period"
        raise ModelError(Problem(path, "", rule, "follow another value of the model"))
    # their values
    for value in values:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ModelError(Problem("range", shown(value), "what is followed must be a number"))
    first, last = map(float, values)
    if abs(last - first) <= _LEAST * max(abs(first), abs(last)):
        rule = f"must be two different values, by more than {_LEAST:g} of the larger one"
        raise ModelError(Problem("range", shown(ends), rule))
    return first, last


def _shown(end: Written) -> str:
    """Return an end as a command line has it."""
    return f"x{factor_in(end).times:g}" if is_factor(end) else shown(end)


def unit_of(ends: Sequence[float]) -> float:
    """Return the scale of a value between two ends [SI]: as much as the larger end, and the width.

    The unit of a narrow range is not its width: along a branch the value would count far more than the state, and its
    folds would be sharper than motions are known.
    """
    first, last = ends
    width = abs(last - first)
    return max(width, min(abs(first), _WIDTHS * width), min(abs(last), _WIDTHS * width))


def check_index(name: str, index: object, ends: tuple[int, int]) -> None:
    """Raise a ModelError for an index that is no whole number from the first end up to, but not including, the last."""
    first, count = ends
    if isinstance(index, Integral) and not isinstance(index, bool) and first <= int(index) < count:
        return
    rule = f"must be a whole number from {first} to {count - 1}" if count > first else f"there is no {name}"
    raise ModelError(Problem(name, shown(index), rule))


def follower_over(
    model: Model, path: str, ends: Sequence[float], cycles: int, *, first: float, step_limit: float | None = None
) -> Continuation:
    """Return what follows motions of a model over a range of the value at a path, in steps up to a limit [SI]."""
    unit = unit_of(ends)
    even = abs(ends[1] - ends[0]) / _POINTS
    family = family_of(model, path, first, cycles, unit, largest=max(map(abs, ends)))
    return Continuation(family, longest=1.0 / _POINTS, step_limit=min(even, step_limit or even))


def family_of(
    model: Model, path: str, first: float, cycles: int, unit: float, *, largest: float | None = None
) -> Family:
    """Return the family of a model over the value at a path, of which ``first`` is one.

    A change by one unit counts as much as a change of the state by the largest corner. Messages write a value as one
    beside others, of which the largest is given [SI]; None: by itself.
    """

    def system_of(value: float) -> PiecewiseSystem:
        try:
            return assemble(model.with_({path: float(value)})).system
        except ModelError as error:
            raise ConvergenceError(f"there is no such driveline: {error}", remedy="a narrower range") from None

    general = GeneralFamily(system_of, first, cycles, unit, partial(shown_value, path, model, largest=largest))
    base = model.with_({path: float(first)})
    system = assemble(base).system
    if bound_of(base, path) is None or not is_compiled(system):
        return general

    shared = repeated(coefficients_of_system(system), _TOGETHER)

    def coefficients_of(values: Array) -> tuple[Coefficients, NDArray[np.bool_]]:
        same = shared if len(values) == _TOGETHER else None
        return coefficients(base, {path: values}, len(values), same)

    return CompiledFamily(general, system, coefficients_of)


def check_alike(family: Family, like: Family) -> None:
    """Refuse the family of a driveline with other clearances or sliders than another one has.

    Raises ConvergenceError: a clearance or a slider is in one of them alone.
    """
    if (family.clearances, family.memories) != (like.clearances, like.memories):
        raise ConvergenceError("a clearance closes or opens there, or a slider goes or comes")


def family_like(like: Family, model: Model, path: str, parameter: float) -> Family:
    """Return the family of a changed driveline near a value; of half-period maps if that of the unchanged one is.

    Raises ConvergenceError: a clearance or a slider is in one of them alone, or the changed driveline has no symmetry.
    """
    family = family_of(model, path, parameter, like.cycles, like.unit)
    check_alike(family, like)
    if not isinstance(like, HalfPeriodFamily):
        return family
    if not are_symmetric(family, parameter):
        raise ConvergenceError("the driveline has no symmetry there")
    return half_of(family)


def check_begin(model: Model, path: str, ends: tuple[float, float]) -> None:
    """Refuse a range that begins where the driveline is of another kind than near it: at a clearance of zero.

    Raises ModelError: a clearance or a slider is missing at the first end alone, or is there alone.
    """
    corners, sliders = _changed(model, path, ends)
    if changed := sorted({*corners, *sliders}):
        rule = f"a branch cannot begin here, where a corner or a slider of {listed(changed)} comes or goes"
        remedy = "begin at the other end, or at a value a little inside"
        raise ModelError(Problem("range", shown_value(path, model, ends[0], 6, max(map(abs, ends))), rule, remedy))


def notes_at_end(model: Model, path: str, ends: tuple[float, float]) -> list[str]:
    """Return what is said of a range at whose last end the driveline has other states: no branch leads there."""
    _, sliders = _changed(model, path, ends[::-1])
    if not sliders:
        return []
    end = shown_value(path, model, ends[1], 6, max(map(abs, ends)))
    changed = listed(sorted(sliders))
    return [f"At {path} = {end} a slider of {changed} comes or goes: branches end just before."]


def _changed(model: Model, path: str, ends: tuple[float, float]) -> tuple[set[str], set[str]]:
    """Elements whose corners, and those whose sliders, exist at the first of two values alone, or near it alone."""
    first, last = ends
    at, next_to = (assemble(model.with_({path: value})).layout for value in (first, first + _NEXT_TO * (last - first)))
    sliders = {name.partition(".")[0] for name in {*at.auxiliary_names} ^ {*next_to.auxiliary_names}}
    return {*at.clearance_names} ^ {*next_to.clearance_names}, sliders


def family_of_excitation(system: PiecewiseSystem, cycles: int) -> Family:
    """Return the family of a driveline over a factor of all its harmonics: 0 at rest, 1 as it is."""
    inputs = system.inputs

    def system_of(factor: float) -> PiecewiseSystem:
        scaled = {name: factor * getattr(inputs, name) for name in _HARMONICS}
        return replace(system, inputs=replace(inputs, **scaled))

    general = GeneralFamily(system_of, 1.0, cycles)
    if not is_compiled(system):
        return general
    base = coefficients_of_system(system)

    def coefficients_of(factors: Array) -> tuple[Coefficients, NDArray[np.bool_]]:
        columns = repeated(base, len(factors))
        for name in _HARMONICS:
            getattr(columns, name)[:] *= factors[:, None, None]
        return columns, np.ones(len(factors), np.bool_)

    return CompiledFamily(general, system, coefficients_of)


def is_compiled(system: PiecewiseSystem) -> bool:
    """Return whether motions of a driveline's variants are followed in compiled code.

    Many regions alone are no reason against it: a motion visits few of them in a period.
    """
    if is_large_for_periods(system) or system.size > MANY_INERTIAS:
        return False
    return is_supported(system) and bool(system.clearances)


def watched_names(model: Model) -> tuple[str, ...]:
    """Return the names that ``Event.watch`` counts: clearances, then auxiliary elements."""
    layout = assemble(model).layout
    return (*layout.clearance_names, *layout.auxiliary_names)
