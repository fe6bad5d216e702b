"""The paper's relative error of a simulation, and its bounds for rounded printed values.

    sigma = 100 (measured - simulated) / measured        [%]

as in Padmanabhan et al. 1995, Table 5: positive where the simulation reads low. Of two values rounded to half a unit
sigma lies between the values that their extreme roundings give.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

NEGLIGIBLE = 0.1
"""[%] of what was measured: a smaller difference does not count."""


def sigma(measured: float, simulated: float) -> float:
    """Return the relative error [%] of a simulated level, of the measured one's unit; NaN where nothing was measured.

    Neither level is below zero.
    """
    return 100.0 * (measured - simulated) / measured if measured else math.nan


@dataclass(frozen=True)
class Printed:
    """Sigma of two printed values.

    Attributes
    ----------
    sigma
        of the values as printed [%].
    low, high
        what the unrounded values allow [%].
    """

    sigma: float
    low: float
    high: float


def of_printed(measured: float, simulated: float, half_unit: float = 0.5) -> Printed:
    """Return sigma of two values that a table gives rounded.

    Parameters
    ----------
    measured, simulated
        as printed, in one unit.
    half_unit
        how far rounding may have moved each; less than what was measured.
    """
    ends = [sigma(measured + a, simulated - a) for a in (-half_unit, half_unit)]
    return Printed(sigma(measured, simulated), min(ends), max(ends))
