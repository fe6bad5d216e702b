"""SUNDIALS CVODE by its C interface: the shared libraries in scikit-sundae's wheel, an optional extra.

The wheel's own binding passes Python functions only; here callbacks are compiled (``kernels.callbacks``) and the loop
over steps is too (``kernels.multistep``), so this module only finds functions, builds CVODE's memory and frees it.

CVODE: Hindmarsh, Brown, Grant, Lee, Serban, Shumaker, Woodward, ACM Trans. Math. Softw. 31 (2005) 363. Its Adams and
BDF formulas go back to Gear and Hindmarsh, as do the IMSL routines of the 1995 paper.
"""

from __future__ import annotations

import ctypes
import weakref
from ctypes import c_double, c_int, c_long, c_void_p
from functools import cache
from importlib.metadata import PackageNotFoundError, files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.solvers.problem_for_c import Block
from gearrattle.errors import NotInstalled

ADAMS = 1
BDF = 2
_MANY = 2**31 - 1
_PARTS = ("core", "nvecserial", "sunmatrixdense", "sunlinsoldense", "cvode")


def missing(algorithm: str, name: str) -> NotInstalled:
    """The error of a start without the library."""
    rule = f"{algorithm} needs SUNDIALS CVODE, an optional extra"
    return NotInstalled.of("sundials", "simulation.algorithm", name, rule)


@cache
def _libraries() -> dict[str, Any]:
    """Load the wheel's libraries by their parts; ImportError where one is not there."""
    import sksundae.cvode  # noqa: F401 - loads them in their order

    try:
        installed = list(files("scikit-sundae") or ())
    except PackageNotFoundError as lost:
        raise ImportError("scikit-sundae has no list of its files") from lost
    libraries = {}
    for part in _PARTS:
        stems = (f"libsundials_{part}-", f"libsundials_{part}.", f"sundials_{part}-", f"sundials_{part}.")
        paths = [str(f.locate()) for f in installed if f.name.startswith(stems)]
        if len(paths) != 1:
            raise ImportError(f"scikit-sundae has {len(paths)} libraries sundials_{part}")
        libraries[part] = ctypes.CDLL(paths[0])
    return libraries


def available(algorithm: str) -> None:
    """Raise a ``ModelError`` that says what to install where the library is missing."""
    try:
        _libraries()
    except (ImportError, OSError) as error:
        raise missing(algorithm, "" if isinstance(error, ModuleNotFoundError) else str(error)) from error


def address(part: str, name: str) -> int:
    """Address of a function."""
    return int(ctypes.cast(getattr(_libraries()[part], name), c_void_p).value or 0)


def _call(part: str, name: str, result: Any, *arguments: tuple[Any, Any]) -> Any:
    """Call a function with (type, value) pairs."""
    kinds = [kind for kind, _ in arguments]
    function = ctypes.CFUNCTYPE(result, *kinds)(address(part, name))
    return function(*(value for _, value in arguments))


class Memory:
    """CVODE's memory for one run, with its vectors, matrix and solvers; freed with the object.

    block: the problem; its two accessor words are filled in here.
    method: ADAMS or BDF.
    newton: Newton's method with the dense Jacobian; otherwise fixed-point iteration, for problems not stiff.
    roots: whether to look for the corners of the pieces held.
    tolerance: relative, and absolute in the block's units.
    step: first step tried [s]; None lets CVODE choose.
    """

    def __init__(
        self, block: Block, *, method: int, newton: bool, roots: bool, tolerance: float, step: float | None
    ) -> None:
        from gearrattle.engine.kernels import callbacks

        # addresses of the accessors in the block
        block.words[callbacks.VECTOR] = address("core", "N_VGetArrayPointer")
        block.words[callbacks.ENTRIES] = address("sunmatrixdense", "SUNDenseMatrix_Data")
        self.block = block
        self.newton = newton
        self.z = block.initial.copy()
        self.point = np.zeros(block.states)
        # a context whose failures are return codes
        context = c_void_p()
        _call("core", "SUNContext_Create", c_int, (c_int, 0), (c_void_p, ctypes.addressof(context)))
        self._owned: list[tuple[str, str, int]] = [("core", "SUNContext_Free", context.value or 0)]
        self._free = weakref.finalize(self, _free, self._owned)
        _call("core", "SUNContext_ClearErrHandlers", c_int, (c_void_p, context.value))  # failures are codes
        self._context = (c_void_p, context.value)
        # vectors over our arrays, and the integrator
        self.vector = self._vector(self.z)
        self.between = self._vector(self.point)
        self.memory = self._own("cvode", "CVodeCreate", "CVodeFree", (c_int, method), self._context)
        # equations, tolerances, stop time and first step
        relative, absolute = block.tolerances(tolerance)
        words = block.words
        self._set("CVodeInit", (c_void_p, callbacks.slopes.address), (c_double, 0.0), (c_void_p, self.vector))
        self._set("CVodeSVtolerances", (c_double, relative), (c_void_p, self._vector(absolute)))
        self._set("CVodeSetUserData", (c_void_p, words.ctypes.data))
        self._set("CVodeSetMaxNumSteps", (c_long, _MANY))
        self._set("CVodeSetStopTime", (c_double, float(block.problem.sample_times[-1])))
        self._set("CVodeSetInitStep", (c_double, step or 0.0))
        self._set("CVodeSetMaxHnilWarns", (c_int, -1))
        self._iterate()
        # corners of the pieces held, as roots that fall through zero
        if roots and block.bounds.size:
            self._set("CVodeRootInit", (c_int, block.bounds.size), (c_void_p, callbacks.corners.address))
            ways = np.full(block.bounds.size, -1, dtype=np.int32)
            self._set("CVodeSetRootDirection", (c_void_p, ways.ctypes.data))
            self._set("CVodeSetNoInactiveRootWarn")

    def _iterate(self) -> None:
        """Attach the iteration for the implicit formula."""
        from gearrattle.engine.kernels import callbacks

        vector = (c_void_p, self.vector)
        index = (c_int, self.block.states)
        if self.newton:
            matrix = self._own("sunmatrixdense", "SUNDenseMatrix", "SUNMatDestroy", index, index, self._context)
            linear = self._own(
                "sunlinsoldense", "SUNLinSol_Dense", "SUNLinSolFree", vector, (c_void_p, matrix), self._context
            )
            self._set("CVodeSetLinearSolver", (c_void_p, linear), (c_void_p, matrix))
            self._set("CVodeSetJacFn", (c_void_p, callbacks.jacobian.address))
        else:
            fixed = self._own("cvode", "SUNNonlinSol_FixedPoint", "SUNNonlinSolFree", vector, (c_int, 0), self._context)
            self._set("CVodeSetNonlinearSolver", (c_void_p, fixed))

    def _own(self, part: str, make: str, free: str, *arguments: tuple[Any, Any]) -> int:
        made = int(_call(part, make, c_void_p, *arguments) or 0)
        if not made:
            raise MemoryError(f"SUNDIALS: {make} failed")
        self._owned.append(("cvode" if part == "cvode" and free == "CVodeFree" else "core", free, made))
        return made

    def _vector(self, values: NDArray[np.float64]) -> int:
        """A vector over an array's own memory."""
        self.__dict__.setdefault("_arrays", []).append(values)
        data = (c_void_p, values.ctypes.data)
        return self._own("nvecserial", "N_VMake_Serial", "N_VDestroy", (c_int, values.size), data, self._context)

    def _set(self, name: str, *arguments: tuple[Any, Any]) -> None:
        flag = _call("cvode", name, c_int, (c_void_p, self.memory), *arguments)
        if flag < 0:
            raise RuntimeError(f"SUNDIALS: {name} answered {flag}")


def _free(owned: list[tuple[str, str, int]]) -> None:
    """Free what a run made: the memory first, the context last."""
    order = {"CVodeFree": 0, "SUNContext_Free": 2}
    for part, free, made in sorted(owned, key=lambda item: order.get(item[1], 1)):
        if free in {"CVodeFree", "SUNContext_Free"}:  # these take the pointer's own address
            pointer = c_void_p(made)
            _call(part, free, c_int, (c_void_p, ctypes.addressof(pointer)))
        else:
            _call(part, free, c_int, (c_void_p, made))
