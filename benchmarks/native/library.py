"""Compile ``steps.c`` and call it with a driveline's arrays."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from gearrattle.engine.solvers.tableaus import Tableau
from gearrattle.engine.solvers.vector_field import FieldProblem

_SOURCE = Path(__file__).with_name("steps.c")
FLAGS = ("-O3", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-shared", "-fPIC")
_COUNTS = ("n", "m", "r", "h", "refs", "size")
_ARRAYS = (
    "inertia",
    "drag",
    "rows",
    "basis",
    "combination",
    "references",
    "first_piece",
    "upper",
    "stiffness",
    "damping",
    "offset",
    "mean",
    "torque_sine",
    "torque_cosine",
    "error_sine",
    "error_cosine",
    "cycles",
)


class _Field(ctypes.Structure):
    _fields_ = (
        [(name, ctypes.c_long) for name in _COUNTS]
        + [(name, ctypes.c_void_p) for name in _ARRAYS]
        + [("period", ctypes.c_double)]
    )


def compiler() -> str | None:
    """Return the C compiler of this machine, if it has one."""
    return shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


def build(folder: Path) -> Any:
    """Compile into a folder and load."""
    target = folder / "steps.so"
    subprocess.run([str(compiler()), *FLAGS, str(_SOURCE), "-lm", "-o", str(target)], check=True)
    return ctypes.CDLL(str(target)).march


def march(function: Any, problem: FieldProblem, tableau: Tableau, *, tolerance: float, step: float, end: float) -> Any:
    """Run from the problem's start to a time [s]; return y and (steps, rejected)."""
    f = problem.field
    arrays = [
        f.inertia,
        f.drag,
        f.rows,
        f.basis,
        f.combination,
        f.references,
        f.first_piece,
        f.upper_corner,
        f.stiffness,
        f.damping,
        f.offset,
        f.mean,
        f.torque_sine,
        f.torque_cosine,
        f.error_sine,
        f.error_cosine,
        f.cycles,
    ]
    kept = [np.ascontiguousarray(array) for array in arrays]
    y, counts = problem.initial.copy(), np.zeros(2, np.int64)
    (m, n), r = f.rows.shape, f.basis.shape[0]
    field = _Field(n, m, r, f.cycles.size, f.references.size, y.size, *(a.ctypes.data for a in kept), f.period)
    a, b, c = tableau.arrays()
    order = min(tableau.order, tableau.estimator_order) + 1
    numbers = [np.ascontiguousarray(array) for array in (a, b, c, tableau.error)]
    pointers = [ctypes.c_void_p(array.ctypes.data) for array in numbers]
    size = np.ascontiguousarray(problem.size)
    function(
        ctypes.byref(field),
        ctypes.c_long(b.size),
        *pointers,
        ctypes.c_long(order),
        ctypes.c_void_p(size.ctypes.data),
        ctypes.c_double(tolerance),
        ctypes.c_double(step),
        ctypes.c_double(end),
        ctypes.c_void_p(y.ctypes.data),
        ctypes.c_void_p(counts.ctypes.data),
    )
    return y, counts
