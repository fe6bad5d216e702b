"""The one door to numba.

``kernel`` compiles a function on first call and keeps it on disk. numba's own cache does not notice an edit in another
kernel file, so the folder carries a stamp of all of them: warm starts stay warm, an edit recompiles. Set
``NUMBA_DISABLE_JIT=1`` to run every kernel as plain Python (coverage, debugging).
"""

from __future__ import annotations

import gc
import hashlib
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import RLock
from typing import Any

import numba


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
    """A writable cache folder named after the content of all kernel files and the compiler's version."""
    stamp = hashlib.sha256(f"{numba.__version__} {sys.version}".encode())
    for file in sorted(Path(__file__).parent.glob("*.py")):
        stamp.update(file.read_bytes())
    name = f"kernels-{stamp.hexdigest()[:16]}"
    for parent in (_user_cache() / "gearrattle", Path(tempfile.gettempdir()) / "gearrattle"):
        try:
            (parent / name).mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(parent / name, os.W_OK):
            return str(parent / name)
    return ""


_FOLDER = _stamped_folder()


def _compiled(function: Callable[..., Any], **options: Any) -> Any:
    settings: Any = numba.config
    before = settings.CACHE_DIR
    settings.CACHE_DIR = _FOLDER or before
    try:
        return numba.njit(cache=bool(_FOLDER), nogil=True, error_model="numpy", fastmath={"contract"}, **options)(
            function
        )
    finally:
        settings.CACHE_DIR = before


def kernel(function: Callable[..., Any]) -> Any:
    """Compile for floats and arrays: no Python objects, no exceptions, the interpreter lock released.

    Products and sums may be fused (fma) but never reordered: event times depend on rounding. Which are fused depends on
    what stands side by side, so everything is put into the entry kernel (``forceinline``): code compiled just now and
    code from the cache then give the same bits, and a motion can go on in another process.
    """
    return _compiled(function, forceinline=True)


def separate(function: Callable[..., Any]) -> Any:
    """Compile once and call: for large parts with several callers, where the last bit may depend on the compiler."""
    return _compiled(function)


def inlined(function: Callable[..., Any]) -> Any:
    """The same for the small parts of a hot loop: written into their callers, so that a call costs nothing."""
    return _compiled(function, inline="always")


_COMPILING = RLock()


def vectorised(entry: Callable[..., Any]) -> Callable[..., Any]:
    """An entry kernel that is compiled, when first called, with LLVM's straight-line vectoriser on.

    numba leaves it off by default; the strips of four that the marching kernels multiply gain a factor of two. The
    setting is numba's own global one, so it is put back after the call. The garbage collector rests meanwhile: a
    compilation makes millions of small objects that all live to its end, and a fifth of its time went into visiting
    them.
    """

    def call(*arguments: Any) -> Any:
        if getattr(entry, "signatures", ()):
            return entry(*arguments)
        settings: Any = numba.config
        with _COMPILING, _uncollected():
            before = settings.SLP_VECTORIZE
            settings.SLP_VECTORIZE = 1
            try:
                return entry(*arguments)
            finally:
                settings.SLP_VECTORIZE = before

    return call


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
