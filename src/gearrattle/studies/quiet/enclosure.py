"""Linear equations whose coefficients lie in a box: the solution at the centre, its slopes, a bound on the rest.

    U diag(m) (V x - s) + C x = U g,        v = V x - s

m, s and g are forms over a box; U, V and C are constant in it. The unknowns v are the quantities that the factors m act
on (rates of bodies, deflections of elements). With A = U m_0 V + C, R = V A^-1 U, and delta for a difference from the
centre,

    delta v = R (delta g - delta m (v_0 + delta v) + m_0 delta s) - delta s.

First order in the parameters gives the slopes v_j. What they leave out, r, obeys

    |r| <= a + B |r|,    B = |R| diag(|delta m|),
    a = |R| (rest_g + rest_m |v_0| + |delta m| sum_j |v_j|) + |R m_0 - 1| rest_s,

so that |r| <= (1 - B)^-1 a if the spectral radius of B is below one; then A is regular in the whole box as well
(A. Neumaier, Interval Methods for Systems of Equations, 1990, sec. 4.1). As B is not negative, one vector w > 0 with
(1 - B) w > 0 shows it. Factors act on deflections, not on differences of angles: a stiff element between heavy bodies
costs no digits.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.studies.quiet.taylor_forms import Array, Form, Matrix

_ALLOWED = 1e-9  # of all moduli, for rounding
_SMALL = 0.01  # largest |1 - A^-1 A|, by rounding
_SURE = 1.0 - 1e-6


class Frame(NamedTuple):
    """U (N, M), V (M, N) and C (N, N)."""

    spread: Array
    view: Array
    constant: Array


def centre_of(frame: Frame, factor: Matrix, drive: Matrix, shift: Matrix) -> Matrix | None:
    """Return v (M,) at the centre alone; None where the equations are singular."""
    matrix = (frame.spread * factor) @ frame.view + frame.constant
    try:
        return np.asarray(frame.view @ np.linalg.solve(matrix, frame.spread @ (drive + factor * shift)) - shift)
    except np.linalg.LinAlgError:
        return None


def enclose(frame: Frame, factor: Form, drive: Form, shift: Form) -> tuple[Form | None, Array]:
    """Solve S sets of equations over a box.

    Parameters
    ----------
    frame
        what holds in all of the box, and for all sets.
    factor, drive, shift
        m, g and s, (S, M) each.

    Returns
    -------
    tuple[Form | None, Array]
        v (S, M); None where the box is too large. And (d,) how strongly each parameter bends it.
    """
    # A and its inverse at the centre
    spread, view, constant = frame
    matrix = (spread * factor.value[:, None, :]) @ view + constant
    try:
        inverse = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return None, np.ones(len(factor.slopes))
    # the centre, once refined
    x = _times(inverse, (drive.value + factor.value * shift.value) @ spread.T)
    left = (drive.value - factor.value * (x @ view.T - shift.value)) @ spread.T - x @ constant.T
    x = x + _times(inverse, left)
    value = x @ view.T - shift.value
    response = view @ inverse @ spread
    # slopes
    pushes = drive.slopes + factor.value * shift.slopes - factor.slopes * value
    slopes = _times(response, pushes) - shift.slopes
    # the rest; what rounding leaves open of the inverse counts twice, for all its powers
    error = np.eye(matrix.shape[1]) - inverse @ matrix
    unsure = 2.0 * np.abs(view @ (error @ inverse) @ spread)
    size = np.abs(response) + unsure
    known = np.abs(value)
    moves = factor.span + factor.rest
    change = np.abs(slopes).sum(axis=0)
    bent = _largest_ratio(_times(size, np.abs(factor.slopes) * known), known)
    if not (np.isfinite(value).all() and _is_small(error, inverse)):
        return None, bent
    apart = _times(size, drive.rest + factor.rest * known + moves * change)
    apart += _times(unsure, np.abs(pushes).sum(axis=0))
    if shift.rest.any():
        apart += _times(np.abs(response * factor.value[:, None, :] - np.eye(view.shape[0])), shift.rest)
    apart += _ALLOWED * (known + change) + 1e-300
    rest = _bound(size * moves[:, None, :], apart)
    return None if rest is None else Form(value, slopes, rest), bent


def _times(matrices: Matrix, vectors: Matrix) -> Matrix:
    """(..., S, p) products of (S, p, m) matrices with (..., S, m) vectors."""
    return np.asarray((matrices @ vectors[..., None])[..., 0])


def _largest_ratio(changed: Array, size: Array) -> Array:
    """(d,) the largest of changes (d, S, M) against sizes (S, M), those that are nearly zero left out."""
    is_known = size > 1e-9 * size.max(axis=1, keepdims=True, initial=0.0)
    ratio = np.where(is_known, changed, 0.0) / np.where(is_known, size, 1.0)
    return np.asarray(ratio.max(axis=(1, 2), initial=0.0))


def _is_small(error: Matrix, inverse: Matrix) -> bool:
    """Whether 1 - A^-1 A is small, in units in which the diagonals of the inverses are one."""
    scale = np.sqrt(np.abs(np.diagonal(inverse, axis1=1, axis2=2)))
    scale = np.where(scale == 0.0, 1.0, scale)
    scaled = np.abs(error) * scale[:, None, :] / scale[:, :, None]
    return bool(scaled.sum(axis=2).max(initial=0.0) <= _SMALL)


def _bound(growth: Array, apart: Array) -> Array | None:
    """(S, M) the bounds (1 - B)^-1 a; None where the spectral radius of a B is not known to be below one."""
    try:
        bound = np.linalg.solve(np.eye(growth.shape[1]) - growth, apart[..., None])[..., 0]
    except np.linalg.LinAlgError:
        return None
    if not (np.isfinite(bound).all() and (bound > 0.0).all()):
        return None
    if not (bound - _times(growth, bound) >= _SURE * apart).all():
        return None
    return np.asarray(bound / _SURE)
