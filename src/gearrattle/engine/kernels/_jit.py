"""The one door to numba.

``kernel`` compiles a function on first call and keeps it on disk. numba's own cache does not notice an edit in another
kernel file, so the folder carries a stamp of all of them: warm starts stay warm, an edit recompiles. Set
``NUMBA_DISABLE_JIT=1`` to run every kernel as plain Python (coverage, debugging).
"""

from __future__ import annotations

import atexit
import contextvars
import ctypes
import gc
import hashlib
import os
import sys
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils
from numba.extending import get_cython_function_address, intrinsic

from gearrattle.files import private_folder


def _user_cache() -> Path:
    """The folder for files that can be made again, on this system."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return Path(os.environ["NUMBA_CACHE_DIR"])
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", tempfile.gettempdir()))
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def _stamped_folder() -> str:
    """A private cache folder named after the content of all kernel files and the compiler's version.

    What lies there is unpickled, so a folder that others can write is not used; without any, nothing is kept.
    """
    stamp = hashlib.sha256(f"{numba.__version__} {sys.version}".encode())
    for file in sorted(Path(__file__).parent.glob("*.py")):
        stamp.update(file.read_bytes())
    name = f"kernels-{stamp.hexdigest()[:16]}"
    user = os.geteuid() if hasattr(os, "geteuid") else "user"
    parents = _user_cache() / "gearrattle", Path(tempfile.gettempdir()) / f"gearrattle-{user}"
    for parent in parents:
        if private_folder(parent / name):
            return str(parent / name)
    words = f"compiled code is not kept: neither {parents[0]} nor {parents[1]} is a folder that only you can write"
    warnings.warn(f"{words}; set NUMBA_CACHE_DIR to one", RuntimeWarning, stacklevel=2)
    return ""


_FOLDER = _stamped_folder()


_LOOK, _PATIENCE = 0.1, 10.0  # seconds: between two looks at a compilation; in which it must end
_RULES: dict[str, Any] = {"cache": bool(_FOLDER), "error_model": "numpy", "fastmath": {"contract"}}


@contextmanager
def _cached() -> Iterator[None]:
    """Whatever is decorated meanwhile is kept in the stamped folder."""
    settings: Any = numba.config
    before = settings.CACHE_DIR
    settings.CACHE_DIR = _FOLDER or before
    try:
        yield
    finally:
        settings.CACHE_DIR = before


def is_compiling() -> bool:
    """Whether kernels are compiled at all, and have addresses."""
    return not numba.config.DISABLE_JIT  # type: ignore[attr-defined]


def _compiled(function: Callable[..., Any], **options: Any) -> Any:
    with _cached():
        made: Any = numba.njit(nogil=True, **{**_RULES, **options})(function)
    if is_compiling():
        made._compile_for_args = partial(_apart, made._compile_for_args)  # what the first call with new types calls
    return made


def _apart(compilation: Callable[..., Any], *arguments: Any) -> Any:
    """Compile in a thread of its own if this is the main thread, so that Ctrl-C is heard at once.

    A KeyboardInterrupt inside numba is late by as long as LLVM works on a function, is lost in what LLVM calls back, or
    becomes an error of numba's. The compilation goes on after it, for the next call; the end of the process ends it.
    """
    if threading.current_thread() is not threading.main_thread():
        return compilation(*arguments)
    results: list[Any] = []
    errors: list[BaseException] = []

    def work() -> None:
        try:
            results.append(compilation(*arguments))
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=contextvars.copy_context().run, args=(work,), name="compilation", daemon=True)
    thread.start()
    try:
        while thread.is_alive():
            thread.join(_LOOK)
    except BaseException:
        atexit.register(_end, thread)
        raise
    if errors:
        raise errors[0]
    return results[0]


def _end(thread: threading.Thread) -> None:
    """Have a thread end at its next line of Python: LLVM must not be at work while the process is taken down."""
    for _ in range(round(_PATIENCE / _LOOK)):
        if not thread.is_alive():
            return
        ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread.ident or 0), ctypes.py_object(SystemExit))
        thread.join(_LOOK)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile for floats and arrays: no Python objects, no exceptions, the interpreter lock released.

    Products and sums may be fused (fma) but never reordered: event times depend on rounding. Which are fused depends on
    what stands side by side, so everything is put into the entry kernel (``forceinline``): code compiled just now and
    code from the cache then give the same bits, and a motion can go on in another process.
    """
    return _compiled(function, forceinline=True)


def loose(function: Callable[..., Any]) -> Any:
    """Compile as ``kernel`` does, but sums may be reordered, in vectors: where the last bits decide nothing."""
    return _compiled(function, forceinline=True, fastmath={"contract", "reassoc", "nsz"})


def separate(function: Callable[..., Any]) -> Any:
    """Compile once and call: for large parts with several callers, where the last bit may depend on the compiler."""
    return _compiled(function)


def strict(function: Callable[..., Any]) -> Any:
    """Compile once and call, every product and sum rounded by itself: the same bits wherever it is called from.

    For kernels to call. What they call is optimised anew with each of them, so chains of calls are kept short.
    """
    return _compiled(function, fastmath=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)


def strict_entry(function: Callable[..., Any]) -> Any:
    """The same for a function that Python calls."""
    return _compiled(function, fastmath=False, no_cfunc_wrapper=True)


def inlined(function: Callable[..., Any]) -> Any:
    """The same for the small parts of a hot loop: written into their callers, so that a call costs nothing."""
    return _compiled(function, inline="always")


def callback(arguments: str) -> Callable[[Callable[..., Any]], Any]:
    """A function that C calls: compiled at once, with ``address``; it answers 0, or a code of the library's.

    Args:
        arguments: one letter each, ``d`` a double, ``p`` a pointer, which arrives as an integer (``array_at``).
    """
    kinds = {"d": numba.float64, "p": numba.intp}

    def compiled(function: Callable[..., Any]) -> Any:
        with _cached():
            return numba.cfunc(numba.int32(*[kinds[letter] for letter in arguments]), **_RULES)(function)

    return compiled


def _to_pointer(_context: Any, address: Any) -> Any:
    """An address as a pointer."""

    def write(_: Any, builder: Any, __: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], cgutils.voidptr_t)

    return numba.types.voidptr(address), write


_pointer: Any = intrinsic(_to_pointer)
_carray: Any = numba.carray  # type: ignore[attr-defined]


@inlined
def array_at(address, shape, kind):  # type: ignore[no-untyped-def]
    """The array of a shape and type that lies at an address."""
    return _carray(_pointer(address), shape, kind)


def _foreign(result: Any) -> Any:
    """A kernel ``call(address, values)`` of the C function at an address: doubles, integers and pointers."""

    @intrinsic
    def call(_context: Any, address: Any, values: Any) -> Any:
        def write(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            types = [context.get_value_type(kind) for kind in signature.args[1]]
            shape = ir.FunctionType(context.get_value_type(result), types)
            function = builder.inttoptr(given[0], shape.as_pointer())
            return builder.call(function, cgutils.unpack_tuple(builder, given[1]))

        return result(address, values), write

    return call


def _native(result: Any) -> Any:
    """A kernel ``call(address, values)`` of compiled code of this package at an address (``address_of``)."""

    @intrinsic
    def call(_context: Any, address: Any, values: Any) -> Any:
        kinds = [numba.types.unliteral(kind) for kind in values.types]

        def write(context: Any, builder: Any, _: Any, given: Any) -> Any:
            shape = context.call_conv.get_function_type(result, kinds)
            function = builder.inttoptr(given[0], shape.as_pointer())
            each = zip(cgutils.unpack_tuple(builder, given[1]), values.types, kinds, strict=True)
            handed = [context.cast(builder, value, kind, plain) for value, kind, plain in each]
            return context.call_conv.call_function(builder, function, result, kinds, handed)[1]

        return result(address, values), write

    return call


_FOUR: Any = ir.VectorType(ir.DoubleType(), 4)


def _group(
    builder: Any, count: int, at: Any, stride: Any, apart: Any, columns: Any, weights: Any, out: Any, adds: bool
) -> None:
    """Write the sums of so many strips side by side: every weight is read once, and no sum waits for another."""
    integer, four, lane = stride.type, _FOUR.as_pointer(), ir.IntType(32)
    places = [builder.bitcast(builder.gep(out, [integer(4 * s)]), four) for s in range(count)]
    strips = [builder.gep(at, [builder.mul(stride, integer(s))]) for s in range(count)]
    sums = [cgutils.alloca_once(builder, _FOUR) for _ in range(count)]
    for place, total in zip(places, sums, strict=True):
        builder.store(builder.load(place, align=8) if adds else _FOUR([0.0] * 4), total)
    with cgutils.for_range(builder, columns) as loop:
        weight = builder.insert_element(_FOUR(ir.Undefined), builder.load(builder.gep(weights, [loop.index])), lane(0))
        spread = builder.shuffle_vector(weight, _FOUR(ir.Undefined), ir.VectorType(lane, 4)([0] * 4))
        for strip, total in zip(strips, sums, strict=True):
            column = builder.gep(strip, [builder.mul(loop.index, apart)])
            rows = builder.load(builder.bitcast(column, four), align=8)
            product = builder.fmul(rows, spread, flags=("contract",))
            builder.store(builder.fadd(builder.load(total), product, flags=("contract",)), total)
    for place, total in zip(places, sums, strict=True):
        builder.store(builder.load(total), place, align=8)


def _strip_product(adds: bool) -> Any:
    """A kernel that multiplies strips of four rows with a vector, see ``products``: in vectors of four by itself."""

    def plain(stack: Any, where: tuple[int, int, int, int, int], y: Any, out: Any, at: int) -> None:
        (first, stride, apart, strips, columns), flat = where, stack.reshape(-1)
        for i, begin in enumerate(range(first, first + strips * stride, stride)):
            for r in range(4):
                sums = out[at + 4 * i + r] if adds else 0.0
                for j in range(columns):
                    sums += flat[begin + apart * j + r] * y[j]
                out[at + 4 * i + r] = sums

    def product(_: Any, stack: Any, where: Any, y: Any, out: Any, at: Any) -> Any:
        def write(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            kinds, (_, where, _, _, at) = signature.args, given
            first, stride, apart, strips, columns = cgutils.unpack_tuple(builder, where)
            data, weights, sums = (context.make_array(kinds[i])(context, builder, given[i]).data for i in (0, 2, 3))
            entry, place, integer = builder.gep(data, [first]), builder.gep(sums, [at]), strips.type

            def group(begin: Any, count: int) -> None:
                here, there = builder.mul(begin, stride), builder.mul(begin, integer(4))
                strip, rows = builder.gep(entry, [here]), builder.gep(place, [there])
                _group(builder, count, strip, stride, apart, columns, weights, rows, adds)

            pairs = builder.ashr(strips, integer(1))
            with cgutils.for_range(builder, pairs) as loop:
                group(builder.shl(loop.index, integer(1)), 2)
            with builder.if_then(builder.trunc(strips, ir.IntType(1))):
                group(builder.shl(pairs, integer(1)), 1)
            return context.get_dummy_value()

        five = numba.types.UniTuple(numba.types.intp, len(where))
        return numba.types.void(stack, five, y, out, numba.types.unliteral(at)), write

    return intrinsic(product) if is_compiling() else plain


strip_product = _strip_product(False)
"""strip_product(stack, (first, stride, apart, strips, columns), y, out, at): out[at:] = strips of four rows, ``stride``
entries apart from the entry ``first`` of the stack on, their columns so many ``apart``, times y[:columns]."""
strip_product_added = _strip_product(True)
"""The same, added to what stands there."""

call_count = _native(numba.int64)
"""Call compiled code that answers a whole number: call_count(address, (values, ...)). Nothing of it is written into the
caller: the same machine code as ever, and no second compilation."""
call_truth = _native(numba.boolean)
"""The same for True or False."""
call_real = _native(numba.float64)
"""The same for a float."""
call_silent = _native(numba.none)
"""The same for code that answers nothing."""

call_code = _foreign(numba.int32)
"""Call a C function that answers an int: call_code(address, (values, ...)); pointers are integers."""
call_pointer = _foreign(numba.intp)
"""Call a C function that answers a pointer."""


def lapack_address(name: str) -> int:
    """Where a routine of the LAPACK that SciPy carries begins."""
    return int(get_cython_function_address("scipy.linalg.cython_lapack", name))


def address_of(entry: Callable[..., Any], *arguments: Any) -> int:
    """Where the compiled code begins that an entry runs for such arguments; compiled if it was not.

    Args:
        entry: from ``vectorised`` or ``compact``.
        arguments: any of the types it will be called with.
    """
    return int(entry.address(*arguments))  # type: ignore[attr-defined]


@cache
def lapack_routine(name: str, arguments: int) -> Callable[..., None]:
    """A routine of the LAPACK that SciPy carries; takes addresses, and lets go of the interpreter while it works."""
    return ctypes.CFUNCTYPE(None, *arguments * [ctypes.c_void_p])(lapack_address(name))


_COMPILING = threading.RLock()


def vectorised(entry: Callable[..., Any]) -> Callable[..., Any]:
    """An entry kernel that is compiled, when first called, with LLVM's straight-line vectoriser on.

    numba leaves it off by default; the strips of four that the marching kernels multiply gain a factor of two. The
    setting is numba's own global one, so it is put back after the call. The garbage collector rests meanwhile: a
    compilation makes millions of small objects that all live to its end, and a fifth of its time went into visiting
    them.
    """

    return _compiled_with(entry, 1, "SLP_VECTORIZE")


def compact(entry: Callable[..., Any]) -> Callable[..., Any]:
    """An entry that is compiled without LLVM's loop vectoriser: for short loops, a fifth less to compile."""
    return _compiled_with(entry, 0, "LOOP_VECTORIZE")


@cache
def _compiled_with(entry: Callable[..., Any], value: int, setting: str) -> Callable[..., Any]:
    """The entry, compiled with a setting of numba's own when first called; one and the same for all who ask."""
    compiled: set[tuple[type, ...]] = set()  # entry.signatures would tell, and take longer than many an entry
    addresses: dict[tuple[Any, ...], int] = {}
    kernel: Any = entry

    def call(*arguments: Any) -> Any:
        kinds = tuple(map(type, arguments))
        if kinds not in compiled:
            if is_compiling():
                _apart(compile_, *arguments)
            compiled.add(kinds)
        return entry(*arguments)

    def compile_(*arguments: Any) -> None:
        with _set(setting, value):
            kernel._compile_for_args(*arguments)

    def address(*arguments: Any) -> int:
        shape = tuple(map(_kind, arguments))
        if shape not in addresses:
            _apart(compile_, *arguments)
            code = kernel.overloads[tuple(map(numba.typeof, arguments))]
            addresses[shape] = int(code.library.get_pointer_to_function(code.fndesc.llvm_func_name))
        return addresses[shape]

    call.address = address  # type: ignore[attr-defined]
    return call


def _kind(value: Any) -> Any:
    """What numba tells an argument's type from, without making the type."""
    if isinstance(value, tuple):
        return type(value), *map(_kind, value)
    if isinstance(value, np.ndarray):
        flags = value.flags
        return value.dtype, value.ndim, flags.c_contiguous, flags.f_contiguous, flags.aligned, flags.writeable
    return type(value)


@contextmanager
def _set(setting: str, value: int) -> Iterator[None]:
    """What is compiled meanwhile is compiled with a setting of numba's own, and undisturbed."""
    settings: Any = numba.config
    with _COMPILING, _uncollected():
        before = getattr(settings, setting)
        setattr(settings, setting, value)
        try:
            yield
        finally:
            setattr(settings, setting, before)


@contextmanager
def _uncollected() -> Iterator[None]:
    """No garbage collection for a while, if there was one."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()
