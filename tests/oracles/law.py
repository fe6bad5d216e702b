"""The piecewise-linear law of an element, its drive and coast stages laid side by side."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from tests.oracles.driveline import differ
from tests.oracles.fixed_point import fixed


@dataclass(frozen=True)
class Law:
    """A piecewise-linear law: piece r lies between corners[r-1] and corners[r] and bears the label first + r."""

    corners: tuple[int, ...]
    stiffness: tuple[int, ...]
    damping: tuple[int, ...]
    offset: tuple[int, ...]
    first: int


def law_of(element) -> Law:
    """Lay the drive and coast stages of an element side by side; the elastic force is continuous."""
    drive, coast = element.sides
    up, down = _side(drive, Fraction(element.preload), 1), _side(coast, Fraction(element.preload), -1)
    split = differ(drive[0], coast[0])
    pieces = [p[:3] for p in reversed(down)] + [p[:3] for p in up]
    corners = [p[3] for p in reversed(down[:-1])] + [Fraction(0)] + [p[3] for p in up[:-1]]
    centre = len(down)
    if not split:  # delta = 0 is no corner: one piece through it
        del pieces[centre - 1], corners[centre - 1]
    columns = [tuple(fixed(x) for x in column) for column in zip(*pieces, strict=True)]
    return Law(tuple(fixed(c) for c in corners), *columns, first=-len(down) + (0 if split else 1))


def _side(stages, preload: Fraction, sign: int) -> list[tuple[Fraction, Fraction, Fraction, Fraction]]:
    """Return (slope, damping, offset, outer corner) of each stage from the centre outward, F = k d + c d' + f."""
    rows, force, inner = [], preload, Fraction(0)
    for stage in stages:
        k, c = Fraction(stage.stiffness), Fraction(stage.damping)
        outer = sign * Fraction(stage.until) if stage.until is not None else Fraction(0)
        rows.append((k, c, force - k * inner, outer))
        force, inner = force + k * (outer - inner), outer
    return rows
