"""Operations that numba does not offer: the names of ``_intrinsics``, imported when the first of them is used."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from gearrattle.engine.kernels._late import Late

_MAKERS = ("group_reader",)
"""The operations that create a kernel when a file is imported."""


def lapack_address(name: str) -> int:
    """Address of a routine in the LAPACK that SciPy contains."""
    return int(_written("lapack_address")(name))


def __getattr__(name: str) -> Any:
    """The operation of this name."""
    if name.startswith("__"):
        raise AttributeError(name)
    if name in _MAKERS:
        return lambda *arguments: _late(lambda: _written(name)(*arguments))
    return _late(lambda: _written(name))


def _late(make: Callable[[], Any]) -> Late:
    def made() -> Any:
        value = make()
        return value.made() if isinstance(value, Late) else value

    return Late(made)


def _written(name: str) -> Any:
    return getattr(import_module("gearrattle.engine.kernels._intrinsics"), name)
