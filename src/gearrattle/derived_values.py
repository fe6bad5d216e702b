"""Derived values of an immutable object, kept on that object.

A driveline that runs again (another start, another length, another algorithm) must not be assembled again. A derived
value lives as long as its object: nothing is compared or hashed, and no table grows. Copies and pickles begin without
it.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

_A = TypeVar("_A")
_T = TypeVar("_T")

_ATTRIBUTE = "_kept"


class _Kept:
    """Results by the function that made them, and their owner."""

    def __init__(self, owner: object = None) -> None:
        self.owner = None if owner is None else weakref.ref(owner)
        self.results: dict[Callable[..., Any], Any] = {}

    def __reduce__(self) -> tuple[type[_Kept], tuple[()]]:
        """Return what makes one that belongs to nothing: results do not travel."""
        return _Kept, ()


def kept(function: Callable[[_A], _T]) -> Callable[[_A], _T]:
    """Decorate a function of one immutable object: the result is kept on the object.

    Threads that ask for the same at the same time may each make it; none waits for another, all get the same.
    """

    @wraps(function)
    def call(owner: _A) -> _T:
        holder: Any = vars(owner).get(_ATTRIBUTE)
        if holder is None or holder.owner is None or holder.owner() is not owner:  # none yet, or that of an original
            holder = _Kept(owner)
            vars(owner)[_ATTRIBUTE] = holder
        results: dict[Callable[..., Any], _T] = holder.results
        if function not in results:
            return results.setdefault(function, function(owner))
        return results[function]

    return call
