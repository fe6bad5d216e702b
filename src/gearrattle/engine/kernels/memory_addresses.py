"""Access to the groups of a workspace by *words*: integers, the address and the shape of every array one after the
other.

A stage that takes the arrays as arguments takes seconds to compile, and every caller has to pass them all. With words,
an array that a stage does not use costs no time.
"""

from __future__ import annotations

from typing import Any

from gearrattle.engine.kernels._llvm import group_reader
from gearrattle.engine.kernels.workspace import Sizes, workspace_for

_SAMPLE, _ = workspace_for(Sizes(*len(Sizes._fields) * [1]))


def _readers() -> list[Any]:
    """For every group a kernel that returns the group from the words."""
    readers = []
    first = 0
    for name, group in _SAMPLE._asdict().items():
        readers.append(group_reader(name, group, first))
        first += sum(1 + array.ndim for array in group)
    return readers


(
    common_at,
    laws_at,
    auxiliaries_at,
    region_at,
    free_at,
    modes_at,
    bounds_at,
    scratch_at,
    solver_at,
    lapack_at,
) = _readers()
