"""Neighbouring events as one family: "a cascade of 5 period doublings from 1187.4 to 1188.1 rpm".

Events are sorted by value. An event belongs to the family of the event before it if their values differ by less than a
width. A family has at least three events; a fold and a grazing near each other are listed as two events.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gearrattle.engine.periodic.events.event_record import DOUBLING
from gearrattle.orbits import Branch
from gearrattle.wording import counted, listed

_FEWEST = 3  # least number of events in a family


@dataclass(frozen=True)
class EventFamily:
    """Neighbouring events, or a single event: ascending rows in the table of events, and range of the values [SI]."""

    rows: tuple[int, ...]
    kinds: tuple[str, ...]
    low: float
    high: float

    @property
    def words(self) -> str:
        """The kinds of its events in words."""
        counts = Counter(self.kinds)
        parts = [counted(count, kind) for kind, count in counts.most_common()]
        if len(self.kinds) == 1:
            return self.kinds[0]
        is_cascade = counts[DOUBLING] >= _FEWEST and counts.most_common(1)[0][0] == DOUBLING
        return f"a cascade: {listed(parts)}" if is_cascade else listed(parts)


def families_of(branch: Branch) -> list[EventFamily]:
    """Return the families of the events of a branch, and its single events, in the order of their first rows."""
    values = branch.events["value"].to_numpy(np.float64)
    kinds = [str(kind) for kind in branch.events["kind"]]
    width = branch.narrow * abs(branch.range[1] - branch.range[0])
    families: list[EventFamily] = []
    for rows in _near(values, width):
        parts = [rows] if len(rows) >= _FEWEST else [[row] for row in rows]
        families += [_family(sorted(part), kinds, values) for part in parts]
    return sorted(families, key=lambda family: family.rows[0])


def _near(values: np.ndarray, width: float) -> list[list[int]]:
    """Rows in groups, in which neighbouring values differ by less than a width."""
    groups: list[list[int]] = []
    for row in np.argsort(values, kind="stable").tolist():
        if groups and values[row] - values[groups[-1][-1]] < width:
            groups[-1].append(row)
        else:
            groups.append([row])
    return groups


def _family(rows: Sequence[int], kinds: Sequence[str], values: np.ndarray) -> EventFamily:
    own = [float(values[row]) for row in rows]
    return EventFamily(tuple(rows), tuple(kinds[row] for row in rows), min(own), max(own))
