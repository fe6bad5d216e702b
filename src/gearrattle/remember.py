"""Remember what was made of the same objects before.

Running a driveline again (another start, another length, another algorithm) must not build it again. Results are kept
for the last few arguments, told apart by identity: nothing is compared or hashed, and an argument that could change
must not be handed in.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from functools import wraps
from threading import RLock
from typing import ParamSpec, TypeVar

_P = ParamSpec("_P")
_T = TypeVar("_T")


def remembered(most: int) -> Callable[[Callable[_P, _T]], Callable[_P, _T]]:
    """Decorate a function of immutable positional arguments: its results for the last ``most`` of them are kept."""

    def decorate(function: Callable[_P, _T]) -> Callable[_P, _T]:
        kept: OrderedDict[tuple[int, ...], tuple[tuple[object, ...], _T]] = OrderedDict()  # arguments stay alive
        lock = RLock()

        @wraps(function)
        def call(*arguments: _P.args, **named: _P.kwargs) -> _T:
            key = tuple(map(id, arguments))
            with lock:
                if key not in kept:
                    kept[key] = arguments, function(*arguments, **named)
                kept.move_to_end(key)
                while len(kept) > most:
                    kept.popitem(last=False)
                return kept[key][1]

        return call

    return decorate
