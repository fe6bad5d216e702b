"""Remember what was made of the same objects before.

Running a driveline again (another start, another length, another algorithm) must not build it again. Results are kept
for the last few arguments, told apart by identity: nothing is compared or hashed, and an argument that could change
must not be handed in.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from functools import wraps
from threading import Lock
from typing import TypeVar, TypeVarTuple

_A = TypeVarTuple("_A")
_T = TypeVar("_T")


def remembered(most: int) -> Callable[[Callable[[*_A], _T]], Callable[[*_A], _T]]:
    """Decorate a function of immutable positional arguments: its results for the last ``most`` of them are kept.

    Threads that ask for the same at the same time may each make it; none waits for another.
    """

    def decorate(function: Callable[[*_A], _T]) -> Callable[[*_A], _T]:
        kept: OrderedDict[tuple[int, ...], tuple[tuple[object, ...], _T]] = OrderedDict()  # arguments stay alive
        lock = Lock()

        @wraps(function)
        def call(*arguments: *_A) -> _T:
            key = tuple(map(id, arguments))
            with lock:
                if key in kept:
                    kept.move_to_end(key)
                    return kept[key][1]
            result = function(*arguments)
            with lock:
                kept[key] = arguments, result
                while len(kept) > most:
                    kept.popitem(last=False)
            return result

        return call

    return decorate
