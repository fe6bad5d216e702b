"""Derived values of an immutable object, kept on that object.

A driveline that runs again (another start, another length, another algorithm) must not be assembled again. A derived
value lives as long as its object; objects are not compared or hashed, and there is no global table that grows. Copies
and pickles of the object do not have the kept values.
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
    """The results kept on one object, by the function that made them, and the object itself."""

    def __init__(self, owner: object = None) -> None:
        self.owner = None if owner is None else weakref.ref(owner)
        self.results: dict[Callable[..., Any], Any] = {}

    def __reduce__(self) -> tuple[type[_Kept], tuple[()]]:
        """Return how to make an empty one without an owner: results are not pickled."""
        return _Kept, ()


def kept(function: Callable[[_A], _T]) -> Callable[[_A], _T]:
    """Decorate a function of one immutable object: the result is kept on the object.

    Threads that ask for the same value at the same time may each compute it. No thread waits for another, and all get
    the same object.
    """

    @wraps(function)
    def call(owner: _A) -> _T:
        holder: Any = vars(owner).get(_ATTRIBUTE)
        if holder is None or holder.owner is None or holder.owner() is not owner:  # none, or copied from another object
            holder = _Kept(owner)
            vars(owner)[_ATTRIBUTE] = holder
        results: dict[Callable[..., Any], _T] = holder.results
        if function not in results:
            return results.setdefault(function, function(owner))
        return results[function]

    return call
