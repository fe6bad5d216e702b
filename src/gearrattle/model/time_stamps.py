"""Time stamps in a table: dates and clock times, as seconds from the first.

    2026-03-01T08:15:00.250     01.03.2026 08:15:00,250     08:15:00.250     8:15:00 PM     2026-03-01T08:15:00+01:00

A fraction stands behind a point, a comma or, of three digits, a colon. Of dates with slashes, whose day and month may
stand in either order, that order is taken in which the record is shorter. Clock times that fall back by more than half
a day have passed midnight.
"""

from __future__ import annotations

import re
from datetime import date
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_DAY = re.compile(r"(\d{1,4})([-./,])(\d{1,2})\2(\d{1,4})")
_CLOCK = re.compile(
    r"(\d{1,2}):([0-5]\d)(?::([0-5]\d|60)(?:[.,](\d{1,12})|:(\d{3}))?)?"
    r"(?:\s*([AaPp])[Mm])?\s*(Z|UTC|GMT|[+-]\d{2}(?::?\d{2})?)?"
)
_SECOND = 1_000_000_000  # in ns
_A_DAY = 86_400


class Instant(NamedTuple):
    """A time stamp.

    Attributes
    ----------
    day
        year, month and day in the order of the text, and what parts them; None: a clock time without a date.
    clock
        since midnight [ns]; None: a date without a clock time.
    zone
        what the clock is before that of Greenwich [min]; None: not said.
    """

    day: tuple[int, int, int, str] | None
    clock: int | None
    zone: int | None

    @property
    def form(self) -> tuple[bool, bool, bool]:
        """Whether it has a date, a clock time and a zone."""
        return self.day is not None, self.clock is not None, self.zone is not None


def instant_of(text: str) -> Instant | None:
    """Return the time stamp in the text of one entry, without quotes; None if it is no time stamp."""
    rest = text.strip()
    day = None
    if match := _DAY.match(rest):
        day = (int(match[1]), int(match[3]), int(match[4]), match[2])
        if not _days(day):
            return None
        rest = rest[match.end() :].lstrip("T ,")
        if not rest:
            return Instant(day, None, None)
    match = _CLOCK.fullmatch(rest)
    if match is None or (day is None and match[3] is None):  # 08:15 may be minutes and seconds
        return None
    hours = int(match[1])
    if match[6]:
        hours = hours % 12 + (12 if match[6] in "Pp" else 0)
    fraction = (match[4] or match[5] or "").ljust(9, "0")[:9]
    clock = (hours * 3600 + int(match[2]) * 60 + int(match[3] or 0)) * _SECOND + int(fraction)
    return Instant(day, clock, _zone(match[7]))


def _zone(text: str | None) -> int | None:
    """Return a zone in minutes; None: none is said."""
    if text is None:
        return None
    digits = re.sub(r"\D", "", text).ljust(4, "0")
    minutes = int(digits[:2]) * 60 + int(digits[2:4])
    return -minutes if text.startswith("-") else minutes


def _days(day: tuple[int, int, int, str]) -> list[int]:
    """Return the number of a day in every order of year, month and day that it may be written in."""
    one, two, three, mark = day
    if one > 31:
        orders = [(one, two, three)]
    elif mark in ".,":
        orders = [(three, two, one)]
    else:
        orders = [(three, one, two), (three, two, one)]
    numbers = []
    for year, month, number in orders:
        try:
            numbers.append(date(year + 2000 if year < 100 else year, month, number).toordinal())
        except ValueError:
            numbers.append(0)
    return numbers if any(numbers) else []


class FromFirst:
    """Reads the stamps of one column as seconds from the first."""

    def __init__(self, first: str) -> None:
        instant = instant_of(first)
        assert instant is not None
        self.first = instant

    def __call__(self, text: str) -> float:
        """Return the seconds of one stamp; ValueError if the text does not have the form of the first."""
        instant = instant_of(text)
        if instant is None or instant.form != self.first.form:
            raise ValueError(text)
        clock = (instant.clock or 0) - (self.first.clock or 0)
        clock -= 60 * ((instant.zone or 0) - (self.first.zone or 0)) * _SECOND
        return (self._since(instant) * _A_DAY * _SECOND + clock) / _SECOND

    def _since(self, instant: Instant) -> int:
        """Return the days from the first stamp to another."""
        if instant.day is None or self.first.day is None or instant.day == self.first.day:
            return 0
        pairs = zip(_days(self.first.day), _days(instant.day), strict=False)
        apart = [later - former for former, later in pairs if former and later]
        forwards = [days for days in apart if days >= 0]
        return min(forwards) if forwards else max(apart, default=0)


def over_midnight(seconds: NDArray[np.float64]) -> tuple[NDArray[np.float64], int]:
    """Return clock times (N,) [s], changed in place, without their falls at midnight, and the number of these."""
    import numpy as np

    falls = np.flatnonzero(np.diff(seconds) < -0.5 * _A_DAY) + 1
    ends = [*falls[1:], seconds.size]
    for days, (begin, end) in enumerate(zip(falls, ends, strict=False), 1):
        seconds[begin:end] += _A_DAY * days
    return seconds, falls.size
