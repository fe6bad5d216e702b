"""Decorators that compile kernels by numba; operations that numba does not offer are in ``_llvm``.

numba is imported when a kernel is first called (``_late``). ``kernel`` compiles a function on first call and keeps it
on disk. numba's own cache does not notice an edit in another kernel file, so the folder carries a stamp of all of them:
warm starts stay warm, an edit recompiles. Set ``NUMBA_DISABLE_JIT=1`` to run every kernel as plain Python (coverage,
debugging).
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
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from gearrattle.compilation import COMPILATION
from gearrattle.engine.kernels._ahead import Ahead, task_of
from gearrattle.engine.kernels._late import Late, is_plain, late, settle
from gearrattle.files import private_folder


def _user_cache() -> Path:
    """The user's cache folder on this system."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return Path(os.environ["NUMBA_CACHE_DIR"])
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", tempfile.gettempdir()))
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


@cache
def _folder() -> str:
    """A private cache folder named after the content of all kernel files and the compiler's version.

    What lies there is unpickled, so a folder that others can write is not used; without any, nothing is kept.
    """
    stamp = hashlib.sha256(f"{version('numba')} {sys.version}".encode())
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


_IS_PLAIN = os.environ.get("NUMBA_DISABLE_JIT", "") not in ("", "0")
# seconds: between two looks at a compilation; in which it must end
_LOOK = 0.1
_PATIENCE = 10.0
_RULES: dict[str, Any] = {
    "error_model": "numpy",
    "fastmath": {"contract"},
    "no_cfunc_wrapper": True,  # nobody passes kernels on as functions
}
_COMPILING = threading.RLock()
"""Held by who compiles, so that settings that another thread has changed meanwhile do not count."""
AHEAD = Ahead("gearrattle.engine.kernels.compiled_ahead")
"""The kernels that other processes compile."""


@contextmanager
def _cached() -> Iterator[None]:
    """Keep the kernels that are decorated inside this context in the stamped folder."""
    import numba

    settings: Any = numba.config
    before = settings.CACHE_DIR
    settings.CACHE_DIR = _folder() or before
    try:
        yield
    finally:
        settings.CACHE_DIR = before


def is_compiling() -> bool:
    """Whether kernels are compiled at all, and have addresses."""
    import numba

    return not numba.config.DISABLE_JIT  # type: ignore[attr-defined]


def _compiled(function: Callable[..., Any], **options: Any) -> Any:
    return function if _IS_PLAIN else Late(partial(_made, function, options), function, options)


def _made(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    """Numba's object for a function."""
    import numba

    with _cached():
        made: Any = numba.njit(nogil=True, cache=bool(_folder()), **{**_RULES, **options})(function)
    if is_compiling():
        made._compiler._customize_flags = _quick_flags()
        made._compiler.compile = partial(_missed, made._compiler.compile, function)  # where the cache has none
        made._compile_for_args = partial(_in_turn, made._compile_for_args, function)  # first call with new types
        if _folder():
            from gearrattle.engine.kernels._loading import Kept

            made._cache._impl.__class__ = Kept
    return made


def _missed(compilation: Callable[..., Any], function: Callable[..., Any], *arguments: Any) -> Any:
    """Compile a kernel that was not kept, and have other processes begin."""
    settle()
    if _folder():
        AHEAD.begin(task_of(function, ())[0])
    return compilation(*arguments)


@cache
def _quick_flags() -> Any:
    """The options of a compilation. numba compares them at every operation, and asks for each of them by itself."""
    from numba.core.compiler import Flags

    defaults = {name: option.default for name, option in Flags.options.items()}

    class QuickFlags(Flags):
        __slots__ = ()

        def values(self) -> dict[str, Any]:
            """Every option; the same as numba's, at once."""
            return {**defaults, **self._values}

    return QuickFlags


def _in_turn(compilation: Callable[..., Any], function: Callable[..., Any], *arguments: Any) -> Any:
    """Compile or load a kernel when no other process compiles it."""

    def work(*arguments: Any) -> Any:
        AHEAD.take(task_of(function, arguments))
        with _COMPILING:
            return compilation(*arguments)

    return _in_own_thread(work, *arguments)


def _in_own_thread(compilation: Callable[..., Any], *arguments: Any) -> Any:
    """Compile in a thread of its own if this is the main thread, so that Ctrl-C works at once.

    A KeyboardInterrupt inside numba is late by as long as LLVM works on a function, is lost in what LLVM calls back, or
    becomes an error of numba's. The compilation goes on after it, for the next call; the end of the process ends it.
    """
    if threading.current_thread() is not threading.main_thread():
        with COMPILATION, _uncollected():
            return compilation(*arguments)
    results: list[Any] = []
    errors: list[BaseException] = []

    def work() -> None:
        sys.settrace(None)  # a tracer, of a debugger or of coverage, doubles the time of the compiler
        try:
            with COMPILATION, _uncollected():
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
    return _compiled(function, fastmath=False, no_cpython_wrapper=True)


def strict_entry(function: Callable[..., Any]) -> Any:
    """Compile a strict kernel (``strict``) that Python calls."""
    return _compiled(function, fastmath=False)


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a small part of a hot loop: it is inlined in its callers, so that a call costs nothing."""
    return _compiled(function, inline="always")


class _PlainCallback:
    """A Python function that C calls, with ``address``, where nothing is compiled."""

    def __init__(self, function: Callable[..., Any], kinds: list[Any]) -> None:
        self._function = ctypes.CFUNCTYPE(ctypes.c_int32, *kinds)(function)  # kept, or the address leads nowhere
        self.address = ctypes.cast(self._function, ctypes.c_void_p).value


def callback(arguments: str) -> Callable[[Callable[..., Any]], Any]:
    """A function that C calls: compiled at once, with ``address``; it answers 0, or a code of the library's.

    arguments: one letter each, ``d`` a double, ``p`` a pointer, which arrives as an integer (``array_at``).
    """
    plain_kinds = {"d": ctypes.c_double, "p": ctypes.c_void_p}

    def compiled(function: Callable[..., Any]) -> Any:
        if not is_compiling():
            return _PlainCallback(function, [plain_kinds[letter] for letter in arguments])
        import numba

        kinds = {"d": numba.float64, "p": numba.intp}
        answer = numba.int32(*[kinds[letter] for letter in arguments])
        settle()
        with _cached():
            return numba.cfunc(answer, cache=bool(_folder()), **_RULES)(function)

    return compiled


def address_of(entry: Callable[..., Any], *arguments: Any) -> Any:
    """Address of the compiled code that an entry runs for such arguments; it is compiled if it was not.

    With numba switched off it is the function itself.

    entry: from ``vectorised`` or ``compact``.
    arguments: any of the types it will be called with.
    """
    return entry.address(*arguments) if is_compiling() else entry  # type: ignore[attr-defined]


def vectorised(entry: Callable[..., Any]) -> Callable[..., Any]:
    """An entry kernel that is compiled, when first called, with LLVM's straight-line vectoriser on.

    numba leaves it off by default; the strips of four that the marching kernels multiply gain a factor of two. The
    setting is numba's own global one, so it is put back after the call.
    """

    return _compiled_with(late(entry), ("SLP_VECTORIZE", 1))


def compact(entry: Callable[..., Any]) -> Callable[..., Any]:
    """A strict entry with little optimisation: an eighth less to compile, for loops that are short or run once.

    Its bits do not depend on that, those of other kernels would.
    """
    entry = late(entry)
    if isinstance(entry, Late) and entry.options.get("fastmath", True):
        raise ValueError(f"{entry.__name__} is not strict")
    return _compiled_with(entry, ("LOOP_VECTORIZE", 0), ("OPT", 1))


@cache
def _compiled_with(entry: Callable[..., Any], *settings: tuple[str, int]) -> Callable[..., Any]:
    """The entry, compiled with settings of numba's own when first called; the same object for all callers."""
    compiled: set[tuple[type, ...]] = set()  # entry.signatures would tell, and take longer than many an entry
    addresses: dict[tuple[Any, ...], int] = {}
    kernel: Any = entry

    # a call compiles for types that are met for the first time
    def call(*arguments: Any) -> Any:
        nonlocal kernel
        kinds = tuple(map(type, arguments))
        if kinds not in compiled:
            if isinstance(entry, Late) and is_plain():
                return entry(*arguments)
            kernel = entry.made() if isinstance(entry, Late) else entry
            if is_compiling():
                _in_own_thread(compile_, *arguments)
            compiled.add(kinds)
        return kernel(*arguments)

    # compile with the settings
    def compile_(*arguments: Any) -> None:
        with _set(settings):
            kernel._compile_for_args(*arguments)

    # the address of the machine code for these types
    def address(*arguments: Any) -> int:
        shape = tuple(map(_kind, arguments))
        if shape not in addresses:
            import numba

            _in_own_thread(compile_, *arguments)
            code = kernel.overloads[tuple(map(numba.typeof, arguments))]
            addresses[shape] = int(code.library.get_pointer_to_function(code.fndesc.llvm_func_name))
        return addresses[shape]

    call.address = address  # type: ignore[attr-defined]
    return call


def _kind(value: Any) -> Any:
    """The properties from which numba derives an argument's type, without making the type."""
    if isinstance(value, tuple):
        return type(value), *map(_kind, value)
    if isinstance(value, np.ndarray):
        flags = value.flags
        return value.dtype, value.ndim, flags.c_contiguous, flags.f_contiguous, flags.aligned, flags.writeable
    return type(value)


def prepared(entry: Callable[..., Any]) -> Callable[..., None]:
    """A function that compiles an entry for arguments of such types, and keeps it.

    entry: from ``vectorised`` or ``compact``, or a kernel.
    """
    return getattr(entry, "address", None) or entry._compile_for_args  # type: ignore[attr-defined,no-any-return]


@contextmanager
def _set(settings: tuple[tuple[str, int], ...]) -> Iterator[None]:
    """Compile with settings of numba's own inside this context."""
    import numba

    of_numba: Any = numba.config
    with _COMPILING:
        before = {name: getattr(of_numba, name) for name, _ in settings}
        for name, value in settings:
            setattr(of_numba, name, type(before[name])(value))
        try:
            yield
        finally:
            for name, known in before.items():
                setattr(of_numba, name, known)


@contextmanager
def _uncollected() -> Iterator[None]:
    """No garbage collection for a while, if there was one.

    A compilation makes millions of small objects that all live to its end: a fifth of its time went into visiting them.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()
