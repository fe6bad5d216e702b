"""Rows times the state as power series of time, through an interval between two samples.

Inside a region dz/ds = M z (``flow``), so a row of numbers R has the value R exp(s M) z a time s after z: a power
series in s/h with coefficients R (h M)^p / p! z. An interval is cut into blocks of equal length h in which |h M| is at
most 4, where |h M| = |(h M)^20|^(1/20) is that of the fastest oscillation.

Takes a Flow and the pieces of a region; gives the rows of coefficients, where to evaluate them, and states.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearrattle.system.energy import _increments, _turning
from gearrattle.system.flow import Flow, Pieces

Array = NDArray[np.float64]
Rows = Callable[[Pieces], Array]

_LONGEST = 4.0  # |h M| of a block
_POWER = 20  # by which |h M| is measured
_SMALL = 1e-17  # first term left out of a series
_TAIL = 1e-3  # of an oscillation, left out of the polynomial that the Chebyshev points resolve
_MOMENT = 1e-11  # error of the mean of the fourth power of an oscillation
_SEARCHED = 0.3  # |h M| between two points of a search


def phase_of(flow: Flow, pieces: Pieces, length: float) -> float:
    """Return |h M| of a region over a length in periods: by how much the fastest oscillation turns [rad]."""
    matrix = _turning(flow, flow.generator(pieces)) * length
    norm = float(np.linalg.norm(matrix, 1))
    if norm == 0.0:
        return 0.0
    power = np.linalg.norm(np.linalg.matrix_power(matrix / norm, _POWER), 1)
    return float(power ** (1.0 / _POWER)) * norm


def blocks_of(phase: float) -> int:
    """Return how many blocks an interval of this |h M| is cut into."""
    return max(1, int(np.ceil(phase / _LONGEST)))


@dataclass(frozen=True)
class Series:
    """Power series of q rows in one region, through an interval of B blocks.

    Attributes:
        matrix: (Z, Z) M.
        known: (S,) memories known in the region, NaN where they go on.
        first_memory: their first column in z.
        block: length of a block, in periods.
        phase: |h M| of a block.
        rows: (B, P + 1, q, Z) coefficients by the state at the begin of the interval, of powers of s/h on 0 ... 1.
    """

    matrix: Array
    known: Array
    first_memory: int
    block: float
    phase: float
    rows: Array

    @classmethod
    def of(cls, flow: Flow, pieces: Pieces, rows: Rows, length: float, phase: float) -> Series:
        """Expand rows in a region, over an interval of this length in periods."""
        count = blocks_of(phase)
        phase, block, matrix = phase / count, length / count, flow.generator(pieces)
        terms, term = 8, phase**9 / 362880.0
        while term > _SMALL:
            terms += 1
            term *= phase / (terms + 1)
        chosen = rows(pieces)
        move = _increments(matrix, np.array([block]))[0]
        expanded = np.empty((count, terms + 1, *chosen.shape))
        for j in range(count):
            expanded[j, 0] = chosen
            for p in range(1, terms + 1):
                expanded[j, p] = expanded[j, p - 1] @ matrix * (block / p)
            chosen = chosen + chosen @ move
        return cls(matrix, flow.known(pieces), flow.states - flow.memory.size, block, phase, expanded)

    @cached_property
    def powers(self) -> Array:
        """(P + 1,) exponents 0, 1, 2 ..."""
        return np.arange(float(self.rows.shape[1]))

    @cached_property
    def points(self) -> Array:
        """(2 d + 1,) Chebyshev points on 0 ... 1, both ends included, d the degree that resolves an oscillation."""
        degree, rest = 2, 2.0 * (0.25 * self.phase) ** 3 / 6.0
        while rest > _TAIL:
            degree += 1
            rest *= 0.25 * self.phase / (degree + 1)
        return 0.5 - 0.5 * np.cos(np.pi * np.arange(2 * degree + 1) / (2 * degree))

    @cached_property
    def gauss(self) -> tuple[Array, Array]:
        """(J,) nodes on 0 ... 1 and weights for the mean of a fourth power."""
        nodes, error = 1, (4.0 * self.phase) ** 2 / 24.0
        while error > _MOMENT or nodes < 3:  # the error of Gauss's rule for exp(4 i |h M| x)
            nodes += 1
            error *= (4.0 * self.phase) ** 2 * nodes**4 * (2 * nodes - 1) / (2 * nodes + 1)
            error /= (2.0 * nodes * (2 * nodes - 1)) ** 3
        x, weights = np.polynomial.legendre.leggauss(nodes)
        return 0.5 * (x + 1.0), 0.5 * weights

    @cached_property
    def grid(self) -> Array:
        """(G + 1,) points on 0 ... 1 between which a rate changes its sign once at most."""
        return np.linspace(0.0, 1.0, 2 + int(self.phase / _SEARCHED))

    def at(self, block: int, places: Array, sign: float = 1.0) -> Array:
        """(len(places), q, Z) rows of the values at places s/h of a block; with sign -1 before the state."""
        return np.tensordot((sign * places)[:, None] ** self.powers, self.rows[block], axes=1)

    def begun(self, states: Array) -> Array:
        """States (N, Z) with the memories that are known in the region written into them."""
        for s, value in enumerate(self.known.tolist()):
            if not np.isnan(value):
                states[:, self.first_memory + s] = value
        return states

    def moved(self, states: Array, durations: Array) -> Array:
        """(N, Z) states (N, Z) after durations (N,), in periods."""
        states, left = states.copy(), durations.copy()
        for _ in range(len(self.rows)):
            length = np.clip(left, 0.0, self.block)[:, None]
            term = states.copy()
            for p in range(1, len(self.powers)):
                term = (term @ self.matrix.T) * (length / p)
                states += term
            left -= self.block
        return states
