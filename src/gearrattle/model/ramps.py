"""Ramps of a torque: from its mean to another level in a straight line, then to the next; a tip-in, or a step.

    ramps = [{ at = "0.5 s", over = "0.2 s", to = "80 N*m" }]

Between ramps, and after the last one, the level is constant. A ramp without ``at`` begins when the one before it has
ended: so a curve of several pieces stays in one piece whatever their durations are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated

from gearrattle.model import units
from gearrattle.model.signal import Signal
from gearrattle.model.table import Breach, Table
from gearrattle.model.value_kinds import Quantity, value_of
from gearrattle.wording import engineering, quantity


class Ramp(Table):
    """A change of a torque to another level."""

    at: Annotated[float, Quantity(units.TIME, "non-negative")] | None = None
    """When it begins [s]; None: when the ramp before has ended."""
    over: Annotated[float, Quantity(units.TIME, "non-negative")] = 0.0
    """How long it takes [s]; 0 is a step."""
    to: Annotated[float, Quantity(units.TORQUE)]
    """The level that it leads to [N m]."""

    def in_words(self, *, is_si: bool) -> str:
        """Say where the torque goes, and when."""
        second, newton_metre = ("s", "N m") if is_si else ("", "")
        begin = "then" if self.at is None else f"at {engineering(self.at, second)}"
        how = f"over {engineering(self.over, second)}" if self.over else "at once"
        return f"{begin} to {quantity(self.to, newton_metre)} {how}"


def overlaps(rows: object, dimensionless: bool) -> Iterator[Breach]:
    """Yield the breaches of ramps, as they are written, that begin before the one before has ended."""
    if not isinstance(rows, Sequence) or isinstance(rows, str):
        return
    ends: float | None = None
    for index, row in enumerate(rows):
        at, over = (value_of(Ramp, row, key, dimensionless) for key in ("at", "over"))
        written = row.get("at") if isinstance(row, Mapping) else at
        if over is None or (at is None and written is not None):  # what is wrong with it the field says
            return
        if at is None and ends is None:
            yield Breach(("ramps", index, "at"), None, "the first ramp must say when it begins", 'at = "0.5 s"')
            return
        if at is not None and ends is not None and at < ends:
            rule = f"must begin when the ramp before has ended, at {ends:.6g} s, or later"
            yield Breach(("ramps", index, "at"), written, rule, "leave `at` out: then it begins there")
        begin = ends if at is None else at
        ends = (begin or 0.0) + over


def spans_of(ramps: Sequence[Ramp]) -> list[tuple[float, float]]:
    """Return when every ramp begins and ends [s]."""
    spans: list[tuple[float, float]] = []
    for ramp in ramps:
        before = spans[-1][1] if spans else 0.0
        begin = before if ramp.at is None else ramp.at
        spans.append((begin, begin + ramp.over))
    return spans


def level_over_time(ramps: Sequence[Ramp], level: float) -> Signal:
    """Return the signal [N m] that ramps, in the order of time, make of a level [N m]."""
    import numpy as np

    points = [(0.0, 0.0)]
    for ramp, (begin, end) in zip(ramps, spans_of(ramps), strict=True):
        before = points[-1][1]
        points += [(begin, before), (end, ramp.to - level)]
    points = _proper(points)
    time = np.array([at for at, _ in points])
    value = np.array([at_level for _, at_level in points])
    return Signal(time, value, static=0.0, source="ramps", interpolation="linear", is_held=True)


def _proper(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return points of which at most two, the levels before and after a jump, stand at one time."""
    kept: list[tuple[float, float]] = []
    for point in points:
        if kept and kept[-1] == point:
            continue
        if len(kept) > 1 and kept[-2][0] == point[0]:
            kept.pop()
        kept.append(point)
    return kept
