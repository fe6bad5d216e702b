"""Local minima of the least-squares problem, from many starts.

Each start runs a trust-region method with bounds (Branch, Coleman and Li, SIAM J. Sci. Comput. 21 (1999) 1, in SciPy)
on the logarithms of the parameters. The first start is the model given, the others a Latin hypercube in the bounds
(McKay, Beckman and Conover, Technometrics 21 (1979) 239; ``scipy.stats.qmc``) with a seed of its own. Directions no
datum notices stay at the start's values: they are projected out of every start and of every minimum.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ConvergenceError
from gearrattle.measured.identification.identifiability import gain, null_space, split

Array = NDArray[np.float64]
Residuals = Callable[[Array], tuple[Array, Array]]

_BLUNT = 0.1  # change of a logarithm that counts as a standard error of a blunted datum
_SAME = 1e-3  # of a logarithm, or a tenth of its standard error: closer minima are one
_EDGE = 1e-6  # of the width of a bound: closer is on it
_NEAR = 1e-3  # of the width of a bound: closer and pressing outward is taken for on it
_LEVEL = 1e-9  # relative change of chi-square that projection may make


@dataclass(frozen=True)
class Effort:
    """Limits of a local search.

    Attributes
    ----------
    evaluations
        of residuals and Jacobian, at most, on each of its two ways.
    tolerance
        relative change of chi-square and of the parameters that ends it.
    roughly
        the same on the first way, that with blunted data; None: the second way alone.
    settles
        whether a search that uses up its evaluations has failed; residuals that jump let none settle.
    """

    evaluations: int
    tolerance: float
    roughly: float | None
    settles: bool = True


EXACT = Effort(1500, 1e-15, 1e-6)
"""For residuals whose Jacobian is exact."""


@dataclass(frozen=True)
class Minimum:
    """A local minimum.

    Attributes
    ----------
    x
        (P,) logarithms of the parameters over their start.
    at_bound
        (P,) -1 at the lower bound, +1 at the upper, 0 inside.
    """

    x: Array
    chi_square: float
    times: int
    at_bound: NDArray[np.int64]


def search(
    residuals: Residuals,
    points: Sequence[Array],
    box: tuple[Array, Array],
    effort: Effort = EXACT,
    progress: Callable[[float], None] | None = None,
) -> tuple[tuple[Minimum, ...], int]:
    """Find distinct local minima.

    Parameters
    ----------
    residuals
        x to (N,) residuals and (N, P) Jacobian.
    points
        (P,) where the searches start.
    box
        (P,) lowest and highest x.

    Raises
    ------
    ConvergenceError
        no start converged.
    """
    optima: list[tuple[Array, float, Array]] = []
    for k, point in enumerate(points):
        ended = local(watched(residuals, progress, k / len(points)), point, box, effort, rough=True)
        if ended is not None:
            optima.append(_settled(residuals, ended, box))
    if progress is not None:
        progress(1.0)
    if not optima:
        raise ConvergenceError(
            f"none of {len(points)} starts converged in {effort.evaluations} evaluations",
            remedy="more starts, narrower bounds, or a prior",
        )
    return _distinct(optima, box), len(points) - len(optima)


def starts(residuals: Residuals, box: tuple[Array, Array], count: int, seed: int) -> list[Array]:
    """Return the model itself, then a Latin hypercube in the bounds, both without directions that change no datum.

    The bounds are (P,) lowest and highest x.
    """
    origin = np.zeros(box[0].size)
    null = split(residuals, origin, null_space(residuals(origin)[1])).exact
    return [np.clip(x - null @ (null.T @ x), *box) for x in spread_out(box, count, seed)]


def spread_out(box: tuple[Array, Array], count: int, seed: int) -> list[Array]:
    """Return zero, then a Latin hypercube of ``count`` - 1 points in the bounds."""
    low, high = box
    points = [np.zeros(low.size)]
    if count > 1:
        points += list(low + latin_hypercube(count - 1, low.size, seed) * (high - low))
    return points


def latin_hypercube(count: int, dimension: int, seed: int) -> Array:
    """(count, dimension) points within 0 ... 1."""
    from scipy.stats import qmc

    return np.asarray(qmc.LatinHypercube(dimension, rng=np.random.default_rng(seed)).random(count))


def local(
    residuals: Residuals, start: Array, box: tuple[Array, Array], effort: Effort = EXACT, rough: bool = False
) -> Array | None:
    """(P,) where a local search from a start ends; None if it does not converge.

    From a rough start the way is walked twice: first with every datum's weight cut so that a tenth in the parameters is
    worth about a standard error, so that sharp data do not carve valleys too narrow to follow; then as it is.
    """
    inside = np.clip(start, *_inside(box))
    try:
        if rough and effort.roughly is not None:
            length = np.linalg.norm(residuals(inside)[1], axis=1)
            weight = 1.0 / np.maximum(1.0, _BLUNT * length)
            roughly = replace(effort, tolerance=effort.roughly)
            inside = np.clip(_descend(_weighted(residuals, weight), inside, box, roughly).x, *_inside(box))
        ended = _descend(residuals, inside, box, effort)
        return _pinned(residuals, np.asarray(ended.x), box, effort, bool(ended.status > 0) or not effort.settles)
    except (np.linalg.LinAlgError, ConvergenceError):
        return None


def _pinned(residuals: Residuals, x: Array, box: tuple[Array, Array], effort: Effort, converged: bool) -> Array | None:
    """Put parameters that press against a bound onto it and settle the others: the method alone is slow there."""
    # parameters that the gradient presses against a bound
    rows, jacobian = residuals(x)
    gradient = jacobian.T @ rows
    near = _NEAR * (box[1] - box[0])
    low = (x <= box[0] + near) & (gradient > 0.0)
    high = (x >= box[1] - near) & (gradient < 0.0)
    held = low | high
    # search the others with these on their bounds
    if held.any():
        whole = np.where(low, box[0], np.where(high, box[1], x))
        if not held.all():
            part = box[0][~held], box[1][~held]
            ended = _descend(of_free(residuals, whole, ~held), np.clip(x[~held], *_inside(part)), part, effort)
            whole[~held] = ended.x
            converged = bool(ended.status > 0)
        # keep the point if it fits no worse and the bounds still hold
        there = residuals(whole)
        push = there[1].T @ there[0]
        if there[0] @ there[0] <= (rows @ rows) * (1.0 + _LEVEL) and np.all(push[low] >= 0) and np.all(push[high] <= 0):
            x = whole
            (rows, jacobian) = there
    inside = (x > box[0]) & (x < box[1])
    return x if converged or _flat(rows, jacobian[:, inside]) else None


def _descend(residuals: Residuals, start: Array, box: tuple[Array, Array], effort: Effort) -> Any:
    """Return the result of SciPy's trust-region method."""
    from scipy.optimize import least_squares

    kept: list[tuple[bytes, Array, Array]] = []

    def both(x: Array) -> tuple[Array, Array]:
        if not kept or kept[0][0] != x.tobytes():
            kept[:] = [(x.tobytes(), *residuals(x))]
        return kept[0][1], kept[0][2]

    return least_squares(
        lambda x: both(x)[0],
        start,
        lambda x: both(x)[1],
        box,
        "trf",
        ftol=effort.tolerance,
        xtol=effort.tolerance,
        gtol=effort.tolerance,
        max_nfev=effort.evaluations,
    )


def _weighted(residuals: Residuals, weight: Array) -> Residuals:
    def scaled(x: Array) -> tuple[Array, Array]:
        rows, jacobian = residuals(x)
        return rows * weight, jacobian * weight[:, None]

    return scaled


def _inside(box: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return bounds that the method takes as interior."""
    margin = 1e-10 * (box[1] - box[0])
    return box[0] + margin, box[1] - margin


def _flat(rows: Array, jacobian: Array) -> bool:
    """Whether a Gauss-Newton step gains next to nothing: rounding may keep a search from its own criteria."""
    if not jacobian.shape[1]:
        return True
    gain = jacobian @ np.linalg.lstsq(jacobian, rows, rcond=1e-12)[0]
    return bool(gain @ gain <= 1e-8 * (rows @ rows) or gain @ gain <= 1e-16 * rows.size)


def of_free(residuals: Residuals, x: Array, free: NDArray[np.bool_]) -> Residuals:
    """Return residuals as a function of the (F,) free parameters, the others as in x."""

    def reduced(y: Array) -> tuple[Array, Array]:
        whole = x.copy()
        whole[free] = y
        rows, jacobian = residuals(whole)
        return rows, jacobian[:, free]

    return reduced


def watched(residuals: Residuals, progress: Callable[[float], None] | None, share: float) -> Residuals:
    """Return residuals that report progress at every evaluation."""
    if progress is None:
        return residuals

    def best_known(x: Array) -> tuple[Array, Array]:
        progress(share)
        return residuals(x)

    return best_known


def _settled(residuals: Residuals, x: Array, box: tuple[Array, Array]) -> tuple[Array, float, Array]:
    """Project unnoticed directions out of a minimum where allowed; return it, chi-square, standard errors."""
    rows, jacobian = residuals(x)
    null = split(residuals, x, null_space(jacobian)).exact
    moved = x - null @ (null.T @ x)
    if null.shape[1] and np.all(moved >= box[0]) and np.all(moved <= box[1]):
        there = residuals(moved)
        if there[0] @ there[0] <= (rows @ rows) * (1.0 + _LEVEL) + _LEVEL**2:
            x = moved
            (rows, jacobian) = there
    return x, float(rows @ rows), np.linalg.norm(gain(jacobian), axis=1)


def _distinct(optima: list[tuple[Array, float, Array]], box: tuple[Array, Array]) -> tuple[Minimum, ...]:
    """Merge equal minima."""
    groups: list[tuple[Array, float, Array, int]] = []
    for x, chi, spread in sorted(optima, key=lambda item: item[1]):
        for k, (y, best, error, times) in enumerate(groups):
            if np.all(np.abs(x - y) <= np.maximum(_SAME, 0.1 * error)) and chi - best <= 0.01 * (1.0 + best):
                groups[k] = y, best, error, times + 1
                break
        else:
            groups.append((x, chi, spread, 1))
    return tuple(Minimum(x, chi, times, at_bounds(x, box)) for x, chi, _, times in groups)


def at_bounds(x: Array, box: tuple[Array, Array]) -> NDArray[np.int64]:
    """(P,) -1 at the lower bound, +1 at the upper, 0 inside."""
    low, high = box
    edge = _EDGE * (high - low)
    return np.where(x <= low + edge, -1, np.where(x >= high - edge, 1, 0)).astype(np.int64)
