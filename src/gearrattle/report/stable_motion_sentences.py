"""The number of stable motions over a value, and the jumps: the first sentences of a page of branches.

The number of motions at a value follows from the ranges of stable motions on a branch, or from the runs of sweeps.
Ranges narrower than a width are left out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from gearrattle.orbits import Branch
from gearrattle.orbits.stability_ranges import Range
from gearrattle.wording import listed

_MOST_SAID = 4
_NUMBERS = ("no known", "one", "two", "three", "four", "five", "six")


@dataclass(frozen=True)
class Count:
    """Begin and end of a part of the range, ascending [SI], and the number of stable motions known in it."""

    low: float
    high: float
    motions: int


def counts_of(branch: Branch, ranges: Sequence[Range]) -> list[Count]:
    """Return the number of known stable motions over the whole range of a branch, by ranges of constant stability."""
    low, high = sorted(branch.range)
    width = branch.narrow * (high - low)
    if branch.sweeps is not None:
        return _of_sweeps(branch, low, high)
    stable = [(min(one.begin, one.end), max(one.begin, one.end)) for one in ranges if one.stable]
    edges = sorted({low, high, *(edge for one in stable for edge in one if low < edge < high)})
    parts = [
        Count(begin, end, sum(one[0] <= 0.5 * (begin + end) <= one[1] for one in stable))
        for begin, end in pairwise(edges)
    ]
    return _merged(parts, width)


def _merged(parts: Sequence[Count], width: float) -> list[Count]:
    """Parts without narrow ones; neighbours with the same count are merged."""
    merged: list[Count] = []
    wide = [part for part in parts if part.high - part.low >= width] or list(parts)
    for part in wide:
        begin = merged[-1].high if merged else parts[0].low
        if merged and merged[-1].motions == part.motions:
            merged[-1] = Count(merged[-1].low, part.high, part.motions)
        else:
            merged.append(Count(begin, part.high, part.motions))
    if merged:
        merged[-1] = Count(merged[-1].low, parts[-1].high, merged[-1].motions)
    return merged


def _of_sweeps(branch: Branch, low: float, high: float) -> list[Count]:
    """Return counts from the sweeps: two motions where both directions differ, up to the jump or the next value."""
    sweeps = branch.sweeps
    assert sweeps is not None
    counts = list[Count]()
    reached = low
    values = [up.value for up, _ in sweeps.of_both]
    for first, last in sweeps.coexistence:
        # each end is the jump there, or else the next value with one motion
        below = max((value for value in values if value < first), default=low)
        above = min((value for value in values if value > last), default=high)
        begin = max((jump.value for jump in sweeps.jumps if below <= jump.value <= first), default=below)
        end = min((jump.value for jump in sweeps.jumps if last <= jump.value <= above), default=above)
        if begin > reached:
            counts.append(Count(reached, begin, 1))
        counts.append(Count(max(begin, reached), end, 2))
        reached = end
    if reached < high:
        counts.append(Count(reached, high, 1))
    return counts


def counts_words(counts: Sequence[Count], span: Callable[[float, float], str]) -> str:
    """Return a sentence with the number of stable motions by range; ``span`` writes a range of values."""
    lengths: dict[int, float] = {}
    for one in counts:
        lengths[one.motions] = lengths.get(one.motions, 0.0) + one.high - one.low
    if len(lengths) == 1:
        (motions,) = lengths
        if not motions:
            return "no stable motion was met"
        return f"{_number(motions)} stable {'motion' if motions == 1 else 'motions'} everywhere"
    usual = max(lengths, key=lambda motions: lengths[motions])
    parts = []
    for motions in sorted(lengths.keys() - {usual}, reverse=True):
        spans = [span(one.low, one.high) for one in counts if one.motions == motions]
        parts.append(f"{_number(motions)} stable {'motions' if motions > 1 else 'motion'} {some(spans)}")
    return f"{'; '.join(parts)}; elsewhere {_number(usual) if usual else 'none known'}"


def _number(count: int) -> str:
    return _NUMBERS[count] if count < len(_NUMBERS) else str(count)


def some(words: Sequence[str]) -> str:
    """Return the first few words of a list, and the number of the others."""
    more = len(words) - _MOST_SAID
    return listed([*words[:_MOST_SAID], *([f"{more} more"] if more > 0 else [])])


def jumps_words(upward: bool, values: Sequence[str]) -> str:
    """Return a sentence with the values at which the motion jumps in one direction; empty without jumps."""
    if not values:
        return ""
    return f"Going {'up' if upward else 'down'} the motion jumps at {some(list(dict.fromkeys(values)))}."
