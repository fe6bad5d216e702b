"""The common period of all orders: T = 2 pi / (Omega gcd(orders)).

An order counts as a fraction p/q with q <= 64 if it lies within 1e-9 of this fraction. If an order is no such fraction,
or if T would be longer than 64 turns of the reference shaft, T = 2 pi / Omega and a note says so.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm, pi

import numpy as np
from numpy.typing import NDArray

from gearrattle.derived_values import kept
from gearrattle.model import Model

_LARGEST_DENOMINATOR = 64
_SAME = 1e-9  # distance of an order from its fraction
_LONGEST = 64  # turns of the reference shaft


@dataclass(frozen=True)
class CommonPeriod:
    """T [s], the distinct orders, cycles of every order in T, notes, and 2 pi / Omega over T (``turns``)."""

    period: float
    orders: NDArray[np.float64]
    cycles: NDArray[np.float64]
    notes: tuple[str, ...]
    turns: float = 1.0


def common_period(omega: float, orders: list[float]) -> CommonPeriod:
    """Find the common period of orders (zeros are ignored) at the reference speed omega [rad/s]."""
    distinct = sorted(set(orders))
    turning = [order for order in distinct if order > 0]
    fundamental = 2 * pi / omega
    as_given = np.array(distinct)
    if not turning:
        return CommonPeriod(fundamental, as_given, as_given, ())
    fractions = {order: Fraction(order).limit_denominator(_LARGEST_DENOMINATOR) for order in turning}
    odd = [order for order, fraction in fractions.items() if abs(order - fraction) > _SAME or fraction == 0]
    if odd:
        note = (
            f"order {odd[0]:.12g} is no fraction p/q with q <= {_LARGEST_DENOMINATOR}: the motion has no common period"
        )
        return CommonPeriod(fundamental, as_given, as_given, (f"{note}; cycles count turns of the reference shaft.",))
    denominator = lcm(*(f.denominator for f in fractions.values()))
    common = Fraction(gcd(*(int(f * denominator) for f in fractions.values())), denominator)
    if 1 / common > _LONGEST:
        note = f"the common period of all orders is {float(1 / common):.6g} turns, more than {_LONGEST}"
        return CommonPeriod(fundamental, as_given, as_given, (f"{note}; cycles count turns of the reference shaft.",))
    cycles = np.array([float(fractions[order] / common) if order > 0 else 0.0 for order in distinct])
    return CommonPeriod(fundamental / float(common), as_given, cycles, (), float(common))


@kept
def period_of(model: Model) -> CommonPeriod:
    """The common period of torques, motions, errors and alternating meshes; along a sweep, at its first speed."""
    orders = [h.order for t in model.torques for h in t.harmonics]
    orders += [h.order for m in model.motions for h in m.harmonics]
    orders += [h.order for element in model.elements for h in element.errors]
    orders += [element.alternation.order for element in model.elements if element.alternation is not None]
    return common_period(model.excitation.omega, orders)
