"""Progress of work with several parts, as one share that never falls."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[float], None]


def silent(_: float) -> None:
    """Report nothing."""


def never_falling(progress: Progress | None) -> Progress:
    """Return a function that passes on the largest share so far, because the value along a branch may turn back.

    None: the shares are not reported.
    """
    if progress is None:
        return silent
    largest = 0.0

    def report(share: float) -> None:
        nonlocal largest
        largest = max(largest, min(1.0, share))
        progress(largest)

    return report


def part_of(progress: Progress, number: int, count: int) -> Progress:
    """Return the progress of part ``number``, from 0, of ``count`` equal ones."""
    return stretch_of(progress, number / count, (number + 1) / count)


def stretch_of(progress: Progress, begin: float, end: float) -> Progress:
    """Return the progress of the work between two shares of the whole."""
    return lambda share: progress(begin + (end - begin) * share)
