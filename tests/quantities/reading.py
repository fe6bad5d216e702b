"""Look up one value among a criterion's entries."""

from __future__ import annotations

from collections.abc import Iterable

from gearrattle.quantities import Entry


def one(entries: Iterable[Entry], subject: str, quantity: str) -> Entry:
    """Return the only entry with this subject and quantity."""
    (found,) = [item for item in entries if (item.subject, item.quantity) == (subject, quantity)]
    return found


def value(entries: Iterable[Entry], subject: str, quantity: str) -> float:
    """Return the number of that entry."""
    number = one(entries, subject, quantity).value
    assert isinstance(number, float)
    return number
