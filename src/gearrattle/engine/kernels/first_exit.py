"""The first exit of a polynomial: isolate with a bound on the third derivative, then bracketed Halley steps.

A gap g(s), positive inside a region, is tested on [s, s + w] by the cubic minorant
g + g' x + g'' x^2 / 2 - b x^3 / 6 <= g(s + x), b >= |g'''|. An interval that the minorant does not decide is halved,
and the left half is tested first: so the first crossing is isolated. At a double root (grazing) the interval narrows
cubically, and the sign of g decides.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from gearrattle.engine.kernels._jit import inlined, kernel

NEVER = 2.0
"""No exit in the window."""
UNDECIDED = -1.0
"""The search is ended without a result: a coefficient is not finite, or no width decides."""
SIXTH = 1.0 / 6.0
_SETTLED = 1e-7  # relative change of the last Halley step; the error after it is of third order
_THIRD = np.array([j * (j - 1.0) * (j - 2.0) for j in range(64)])
_NARROWEST = 1e-13  # share of the window: in a narrower interval a tangency is not decided
_ROUNDING = 1e-15  # share of the sum of the coefficients' moduli
_MOST_TRIALS = 100_000  # widths tested in a window, some milliseconds; motions need a few hundred at most
_MANY_TRIALS = 64  # widths tested in a window after which the third derivative is bounded on the tested part only


@kernel
def stays_inside(gap, rate, curvature, third, h):
    """Whether gap + rate x + curvature x^2 / 2 - third x^3 / 6 > 0 for all 0 < x <= h (third >= 0).

    A gap of exactly zero counts as inside if it opens.
    """
    # the end of the interval
    sixth = SIXTH * third
    end = gap + h * (rate + h * (0.5 * curvature - h * sixth))
    if end <= 0.0:
        return False
    if rate >= 0.0:  # the cubic rises, then falls at most once: its ends decide
        return gap > 0.0 or (gap == 0.0 and (rate > 0.0 or curvature > 0.0))
    if gap <= 0.0:
        return False
    if curvature <= 0.0:
        return True  # the cubic falls all the way, and its end is positive
    # else the one minimum of the cubic before its end
    spread = curvature * curvature + 2.0 * third * rate
    if spread <= 0.0:
        return True
    x = -2.0 * rate / (curvature + sqrt(spread))  # the minimum of the minorant
    if x >= h:
        return True
    return gap + x * (rate + x * (0.5 * curvature - x * sixth)) > 0.0


@inlined
def evaluate(c, s):
    """Value and first two derivatives of sum c_j s^j.

    Even and odd powers are summed separately in q = s^2: p = E(q) + s O(q).
    """
    q = s * s
    n = c.size
    even = 0.0
    even1 = 0.0
    even2 = 0.0
    odd = 0.0
    odd1 = 0.0
    odd2 = 0.0
    if n % 2:
        n -= 1
        even = c[n]
    # Horner in s^2, value and two derivatives of both halves at once
    for j in range(n - 2, -1, -2):
        even2 = even2 * q + even1
        odd2 = odd2 * q + odd1
        even1 = even1 * q + even
        odd1 = odd1 * q + odd
        even = even * q + c[j]
        odd = odd * q + c[j + 1]
    # derivatives of E(q) + s O(q) by s
    first = 2.0 * s * even1 + odd + 2.0 * q * odd1
    second = 2.0 * even1 + 8.0 * q * even2 + s * (6.0 * odd1 + 8.0 * q * odd2)
    return even + s * odd, first, second


@kernel
def slope(c, s):
    """First derivative of sum c_j s^j."""
    return evaluate(c, s)[1]


@kernel
def third_within(c, end):
    """Bound on the modulus of the third derivative in [0, end]."""
    third = 0.0
    for j in range(c.size - 1, 2, -1):
        third = third * end + abs(c[j]) * _THIRD[j]
    return third


@kernel
def _is_rounding(c, third, width):
    """Whether the term of the third derivative over a width is below the rounding of the coefficients."""
    total = 0.0
    for j in range(c.size):
        total += abs(c[j])
    return third * width * width * width <= _ROUNDING * total


@inlined
def _halley(value, first, second):
    """Halley's step towards a zero."""
    return -2.0 * value * first / (2.0 * first * first - value * second)


@inlined
def _guess(c, low, width, gap, rate, curvature):
    """Zero of the parabola at the left end, improved by the cubic if low is 0; the middle if it lies outside."""
    spread = rate * rate - 2.0 * curvature * gap
    x = 2.0 * gap / (sqrt(spread) - rate) if spread > 0.0 and rate < 0.0 else 0.5 * width
    if low == 0.0 and c.size > 3:
        value = gap + x * (rate + x * (c[2] + x * c[3]))
        first = rate + x * (curvature + 3.0 * x * c[3])
        x += _halley(value, first, curvature + 6.0 * x * c[3])
    return x if 0.0 < x < width else 0.5 * width


@kernel
def _bracketed_root(c, low, high, guess):
    """Root in [low, high] with c(low) > 0 >= c(high): Halley's steps, bisection where they leave the bracket."""
    s = low + guess
    for _ in range(80):
        # the bracket shrinks from the side that the value lies on
        value, first, second = evaluate(c, s)
        if value > 0.0:
            low = s
        else:
            high = s
        # Halley's step, settled where the next change is below rounding
        step = s + _halley(value, first, second) if first != 0.0 else low
        change = abs(step - s)
        if low <= step <= high and change <= _SETTLED * step and change * abs(second) <= 10.0 * _SETTLED * abs(first):
            return step  # the error is of third order in this change: below rounding
        # outside the bracket: bisection
        if not (low < step < high):
            step = 0.5 * (low + high)
            if step <= low or step >= high:
                break
        s = step
    return s


@kernel
def first_exit(c):
    """First s in [0, 1] at which the gap sum c_j s^j turns negative; ``NEVER`` if it does not, or ``UNDECIDED``.

    A gap of zero or below at s = 0 (rounding) is an exit if it is closing, and counts as zero if it opens.
    """
    return exit_from(c, 0.0, c[0], c[1], 2.0 * c[2])


@kernel
def exit_from(c, low, gap, rate, curvature):
    """The first exit in [low, 1] from the value and two derivatives at low.

    The number of tests is bounded. At first the bound on the third derivative holds for the whole window; after
    ``_MANY_TRIALS`` tests, for the part up to the end of the tested interval, where high powers are small. If the gap
    stays zero to rounding, every undecided interval doubles the narrowest width, as long as the undecided difference is
    below the rounding of the gap. After ``_MOST_TRIALS`` tests the result is ``UNDECIDED``: with a NaN all comparisons
    are false, and the narrowest width would be tested all through the window.
    """
    # bound on the third derivative in the whole window
    third = 0.0
    for j in range(3, c.size):
        third += abs(c[j]) * _THIRD[j]
    width = 1.0
    narrowest = _NARROWEST
    trials = 0
    while True:
        # at or below the corner: an exit if the gap closes, else the gap counts as zero
        if gap <= 0.0:
            if rate < 0.0 or (rate == 0.0 and curvature < 0.0):
                return low
            gap = 0.0
        width = min(width, 1.0 - low)
        # halve the width until the interval is decided, left half first
        while True:
            trials += 1
            # after many tests: the third derivative is bounded up to the end of the tested interval
            if trials > _MANY_TRIALS:
                if trials > _MOST_TRIALS:
                    return UNDECIDED
                third = third_within(c, low + width)
            # open: the cubic minorant stays positive
            if stays_inside(gap, rate, curvature, third, width):
                narrowest = max(_NARROWEST, min(narrowest, 0.25 * width))
                break
            # the gap falls all the way: one root if it ends below zero, none if it ends above
            closing = max(rate, rate + curvature * width) + 0.5 * third * width * width < 0.0
            if closing:
                beyond, _first, _second = evaluate(c, low + width)
                if beyond <= 0.0:
                    return _bracketed_root(c, low, low + width, _guess(c, low, width, gap, rate, curvature))
                break
            # undecided and too narrow: a tangency within rounding
            if width < narrowest:
                if _is_rounding(c, third, 2.0 * narrowest):
                    narrowest *= 2.0
                break
            width *= 0.5
        # no exit up to here: go on from the end of the interval
        low += width
        if low >= 1.0:
            return NEVER
        width *= 2.0
        gap, rate, curvature = evaluate(c, low)
