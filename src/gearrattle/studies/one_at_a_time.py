"""Swings of an output, one value at a time: its values when each goes to its lower and to its upper end.

The first case is the model itself; the others come in pairs, a value at its lower and at its upper end, all other
values the model's own (``designs``). Drawn widest on top these are the bars of a tornado diagram (T. G. Eschenbach,
Spiderplots versus tornado diagrams for sensitivity analysis, Interfaces 22, 1992, pp. 40-46). Interactions are not
seen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Swings:
    """Values of one output in a design of one value at a time: of the model, and (d,) with each value at either end."""

    base: float
    low: Array
    high: Array

    @property
    def swing(self) -> Array:
        """(d,) the width from the lowest to the highest of base, low and high; what failed is left out."""
        three = np.stack([np.full_like(self.low, self.base), self.low, self.high])
        there = np.isfinite(three)
        top = np.where(there, three, -np.inf).max(axis=0)
        bottom = np.where(there, three, np.inf).min(axis=0)
        return np.where(there.sum(axis=0) > 1, top - bottom, np.nan)


def swings(y: Array, d: int) -> Swings:
    """Return the values of an output when d values go to their ends.

    ``y`` (2 d + 1,) is the output in the order of the design; ModelError where these are not all cases of it.
    """
    if len(y) != 2 * d + 1:
        rule = f"must be the {2 * d + 1} cases of one value at a time"
        raise ModelError(Problem("data", f"{len(y)} samples", rule, "give all samples of the study"))
    return Swings(float(y[0]), y[1::2], y[2::2])
