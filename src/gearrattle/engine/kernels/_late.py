"""Kernels that are passed to numba only when they are first called.

Importing numba and preparing its targets takes half a second, and creating numba objects for three hundred kernels some
hundredths more. Therefore a decorated function is a ``Late``: numba is imported when the first kernel is called, and
only kernels that Python calls become numba objects. Machine code from the cache needs no numba objects of the kernels
it calls. Before a kernel is compiled, ``settle`` replaces the ``Late`` objects in all files by numba objects.

A strict kernel rounds every product and sum by itself, so it gives the same bits as plain Python (``plainly``).
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import update_wrapper
from typing import Any

import numpy as np

_LOCK = threading.RLock()
_FILES: dict[int, dict[str, Any]] = {}
"""The names of every file with kernels in it, by their identity."""


class _Mode(threading.local):
    """Settings of the calls of kernels in this thread."""

    is_plain = False


_MODE = _Mode()


class Late:
    """A kernel whose numba object is created when it is first called.

    make: creates the numba object.
    function: the Python function; None: the kernel has no Python form.
    """

    def __init__(
        self,
        make: Callable[[], Any],
        function: Callable[..., Any] | None = None,
        options: dict[str, Any] | None = None,
    ) -> None:
        self._make = make
        self._made = None
        self.options = options or {}
        if function is not None:
            update_wrapper(self, function)
            _FILES[id(function.__globals__)] = function.__globals__

    def __call__(self, *arguments: Any) -> Any:
        """Call the kernel."""
        return self.__wrapped__(*arguments) if _MODE.is_plain else self.made()(*arguments)

    def __getattr__(self, name: str) -> Any:
        """Any other attribute of numba's object."""
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.made(), name)

    def made(self) -> Any:
        """Numba's object for the function."""
        if self._made is None:
            with _LOCK:
                if self._made is None:
                    self._made = self._make()
                    _LATE[id(self._made)] = self
        return self._made


_LATE: dict[int, Late] = {}
"""Every ``Late`` by the identity of its numba object, which it keeps alive."""


def late(entry: Callable[..., Any]) -> Callable[..., Any]:
    """Return the ``Late`` of an entry, which is this object or its numba object."""
    return _LATE.get(id(entry), entry)


def settle() -> None:
    """Replace every kernel by numba's object in the modules that name it."""
    with _LOCK:
        for names in list(_FILES.values()):
            for name, value in list(names.items()):
                if isinstance(value, Late):
                    names[name] = value.made()


def is_plain() -> bool:
    """Whether kernels are called as plain Python in this thread just now."""
    return _MODE.is_plain


@contextmanager
def plainly() -> Iterator[None]:
    """Run strict kernels as plain Python inside this context if numba is not imported yet: the same bits."""
    before = _MODE.is_plain
    _MODE.is_plain = before or "numba" not in sys.modules
    try:
        with np.errstate(all="ignore"):
            yield
    finally:
        _MODE.is_plain = before
