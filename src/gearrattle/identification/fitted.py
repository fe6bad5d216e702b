"""What a fit found: the model, its parameters with errors, every datum's residual, other minima, what stays open.

Takes findings of ``fit``; gives words and JSON types.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.identification.identifiability import Combination
from gearrattle.identification.problem import Residual
from gearrattle.json_types import json_value
from gearrattle.model import Model
from gearrattle.wording import counted

Array = NDArray[np.float64]

RIVAL = 3.841
"""Minima whose chi-square exceeds the best by less than this (95 % of one degree of freedom) fit as well."""


@dataclass(frozen=True)
class FittedParameter:
    """One free parameter; values in SI.

    Attributes:
        path: as ``Model.with_`` takes it.
        start: value in the model given.
        value: fitted value.
        standard_error: of the value, to first order; inf if the data leave it open, NaN on a bound.
        lower, upper: bounds.
        at_bound: "lower", "upper" or empty.
        interval: 95 % profile-likelihood interval, ends beyond the bounds infinite (0 below); None unless asked for.
    """

    path: str
    start: float
    value: float
    standard_error: float
    lower: float
    upper: float
    at_bound: str
    interval: tuple[float, float] | None = None

    @property
    def relative_error(self) -> float:
        """Standard error over value: that of the logarithm."""
        return self.standard_error / self.value


@dataclass(frozen=True)
class LocalMinimum:
    """One set of parameters from which every small change fits worse.

    Attributes:
        chi_square: sum of squares of the residuals in standard errors.
        values: by path [SI].
        times: from how many starts it was reached.
    """

    chi_square: float
    values: Mapping[str, float]
    times: int


@dataclass(frozen=True)
class Fit:
    """A fitted model and what the data say about it.

    Attributes:
        model: the model with the fitted values; it can be saved (``to_toml``) and simulated like any other.
        parameters: the free ones.
        residuals: every datum.
        chi_square: sum of squares of the residuals of the data.
        degrees_of_freedom: data, less one for each shape's scale, less parameters determined and not on a bound.
        covariance: (P, P) of the logarithms of the parameters; inf on the diagonal of those left open, NaN on a bound.
        minima: all distinct local minima found, the best first.
        starts: number of starts.
        undetermined: combinations of parameters that the data leave open.
        notes: what the user must know.
    """

    model: Model
    parameters: tuple[FittedParameter, ...]
    residuals: tuple[Residual, ...]
    chi_square: float
    degrees_of_freedom: int
    covariance: Array
    minima: tuple[LocalMinimum, ...]
    starts: int
    undetermined: tuple[Combination, ...]
    notes: tuple[str, ...]

    @property
    def report(self) -> str:
        """The whole in words."""
        return "\n".join(
            [*self._parameters(), "", *self._residuals(), "", *self._open(), *self._minima(), *self._notes()]
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the record in JSON types; numbers that are not finite are null."""
        return {
            "name": self.model.name,
            "parameters": json_value(self.parameters),
            "residuals": json_value(self.residuals),
            "chi_square": self.chi_square,
            "degrees_of_freedom": self.degrees_of_freedom,
            "covariance": json_value(self.covariance),
            "minima": json_value(self.minima),
            "starts": self.starts,
            "undetermined": json_value(self.undetermined),
            "notes": list(self.notes),
        }

    def _parameters(self) -> list[str]:
        profiled = any(p.interval is not None for p in self.parameters)
        rows = [["parameter", "start", "fitted", "standard error", "bounds", *(["95 % interval"] if profiled else [])]]
        for p in self.parameters:
            error = f"{p.standard_error:.2g} ({100 * p.relative_error:.2g} %)"
            error = {True: "not determined"}.get(math.isinf(p.standard_error), error)
            error = "on its bound" if p.at_bound else error
            bounds = f"{p.lower:.4g} ... {p.upper:.4g}" + (f", {p.at_bound} reached" if p.at_bound else "")
            row = [p.path, f"{p.start:.6g}", f"{p.value:.6g}", error, bounds]
            if profiled:
                row.append("-" if p.interval is None else _interval(p.interval))
            rows.append(row)
        return _table(rows)

    def _residuals(self) -> list[str]:
        rows = [["datum", "measured", "fitted", "standard error", "residual"]]
        responses: dict[str, list[Residual]] = {}
        for r in self.residuals:
            if r.label.startswith("response "):
                responses.setdefault(r.label.split(": ")[0], []).append(r)
                continue
            numbers = (r.measured, r.fitted) if r.unit else (round(r.measured, 6), round(r.fitted, 6))
            unit = f" {r.unit}" if r.unit else ""
            rows.append(
                [r.label, *(f"{v:.6g}{unit}" for v in numbers), f"{r.standard_error:.2g}", f"{r.residual:+.2f}"]
            )
        lines = _table(rows) if len(rows) > 1 else []
        for label, samples in responses.items():
            squares = np.array([r.residual for r in samples]) ** 2
            lines.append(
                f"{label}: {counted(len(samples) // 2, 'sample')}, "
                f"residuals {math.sqrt(squares.mean()):.3g} standard errors rms, "
                f"{math.sqrt(squares.max()):.3g} at most ({samples[int(squares.argmax())].label.split(': ')[1]} rad/s)"
            )
        lines.append(f"chi-square {self.chi_square:.4g}, {self.degrees_of_freedom} degrees of freedom")
        return lines

    def _open(self) -> list[str]:
        lines = []
        for structural, title in ((True, "not determined by the data:"), (False, "hardly determined by the data:")):
            found = [c.words for c in self.undetermined if c.structural == structural]
            lines += [title, *(f"  {words}" for words in found)] if found else []
        return lines or ["the data determine every parameter"]

    def _minima(self) -> list[str]:
        first = self.minima[0]
        lines = [
            f"best minimum reached from {first.times} of {counted(self.starts, 'start')}; "
            f"{counted(len(self.minima), 'distinct minimum', 'distinct minima')}"
        ]
        others = (f"  another: chi-square {m.chi_square:.4g}, from {m.times}" for m in self.minima[1:4])
        return [*lines, *others]

    def _notes(self) -> list[str]:
        return [f"note: {note}" for note in self.notes]


def _interval(ends: tuple[float, float]) -> str:
    low = "below the bound" if ends[0] == 0.0 else f"{ends[0]:.5g}"
    high = "beyond the bound" if math.isinf(ends[1]) else f"{ends[1]:.5g}"
    return f"{low} ... {high}"


def _table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows as lines of aligned columns, the first to the left."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return [
        "  ".join(
            c.ljust(w) if k == 0 else c.rjust(w) for k, (c, w) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
