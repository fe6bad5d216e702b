"""Identifiability: combinations of parameters that the data do not determine.

At the solution the residuals change with the logarithms of the parameters as J dx. Its null space is found from rows of
unit length, so it does not depend on the standard errors, and is split by comparing it with those at other points:

exact
    directions in the null space everywhere: p -> p s^n changes no datum, whatever s. Frequencies and shapes alone
    always have one: all inertias and stiffnesses times the same factor. A basis with many zeros (reduced row echelon
    form) puts them in words.
curved
    directions of a null space that keeps its dimension nearby: the parameters may move unnoticed along a curve, as
    with fewer data than parameters. Exact and curved ones are *structural*.
first order
    null directions that are gone nearby: where two modes have the same frequency, or a derivative happens to vanish.
weak
    directions v of the singular value decomposition J = U diag(s) V^T whose standard error 1/s exceeds ``WEAK``: the
    data bound them, but not to within a factor of e.

The covariance of the others is (J^T J)^+ = J^+ J^+^T (Bard, Nonlinear Parameter Estimation, 1974, ch. 7); a parameter
with a part in a structural direction has no standard error.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WEAK = 1.0
"""Standard error of a logarithm from which a direction counts as weak: a factor of e."""
RANK = 1e-9
"""Singular values of the Jacobian with unit rows below this part of the largest are zero."""

_SHOWN = 0.1
_WHOLE = 1e-5
_HARDLY = 1e3
_POINTS = 3
_FAR = 0.2  # step of logarithms to points that tell exact directions from curved ones
_NEARBY = 1e-4
_MOST = 5


@dataclass(frozen=True)
class Combination:
    """A combination of parameters that the data leave open.

    Attributes
    ----------
    exponents
        by path: with any factor s, each parameter times s**exponent; the largest is 1.
    structural
        no datum notices it at all; else the data bound it, weakly.
    factor
        the standard error of s as a factor: it is known to within times or divided by this; inf if structural
        or not noticed to first order.
    words
        the same in a sentence.
    """

    exponents: Mapping[str, float]
    structural: bool
    factor: float
    words: str


def null_space(jacobian: Array) -> Array:
    """(P, q) an orthonormal basis of the directions that change no row of a Jacobian (N, P)."""
    length = np.linalg.norm(jacobian, axis=1)
    rows = jacobian[length > 0.0] / length[length > 0.0][:, None]
    if not len(rows):
        return np.eye(jacobian.shape[1])
    values, vectors = np.linalg.svd(rows, full_matrices=True)[1:]
    rank = int(np.count_nonzero(values > RANK * values[0]))
    return np.asarray(vectors[rank:].T)


def gain(jacobian: Array) -> Array:
    """(P, N) change of the least-squares estimate with the residuals: J^+, none in directions without information."""
    null = null_space(jacobian)
    count, dimension = null.shape
    kept = np.linalg.svd(null, full_matrices=True)[0][:, dimension:] if dimension else np.eye(count)
    return np.asarray(kept @ np.linalg.pinv(jacobian @ kept))


class Open(NamedTuple):
    """A null space (P, q) split in three, each (P, .) with orthonormal columns."""

    exact: Array
    curved: Array
    first_order: Array


def split(residuals: Callable[[Array], tuple[Array, Array]], x: Array, null: Array) -> Open:
    """Split a null space: directions that hold everywhere, nearby, and at x only.

    Parameters
    ----------
    residuals
        x to residuals and Jacobian.
    x
        (P,) where the null space was found.
    null
        (P, q).
    """
    count, dimension = null.shape
    if not dimension:
        return Open(null, null, null)
    steps = np.random.default_rng(0).standard_normal((_POINTS + 1, count))
    far = [residuals(x + _FAR * step)[1] for step in steps[1:]]
    exact = null_space(np.vstack([residuals(x)[1], *far]))
    near = null_space(residuals(x + _NEARBY * steps[0])[1])
    rest = np.linalg.svd(null - exact @ (exact.T @ null))[0][:, : dimension - exact.shape[1]]
    seen = np.linalg.svd(rest.T @ near)[0]
    curved = max(0, min(near.shape[1], dimension) - exact.shape[1])
    return Open(exact, rest @ seen[:, :curved], rest @ seen[:, curved:])


def undetermined(paths: Sequence[str], jacobian: Array, null: Open, scale: float) -> tuple[Combination, ...]:
    """Put open directions of a Jacobian (N, P), in standard errors, in words, structural ones first."""
    combinations = [_structural(paths, row) for row in _echelon(null.exact.T)]
    combinations += [_curved(paths, row, True) for row in _echelon(null.curved.T)]
    combinations += [_curved(paths, row, False) for row in _echelon(null.first_order.T)]
    whole = np.hstack(null)
    count = len(paths)
    kept = np.linalg.svd(whole, full_matrices=True)[0][:, whole.shape[1] :] if whole.shape[1] else np.eye(count)
    if kept.shape[1]:
        values, vectors = np.linalg.svd(jacobian @ kept, full_matrices=False)[1:]
        for value, direction in zip(values[::-1], vectors[::-1] @ kept.T, strict=True):
            spread = scale / value
            if spread > WEAK:
                combinations.append(_weak(paths, direction, spread))
    return tuple(combinations)


def _echelon(rows: Array) -> Array:
    """Return the reduced row echelon form, pivots by size: the same span with many zeros."""
    work = rows.copy()
    for done in range(len(work)):
        rest = np.abs(work[done:])
        row, column = divmod(int(np.argmax(rest)), rest.shape[1])
        work[[done, done + row]] = work[[done + row, done]]
        work[done] /= work[done, column]
        for other in range(len(work)):
            if other != done:
                work[other] -= work[other, column] * work[done]
        work[np.abs(work) < _WHOLE] = 0.0
    return work


def _structural(paths: Sequence[str], row: Array) -> Combination:
    largest = row[int(np.argmax(np.abs(row) > np.abs(row).max() - _WHOLE))]
    exponents = {path: _neat(value / largest) for path, value in zip(paths, row.tolist(), strict=True) if value}
    return Combination(exponents, True, float("inf"), _words(exponents, paths))


def _curved(paths: Sequence[str], row: Array, structural: bool) -> Combination:
    """Return in words where an open direction holds: along a curve, or at this point alone."""
    row = row / row[int(np.argmax(np.abs(row)))]
    exponents = {path: value for path, value in zip(paths, row.tolist(), strict=True) if abs(value) > _WHOLE}
    names = _powers(exponents)
    if structural and len(exponents) == 1:
        words = f"{next(iter(exponents))}: no datum depends on it near this value"
    elif structural:
        words = f"multiplying {names} changes nothing as long as s is near 1, and more as others follow"
    else:
        words = f"multiplying {names} is not noticed to first order; a larger change is"
    return Combination(exponents, structural, float("inf"), words)


def _powers(exponents: Mapping[str, float]) -> str:
    """Name parameters with their powers, the largest first, not too many."""
    first = sorted(exponents.items(), key=lambda item: -abs(item[1]))
    rest = len(first) - _MOST
    names = ", ".join(f"{path} by s^{value:.2g}" for path, value in first[:_MOST])
    return names + (f" and {rest} other{'s' if rest > 1 else ''} by powers of s" if rest > 0 else "")


def _neat(value: float) -> float:
    """Return a simple fraction if the value is one within its accuracy."""
    for denominator in (1, 2, 3, 4):
        near = round(value * denominator) / denominator
        if abs(value - near) < _WHOLE:
            return near
    return value


def _words(exponents: Mapping[str, float], paths: Sequence[str]) -> str:
    """Return in words the change that no datum shows."""
    if len(exponents) == 1:
        return f"{next(iter(exponents))}: no datum depends on it"
    up = [path for path, value in exponents.items() if value == 1.0]
    down = [path for path, value in exponents.items() if value == -1.0]
    if len(up) + len(down) < len(exponents):
        product = ", ".join(f"{path} by s^{value:.4g}" for path, value in exponents.items())
        return f"multiplying {product}, with any s, changes nothing"
    if not down:
        return f"multiplying {_listed(up, paths)} by the same factor changes nothing: only their ratios are determined"
    return (
        f"multiplying {_listed(up, paths)} by a factor and dividing {_listed(down, paths)} by it changes nothing: "
        "only their products are determined"
    )


def _listed(chosen: Sequence[str], paths: Sequence[str]) -> str:
    """Join paths; where all free paths of a kind are meant, the kind is named once."""
    words: dict[str, None] = {}
    for path in chosen:
        kind = _kind(path)
        alike = [other for other in paths if _kind(other) == kind]
        words[f"all {kind} that are free" if len(alike) > 1 and set(alike) <= set(chosen) else path] = None
    *most, last = words
    return f"{', '.join(most)} and {last}" if most else last


def _kind(path: str) -> str:
    """Return ``coupling.*.stiffness`` for ``coupling.clutch.stiffness``."""
    head, _, *tail = path.split(".")
    return ".".join([head, "*", *tail])


def _weak(paths: Sequence[str], direction: Array, spread: float) -> Combination:
    direction = direction / direction[int(np.argmax(np.abs(direction)))]
    spread = spread / float(np.linalg.norm(direction))
    exponents = {p: v for p, v in zip(paths, direction.tolist(), strict=True) if abs(v) >= _SHOWN}
    factor = float(np.exp(min(spread, 700.0)))
    known = f"known only to within a factor of {factor:.3g}" if factor < _HARDLY else "hardly known at all"
    if len(exponents) == 1:
        return Combination(exponents, False, factor, f"{next(iter(exponents))} is {known}")
    return Combination(
        exponents, False, factor, f"the data hardly notice multiplying {_powers(exponents)}: s is {known}"
    )
