"""Numbers over a box of parameters: a value at the centre, slopes, and a bound on the remainder.

    x(t) = x_0 + sum_j t_j x_j + rest,     |t_j| <= 1,   |rest| <= r

holds for every point t of the box. Sums and products of such forms are forms again; the slopes of a product are exact,
and all of second order goes into its rest (first-order Taylor models: M. Berz, K. Makino 1998, Reliable Computing 4,
361-369). Coefficients of a driveline depend on their parameters by polynomials of second degree, whose forms over any
box are written down without a loss.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Matrix = NDArray[Any]
"""Real or complex."""


class Form(NamedTuple):
    """Numbers (...) over a box of d parameters, real or complex.

    Attributes
    ----------
    value
        (...) at the centre.
    slopes
        (d, ...) change from the centre to the box's end, a parameter each.
    rest
        (...) bound on the modulus of what is left out.
    """

    value: Matrix
    slopes: Matrix
    rest: Array

    @property
    def span(self) -> Array:
        """(...) how far the numbers may be from those at the centre, the rest not included."""
        return np.asarray(np.abs(self.slopes).sum(axis=0))

    def plus(self, other: Form, factor: complex = 1.0) -> Form:
        """Return the sum with a multiple of another form."""
        return Form(
            self.value + factor * other.value,
            self.slopes + factor * other.slopes,
            self.rest + abs(factor) * other.rest,
        )

    def times(self, other: Form) -> Form:
        """Return the product, number by number."""
        here = self.span
        there = other.span
        return Form(
            self.value * other.value,
            self.value * other.slopes + self.slopes * other.value,
            (np.abs(self.value) + here) * other.rest
            + (np.abs(other.value) + there) * self.rest
            + self.rest * other.rest
            + here * there,
        )

    def scaled(self, factor: complex | Matrix) -> Form:
        """Return the product with numbers without uncertainty."""
        return Form(factor * self.value, factor * self.slopes, np.abs(factor) * self.rest)

    def at(self, index: NDArray[np.int64]) -> Form:
        """Return the form of numbers by their index in the last axis."""
        return Form(self.value[..., index], self.slopes[..., index], self.rest[..., index])

    def part(self, block: slice) -> Form:
        """Return the form of a block of numbers (L,)."""
        return Form(self.value[block], self.slopes[:, block], self.rest[block])

    def rows(self, count: int) -> Form:
        """Return numbers (count * m,) as (count, m), row by row."""
        shape = (count, -1)
        return Form(self.value.reshape(shape), self.slopes.reshape(len(self.slopes), *shape), self.rest.reshape(shape))


def joined(*forms: Form) -> Form:
    """Return numbers one after the other along the last axis."""
    return Form(
        np.concatenate([form.value for form in forms], axis=-1),
        np.concatenate([form.slopes for form in forms], axis=-1),
        np.concatenate([form.rest for form in forms], axis=-1),
    )


def zeros(count: int, *shape: int) -> Form:
    """Return zeros over a box of so many parameters."""
    return Form(np.zeros(shape), np.zeros((count, *shape)), np.zeros(shape))


class Quadratic(NamedTuple):
    """Numbers (L,) as polynomials of second degree of d parameters in [-1, 1].

    Attributes
    ----------
    value
        (L,) at the centre.
    linear
        (d, L).
    square
        (d, d, L), symmetric; numbers are value + t . linear + t . square . t.
    """

    value: Array
    linear: Array
    square: Array

    def at(self, point: Array) -> Array:
        """Return the numbers at a point (d,)."""
        bent = np.einsum("i,ijl,j->l", point, self.square, point)
        return np.asarray(self.value + point @ self.linear + bent)

    def over(self, centre: Array, radius: Array) -> Form:
        """Return the form of the numbers over the box with this centre (d,) and radius (d,)."""
        tilt = np.einsum("ijl,j->il", self.square, centre)
        rest = np.einsum("i,ijl,j->l", radius, np.abs(self.square), radius)
        return Form(self.at(centre), radius[:, None] * (self.linear + 2.0 * tilt), rest)
