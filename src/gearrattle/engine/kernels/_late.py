"""Kernels that are handed to numba only when they are first called.

To import numba and to prepare its targets takes half a second, and an object of numba's for each of three hundred
kernels some hundredths more. Therefore a decorated function is a ``Late``: numba is imported when the first is called,
and only those that Python calls become objects of numba's. Machine code from the cache needs nothing of what a kernel
calls; where one must be compiled, the names in its file have to be numba's objects: ``settle``.

A strict kernel rounds every product and sum by itself, so as plain Python it gives the same bits: ``plainly``.
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
    """A kernel that is made when it is first called.

    make: makes numba's object.
    function: as Python; None of what has no plain form.
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
        """Run it."""
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
"""By the identity of what was made of it, which it keeps."""


def late(entry: Callable[..., Any]) -> Callable[..., Any]:
    """Return the one ``Late`` of an entry, given this object or numba's."""
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
