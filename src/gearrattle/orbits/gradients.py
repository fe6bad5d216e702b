"""How the events of a branch, and the response of a motion, move with every number of the model.

The gradient of an event is that of its defining equations (``event_gradient``); scatter under tolerances follows
to first order.

A periodic motion y = P(y; q) moves by dy/dq = (I - M)^-1 dP/dq. The state so predicted for a slightly smaller and a
slightly larger q is made exact by Newton's method, and the responses of these two motions give a central difference.
The motions are exact to rounding, and so are their extremes between crossings (``engine.system.deflection_levels``).
With a change of 1e-5 of q the difference is good to about 1e-7 of the response: its truncation is of 1e-10, rounding is
magnified to 1e-7.

As long as its impacts keep their order the motion moves smoothly. Where one comes or goes on either side of q, it
touches a corner so nearly that there is no gradient to give. Where two exchange their order, as the slips of two stages
do that begin to slip together, there is one if both sides have the same, to 1e-3 of the response: it is their mean.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from gearrattle.assembly import assemble
from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import BREAKING, DOUBLING, GRAZING, Event
from gearrattle.engine.periodic.events.grazing import JUMP, RELEASE
from gearrattle.engine.periodic.events.symmetry_breaking import as_doubling
from gearrattle.engine.periodic.families import Family
from gearrattle.engine.periodic.motion import Pass, State
from gearrattle.engine.periodic.multipliers import multipliers_of
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.point import pattern_of
from gearrattle.engine.periodic.two_parameters.event_gradient import KINDS, Drift, gradient_of_grazing
from gearrattle.engine.system.deflection_levels import deflection_levels, force_levels
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.factors import Written
from gearrattle.model.path_labels import shown_value
from gearrattle.model.path_values import change_in_si
from gearrattle.model.paths import expanded, path_names, value_at
from gearrattle.model.table import did_you_mean, shown
from gearrattle.orbits.family_ends import EDGE, gradient_of_end
from gearrattle.orbits.value_family import check_alike, ends_of, family_like, family_of

if TYPE_CHECKING:
    import pandas as pd

MOVED = (*KINDS, BREAKING, EDGE)
"""Kinds of events that have a gradient and can be followed over a second value."""
_SPEED = "excitation.speed"
_SAME = {_SPEED, "excitation.frequency"}
_LEFT_OUT = ("simulation", "schema", "name", "units")
Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
SWING = "peak-to-peak deflection"
FORCE = "largest force"
MULTIPLIER = "multiplier modulus"
"""Responses: of every clearance the first two, of every multiplier, by its number from 1, the last."""
_CHANGE = 1e-5  # of a number, to both sides
_KINK = 1e-3  # of a response per change of the number by itself: gradients on both sides that differ by more


def _moves_nothing(other: str) -> str:
    """Why no motion moves smoothly with the number at a path; empty where it may."""
    if other.rpartition(".")[2] == "order":
        return "cannot be changed a little: between two orders there are others without a common period"
    if other.partition(".")[0] in _LEFT_OUT:
        return "is no number of the driveline, and motions do not depend on it"
    return ""


def numbers_of(model: Model, path: str) -> Iterator[str]:
    """Yield the paths of all numbers of a model that are not zero, without ``path`` and simulation settings."""
    tables = model.to_tables()
    for other in path_names(tables):
        value = value_at(tables, other)
        is_number = isinstance(value, int | float) and not isinstance(value, bool) and value != 0.0
        same = {other, path} <= _SAME
        if is_number and not same and other != path and not _moves_nothing(other):
            yield other


def paths_of(paths: Iterable[str], model: Model) -> list[str]:
    """Return paths of numbers as a list, patterns replaced by what they match.

    Raises ModelError: one text, what is no text, or a pattern that matches nothing.
    """
    remedy = 'such as ["torque.0.mean"]; None: all of them'
    if isinstance(paths, str) or not isinstance(paths, Iterable):
        raise ModelError(Problem("paths", shown(paths), "must be a list of paths", remedy))
    chosen = list(paths)
    if problems := [Problem("paths", shown(one), "must be text", remedy) for one in chosen if not isinstance(one, str)]:
        raise ModelError(problems)
    return expanded(model.to_tables(), chosen)


def number_at(model: Model, path: str, other: str, argument: str = "paths") -> float:
    """Return the number at a path by which an event may be moved.

    Raises ModelError: the path leads to no number, to zero, or to what the branch is followed over.
    """
    value = model.excitation.omega if other == _SPEED else value_at(model.to_tables(), other)
    if rule := _moves_nothing(other):
        raise ModelError(Problem(argument, other, rule, "name another number"))
    if other == path or {other, path} <= _SAME:
        raise ModelError(Problem(argument, other, "is what the branch is followed over", "name another number"))
    if isinstance(value, bool) or not isinstance(value, int | float):
        paths = path_names(model.to_tables())
        remedy = "name another number" if other in paths else did_you_mean(other, paths)
        raise ModelError(Problem(argument, other, "must lead to a number of the model", remedy))
    if value == 0.0:
        raise ModelError(Problem(argument, other, "is zero, and is changed in proportion", "give it a small value"))
    return float(value)


def second_of(model: Model, path: str, second: str, ends: Sequence[Written]) -> tuple[float, tuple[float, float]]:
    """Return the model's own value at the path of a second value, and the ascending ends of its range [SI].

    Raises ModelError: the path leads to no number, to zero, or to what the branch is followed over; a range without
    sense, or one without the model's own value.
    """
    low, high = sorted(ends_of(model, second, ends, "second"))
    own = number_at(model, path, second, "second")
    if not low <= own <= high:
        first, last, inside = (shown_value(second, model, number, 6, max(-low, high)) for number in (low, high, own))
        rule = f"must contain the model's own {second}, {inside}"
        raise ModelError(Problem("range", f"{first} to {last}", rule))
    return own, (low, high)


def moved_as(event: Event, curve: Continuation) -> tuple[Event, Continuation]:
    """Return the event by which an event of a branch moves with numbers of the model, and the Continuation of that.

    It is the event itself. But where the branch joins one of half its period, or the symmetry breaks, I - M is singular
    in two ways: the event is the doubling of the motion of half its length, where I - DH is regular.

    Raises ModelError: it does not move smoothly.
    """
    _check_kind(event)
    doubling = as_doubling(curve, event.point) if event.kind in (DOUBLING, BREAKING) else None
    if doubling is not None:
        halves, point = doubling
        return Event(DOUBLING, point), halves
    if event.kind == BREAKING:
        rule = "is that of no symmetric motion, and does not move smoothly"
        raise ModelError(Problem("event", event.kind, rule, "name another event"))
    return event, curve


def _check_kind(event: Event) -> None:
    """Refuse a kind of event that does not move smoothly with numbers of the model."""
    jumps = event.is_collision or (event.grazing is not None and event.grazing.kind in (JUMP, RELEASE))
    if event.kind in MOVED and not jumps:
        return
    kind = event.kind if event.kind not in MOVED else f"{event.kind} at which the motion or its gradient jumps"
    rule = f"must be a {', '.join(MOVED[:-1])} or {MOVED[-1]} at which that gradient is continuous"
    raise ModelError(Problem("event", kind, rule))


def gradients_of(
    model: Model, path: str, curve: Continuation, event: Event, paths: Sequence[str] | None
) -> pd.DataFrame:
    """Return how an event moves with the numbers of a model, as a table; see ``Branch.gradients``.

    Raises ModelError: the kind of event has no gradient.
    """
    import pandas as pd

    event, curve = moved_as(event, curve)
    rows = []
    gradient = _gradient_by(model, path, curve, event)
    for other in numbers_of(model, path) if paths is None else paths_of(paths, model):
        value = number_at(model, path, other)
        try:
            slope = gradient(other, value)
        except (ConvergenceError, ModelError):
            slope = np.nan
        rows.append((other, value, slope, 0.1 * value * slope))
    table = pd.DataFrame(rows, columns=["path", "value", "gradient", "per_10_percent"])
    order = np.argsort(-np.abs(table["per_10_percent"].to_numpy()), kind="stable")
    return table.iloc[order].reset_index(drop=True)


def _gradient_by(model: Model, path: str, curve: Continuation, event: Event) -> Callable[[str, float], float]:
    """What gives dp / dq of an event, from the path and the value of a number q."""
    drift = Drift(event, curve)
    at = event.point.parameter

    def gradient(other: str, value: float) -> float:
        if event.kind == GRAZING:
            over = family_of(model.with_({path: at}), other, value, curve.cycles, abs(value))
            check_alike(over, curve.family)
            return gradient_of_grazing(event, curve, over, value)

        def families_of(change: float) -> tuple[Family, Family]:
            low, high = (model.with_({other: value + side}) for side in (-change, change))
            return family_like(curve.family, low, path, at), family_like(curve.family, high, path, at)

        is_end = event.kind == EDGE
        return gradient_of_end(event, curve, families_of, value) if is_end else drift.gradient(families_of, value)

    return gradient


def tolerances_of(model: Model, path: str, tolerances: Mapping[str, Written]) -> dict[str, float]:
    """Return standard deviations by path [SI]: of a pattern all that match have one each, independent of the others.

    Raises ModelError: a path by which no event is moved, or a deviation below zero.
    """
    if not isinstance(tolerances, Mapping):
        rule = "must be standard deviations by path"
        remedy = 'such as {"torque.0.mean": 0.1}'
        raise ModelError(Problem("tolerances", shown(tolerances), rule, remedy))
    deviations = {other: tolerances[named] for named in tolerances for other in paths_of([named], model)}
    for other in deviations:
        number_at(model, path, other, "tolerances")
    return {
        other: change_in_si(other, deviation, model, "non-negative", f"tolerances: {other}")
        for other, deviation in deviations.items()
    }


def scatter_of(gradients: Mapping[Any, Any], tolerances: Mapping[str, float]) -> float:
    """Return the standard deviation of an event under those of independent numbers [SI], to first order."""
    parts: list[Any] = [gradients[path] * deviation for path, deviation in tolerances.items()]
    return float(np.sqrt(np.sum(np.square(parts))))


def responses_of(period_map: PeriodMap, motion: Pass) -> Array:
    """Return (2 K,) peak-to-peak deflections of the K clearances, then the largest moduli of their forces [SI]."""
    along = period_map.flow, *period_map.along(motion)
    low, high, _ = deflection_levels(*along)
    return np.concatenate([high - low, np.abs(force_levels(*along)).max(axis=0, initial=0.0)])


def orbit_gradients(model: Model, period_map: PeriodMap, motion: Pass, paths: Sequence[str] | None) -> pd.DataFrame:
    """Return how the responses of an isolated motion move; see ``Orbit.gradients``.

    Raises ModelError: a path that leads to no number of the model, or to zero.
    """
    import pandas as pd

    names = assemble(model).layout.clearance_names
    multipliers = multipliers_of(motion.gradient)
    subjects = [(response, name) for response in (SWING, FORCE) for name in names]
    subjects += [(MULTIPLIER, str(i + 1)) for i in range(len(multipliers))]
    chosen = list(numbers_of(model, "")) if paths is None else paths_of(paths, model)
    values = [number_at(model, "", path) for path in chosen]
    slopes = [_slopes(model, path, value, period_map, motion) for path, value in zip(chosen, values, strict=True)]
    sizes = np.concatenate([responses_of(period_map, motion), np.abs(multipliers)]).tolist()
    rows = []
    for i, subject in enumerate(subjects):
        own = [
            (*subject, sizes[i], path, value, float(slope[i]), 0.1 * value * float(slope[i]))
            for path, value, slope in zip(chosen, values, slopes, strict=True)
        ]
        rows += sorted(own, key=lambda row: -np.nan_to_num(abs(row[-1]), nan=-1.0))
    return pd.DataFrame(rows, columns=["response", "of", "size", "path", "value", "gradient", "per_10_percent"])


def _slopes(model: Model, path: str, value: float, period_map: PeriodMap, motion: Pass) -> Array:
    """(2 K + N,) derivatives of responses, then of the moduli of multipliers; NaN where there are none."""
    change = _CHANGE * abs(value)
    multipliers = multipliers_of(motion.gradient)
    clearances = len(period_map.system.clearances)
    try:
        maps = [
            PeriodMap(assemble(model.with_({path: value + d})).system, period_map.cycles) for d in (-change, change)
        ]
        moved = [_moved(other, motion) for other in maps]
    except (ConvergenceError, ModelError, np.linalg.LinAlgError):
        return np.full(2 * clearances + len(multipliers), np.nan)
    patterns = [pattern_of(one) for one in (moved[0], motion, moved[1])]
    if len({tuple(sorted(pattern)) for pattern in patterns}) > 1:
        return np.full(2 * clearances + len(multipliers), np.nan)
    low, own, high = (
        np.concatenate([responses_of(other, one), np.abs(_matched(one, multipliers))])
        for other, one in zip((maps[0], period_map, maps[1]), (moved[0], motion, moved[1]), strict=True)
    )
    bends = np.abs(high - 2.0 * own + low) > _KINK * _CHANGE * np.abs(own)
    is_exchanged = len(set(patterns)) > 1
    return np.asarray(np.where(is_exchanged & bends, np.nan, (high - low) / (2.0 * change)))


def _moved(period_map: PeriodMap, motion: Pass) -> Pass:
    """The motion of a slightly changed driveline, from the state that (I - M)^-1 (P(y; q) - y) predicts."""
    gap = period_map.later(motion.start).y - motion.start.y
    step = np.linalg.solve(np.eye(len(gap)) - motion.gradient, gap)
    return shooting.shoot(period_map, State(motion.start.y + step, motion.start.auxiliary_pieces)).motion


def _matched(motion: Pass, multipliers: Complex) -> Complex:
    """(N,) multipliers of a motion in the order of those of its neighbour."""
    own = multipliers_of(motion.gradient)
    order = linear_sum_assignment(np.abs(own[None, :] - multipliers[:, None]))[1]
    return np.asarray(own[order])
