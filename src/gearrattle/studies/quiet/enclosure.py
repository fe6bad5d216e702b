"""Linear equations whose coefficients lie in a box: the solution at the centre, its slopes, a bound on the rest.

    U diag(m) (V x - s) + C x = U g,        v = V x - s

m, s and g are forms over a box; U, V and C hold in all of it. v are what the factors m act on (rates of bodies,
deflections of elements): it alone is asked for. With A = U m_0 V + C, R = V A^-1 U, and delta for a difference from the
centre,

    delta v = R (delta g - delta m (v_0 + delta v) + m_0 delta s) - delta s.

First order in the parameters gives the slopes v_j. What they leave out, r, obeys

    |r| <= a + B |r|,    B = |R| diag(|delta m|),
    a = |R| (rest_g + rest_m |v_0| + |delta m| sum_j |v_j|) + |R m_0 - 1| rest_s,

so that |r| <= (1 - B)^-1 a if the spectral radius of B is below one; then A is regular in the whole box as well
(A. Neumaier, Interval Methods for Systems of Equations, 1990, sec. 4.1). As B is not negative, one vector w > 0 with
(1 - B) w > 0 shows it. Factors act on deflections, not on differences of angles: a stiff element between heavy bodies
costs no digits.

Takes forms and matrices; gives a form, and what every parameter adds to B.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.studies.quiet.forms import Array, Form

Matrix = NDArray[np.generic]

_ALLOWED = 1e-9  # of all moduli, for rounding
_REGULAR = 1e-6  # largest |1 - A^-1 A|, by rounding


class Frame(NamedTuple):
    """U (N, M), V (M, N) and C (N, N)."""

    spread: Array
    view: Array
    constant: Array


@dataclass(frozen=True)
class Solution:
    """The solution of equations over a box.

    Attributes
    ----------
    view
        v (M,).
    bent
        (d,) how strongly each parameter bends it: its part in the rest.
    """

    view: Form
    bent: Array


def centre_of(frame: Frame, factor: Matrix, drive: Matrix, shift: Matrix) -> NDArray[np.generic] | None:
    """Return v at the centre alone; None where the equations are singular."""
    matrix = (frame.spread * factor) @ frame.view + frame.constant
    try:
        return np.asarray(frame.view @ np.linalg.solve(matrix, frame.spread @ (drive + factor * shift)) - shift)
    except np.linalg.LinAlgError:
        return None


def enclose(frame: Frame, factor: Form, drive: Form, shift: Form) -> tuple[Solution | None, Array]:
    """Solve the equations over a box.

    Parameters
    ----------
    frame
        what holds in all of the box.
    factor, drive, shift
        m, g and s, (M,) each.

    Returns
    -------
    tuple[Solution | None, Array]
        The solution; None where the box is too large. And (d,) how strongly each parameter bends it, to first order.
    """
    count = len(factor.slopes)
    spread, view, constant = frame
    matrix = (spread * factor.value) @ view + constant
    try:
        inverse = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return None, np.ones(count)
    # the centre, once refined
    x = inverse @ (spread @ (drive.value + factor.value * shift.value))
    left = spread @ (drive.value - factor.value * (view @ x - shift.value)) - constant @ x
    x = x + inverse @ left
    value = view @ x - shift.value
    response = view @ inverse @ spread
    # slopes
    pushes = drive.slopes + factor.value * shift.slopes - factor.slopes * value
    slopes = pushes @ response.T - shift.slopes
    # the rest
    size = np.abs(response)
    moves = factor.span + factor.rest
    change = np.abs(slopes).sum(axis=0)
    bent = np.array([_ratio(size @ (np.abs(part) * np.abs(value)), np.abs(value)) for part in factor.slopes])
    if not (np.isfinite(value).all() and _is_regular(inverse, matrix)):
        return None, bent
    other = np.abs(response * factor.value - np.eye(len(value)))
    apart = size @ (drive.rest + factor.rest * np.abs(value) + moves * change) + other @ shift.rest
    apart += _ALLOWED * (np.abs(value) + change) + 1e-300
    rest = _bound(size * moves, apart)
    if rest is None:
        return None, bent
    return Solution(Form(value, slopes, rest), bent), bent


def _ratio(changed: Array, size: Array) -> float:
    """The largest of some changes against their sizes, those that are nearly zero left out."""
    known = size > 1e-9 * size.max(initial=0.0)
    return float((changed[known] / size[known]).max(initial=0.0))


def _is_regular(inverse: Matrix, matrix: Matrix) -> bool:
    """Whether rounding leaves the inverse one, in units in which its diagonal is one."""
    scale = np.sqrt(np.abs(np.diag(inverse)))
    scale[scale == 0.0] = 1.0
    off = np.abs(np.eye(len(matrix)) - inverse @ matrix) * scale / scale[:, None]
    return bool(off.sum(axis=1).max(initial=0.0) <= _REGULAR)


def _bound(growth: Array, apart: Array) -> Array | None:
    """(M,) the bound (1 - B)^-1 a; None where the spectral radius of B is not known to be below one."""
    try:
        bound = np.linalg.solve(np.eye(len(apart)) - growth, apart)
    except np.linalg.LinAlgError:
        return None
    if not (np.isfinite(bound).all() and (bound > 0.0).all()):
        return None
    left = bound - growth @ bound
    if not (left >= (1.0 - _REGULAR) * apart).all():
        return None
    return np.asarray(bound / (1.0 - _REGULAR))
