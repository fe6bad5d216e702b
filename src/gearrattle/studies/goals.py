"""Goals of an optimisation: objectives, outputs to be small or large, and constraints, limits of others.

An output of one subject is named by itself, "verdict"; one of several by subject and output, "gear: largest impact
energy". A constraint holds an output, or in Python a function of the Model, ``below`` a limit, ``above`` one, or both.
The violation by a design is given in units of the limit, so that violations of different quantities can be added up.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.table import did_you_mean, shown
from gearrattle.model.units import DIMENSIONS
from gearrattle.model.value_kinds import AnyTable, Choice, Plain, checked
from gearrattle.model.value_kinds import Quantity as InUnits
from gearrattle.studies.dataset_layout import numbers_of
from gearrattle.studies.output import Output
from gearrattle.studies.outputs import Outputs

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
SENSES: Mapping[str, float] = {"min": 1.0, "max": -1.0}


@dataclass(frozen=True)
class Quantity:
    """One number of every design.

    Attributes
    ----------
    output, subject
        where it stands in the Dataset; the subject is empty for an output without.
    of
        a function of the Model instead; None for an output.
    unit
        of it; "" for a plain number.
    """

    label: str
    output: str = ""
    subject: str = ""
    of: Callable[[Model], float] | None = None
    unit: str = ""

    def values(self, data: xr.Dataset, models: Callable[[int], Model]) -> Array:
        """Return (n,) its value for every design, NaN where there is none; ``models`` gives a design's."""
        if self.of is not None:
            return np.array([_called(self.of, self.label, models(i)) for i in range(data["outcome"].size)])
        values = numbers_of(data[self.output])
        if self.subject:
            dimension = next(name for name in values.dims if name not in data["outcome"].dims)
            values = values.sel({dimension: self.subject})
        return np.asarray(values.values, dtype=np.float64)


@dataclass(frozen=True)
class Objective:
    """Quantity to be small (``sense`` "min") or large ("max")."""

    quantity: Quantity
    sense: str


@dataclass(frozen=True)
class Constraint:
    """Quantity to stay below or above a limit; None for no limit."""

    quantity: Quantity
    below: float | None
    above: float | None

    @property
    def words(self) -> str:
        """The limits, as a sentence says them."""
        limits = (("at most", self.below), ("at least", self.above))
        parts = [f"{word} {limit:g}" for word, limit in limits if limit is not None]
        return f"{self.quantity.label} {' and '.join(parts)}"

    def violation(self, values: Array) -> Array:
        """Return (n,) by how much values miss the limits, in units of the limit; 0 within, NaN without a value."""
        over = np.zeros(len(values)) if self.below is None else (values - self.below) / (abs(self.below) or 1.0)
        under = np.zeros(len(values)) if self.above is None else (self.above - values) / (abs(self.above) or 1.0)
        return np.where(np.isnan(values), np.nan, np.maximum(np.maximum(over, under), 0.0))


def objectives_of(requested: Mapping[str, Any], outputs: Outputs) -> tuple[Objective, ...]:
    """Read objectives, "min" or "max" by label; a ModelError has everything that is wrong with them."""
    problems = []
    objectives = []
    if not checked(AnyTable(), requested, "objectives"):
        problems.append(Problem("objectives", "none", "an optimisation needs at least one", 'for example {...: "min"}'))
    for label, sense in requested.items():
        try:
            quantity = _quantity(f"objective {label}", label, outputs, small=sense == "min")
            objectives.append(Objective(quantity, checked(Choice(tuple(SENSES)), sense, f"objective {label}")))
        except ModelError as error:
            problems += error.problems
    if problems:
        raise ModelError(problems)
    return tuple(objectives)


def constraints_of(requested: Mapping[str, Any], outputs: Outputs, model: Model) -> tuple[Constraint, ...]:
    """Read constraints; a ModelError has everything that is wrong with them.

    By label each is a mapping with ``below``, ``above`` or both; with ``of``, a function of the Model.
    """
    problems: list[Problem] = []
    constraints = []
    for label, table in checked(AnyTable(), requested, "constraints").items():
        try:
            constraints.append(_constraint(label, table, outputs, model))
        except ModelError as error:
            problems += error.problems
    if problems:
        raise ModelError(problems)
    return tuple(constraints)


def _constraint(label: str, table: Any, outputs: Outputs, model: Model) -> Constraint:
    location = f"constraint {label}"
    if not isinstance(table, Mapping) or not {"below", "above"} & set(table):
        raise ModelError(
            Problem(location, shown(table), "must say below, above or both", "for example { below = 2.0 }")
        )
    unknown = [key for key in table if key not in ("below", "above", "of")]
    if unknown:
        remedy = did_you_mean(unknown[0], ("below", "above", "of"))
        raise ModelError(Problem(location, unknown[0], "a constraint has below, above, of", remedy))
    of_model = table.get("of")
    if of_model is None:
        quantity = _quantity(location, label, outputs, small=table.get("below") is not None)
    elif callable(of_model):
        _called(of_model, label, model)
        quantity = Quantity(label, of=of_model)
    else:
        raise ModelError(Problem(location, shown(of_model), "of must be a function that takes a Model"))
    below, above = (_limit(table.get(side), quantity.unit, location) for side in ("below", "above"))
    if below is not None and above is not None and not above < below:
        raise ModelError(Problem(location, f"above {above:g}, below {below:g}", "leaves nothing between"))
    return Constraint(quantity, below, above)


def _limit(value: Any, unit: str, location: str) -> float | None:
    """Return a limit in SI: a plain number, or a text with a unit where the quantity has one; None for none."""
    if value is None:
        return None
    dimension = DIMENSIONS.get(unit.replace(" ", "*"))
    if dimension is None:
        return float(checked(Plain(), value, location))
    return float(checked(InUnits(dimension), value, location, dimensionless=False))


def _called(function: Callable[[Model], float], label: str, model: Model) -> float:
    value = function(model)
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        raise ModelError(Problem(f"constraint {label}", type(value).__name__, "its function must return a number"))
    return float(value)


def _quantity(location: str, label: str, outputs: Outputs, *, small: bool) -> Quantity:
    """Return the quantity that a label names.

    Where small values are wanted, a design must not lose because its motion lacks the quantity.
    """
    known = labels_of(outputs)
    if label not in known:
        output = next((candidate for candidate in outputs.all if candidate.name == label), None)
        if output is not None:
            several = ", ".join(f'"{subject}: {label}"' for subject in output.applies_to)
            raise ModelError(Problem(location, f'"{label}"', "is of several parts", f"name one: {several}"))
        rule = f"the study has no such output; it has {', '.join(known)}"
        raise ModelError(Problem(location, f'"{label}"', rule, did_you_mean(label, tuple(known))))
    output, subject = known[label]
    if small and not output.can_rank:
        rule = f"has no value where there is {output.lacking}, so such a design could not win"
        largest = label.replace("mean ", "largest ")
        remedy = f'take "{largest}", which is 0 there' if largest != label else "take an output that every motion has"
        raise ModelError(Problem(location, f'"{label}"', rule, remedy))
    units = dict(zip(output.applies_to, output.unit, strict=False)) if output.subjects else {"": output.unit[0]}
    unit = units.get(subject, output.unit[0])
    return Quantity(label, output.name, subject, None, "" if unit == "1" else unit)


def labels_of(outputs: Outputs) -> dict[str, tuple[Output, str]]:
    """Return every label an output can be named by, with its subject."""
    labels: dict[str, tuple[Output, str]] = {}
    for output in outputs.all:
        subjects = [str(subject) for subject in output.applies_to] if output.dimension else [""]
        labels |= {f"{subject}: {output.name}" if subject else output.name: (output, subject) for subject in subjects}
        if len(subjects) == 1:
            labels[output.name] = (output, subjects[0])
    return labels


def named_outputs(labels: list[str]) -> list[str]:
    """Return the outputs that labels ask for."""
    return list(dict.fromkeys(label.rpartition(": ")[2] if isinstance(label, str) else label for label in labels))
