"""Rows times the state as power series of time, through one interval between two samples, or several.

Inside a region dz/ds = M z (``flow``), so a row of numbers R has the value R exp(s M) z a time s after z. Over a length
h this is a power series in s/h with coefficients R (h M)^p / p! z, whose size grows with |h M| = |(h M)^20|^(1/20),
that of the fastest oscillation. Neighbouring intervals are joined as long as |h M| of their whole length stays below 2.
A single interval is cut into blocks of equal length h in which |h M| is at most 4.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.energy_audit import _turning
from gearrattle.engine.system.flow import Flow, Pieces

Array = NDArray[np.float64]
Rows = Callable[[Pieces], Array]

_TOGETHER = 2.0  # largest |h M| of joined intervals
_MOST_TOGETHER = 64  # most joined intervals, a power of two
_LONGEST = 4.0  # largest |h M| of a block
_POWER = 20  # exponent n in |h M| = |(h M)^n|^(1/n)
_SMALL = 1e-17  # size of the first omitted term of a series
_TAIL = 1e-3  # share of an oscillation that the polynomial through the Chebyshev points may miss
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
    """Return the number of blocks of an interval with this |h M|."""
    return max(1, int(np.ceil(phase / _LONGEST)))


@dataclass(frozen=True)
class Series:
    """Power series of rows in one region, over joined intervals or over one interval of B blocks."""

    intervals: int  # number of joined intervals between samples; 1 with several blocks
    matrix: Array  # (Z, Z) M
    known: Array  # (S,) known values of memories in the region; NaN: a memory keeps its value
    first_memory: int  # index of the first memory in z
    count: int  # B
    block: float  # length of a block, in periods
    phase: float  # |h M| of a block
    terms: int  # P, the highest power

    @classmethod
    def of(cls, flow: Flow, pieces: Pieces, interval: float) -> Series:
        """Return those of a region, with so long an interval between two samples, in periods."""
        phase = phase_of(flow, pieces, interval)
        together = 1
        while together < _MOST_TOGETHER and 2.0 * together * phase <= _TOGETHER:
            together *= 2
        count = blocks_of(phase * together)
        phase = phase * together / count
        block = interval * together / count
        terms = 8
        term = phase**9 / 362880.0
        while term > _SMALL:
            terms += 1
            term *= phase / (terms + 1)
        matrix = flow.generator(pieces)
        first_memory = flow.states - flow.memory.size
        return cls(together, matrix, flow.known(pieces), first_memory, count, block, phase, terms)

    @property
    def length(self) -> float:
        """Length of all blocks, in periods."""
        return self.count * self.block

    def expanded(self, chosen: Array) -> Array:
        """Return (B, q, P + 1, Z) coefficients of rows (q, Z) by the state at the start, of powers of s/h."""
        width = len(self.matrix)
        out = np.empty((self.terms + 1, self.count, len(chosen), width))
        for j in range(self.count):
            out[0, j] = chosen
            if j + 1 < self.count:
                chosen = chosen + chosen @ self._move
        powers = out.reshape(self.terms + 1, -1, width)
        for p in range(1, self.terms + 1):
            powers[p] = powers[p - 1] @ self.matrix * (self.block / p)
        return out.transpose(1, 2, 0, 3)

    @cached_property
    def _move(self) -> Array:
        """(Z, Z) exp(h M) - 1."""
        return _increment(self.matrix, self.block)

    @cached_property
    def powers(self) -> Array:
        """(P + 1,) exponents 0, 1, 2 ..."""
        return np.arange(float(self.terms + 1))

    @cached_property
    def points(self) -> Array:
        """(2 d + 1,) Chebyshev points on 0 ... 1, both ends included, d the degree that resolves an oscillation."""
        degree = 2
        rest = 2.0 * (0.25 * self.phase) ** 3 / 6.0
        while rest > _TAIL:
            degree += 1
            rest *= 0.25 * self.phase / (degree + 1)
        return 0.5 - 0.5 * np.cos(np.pi * np.arange(2 * degree + 1) / (2 * degree))

    @cached_property
    def gauss(self) -> tuple[Array, Array]:
        """(J,) nodes on 0 ... 1 and weights for the mean of a fourth power."""
        nodes = 1
        error = (4.0 * self.phase) ** 2 / 24.0
        # error of Gauss's rule with J nodes, (J!)^4 / ((2 J + 1) (2 J)!^3) f^(2 J), for f = exp(4 i |h M| x)
        while error > _MOMENT or nodes < 3:
            nodes += 1
            error *= (4.0 * self.phase) ** 2 * nodes**4 * (2 * nodes - 1) / (2 * nodes + 1)
            error /= (2.0 * nodes * (2 * nodes - 1)) ** 3
        return _gauss(nodes)

    @property
    def cells(self) -> int:
        """Number of equal parts of a block in which a rate changes its sign at most once."""
        return 1 + int(self.phase / _SEARCHED)

    def begun(self, states: Array) -> Array:
        """States (N, Z) with the memories that are known in the region written into them."""
        for s, value in enumerate(self.known.tolist()):
            if not np.isnan(value):
                states[:, self.first_memory + s] = value
        return states

    def moved(self, states: Array, durations: Array) -> Array:
        """(N, Z) states (N, Z) after durations (N,), in periods."""
        states = states.copy()
        whole = np.floor(durations / self.block).astype(np.int64)
        for j in range(int(whole.max(initial=0))):
            on = np.flatnonzero(whole > j)
            states[on] += states[on] @ self._move.T
        term = states
        rest = (durations - whole * self.block)[:, None]
        for p in range(1, self.terms + 1):
            term = (term @ self.matrix.T) * (rest / p)
            states = states + term
        return states


def _increment(matrix: Array, length: float) -> Array:
    """(Z, Z) exp(length A) - 1."""
    norm = float(np.linalg.norm(matrix, 1)) * length
    halved = max(0, int(np.ceil(np.log2(max(norm, 1e-300) / 0.25))))
    scaled = matrix * (length / 2.0**halved)
    increment = scaled.copy()
    term = scaled
    for j in range(2, 17):
        term = term @ scaled / j
        increment += term
    for _ in range(halved):
        increment = 2.0 * increment + increment @ increment
    return increment


@cache
def _gauss(nodes: int) -> tuple[Array, Array]:
    """(J,) nodes on 0 ... 1 and weights of Gauss's rule."""
    x, weights = np.polynomial.legendre.leggauss(nodes)
    return 0.5 * (x + 1.0), 0.5 * weights
