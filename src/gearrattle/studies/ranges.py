"""Ranges of values that an optimisation may choose from, and the designs it starts with.

A range is a pair of ends, or a mapping with from, to and spacing; the model must accept both ends as values. It may be
of factors of what the model says, ``{ factor = ... }`` about it or ends that are factors, and at a pattern. The first
design is the model itself, if its values are within the ranges; the others are Latin hypercube samples of the ranges.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.path_values import Varied
from gearrattle.model.table import did_you_mean, shown
from gearrattle.model.value_kinds import AnyTable, checked
from gearrattle.studies.study_axes import SPACING, listed_values, without_factor

Array = NDArray[np.float64]
_KEYS = ("from", "to", "spacing")


@dataclass(frozen=True)
class Range:
    """The range of one value of the model.

    Attributes
    ----------
    low, high
        its ends, SI.
    varied
        what it is of: the path, and whether the ends are factors.
    """

    path: str
    low: float
    high: float
    log: bool
    varied: Varied = field(repr=False)  # not in what tells stored optimisations apart: factors are, by themselves

    def at(self, share: Array) -> Array:
        """Return (n,) values at shares (n,) of the range, 0 to 1."""
        if self.log:
            return np.clip(self.low * (self.high / self.low) ** share, self.low, self.high)
        return np.clip(self.low + (self.high - self.low) * share, self.low, self.high)

    def share(self, value: float) -> float:
        """Return the position of a value in the range, 0 to 1."""
        if self.log:
            return float(np.log(value / self.low) / np.log(self.high / self.low))
        return (value - self.low) / (self.high - self.low)


def ranges_of(requested: Mapping[str, Any], model: Model) -> tuple[Range, ...]:
    """Read ranges; a ModelError has all errors in them.

    Each path or pattern has a pair, or a mapping with ``from``, ``to`` and ``spacing``; for factors of what the model
    says ``{"factor": ...}`` about it, or ends that are factors.
    """
    problems = []
    ranges = []
    if not checked(AnyTable(), requested, "variables"):
        problems.append(Problem("variables", "none", "an optimisation needs at least one"))
    for path, table in requested.items():
        try:
            ranges.append(_range(path, table, model))
        except ModelError as error:
            problems += [Problem(f"variable {path}: {p.place}", p.value, p.rule, p.remedy) for p in error.problems]
    if problems:
        raise ModelError(problems)
    return tuple(ranges)


def _range(path: str, entry: Any, model: Model) -> Range:
    entry, by_factor = without_factor(path, entry)
    varied = Varied(path, by_factor)
    if not isinstance(entry, Mapping) and len(pair := listed_values(entry)) == 2:
        entry = {"from": pair[0], "to": pair[1]}
    if not isinstance(entry, Mapping) or not {"from", "to"} <= set(entry):
        raise ModelError(Problem("range", shown(entry), "must be a pair, or have from and to"))
    unknown = [key for key in entry if key not in _KEYS]
    if unknown:
        raise ModelError(Problem(unknown[0], "", f"a range has {', '.join(_KEYS)}", did_you_mean(unknown[0], _KEYS)))
    spacing = checked(SPACING, entry.get("spacing", "linear"), "spacing")
    low, high = (varied.read(entry[key], model) for key in ("from", "to"))
    if any(isinstance(end, bool) or not isinstance(end, int | float) for end in (low, high)):
        raise ModelError(Problem("range", f"{shown(low)} to {shown(high)}", "the ends of a range must be numbers"))
    if not low < high:
        raise ModelError(Problem("from", f"{low:g}", f"must lie below to, {high:g}"))
    if spacing == "log" and not low > 0.0:
        raise ModelError(Problem("from", f"{low:g}", 'spacing "log" needs positive ends'))
    if not np.isfinite(float(high) - float(low)):
        rule = "the ends of a range lie too far apart for floating-point numbers"
        raise ModelError(Problem("range", f"{low:g} to {high:g}", rule))
    return Range(path, float(low), float(high), spacing == "log", varied)


def first_points(ranges: tuple[Range, ...], model: Model, count: int, seed: int) -> Array:
    """Return (count, d) points of the unit cube: first the model, if it is within the ranges; the others are spread."""
    from scipy.stats import qmc

    points = np.asarray(qmc.LatinHypercube(len(ranges), rng=np.random.default_rng(seed)).random(count))
    lowest = np.array([variable.low for variable in ranges])
    own = own_values(ranges, model, lowest - 1.0)
    if (own >= lowest).all():
        points[0] = [variable.share(value) for variable, value in zip(ranges, own.tolist(), strict=True)]
    return points


def own_values(ranges: tuple[Range, ...], model: Model, otherwise: Array) -> Array:
    """Return (d,) the unrounded values of the model, if all are within the ranges; else ``otherwise``."""
    own = [variable.varied.own(model) for variable in ranges]
    numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in own)
    if not numbers or not all(
        variable.low <= value <= variable.high for variable, value in zip(ranges, own, strict=True)
    ):
        return otherwise
    return np.array(own, dtype=np.float64)
