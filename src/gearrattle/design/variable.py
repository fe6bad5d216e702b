"""Variable of a design: one value of a model, a factor on several values, or several values that change together.

A range is divided on a logarithmic scale if its ends are positive and have a large ratio, else on a linear scale.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.path_labels import in_shown_unit
from gearrattle.model.table import shown
from gearrattle.studies.ranges import Range, ranges_of

_FAR_APART = 4.0  # ratio of the ends of a range from which on its scale is logarithmic
_ROUNDING = 1e-12  # share of a range: a value nearer to zero is zero


@dataclass(frozen=True)
class Variable:
    """One number that changes a model.

    Attributes
    ----------
    path
        path of the value in the model file; the paths of several values are joined by "+".
    low, high
        ends of the range: in SI, or factors; for several values shares of their way to their ends.
    own
        value in the model itself; None if it is not within the range.
    unit
        SI unit of the numbers; empty for a plain number.
    ends
        for every value that the variable sets: its range, its own number, its number at the variable's upper end.
    """

    path: str
    low: float
    high: float
    own: float | None
    words: str
    unit: str
    ends: tuple[tuple[Range, float, float], ...]

    def changes(self, value: float) -> dict[str, Any]:
        """Return the changes that set a value, as ``Model.with_`` takes them."""
        if len(self.ends) == 1:
            return {self.path: self.change(value)}
        return {one.path: one.varied.change(own + value * (end - own)) for one, own, end in self.ends}

    def change(self, value: float) -> Any:
        """Return a value as ``Model.with_`` takes it at the path, a number or a factor; for a variable of one path."""
        ((one, _, _),) = self.ends
        return one.varied.change(value)

    @property
    def is_log(self) -> bool:
        """Whether the range is divided on a logarithmic scale."""
        return self.low > 0.0 and self.high >= _FAR_APART * self.low

    def spread(self, count: int) -> NDArray[np.float64]:
        """Return ``count`` values from end to end, and the model's own value."""
        space = np.geomspace if self.is_log else np.linspace
        values = space(self.low, self.high, count)
        values[0] = self.low
        values[-1] = self.high
        if not self.is_log:
            values[np.abs(values) < _ROUNDING * (self.high - self.low)] = 0.0
        if self.own is None:
            return values
        # the model's own value replaces a value near it
        is_near = np.abs(values - self.own) < 0.25 * np.min(np.diff(values))
        is_near[[0, -1]] = False
        return np.unique(np.append(values[~is_near], self.own))

    def between(self, low: float, high: float) -> float:
        """Return the value in the middle of two values, on the scale of the range."""
        return float(np.sqrt(low * high)) if self.is_log else 0.5 * (low + high)

    def shown(self, value: float, digits: int = 4) -> str:
        """Return a value as messages write it."""
        factor, unit = in_shown_unit(self.path, self.unit, max(abs(self.low), abs(self.high)))
        return f"{value * factor:.{digits}g} {unit}".rstrip()


def variable_of(model: Model, path: str, ends: Any) -> Variable:
    """Read the range of one value of a model.

    The ends are two values as a model file writes them, two factors, or a mapping as of a variable of ``optimize``.
    ModelError if the path leads nowhere, or if the model does not take the range.
    """
    if not isinstance(path, str):
        raise ModelError(Problem("path", shown(path), "must be a text", 'such as "mesh.gear.backlash"'))
    try:
        (one,) = ranges_of({path: ends}, model)
    except ModelError as error:
        own = f"variable {path}: "
        raise ModelError(
            replace(problem, place=problem.place.removeprefix(own)) for problem in error.problems
        ) from None
    own = one.varied.own(model)
    is_number = isinstance(own, int | float) and not isinstance(own, bool)
    inside = float(own) if is_number and one.low <= own <= one.high else None
    label = one.varied.label(model)
    return Variable(path, one.low, one.high, inside, label.words, label.unit, ((one, one.low, one.high),))


def together(model: Model, moves: Sequence[tuple[Range, float]]) -> Variable:
    """Return the variable that changes several values together, each from the model's own value to an end."""
    ends = tuple((one, float(one.varied.own(model)), end) for one, end in moves)
    words = " and ".join(one.varied.label(model).words for one, _ in moves)
    return Variable("+".join(one.path for one, _ in moves), 0.0, 1.0, 0.0, f"{words}, share of the way", "", ends)
