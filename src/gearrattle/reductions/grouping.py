"""Groups of bodies that turn as one: the ratio of every body to the body kept, and the basis of the groups.

Merging element k means w_k . q = 0: with two entries, q_b = -(w_a / w_b) q_a. Along a group the ratios multiply; round
a closed loop they must multiply to one, or the loop would lock. J, D and loads then add up with the ratios,

    J_A = sum_i rho_i^2 J_i,   D_A = sum_i rho_i^2 D_i,   T_A = sum_i rho_i T_i,      q_i = rho_i q_A,

which is T^T J T and its like for the basis T whose columns are the ratios of one group each.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SAME = 1e-9  # relative difference up to which two ratios are equal


@dataclass(frozen=True)
class Grouping:
    """Groups of bodies that turn as one.

    Attributes
    ----------
    owner
        (n,) for every body the body kept of its group.
    ratio
        (n,) q_i = ratio_i q_owner.
    """

    owner: tuple[int, ...]
    ratio: tuple[float, ...]

    @property
    def kept(self) -> tuple[int, ...]:
        """Bodies kept, ascending."""
        return tuple(sorted(set(self.owner)))

    @cached_property
    def basis(self) -> Array:
        """(n, r) T."""
        column = {body: j for j, body in enumerate(self.kept)}
        basis = np.zeros((len(self.owner), len(column)))
        for i, (owner, ratio) in enumerate(zip(self.owner, self.ratio, strict=True)):
            basis[i, column[owner]] = ratio
        return basis

    def turned(self, old: int, new: int) -> Grouping:
        """Return the grouping with the body ``new`` kept instead of ``old`` in their group."""
        scale = self.ratio[new]
        pairs = [(new, r / scale) if o == old else (o, r) for o, r in zip(self.owner, self.ratio, strict=True)]
        return Grouping(tuple(o for o, _ in pairs), tuple(1.0 if i == new else r for i, (_, r) in enumerate(pairs)))


def grouped(rows: Array, merged: tuple[int, ...]) -> Grouping | None:
    """Group the bodies that merged elements connect; the first body of a group is kept; None if a loop would lock.

    Merged elements have two entries in their rows of W (m, n).
    """
    owner = list(range(rows.shape[1]))
    ratio = [1.0] * len(owner)
    for element in merged:
        a, b = (int(i) for i in np.flatnonzero(rows[element]))
        step = -float(rows[element, a] / rows[element, b])
        if owner[a] == owner[b]:
            if abs(ratio[b] - step * ratio[a]) > SAME * abs(ratio[b]):
                return None
            continue
        scale = step * ratio[a] / ratio[b]
        absorbed = owner[b]
        into = owner[a]
        for i, o in enumerate(owner):
            if o == absorbed:
                owner[i] = into
                ratio[i] = ratio[i] * scale
    grouping = Grouping(tuple(owner), tuple(ratio))
    for body in grouping.kept:
        first = owner.index(body)
        if first != body:
            grouping = grouping.turned(body, first)
    return grouping
