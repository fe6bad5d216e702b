"""Along branches of periodic motions: ranges of one stability, and where a motion jumps.

The stability changes at an event: a fold, a period doubling, a symmetry breaking, a Neimark-Sacker bifurcation. A range
ends at the located event; where none was located, halfway between two points. At a fold the parameter turns back, so a
range ends at every fold: over each range the parameter only grows, or only falls. A range without width, such as that
of a vertical branch, is none.

Where the parameter runs over a fold the motion jumps. Where it runs over a period doubling or a symmetry breaking, the
motion goes on along what leaves there, if that is stable just beyond (a *soft* loss of stability); if it is unstable,
leads backwards or is vertical, the motion jumps (a *hard* loss). Of a Neimark-Sacker bifurcation nothing is known.

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
_NO_WIDTH = 1e-9  # of the range: values that differ by less are one, as along a vertical branch
_SAME = 1e-6  # of swings: motions that differ by less are one


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
    """An event that a slowly changed value of the model runs over, and beyond which a motion does not go on.

    Attributes
    ----------
    value
        of the parameter [SI].
    upward
        whether it is met with a growing value.
    branch
        number of the branch.
    kind
        of the event.
    """

    value: float
    upward: bool
    branch: int
    kind: str = FOLD


def slices_of(branch: Followed) -> list[slice]:
    """Return the points of every branch."""
    ends = np.cumsum([0, *(len(curve.points) for curve in branch.curves)]).tolist()
    return [slice(a, b) for a, b in pairwise(ends)]


def ranges_of(branch: Followed) -> list[Range]:
    """Return ranges of one stability that end at folds, branch by branch, in the order of each."""
    stable, values = branch.data["stable"].values, branch.data["value"].values
    folds = branch.events.loc[branch.events["kind"] == FOLD, "point"].value_counts()
    turning = set(folds.index[folds % 2 == 1])
    ranges = list[Range]()
    for number, part in enumerate(slices_of(branch)):
        first, begin, own = part.start, float(values[part.start]), list[Range]()
        for i in range(part.start, part.stop - 1):
            if stable[i] != stable[i + 1] or i in turning:
                at, cause = _change(branch, i)
                own.append(Range(number, begin, at, bool(stable[i]), i + 1 - first, cause))
                first, begin = i + 1, at
        last = float(values[part.stop - 1])
        own.append(Range(number, begin, last, bool(stable[first]), part.stop - first, _end(branch, number, last)))
        wide = [one for one in own if abs(one.end - one.begin) > _no_width(branch)]
        ranges += wide or own[:1]
    return ranges


def _no_width(branch: Followed) -> float:
    return _NO_WIDTH * abs(branch.range[1] - branch.range[0])


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


def _end(branch: Followed, number: int, value: float) -> str:
    """What ends a branch: the range, the event at which it joins another one, or something else."""
    if value in branch.range:
        return "end of the range"
    curve = branch.curves[number]
    return curve.events[-1].kind if curve.happens_at(-1) else "end of the branch"


def jumping_folds_of(branch: Followed) -> list[int]:
    """Return which events are folds at which stable motions end."""
    stable, events = branch.data["stable"].values, branch.events
    is_fold = (events["kind"] == FOLD).to_numpy() & (events["point"] + 1 < len(stable)).to_numpy()
    points = events["point"].to_numpy()
    return [int(e) for e in np.flatnonzero(is_fold) if stable[points[e]] or stable[points[e] + 1]]


def jumps_of(branch: Followed) -> list[Jump]:
    """Return the folds at which stable motions end and the hard losses of their stability, by their values."""
    values, jumps = branch.data["value"].values, []
    folds = branch.events.iloc[jumping_folds_of(branch)]
    for number, value, point in folds[["branch", "value", "point"]].itertuples(index=False):
        jumps.append(Jump(float(value), bool(value >= max(values[point], values[point + 1])), int(number)))
    jumps += [
        Jump(loss.value, loss.upward, loss.branch, loss.kind)
        for loss in _losses(branch)
        if (beyond := _stable_beyond(branch, loss)) and not any(beyond)
    ]
    return sorted(jumps, key=lambda jump: jump.value)


def not_known_of(branch: Followed) -> list[tuple[str, float]]:
    """Return kinds and values of the events at which motions lose their stability, and of what leaves nothing is known.

    At each of them the motion may jump, or not.
    """
    lost = [loss for loss in _losses(branch) if not _stable_beyond(branch, loss)]
    return sorted({(loss.kind, loss.value) for loss in lost}, key=lambda pair: pair[1])


@dataclass(frozen=True)
class _Loss:
    """An event other than a fold at which motions lose their stability, if the value goes one way."""

    event: int
    branch: int
    kind: str
    value: float
    upward: bool


def _losses(branch: Followed) -> list[_Loss]:
    stable, values = branch.data["stable"].values, branch.data["value"].values
    losses, parts = list[_Loss](), slices_of(branch)
    columns = branch.events[["branch", "kind", "value", "point"]]
    for event, (number, kind, value, point) in enumerate(columns.itertuples(index=False)):
        if kind not in CHANGES - {FOLD} or point + 1 >= parts[number].stop or stable[point] == stable[point + 1]:
            continue
        before, after = (point, point + 1) if stable[point] else (point + 1, point)
        if abs(values[after] - values[before]) > _no_width(branch):
            losses.append(_Loss(event, int(number), str(kind), float(value), bool(values[after] > values[before])))
    return losses


def _stable_beyond(branch: Followed, loss: _Loss) -> list[bool]:
    """Of every branch that leaves or ends at an event whether its motions are stable just beyond that; empty: none."""
    if loss.kind == NEIMARK_SACKER:
        return []
    stable, values = branch.data["stable"].values, branch.data["value"].values
    swings, least = branch.data["peak_to_peak"].values, _no_width(branch)
    apart = _SAME * float(swings.max(initial=0.0))
    own = branch.event_levels[loss.event, 1] - branch.event_levels[loss.event, 0]
    cycles = branch.curves[loss.branch].cycles * (2 if loss.kind == DOUBLING else 1)
    beyond = []
    for number, (part, curve) in enumerate(zip(slices_of(branch), branch.curves, strict=True)):
        if number == loss.branch or curve.cycles != cycles:
            continue
        inwards = np.arange(part.start, part.stop)
        for points in (inwards, inwards[::-1]):
            away = values[points] - loss.value
            if abs(away[0]) > least or np.abs(swings[points[0]] - own).max() > apart:
                continue
            is_next = len(points) > 1 and abs(away[1]) > least  # else it is vertical
            beyond.append(bool(is_next and stable[points[1]] and (away[1] > 0.0) == loss.upward))
    return beyond


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
