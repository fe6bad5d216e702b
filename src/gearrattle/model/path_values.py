"""Values at paths of a model in SI, and paths that a study varies by values or by factors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from gearrattle.model.factors import Factor, factor_in, is_factor
from gearrattle.model.model import Model
from gearrattle.model.path_labels import PathLabel, dimension_at, path_label
from gearrattle.model.paths import factored, paths_at, value_at
from gearrattle.model.value_kinds import Bound, Plain, Quantity, checked


def in_si(path: str, value: Any, model: Model) -> Any:
    """Read a value as the model does, and return it in SI; at a pattern it is the value of all that match, a factor
    needs a single path. ModelError if the model refuses it, or the path leads nowhere.
    """
    taken = model.with_({path: value})
    one = path if is_factor(value) else paths_at(model.to_tables(), path)[0]
    return value_at(taken.to_tables(), one)


def change_in_si(path: str, change: Any, model: Model, bound: Bound, name: str) -> float:
    """Read the change of a number at a path, such as a step or a standard deviation: a plain number in SI, a string
    with a unit, or a factor of the model's number. No rule of the number itself holds; ModelError if it is no such
    change.
    """
    if is_factor(change):
        change = abs(in_si(path, change, model))
    dimension = dimension_at(paths_at(model.to_tables(), path)[0])
    reader = Plain(bound) if dimension is None else Quantity(dimension, bound)
    return float(checked(reader, change, name, dimensionless=model.units == "dimensionless"))


@dataclass(frozen=True)
class Varied:
    """What a study varies by one path or pattern: the value there, or the factor of what the model says."""

    path: str
    by_factor: bool = False

    def change(self, value: Any) -> Any:
        """Return a number as ``Model.with_`` takes it at the path."""
        return Factor(value) if self.by_factor else value

    def read(self, value: Any, model: Model) -> Any:
        """Return a value in SI, a factor as a plain number; ModelError where the model refuses it."""
        if not self.by_factor:
            return in_si(self.path, value, model)
        times = factor_in(value if is_factor(value) else {"factor": value})
        model.with_({self.path: times})
        return times.times

    def read_change(self, change: Any, model: Model, name: str) -> float:
        """Return a positive change, such as a standard deviation: in SI, that of a factor as a plain number; ModelError
        otherwise.
        """
        if self.by_factor:
            return float(checked(Plain("positive"), change, name))
        return change_in_si(self.path, change, model, "positive", name)

    def own(self, model: Model) -> Any:
        """Return what the model says: of a factor 1; of a pattern the value of all that match, None if they differ."""
        if self.by_factor:
            return 1.0
        tables = model.to_tables()
        values = [value_at(tables, path) for path in paths_at(tables, self.path)]
        return values[0] if all(value == values[0] for value in values) else None

    def targets(self, model: Model) -> dict[str, float | None]:
        """Return the plain paths with the numbers that factors multiply, None where values are set as they are;
        ModelError for a pattern that matches nothing, or a factor of what is no number.
        """
        tables = model.to_tables()
        return {**factored(tables, self.path)} if self.by_factor else dict.fromkeys(paths_at(tables, self.path))

    def spread(self, values: Sequence[Any], model: Model) -> dict[str, tuple[Any, ...]]:
        """Return by plain path what the model is given for values that are read; errors as ``targets``."""
        return {
            path: tuple(values if own is None else (Factor(value).of(own) for value in values))
            for path, own in self.targets(model).items()
        }

    def label(self, model: Model) -> PathLabel:
        """Return what its numbers are called."""
        return path_label(self.path, model, by_factor=self.by_factor)
