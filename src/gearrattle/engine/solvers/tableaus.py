"""Explicit Runge-Kutta tableaus as data, each with its source.

a is strictly lower triangular (s, s), b the weights (s,), c the nodes; order conditions are checked in rational
arithmetic by the tests.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tableau:
    """An explicit Runge-Kutta method."""

    name: str
    order: int  # of the solution carried on
    # a, b: stages and weights
    a: tuple[tuple[Fraction, ...], ...]
    b: tuple[Fraction, ...]
    source: str  # where the numbers are printed
    # weights of the embedded solution whose distance estimates the error; empty: none
    estimator: tuple[Fraction, ...] = ()
    estimator_order: int = 0  # of that solution

    @property
    def c(self) -> tuple[Fraction, ...]:
        """Nodes: row sums of a."""
        return tuple(sum(row, Fraction(0)) for row in self.a)

    @property
    def error(self) -> Array:
        """(s,) weights of the error estimate; zeros if there is none."""
        if not self.estimator:
            return np.zeros(len(self.b))
        return np.array([float(x - y) for x, y in zip(self.b, self.estimator, strict=True)])

    def extrapolated(self) -> Tableau:
        """The same pair with its other solution carried on (local extrapolation, if that is the better one)."""
        return replace(self, order=self.estimator_order, b=self.estimator, estimator=self.b, estimator_order=self.order)

    def arrays(self) -> tuple[Array, Array, Array]:
        """a (s, s), b (s,), c (s,) as floats."""
        s = len(self.b)
        a = np.zeros((s, s))
        for i, row in enumerate(self.a):
            a[i, : len(row)] = [float(x) for x in row]
        return a, np.array([float(x) for x in self.b]), np.array([float(x) for x in self.c])

    @cached_property
    def stability_polynomial(self) -> Array:
        """(s + 1,) coefficients of R(z) = 1 + z b^T 1 + z^2 b^T a 1 + ..., highest power first."""
        coefficients = [Fraction(1)]
        powers = [Fraction(1)] * len(self.b)  # a^k 1
        for _ in self.b:
            coefficients.append(sum((x * y for x, y in zip(self.b, powers, strict=True)), Fraction(0)))
            powers = [sum((x * y for x, y in zip(row, powers, strict=False)), Fraction(0)) for row in self.a]
        return np.array([float(x) for x in reversed(coefficients)])

    def growth(self, z: NDArray[np.complex128]) -> Array:
        """|R(z)|, the factor a step multiplies a mode by; z = h lambda."""
        return np.asarray(np.abs(np.polyval(self.stability_polynomial, z)))


MIDPOINT = Tableau(
    "rk2",
    2,
    ((), (Fraction(1, 2),)),
    (Fraction(0), Fraction(1)),
    "C. Runge, Math. Ann. 46 (1895) 167: the midpoint rule",
)
CLASSICAL = Tableau(
    "rk4",
    4,
    ((), (Fraction(1, 2),), (Fraction(0), Fraction(1, 2)), (Fraction(0), Fraction(0), Fraction(1))),
    (Fraction(1, 6), Fraction(1, 3), Fraction(1, 3), Fraction(1, 6)),
    "W. Kutta, Z. Math. Phys. 46 (1901) 435: the classical method",
)


def _rows(*rows: str) -> tuple[tuple[Fraction, ...], ...]:
    return tuple(tuple(Fraction(entry) for entry in row.split()) for row in rows)


def _row(row: str) -> tuple[Fraction, ...]:
    return _rows(row)[0]


FEHLBERG = Tableau(
    "rkf",
    4,
    _rows(
        "",
        "1/4",
        "3/32 9/32",
        "1932/2197 -7200/2197 7296/2197",
        "439/216 -8 3680/513 -845/4104",
        "-8/27 2 -3544/2565 1859/4104 -11/40",
    ),
    _row("25/216 0 1408/2565 2197/4104 -1/5 0"),
    "E. Fehlberg, Computing 6 (1970) 61, table III; carried on with the fourth order, as in Padmanabhan et al. 1995",
    _row("16/135 0 6656/12825 28561/56430 -9/50 2/55"),
    5,
)
VERNER = Tableau(
    "rkv",
    5,
    _rows(
        "",
        "1/6",
        "4/75 16/75",
        "5/6 -8/3 5/2",
        "-165/64 55/6 -425/64 85/96",
        "12/5 -8 4015/612 -11/36 88/255",
        "-8263/15000 124/75 -643/680 -81/250 2484/10625 0",
        "3501/1720 -300/43 297275/52632 -319/2322 24068/84065 0 3850/26703",
    ),
    _row("13/160 0 2375/5984 5/16 12/85 3/44 0 0"),
    "J. H. Verner, SIAM J. Numer. Anal. 15 (1978) 772, as in T. E. Hull, W. H. Enright, K. R. Jackson, DVERK (Toronto "
    "1976); carried on with the fifth order, as in Padmanabhan et al. 1995",
    _row("3/40 0 875/2244 23/72 264/1955 0 125/11592 43/616"),
    6,
)
