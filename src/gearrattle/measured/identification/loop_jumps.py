"""The density of a break at which the torque jumps, where its slider is released and where it begins to stretch.

At a break b the torque on the way back jumps by what the slider carried, q; on the way out the slider stretches from b
to b + r, often within few samples. Both move over the samples one by one, so a curvature says nothing about them. Moved
to b', with residuals y and their sum of squares S,

    S(b') - S(b) = C (b' - b)^2 - 2 G (b' - b)
                   + sum over samples on the way back between b and b' of (y +- q)^2 - y^2
                   + sum over samples on the way out of (y - H (f(b') - f(b)))^2 - y^2,

    f = min(max(delta - b, 0) / r, 1),

C the curvature and -2 G the slope of S in b, without jump and stretch, when all other parameters give way. The samples
of the sums are few beside all, so what the others would gain by them is left out; after a break is moved, all is solved
again.

    density of b  ~  sum over the density of r of  exp(-(S(b') - S(b)) / (2 tau s^2)) / W(r),

W the integral over b' of the same without the jump, of which the density of r knows nothing, is the posterior with a
flat prior, the best estimate of the place of a jump (E. J. G. Pitman, Biometrika 30, 1939, pp. 391-421). Its quantiles
are exact intervals where a law is only shifted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.identification.loop_law import COAST, DRIVE, Regression, Solved, heights_of
from gearrattle.measured.identification.loop_linear import Linear, Normal
from gearrattle.measured.identification.loop_slopes import carried, slopes_in

Array = NDArray[np.float64]

_WIDE = 8.0  # half width of the search, in standard errors without the jump
_ROOM = 0.02  # largest half width of the search, as a share of the range
_PLACES = 400  # largest number of places that are tried
_FLAT = 1e-5  # share of the highest density: places with a lower density are left out
SHARES = (np.arange(7) + 0.5) / 7
"""Quantiles of the density of a reach at which the density of the break is computed."""


class _Near(NamedTuple):
    """What does not change while a break moves: where it is, S without jump and stretch, samples of both ways.

    Ways out and back have deflections counted outward, and residuals; the way back its jumps.
    """

    here: float
    curvature: float
    pull: float
    wide: float
    out: tuple[Array, Array]
    back: tuple[Array, Array, Array]
    height: float
    reach: float


def best_place(linear: Linear, solution: Solved, where: tuple[str, int]) -> float:
    """Return the magnitude of deflection at which a break fits best, all other parameters fitted again [rad]."""
    near = _near(linear, solution, *where)
    low = near.here - near.wide
    high = near.here + near.wide
    position = near.here
    for _ in range(3):
        places = _places(near, low, high)
        position = float(places[int(np.argmin(_raised(near, places, near.reach)))])
        narrow = 0.03 * (high - low)
        low = position - narrow
        high = position + narrow
    return position


def interval(linear: Linear, solution: Solved, where: tuple[str, int], variance: float, reaches: Array) -> Array:
    """Return both ends of the central 95 % interval of a break, and the standard deviation of its density [rad].

    Parameters
    ----------
    variance
        of the noise, times its autocorrelation time [(N m)^2].
    reaches
        of its slider, each as likely as the next; none: that of the law.
    """
    near = _near(linear, solution, *where)
    reaches = reaches if reaches.size else np.array([near.reach])
    low = near.here - near.wide
    high = near.here + near.wide
    places = _places(near, low, high)
    smooth = np.array([_logs(near, places, reach, variance, jumps=False) for reach in reaches])
    level = smooth.max(axis=1, keepdims=True)
    wholes = level[:, 0] + np.log(np.trapezoid(np.exp(smooth - level), places, axis=1))
    for _ in range(3):
        places = _places(near, low, high)
        logs = np.array([_logs(near, places, reach, variance) for reach in reaches]) - wholes[:, None]
        density = np.sum(np.exp(logs - logs.max()), axis=0)
        dense = np.flatnonzero(density > _FLAT * density.max())
        low = places[max(dense[0] - 1, 0)]
        high = places[min(dense[-1] + 1, places.size - 1)]
    ends = quantiles(places, density, np.array([0.025, 0.975]))
    share = _masses(places, density)
    middle = 0.5 * (places[1:] + places[:-1])
    return np.array([*ends, np.sqrt(share @ (middle - share @ middle) ** 2)])


def quantiles(places: Array, density: Array, shares: Array) -> Array:
    """Places up to which some shares of a density lie."""
    return np.interp(shares, np.concatenate([[0.0], np.cumsum(_masses(places, density))]), places)


def _masses(places: Array, density: Array) -> Array:
    """(K - 1,) shares of a density between neighbouring places."""
    masses = np.diff(places) * 0.5 * (density[1:] + density[:-1])
    return np.asarray(masses / masses.sum(), dtype=np.float64)


def _near(linear: Linear, solution: Solved, side: str, index: int) -> _Near:
    moments = linear.moments
    here = solution.shape.breaks(side)[index]
    loop = moments.loop
    low, high = loop.ends
    slider = (side, index + 1)
    height = heights_of(solution).get(slider, 0.0)
    first = len(solution.labels) + (index if side == DRIVE else len(solution.shape.drive) + index)
    own = np.array([label == ("slider", *slider) for label in solution.labels])
    bare = solution._replace(coefficients=np.where(own, 0.0, solution.coefficients))
    column = slopes_in(linear.loop, bare, ())[:, first - len(solution.labels)]
    curvature, pull = _yielding(linear.with_column(first, column).normal(), first)
    variance = moments.variance(solution)
    room = _ROOM * (high - low)
    wide = min(_WIDE * np.sqrt(variance / curvature) + abs(pull) / curvature if curvature > 0.0 else np.inf, room)
    reach = solution.shape.reach_of(slider, moments.reach)
    sign = -1.0 if side == COAST else 1.0
    parts = []
    for way in (1.0, -1.0):
        more = min(4.0 * reach, room) if way > 0.0 else 0.0
        part = moments.between(sign, way, here - wide, here + wide + more)
        residual = Regression(part, 0, moments.reach).residual(solution)
        parts.append((sign * part.deflection, residual, carried(part, solution, side, index)))
    return _Near(here, curvature, pull, wide, parts[0][:2], parts[1], sign * height, reach)


def _places(near: _Near, low: float, high: float) -> Array:
    """Places between two ends: between all samples if they are few, else at equal distances; and the present one."""
    back = near.back[0]
    inside = back[(back > low) & (back < high)]
    if inside.size > _PLACES:
        places = np.linspace(low, high, _PLACES)
    else:
        gaps = np.concatenate([[low], inside, [high]])
        inner = (np.arange(5) + 0.5) / 5 if inside.size < _PLACES // 5 else np.array([0.5])
        places = np.unique((gaps[:-1, None] + np.diff(gaps)[:, None] * inner).ravel())
        if places.size < _PLACES // 8:
            places = np.union1d(places, np.linspace(low, high, _PLACES // 8))
    return np.union1d(places, [near.here]) if low <= near.here <= high else places


def _logs(near: _Near, places: Array, reach: float, variance: float, *, jumps: bool = True) -> Array:
    """(K,) logarithm of the density of a place, given a reach, up to a constant."""
    return -0.5 / variance * _raised(near, places, reach, jumps=jumps)


def _raised(near: _Near, places: Array, reach: float, *, jumps: bool = True) -> Array:
    """(K,) sum of squares at some places, up to a constant; on request without the jump."""
    moved = places - near.here
    raised = near.curvature * moved**2 - 2.0 * near.pull * moved
    delta, residual, jump = near.back
    if jumps and delta.size and near.height != 0.0:
        cost = np.where(delta > near.here, (residual + jump) ** 2 - residual**2, residual**2 - (residual - jump) ** 2)
        total = np.concatenate([[0.0], np.cumsum(cost)])
        raised = raised + total[np.searchsorted(delta, places, "right")]
    delta, residual = near.out
    if delta.size and near.height != 0.0:
        now = near.height * np.clip((delta - near.here) / near.reach, 0.0, 1.0)
        law = near.height * np.clip((delta - places[:, None]) / reach, 0.0, 1.0)
        raised = raised + np.sum((residual + now - law) ** 2 - residual**2, axis=1)
    return np.asarray(raised, dtype=np.float64)


def _yielding(normal: Normal, first: int) -> tuple[float, float]:
    """Curvature C and pull G in one parameter with the others eliminated: Schur complement of the normal matrix."""
    others = normal.free
    if not others[first]:
        return 0.0, 0.0
    others[first] = False
    inner, size = normal.scaled(others)
    row = normal.matrix[first, others] / size
    solved = np.linalg.lstsq(inner, np.stack([row, normal.right[others] / size], axis=1), rcond=1e-12)[0]
    curvature, pull = np.array([normal.matrix[first, first], normal.right[first]]) - row @ solved
    return max(float(curvature), 0.0), float(pull) if curvature > 0.0 else 0.0
