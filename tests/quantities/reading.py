"""Evaluate one criterion, and look up one value among its rows."""

from __future__ import annotations

from collections.abc import Iterable

from gearrattle.quantities.evaluation import add
from gearrattle.quantities.quantity import Quantity, Row, Sums
from gearrattle.trajectory import Trajectory


def evaluate(criterion: Quantity[Sums], motion: Trajectory) -> list[Row]:
    """Return the rows of one criterion of a whole motion."""
    return criterion.rows(add(motion, None, [criterion]))


def one(rows: Iterable[Row], subject: str, quantity: str) -> Row:
    """Return the only row with this subject and quantity."""
    (row,) = [row for row in rows if (row.subject, row.quantity) == (subject, quantity)]
    return row


def value(rows: Iterable[Row], subject: str, quantity: str) -> float:
    """Return the number in that row."""
    number = one(rows, subject, quantity).value
    assert isinstance(number, float)
    return number
