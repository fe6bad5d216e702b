"""How far work of several parts has come, as one share that never falls."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[float], None]


def never_falling(progress: Progress) -> Progress:
    """Return a function that passes on the largest share so far: the value along a branch may turn back."""
    largest = 0.0

    def report(share: float) -> None:
        nonlocal largest
        largest = max(largest, min(1.0, share))
        progress(largest)

    return report


def part_of(progress: Progress | None, number: int, count: int) -> Progress | None:
    """Return the function for part ``number``, from 0, of ``count`` equal ones; None if there is none to tell."""
    return stretch_of(progress, number / count, (number + 1) / count)


def stretch_of(progress: Progress | None, begin: float, end: float) -> Progress | None:
    """Return the function for the work between two shares of the whole; None if there is none to tell."""
    if progress is None:
        return None
    return lambda share: progress(begin + (end - begin) * share)
