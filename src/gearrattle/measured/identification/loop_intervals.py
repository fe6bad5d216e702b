"""95 % likelihood intervals of a fitted loop's numbers.

Slopes, heights and the preload are nearly normal: value +- 1.96 standard errors, none below zero where the law allows
none. A break that has a jump is known by the samples beside the jump (``loop_jumps``). A stick stiffness s = H / r is
known by few samples, and the likelihood of its reach r is lopsided and has several maxima: its interval is that of
the density of r (``loop_reaches``), with what the height H leaves open beside the reach added as a square. Where no
reach is too short, samples do not resolve the slider and its stiffness has no upper end; where none is too long, no
lower end but zero.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.identification.loop_errors import Spread
from gearrattle.measured.identification.loop_jumps import SHARES, interval
from gearrattle.measured.identification.loop_reaches import Stretch
from gearrattle.measured.identification.loop_settle import Settled
from gearrattle.measured.identification.loop_values import KEYS, stick_sliders

Array = NDArray[np.float64]

NORMAL = 1.959963984540054
"""Standard errors to each side of a 95 % interval."""


def places(settled: Settled, known: Spread) -> dict[str, Array]:
    """Return ends of the interval and standard deviation of every break [rad] by its name in a coupling."""
    made = {}
    linear = settled.polish.linear(settled.law)
    for side, i in settled.law.shape.every_break():
        density = settled.reaches.get((side, i + 1))
        reaches = np.empty(0) if density is None else density.at(SHARES)
        made[f"{KEYS[side]}.{i}.until"] = interval(linear, settled.law, (side, i), known.variance, reaches)
    return made


def intervals(
    settled: Settled,
    known: Spread,
    estimates: tuple[Mapping[str, float], Mapping[str, float]],
    breaks: Mapping[str, Array],
) -> dict[str, tuple[float, float]]:
    """Return the 95 % interval of every number, and of stick stiffnesses whose default stands."""
    values, errors = estimates
    made = {}
    for name, value in values.items():
        kind = name.rpartition(".")[2]
        wide = NORMAL * errors[name]
        if kind == "until":
            made[name] = (float(breaks[name][0]), float(breaks[name][1]))
        elif kind != "stick_stiffness":
            made[name] = (value - wide if name == "preload" else max(value - wide, 0.0), value + wide)
    for name, slider in stick_sliders(settled.law).items():
        if slider in settled.sticks:
            made[name] = _widened(settled.sticks[slider], values.get(name), known.rest(settled.law, slider))
    return made


def _widened(stretch: Stretch, value: float | None, rest: float) -> tuple[float, float]:
    """Widen an interval by the uncertainty of the height, a standard error of its logarithm."""
    if value is None:
        return stretch.low, stretch.high
    low = stretch.low
    high = stretch.high
    more = NORMAL * rest
    if 0.0 < low < value:
        low = value * math.exp(-math.hypot(math.log(value / low), more))
    if value < high < math.inf:
        high = value * math.exp(math.hypot(math.log(high / value), more))
    return low, high


def smaller(settled: Settled, known: Spread, breaks: Mapping[str, Array]) -> Array:
    """(P,) factors on the standard errors of a law: those of breaks become the standard deviations of ``places``."""
    factors = np.ones(known.covariance.shape[0])
    first = len(settled.law.labels)
    for j, (_, _, reported) in enumerate(breaks.values(), first):
        error = math.sqrt(known.covariance[j, j])
        factors[j] = reported / error if math.isfinite(error) and error > 0.0 else 1.0
    return factors
