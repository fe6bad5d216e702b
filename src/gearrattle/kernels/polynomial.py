"""The first exit of a polynomial: isolate with a bound on the third derivative, then bracketed Newton.

A gap g(s), positive inside a region, is tested on [s, s + w] by the cubic minorant
g + g' x + g'' x^2 / 2 - b x^3 / 6 <= g(s + x), b >= |g'''|. What the minorant cannot decide is halved, left half first,
so the crossing found is the first one; a double root (grazing) narrows cubically and is decided by its sign.
"""

from __future__ import annotations

from math import sqrt

from gearrattle.kernels._jit import kernel

NEVER = 2.0
_NARROWEST = 1e-13  # of the window: below this a tangency is neither promised nor denied


@kernel
def stays_inside(gap, rate, curvature, third, h):
    """Whether gap + rate x + curvature x^2 / 2 - third x^3 / 6 > 0 for all 0 < x <= h (third >= 0).

    A gap of exactly zero counts as inside if it opens.
    """
    end = gap + h * (rate + h * (0.5 * curvature - h * third / 6.0))
    if end <= 0.0:
        return False
    if rate >= 0.0:  # rises, then falls at most once: the ends decide
        return gap > 0.0 or (gap == 0.0 and (rate > 0.0 or curvature > 0.0))
    if gap <= 0.0:
        return False
    if curvature <= 0.0:
        return True  # falls all the way, and the end is inside
    spread = curvature * curvature + 2.0 * third * rate
    if spread <= 0.0:
        return True
    x = -2.0 * rate / (curvature + sqrt(spread))  # the minimum of the minorant
    if x >= h:
        return True
    return gap + x * (rate + x * (0.5 * curvature - x * third / 6.0)) > 0.0


@kernel
def _value(c, s):
    """Value and first two derivatives of sum c_j s^j."""
    value, first, second = 0.0, 0.0, 0.0
    for j in range(c.size - 1, -1, -1):
        second = second * s + first
        first = first * s + value
        value = value * s + c[j]
    return value, first, 2.0 * second


@kernel
def slope(c, s):
    """First derivative of sum c_j s^j."""
    total = 0.0
    for j in range(c.size - 1, 0, -1):
        total = total * s + j * c[j]
    return total


@kernel
def _bracketed_root(c, low, high):
    """Root in [low, high] with c(low) > 0 >= c(high): Newton, bisection where it leaves the bracket."""
    s = 0.5 * (low + high)
    for _ in range(80):
        value, first, _second = _value(c, s)
        if value > 0.0:
            low = s
        else:
            high = s
        step = s - value / first if first != 0.0 else low
        if not (low < step < high):
            step = 0.5 * (low + high)
        if step == s or high - low <= 1e-16 * high:
            break
        s = step
    return s


@kernel
def first_exit(c):
    """First s in [0, 1] at which the gap sum c_j s^j turns negative; ``NEVER`` if it does not.

    A gap of zero or below at s = 0 (rounding) is an exit if it is closing, and counts as zero if it opens.
    """
    third = 0.0
    for j in range(3, c.size):
        third += abs(c[j]) * j * (j - 1) * (j - 2)
    low, width = 0.0, 1.0
    while low < 1.0:
        gap, rate, curvature = _value(c, low)
        if gap <= 0.0:
            if rate < 0.0 or (rate == 0.0 and curvature < 0.0):
                return low
            gap = 0.0
        width = min(width, 1.0 - low)
        while True:
            if stays_inside(gap, rate, curvature, third, width):
                break
            closing = max(rate, rate + curvature * width) + 0.5 * third * width * width < 0.0
            if closing:
                beyond, _first, _second = _value(c, low + width)
                if beyond <= 0.0:
                    return _bracketed_root(c, low, low + width)
                break
            if width < _NARROWEST:
                break
            width *= 0.5
        low += width
        width *= 2.0
    return NEVER
