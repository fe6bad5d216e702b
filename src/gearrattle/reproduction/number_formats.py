"""Formats of numbers on the reproduction page."""

from __future__ import annotations

from gearrattle.report.plots.numerals import grouped, numeral


def counted(number: int) -> str:
    """An integer with its digits in groups of three."""
    return grouped(number)


def figure(value: float, digits: int = 3) -> str:
    """A number with a few significant digits; a dash for NaN."""
    return numeral(float(value), digits)


def several(number: int, noun: str) -> str:
    """A count and its noun, in the plural unless the count is 1."""
    return f"{counted(number)} {noun}" if number == 1 else f"{counted(number)} {noun}s"
