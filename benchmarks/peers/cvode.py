"""SUNDIALS CVODE itself: the library in scikit-sundae's wheel, called directly, every callback compiled.

The binding passes Python functions only (:mod:`benchmarks.peers.sundae`); this is what CVODE costs without them. Adams
and BDF, Newton's method with the dense Jacobian given, root-finding in the region's own corners for the way out,
restarted at each.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import POINTER, c_double, c_int, c_long, c_void_p
from functools import cache
from importlib.metadata import files
from typing import Any

import numba
import numpy as np
from numba import types

from benchmarks.peers.base import Outcome, Peer, Prepared, tolerances
from benchmarks.peers.plant import Plant
from benchmarks.peers.smooth import LENGTH, SIZE, M, Regions, jacobian, slopes

METHODS = {"Adams": 1, "BDF": 2}
TO_THE_END = 1
STOPPED = 1
ROOT = 2
ROOTS = 2 * M


@cache
def _library(part: str) -> Any:
    """Load one of the wheel's SUNDIALS libraries."""
    import sksundae.cvode  # noqa: F401 - loads them all

    (path,) = (f.locate() for f in files("scikit-sundae") or () if f.name.startswith(f"libsundials_{part}-"))
    return ctypes.CDLL(str(path))


def _function(part: str, name: str, result: Any, *arguments: Any) -> Any:
    entry = getattr(_library(part), name)
    entry.restype, entry.argtypes = result, arguments
    return entry


@cache
def _callbacks() -> tuple[Any, Any, Any]:
    """Compile right-hand side, roots and Jacobian as C functions."""
    vector = _function("core", "N_VGetArrayPointer", POINTER(c_double), c_void_p)
    entries = _function("sunmatrixdense", "SUNDenseMatrix_Data", POINTER(c_double), c_void_p)
    p, d = types.voidptr, types.float64

    @numba.cfunc(types.int32(d, p, p, p))
    def field(time, y, dy, user):  # type: ignore[no-untyped-def]
        out = numba.carray(vector(dy), (SIZE,))
        slopes(time, numba.carray(vector(y), (SIZE,)), out, numba.carray(user, (LENGTH,), np.float64))
        return 0

    @numba.cfunc(types.int32(d, p, types.CPointer(d), p))
    def roots(_time, y, out, user):  # type: ignore[no-untyped-def]
        u = numba.carray(vector(y), (SIZE,))
        flat, distance = numba.carray(user, (LENGTH,), np.float64), numba.carray(out, (ROOTS,))
        for k in range(M):
            distance[2 * k] = u[k] - flat[5 * k + 3]
            distance[2 * k + 1] = u[k] - flat[5 * k + 4]
        return 0

    @numba.cfunc(types.int32(d, p, p, p, p, p, p, p))
    def matrix(_time, _y, _dy, out, user, _one, _two, _three):  # type: ignore[no-untyped-def]
        columns = numba.carray(entries(out), (SIZE, SIZE))  # column by column: transposed
        jacobian(columns.T, numba.carray(user, (LENGTH,), np.float64))
        return 0

    return field, roots, matrix


class _Integrator:
    """One CVODE memory with its vectors; ``advance`` goes on to the end or the next root."""

    def __init__(self, method: str, tolerance: float, flat: Any) -> None:
        field, roots, matrix = _callbacks()
        self.state = np.zeros(SIZE)
        self.time = c_double(0.0)
        self.met = np.zeros(ROOTS, dtype=np.int32)
        context = c_void_p()
        _function("core", "SUNContext_Create", c_int, c_int, c_void_p)(0, ctypes.byref(context))
        make = _function("nvecserial", "N_VMake_Serial", c_void_p, c_int, c_void_p, c_void_p)
        dense = _function("sunmatrixdense", "SUNDenseMatrix", c_void_p, c_int, c_int, c_void_p)
        solver = _function("sunlinsoldense", "SUNLinSol_Dense", c_void_p, c_void_p, c_void_p, c_void_p)
        create = _function("cvode", "CVodeCreate", c_void_p, c_int, c_void_p)
        self.vector = make(SIZE, self.state.ctypes.data, context)
        A = dense(SIZE, SIZE, context)
        self.memory = create(METHODS[method], context)
        ways = np.array([-1, 1] * M, dtype=np.int32)
        self._call("CVodeInit", (c_void_p, c_double, c_void_p), field.address, 0.0, self.vector)
        self._call("CVodeSStolerances", (c_double, c_double), tolerance, tolerance)
        self._call("CVodeSetUserData", (c_void_p,), flat.ctypes.data)
        self._call("CVodeSetLinearSolver", (c_void_p, c_void_p), solver(self.vector, A, context), A)
        self._call("CVodeSetJacFn", (c_void_p,), matrix.address)
        self._call("CVodeSetMaxNumSteps", (c_long,), 10**9)
        self._call("CVodeRootInit", (c_int, c_void_p), ROOTS, roots.address)
        self._call("CVodeSetRootDirection", (c_void_p,), ways.ctypes.data)
        self._restart = self._bound("CVodeReInit", c_double, c_void_p)
        self._stop = self._bound("CVodeSetStopTime", c_double)
        self._march = self._bound("CVode", c_double, c_void_p, c_void_p, c_int)
        self._roots = self._bound("CVodeGetRootInfo", c_void_p)

    def _bound(self, name: str, *types_: Any) -> Callable[..., int]:
        function, memory = _function("cvode", name, c_int, c_void_p, *types_), self.memory
        return lambda *values: function(memory, *values)

    def _call(self, name: str, types_: tuple[Any, ...], *values: Any) -> None:
        if self._bound(name, *types_)(*values) < 0:
            raise RuntimeError(f"{name} failed")

    def advance(self, end: float) -> bool:
        """Restart from ``time`` and ``state``; return whether a root came before the end."""
        self._restart(self.time.value, self.vector)
        self._stop(end)
        flag = self._march(end, self.vector, ctypes.addressof(self.time), TO_THE_END)
        if flag not in (STOPPED, ROOT):
            raise ArithmeticError(f"CVODE stopped with {flag} at {self.time.value}")
        if flag == ROOT:
            self._roots(self.met.ctypes.data)
        return flag == ROOT


def build(plant: Plant, method: str, tolerance: float) -> Prepared:
    """Make a case ready."""
    regions = Regions(plant)
    integrator = _Integrator(method, tolerance, regions.flat)

    def run(cycles: float) -> Outcome:
        regions.reset()
        integrator.time.value, integrator.state[:] = 0.0, plant.start
        while integrator.advance(2.0 * np.pi * cycles):
            for i, sign in enumerate(integrator.met.tolist()):
                if sign == 2 * (i % 2) - 1:
                    regions.cross(i // 2, sign)
        return Outcome(integrator.state[list(plant.clearances)], regions.crossings)

    return Prepared(run)


ADAMS = Peer(
    "CVODE Adams",
    "scikit-sundae",
    "C library, compiled callbacks; roots, restarted",
    tolerances(6, 8, 10, 11, 12, 13, 14, 15, method="Adams"),
    build,
)
BDF = Peer(
    "CVODE BDF",
    "scikit-sundae",
    "C library, compiled callbacks; roots, restarted",
    tolerances(6, 8, 10, 11, 12, 13, 14, 15, method="BDF"),
    build,
)
