"""What the deflections of a driveline lose to rounding before any motion: the sums the program makes them from.

The program keeps independent deflections, those with corners first, each with its transmission error added back
(delta + e = w . q), takes the others from them, and makes the angles from deflections and, in a free train, one angle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.dense.case import Case
from tests.dense.plain import EPS


@dataclass(frozen=True)
class Sums:
    """Sizes of the terms.

    Attributes
    ----------
    loops
        (m, m) identity plus the terms by which dependent deflections are sums of the kept ones. Where those
        are nearly dependent themselves, the terms are large.
    ratios
        (m, m) length of a row over that of another: how one deflection shows in another, at least.
    carried
        (m,) transmission errors, with the rounding of their phases.
    inverses
        from deflections (and one angle, for every choice of it, in a free train) to angles.
    """

    loops: np.ndarray
    ratios: np.ndarray
    carried: np.ndarray
    inverses: tuple[np.ndarray, ...]

    def angles(self, q: np.ndarray, delta: np.ndarray) -> np.ndarray:
        """(n,) sums from which angles are made."""
        shape = np.abs(delta) + self.carried
        if self.inverses[0].shape[1] == len(delta):
            return self.inverses[0] @ shape
        return np.max([P @ np.append(shape, abs(x)) for P, x in zip(self.inverses, q, strict=True)], axis=0)

    def stored(self, delta: np.ndarray) -> np.ndarray:
        """(m,) rounding of deflections as stored."""
        return 2 * EPS * (self.loops @ (np.abs(delta) + self.carried))

    def from_angles(self, rows: np.ndarray, q: np.ndarray, delta: np.ndarray, *, values: bool) -> np.ndarray:
        """(m,) rounding of W q - e; the angles are given exactly, or were made from deflections."""
        sums = np.abs(rows) @ (np.abs(q) + (0.0 if values else self.angles(q, delta))) + self.carried
        return 2 * EPS * (sums + (self.loops if values else self.ratios) @ np.abs(delta))


def sums_of(case: Case) -> Sums:
    """The sums of a case."""
    rows, n = case.rows, case.rows.shape[1]
    length = np.linalg.norm(rows, axis=1)
    ends = [np.zeros((0, n))] if np.linalg.matrix_rank(rows) == n else np.eye(n)[:, None]
    phase = 1 + 2 * np.pi * case.cycles * case.length
    return Sums(
        np.eye(len(rows)) + _dependence(rows, list(case.clearances)),
        length[:, None] / length[None, :],
        (np.abs(case.error_cosine) + np.abs(case.error_sine)) @ phase,
        tuple(np.abs(np.linalg.pinv(np.vstack([rows, end]))) for end in ends),
    )


def _dependence(rows: np.ndarray, first: list[int]) -> np.ndarray:
    """(m, m) sizes of the terms by which dependent deflections are sums of those kept."""
    kept: list[int] = []
    for k in [*first, *(k for k in range(len(rows)) if k not in first)]:
        if np.linalg.matrix_rank(rows[[*kept, k]], tol=1e-9 * np.linalg.norm(rows[k])) > len(kept):
            kept.append(k)
    terms = np.zeros((len(rows), len(rows)))
    terms[:, kept] = np.abs(rows @ np.linalg.pinv(rows[kept]))
    terms[kept] = 0.0
    return terms
