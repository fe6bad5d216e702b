"""Along branches of periodic motions: ranges of one stability, and where a motion jumps.

The stability changes at an event: a fold, a period doubling, a symmetry breaking, a Neimark-Sacker bifurcation. A range
ends at the located event; where none was located, halfway between two points. At a fold the parameter turns back, so a
range ends at every fold: over each range the parameter only grows, or only falls.

Takes a Branch; gives ranges and jumps.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gearrattle.engine.periodic.events import BREAKING, DOUBLING, FOLD, NEIMARK_SACKER
from gearrattle.orbits.followed import Followed

CHANGES = frozenset({FOLD, DOUBLING, BREAKING, NEIMARK_SACKER})
"""Events at which the stability may change."""


@dataclass(frozen=True)
class Range:
    """Neighbouring points of a branch with the same stability and no fold between them.

    Attributes
    ----------
    branch
        number of the branch.
    begin, end
        values of the parameter at its two ends, in the order of the branch [SI].
    stable
        whether the motions are.
    points
        how many.
    cause
        of its end: the kind of an event, or what else ends it.
    """

    branch: int
    begin: float
    end: float
    stable: bool
    points: int
    cause: str


@dataclass(frozen=True)
class Jump:
    """A fold that a slowly changed value of the model runs over.

    Attributes
    ----------
    value
        of the parameter [SI].
    upward
        whether it is met with a growing value.
    branch
        number of the branch.
    """

    value: float
    upward: bool
    branch: int


def slices_of(branch: Followed) -> list[slice]:
    """Return the points of every branch."""
    ends = np.cumsum([0, *(len(curve.points) for curve in branch.curves)]).tolist()
    return [slice(a, b) for a, b in pairwise(ends)]


def ranges_of(branch: Followed) -> list[Range]:
    """Return ranges of one stability that end at folds, branch by branch, in the order of each."""
    stable, values = branch.data["stable"].values, branch.data["value"].values
    folds = branch.events.loc[branch.events["kind"] == FOLD, "point"].value_counts()
    turning = set(folds.index[folds % 2 == 1])
    ranges = []
    for number, part in enumerate(slices_of(branch)):
        first, begin = part.start, float(values[part.start])
        for i in range(part.start, part.stop - 1):
            if stable[i] != stable[i + 1] or i in turning:
                at, cause = _change(branch, i)
                ranges.append(Range(number, begin, at, bool(stable[i]), i + 1 - first, cause))
                first, begin = i + 1, at
        last = float(values[part.stop - 1])
        ranges.append(Range(number, begin, last, bool(stable[first]), part.stop - first, _end(branch, last)))
    return ranges


def _change(branch: Followed, before: int) -> tuple[float, str]:
    """Where the stability changes or the branch turns back after a point, and by what."""
    events = branch.events
    here = events[(events["point"] == before) & events["kind"].isin(CHANGES)]
    if len(here):
        return float(here["value"].iloc[0]), str(here["kind"].iloc[0])
    values = branch.data["value"].values
    grazing = events[(events["point"] == before) & (events["kind"] == "grazing")]
    if len(grazing):
        return float(grazing["value"].iloc[0]), "grazing"
    return float(0.5 * (values[before] + values[before + 1])), "not located"


def _end(branch: Followed, value: float) -> str:
    return "end of the range" if value in branch.range else "end of the branch"


def jumping_folds_of(branch: Followed) -> list[int]:
    """Return which events are folds at which stable motions end."""
    stable, events = branch.data["stable"].values, branch.events
    is_fold = (events["kind"] == FOLD).to_numpy() & (events["point"] + 1 < len(stable)).to_numpy()
    points = events["point"].to_numpy()
    return [int(e) for e in np.flatnonzero(is_fold) if stable[points[e]] or stable[points[e] + 1]]


def jumps_of(branch: Followed) -> list[Jump]:
    """Return the folds at which stable motions end, by their values."""
    values, jumps = branch.data["value"].values, []
    folds = branch.events.iloc[jumping_folds_of(branch)]
    for number, value, point in folds[["branch", "value", "point"]].itertuples(index=False):
        jumps.append(Jump(float(value), bool(value >= max(values[point], values[point + 1])), int(number)))
    return sorted(jumps, key=lambda jump: jump.value)


def nodes_of(branch: Followed, number: int) -> Iterator[tuple[int, int]]:
    """Yield the points and events of one branch in its order: (point, -1) or (point before it, event)."""
    part, points = slices_of(branch)[number], branch.events["point"].to_numpy()
    of_branch = np.flatnonzero(branch.events["branch"].to_numpy() == number)
    for i in range(part.start, part.stop):
        yield i, -1
        yield from ((i, int(e)) for e in of_branch if points[e] == i)


def stability_of_steps(branch: Followed, nodes: Sequence[tuple[int, int]]) -> list[bool]:
    """Return whether motions are stable between each node and the next."""
    stable, kinds = branch.data["stable"].values, branch.events["kind"].tolist()
    steps = []
    has_changed = False
    for (point, event), following in pairwise(nodes):
        has_changed = event >= 0 and (has_changed or kinds[event] in CHANGES)
        after = point if event < 0 else min(point + 1, len(stable) - 1)
        is_last = following[1] < 0 and event >= 0
        steps.append(bool(stable[after if has_changed or is_last else point]))
    return steps
