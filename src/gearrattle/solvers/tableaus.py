"""Explicit Runge-Kutta tableaus as data, each with its source.

a is strictly lower triangular (s, s), b the weights (s,), c the nodes; order conditions are checked in rational
arithmetic by the tests.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tableau:
    """An explicit Runge-Kutta method."""

    name: str
    order: int
    a: tuple[tuple[Fraction, ...], ...]
    b: tuple[Fraction, ...]
    source: str

    @property
    def c(self) -> tuple[Fraction, ...]:
        """Nodes: row sums of a."""
        return tuple(sum(row, Fraction(0)) for row in self.a)

    def arrays(self) -> tuple[Array, Array, Array]:
        """a (s, s), b (s,), c (s,) as floats."""
        s = len(self.b)
        a = np.zeros((s, s))
        for i, row in enumerate(self.a):
            a[i, : len(row)] = [float(x) for x in row]
        return a, np.array([float(x) for x in self.b]), np.array([float(x) for x in self.c])

    def growth(self, z: NDArray[np.complex128]) -> Array:
        """|R(z)|, the factor a step multiplies a mode by; z = h lambda."""
        a, b, _ = self.arrays()
        total = np.ones_like(z)
        stage = np.ones((len(b), *z.shape), dtype=complex)
        for i in range(len(b)):
            stage[i] = 1 + z * np.tensordot(a[i], stage, axes=1)
        total = total + z * np.tensordot(b, stage, axes=1)
        return np.abs(total)


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
