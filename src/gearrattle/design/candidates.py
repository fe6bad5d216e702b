"""The changes that a search for remedies may make: each a value, or a factor on several, within bounds, at a cost.

Without a list of the user's these are, each from 0.7 to 1.3 times what the model says: the drag torque of all bodies
together, the backlash of all meshes together, every gap of a coupling, stiffness and hysteresis of every stage, and the
moment of inertia of every body that is no loose gear. A ramp of a torque may take up to four times as long, where the
next one leaves room for that.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from gearrattle.assembly import assemble
from gearrattle.design.variable import Variable, variable_of
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.table import shown
from gearrattle.model.value_kinds import AnyTable, Plain, checked
from gearrattle.signals import loose_gears

BOUNDS = (0.7, 1.3)
"""Factors between which a value may be changed where nothing is said."""
SLOWER = (1.0, 4.0)
"""Factors between which the duration of a ramp may be changed."""
_COST = Plain("non-negative")


@dataclass(frozen=True)
class Candidate:
    """One change that may be made, and the cost of the whole way from the model's own value to an end."""

    variable: Variable
    cost: float

    def cost_of(self, value: float) -> float:
        """Return the cost of a value: it grows with the way from the model's own."""
        own = self.variable.own
        if own is None:
            return self.cost
        end = self.variable.high if value > own else self.variable.low
        return self.cost * abs(value - own) / abs(end - own) if end != own else 0.0


def candidates_of(model: Model, requested: Mapping[str, object] | None) -> tuple[Candidate, ...]:
    """Read the candidates of a search for remedies; a ModelError has all that is wrong with them.

    By path or pattern each is a pair of ends, or a mapping with ``from``, ``to`` (or ``factor`` with them) and
    ``cost``; None stands for the default list.
    """
    if requested is None:
        return _default(model)
    problems: list[Problem] = []
    candidates = []
    for path, entry in checked(AnyTable(), requested, "candidates").items():
        try:
            candidates.append(_candidate(model, path, entry))
        except ModelError as error:
            problems += [Problem(f"candidate {path}: {p.place}", p.value, p.rule, p.remedy) for p in error.problems]
    if not requested:
        problems.append(Problem("candidates", "none", "a search for remedies needs one at least"))
    if problems:
        raise ModelError(problems)
    return tuple(candidates)


def _candidate(model: Model, path: str, entry: Any) -> Candidate:
    """Read one candidate."""
    cost = 1.0
    if isinstance(entry, Mapping):
        entry = dict(entry)
        cost = checked(_COST, entry.pop("cost", 1.0), "cost")
        if not entry:
            entry = _factors(BOUNDS)
    variable = variable_of(model, path, entry)
    if variable.own is None:
        low = variable.shown(variable.low)
        high = variable.shown(variable.high)
        rule = f"must lie around the model's own value, so that the change has a size; it is {low} to {high}"
        raise ModelError(Problem("range", shown(entry), rule))
    return Candidate(variable, cost)


def _factors(bounds: tuple[float, float]) -> dict[str, Any]:
    low, high = bounds
    return {"factor": {"from": low, "to": high}}


def _default(model: Model) -> tuple[Candidate, ...]:
    """Return the default candidates: everything on the list of the module that the model has."""
    layout = assemble(model).layout
    loose = {layout.inertia_names[gear.loose] for gear in loose_gears(layout)}
    together = ["inertia.*.drag_torque", "mesh.*.backlash"]
    patterns = ["coupling.*.clearance", "coupling.*.stages.*.stiffness", "coupling.*.stages.*.hysteresis"]
    paths = [pattern for pattern in together if _numbers(model, pattern)]
    paths += [path for pattern in patterns for path in _numbers(model, pattern)]
    paths += [f"inertia.{inertia.name}.J" for inertia in model.inertias if inertia.name not in loose]
    candidates = [Candidate(variable_of(model, path, _factors(BOUNDS)), 1.0) for path in paths]
    for path in _numbers(model, "torque.*.ramps.*.over"):
        with suppress(ModelError):  # the next ramp begins before that
            candidates.append(Candidate(variable_of(model, path, _factors(SLOWER)), 1.0))
    return tuple(candidates)


def _numbers(model: Model, pattern: str) -> list[str]:
    """Return the paths of a pattern at which numbers above zero stand."""
    paths = model.paths(pattern)
    return [path for path in paths if isinstance(model[path], int | float) and model[path] > 0.0]
