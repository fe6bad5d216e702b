"""Assignment of pulses to the teeth of a wheel: gaps of the wheel, pulses lost, pulses too many.

A wheel is the sequence of its intervals over a turn, in teeth: all 1 for a full wheel; fifty-seven of 1 and one of 3
for 60-2. Every measured interval is taken in units of a tooth, by the median of the seven intervals around it. A wheel
with several gaps is recognised by the sequence that most of its turns show; it need not be given.

Then the sequence is followed. Where an interval is off by more than a factor of 1.4, the readings of what follows are
compared: that the shaft did so, that up to five pulses in a row are lost, that one or two are too many. The cost of a
reading is the sum of the squared logarithms of its intervals over the wheel's, and ``_EDIT`` for every pulse lost or
too many; the cheapest one is taken (A. J. Viterbi 1967, IEEE Trans. Inf. Theory 13, 260-269). On a full wheel a pulse
is lost from about 1.63 intervals on. A step of the speed, a run-up or a vibration does not become cheaper by such a
reading, as the median follows it.

On a wheel with gaps the next gap decides. On a full one a repair must be certain as well: the shaft does not slow down
towards the interval on either side, as it does before and after a standstill; and on a wheel with fewer than ``_FINE``
teeth, over one of which a real speed may change by half, and near the ends, it must turn evenly there. A repair that is
not certain is not made, but reported. A fault that recurs every turn means another wheel, not a lost pulse.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Gaps = tuple[int, ...] | tuple[tuple[int, ...], ...]
"""How many teeth are left out at each gap, or the numbers of the teeth left out, gap by gap; empty: a full wheel."""

SHARE = 0.02
"""Of the pulses: more that are lost or too many are refused; one is always repaired."""
_AROUND = 7  # intervals whose median is the unit of the one in their middle
_AGREES = 0.35  # logarithm of an interval over the wheel's that still agrees
_GAP_AGREES = 0.5  # of teeth: the stricter limit at a gap
_DOUBTFUL = 0.5  # beyond it an interval that is left as it is gets reported
_NEAR = 0.25  # largest misfit of a reading with pulses lost or too many, as a logarithm
_TEETH_OFF = 0.45  # largest misfit in teeth: beyond it the number of lost ones is not known
_CERTAIN = 6  # intervals of a reading that are kept; those after it only decide between readings
_EDIT = 0.2
_EDITS = ((0, 0), *((0, lost) for lost in range(1, 6)), (1, 0), (2, 0))  # pulses too many, pulses lost
_FINE = 20  # teeth, from which on no real speed changes by half over one
_EVEN = 0.2  # of logarithms: how far the neighbours may be off there, and how well a repair must fit
_EVEN_FIT = 0.15
_SLOWS = 0.2  # logarithm by which the nearest three intervals are longer than the next three where a shaft stops
_RECURS = 0.8  # of the distances between intervals that are off: so many alike are another wheel
_FEWEST_RECURRING = 4


class PulseError(ValueError):
    """Pulses from which no angle follows, with rule and remedy."""

    def __init__(self, rule: str, remedy: str) -> None:
        super().__init__(rule)
        self.rule = rule
        self.remedy = remedy


class Teeth(NamedTuple):
    """Pulses that belong to teeth.

    Attributes
    ----------
    times
        (P,) of the pulses that count [s].
    passed
        (P,) teeth since the first of them.
    lost
        when pulses are missing, by equal speed over their interval [s].
    extra
        when there were pulses too many [s].
    unsure
        when intervals begin that may be faults and were left as they are [s].
    """

    times: Array
    passed: Array
    lost: Array
    extra: Array
    unsure: Array


class _Reading(NamedTuple):
    """Teeth of every interval, and the faults, by numbers of intervals."""

    teeth: Array
    edits: list[tuple[int, int, int]]  # interval, pulses too many, pulses lost
    unsure: list[int]


def teeth_passed(times: Array, per_turn: float, gaps: Gaps = ()) -> Teeth:
    """Return the pulses that count, and the teeth passed at each.

    Parameters
    ----------
    times
        (P,) ascending [s], P >= 4.
    per_turn
        teeth of the wheel, those left out counted.

    Raises
    ------
    PulseError
        the wheel is not recognised, or more than ``SHARE`` of the pulses are lost or too many.
    """
    steps = np.diff(times)
    units = _in_teeth(steps)
    if gaps:
        pattern, start = _pattern(times, units, round(per_turn), gaps)
        reading = _both_ways(units, pattern, start)
        _refuse_another_wheel(times, units, reading, pattern)
    else:
        _refuse_recurring(times, units, per_turn)
        reading = _only_certain(times, units, _follow(units, np.ones(1)), per_turn)
    return _told(times, reading)


def _in_teeth(steps: Array) -> Array:
    """Return intervals over the median of those around."""
    from scipy.ndimage import median_filter

    logarithms = np.log(steps)
    around = median_filter(logarithms, size=_AROUND, mode="mirror")
    half = _AROUND // 2
    around[:half] = np.median(logarithms[:_AROUND])
    around[-half:] = np.median(logarithms[-_AROUND:])
    return np.asarray(np.exp(logarithms - around), dtype=np.float64)


def _pattern(times: Array, units: Array, per_turn: int, gaps: Gaps) -> tuple[Array, int]:
    """Return the wheel's intervals from a gap on, and the first interval from which a whole turn shows them."""
    # every interval in whole teeth; those longer than one are gaps
    sizes = [len(gap) if isinstance(gap, tuple) else gap for gap in gaps]
    levels = np.array([1, *sorted({size + 1 for size in sizes})])
    whole = levels[np.searchsorted(np.sqrt(levels[1:] * levels[:-1]), units)]
    long = np.flatnonzero(whole > 1)
    if not long.size:
        raise PulseError("no interval is as long as a gap", "set missing = 0 for a full wheel")
    # sequences of one turn, and how often each comes
    count = per_turn - sum(sizes)
    expected = sorted(size + 1 for size in sizes)
    stated = _turns_alike(_given(per_turn, gaps)) if isinstance(gaps[0], tuple) else None
    turns: Counter[tuple[int, ...]] = Counter()
    first: dict[tuple[int, ...], int] = {}
    for at in long[long + count <= whole.size].tolist():
        turn = whole[at : at + count]
        if int(turn.sum()) == per_turn and sorted(turn[turn > 1].tolist()) == expected:
            alike = _turns_alike(tuple(turn.tolist()))
            turns[alike] += 1
            first.setdefault(alike, at)
    # a stated sequence must be among them
    if stated is not None:
        turns = Counter({stated: turns[stated]} if turns[stated] else {})
    if not turns:
        raise _other_wheel(times, np.rint(units).astype(np.int64), per_turn, sizes)
    # the commonest one must be that of most turns
    commonest, seen = turns.most_common(1)[0]
    if 2 * seen <= sum(turns.values()):
        rule = f"the gaps lie at one place in {seen} turns of {sum(turns.values())}: they are not told from lost pulses"
        raise PulseError(rule, "say which teeth are missing, such as missing = [[1, 2], [19, 20], [22, 23]]")
    start = first[commonest]
    return whole[start : start + count].astype(np.float64), start


def _given(per_turn: int, gaps: Gaps) -> tuple[int, ...]:
    """Return the intervals of a wheel whose missing teeth are given by their numbers."""
    left_out = {tooth for gap in gaps if isinstance(gap, tuple) for tooth in gap}
    there = [tooth for tooth in range(1, per_turn + 1) if tooth not in left_out]
    return tuple(int(step) for step in np.diff([*there, there[0] + per_turn]))


def _turns_alike(turn: tuple[int, ...]) -> tuple[int, ...]:
    """Return one rotation of a turn that stands for all: a turn may begin at any gap."""
    return max(turn[at:] + turn[:at] for at, step in enumerate(turn) if step > 1)


def _other_wheel(times: Array, whole: NDArray[np.int64], per_turn: int, sizes: list[int]) -> PulseError:
    """Return the error for pulses none of whose turns is that of the wheel, with what they show."""
    wheel = "-".join(str(number) for number in (per_turn, *sizes))
    rule = f"no whole turn of a wheel {wheel} is among the intervals"
    long = np.flatnonzero(whole > 1)
    if long.size > 1:
        apart = Counter(np.diff(long).tolist()).most_common(1)[0][0]
        missing = Counter((whole[long] - 1).tolist()).most_common(1)[0][0]
        rule += f"; most gaps lie {apart} pulses apart and leave {missing} out, the first at {times[long[0]]:.6g} s"
    return PulseError(rule, "check pulses_per_turn and missing, or raise the hysteresis")


def _both_ways(units: Array, pattern: Array, start: int) -> _Reading:
    """Follow a wheel from a whole turn on to the end, and back to the beginning."""
    on = _follow(units[start:], pattern)
    back = _follow(units[:start][::-1], pattern[::-1])
    edits = [(start - 1 - at - extra, extra, lost) for at, extra, lost in back.edits[::-1]]
    edits += [(start + at, extra, lost) for at, extra, lost in on.edits]
    unsure = [start - 1 - at for at in back.unsure[::-1]] + [start + at for at in on.unsure]
    return _Reading(np.concatenate([back.teeth[::-1], on.teeth]), edits, unsure)


def _follow(units: Array, pattern: Array) -> _Reading:
    """Follow a wheel from its first interval on; where it does not fit, take the cheapest reading."""
    size = pattern.size
    reading = _Reading(np.zeros(units.size), [], [])
    logarithms = np.log(units)
    wheel = np.log(pattern)
    block = max(4096, 16 * size)
    at = 0
    tooth = 0
    while at < units.size:
        # intervals that agree with the wheel
        end = min(units.size, at + block)
        places = (tooth + np.arange(end - at)) % size
        off = np.abs(logarithms[at:end] - wheel[places]) > _AGREES
        off |= np.abs(units[at:end] - pattern[places]) > _GAP_AGREES
        agreeing = int(np.argmax(off)) - 1 if off.any() else end - at  # one less: its end may be a pulse too many
        agreeing = max(agreeing, 0)
        reading.teeth[at : at + agreeing] = pattern[places[:agreeing]]
        at += agreeing
        tooth = (tooth + agreeing) % size
        # the first interval that does not agree
        if off.any():
            at, tooth = _read(units, pattern, at, tooth, reading)
    return reading


def _read(units: Array, pattern: Array, begin: int, tooth: int, reading: _Reading) -> tuple[int, int]:
    """Take the cheapest reading of some intervals, a turn ahead; return the interval and the place behind them."""
    size = pattern.size
    end = min(units.size, begin + 2 * _CERTAIN + (size if size > 1 else 0))
    passed = np.concatenate([[0.0], np.cumsum(units[begin : end + 2])]).tolist()
    ahead_most = (end - begin) * len(_EDITS) + 1
    wheel = np.concatenate([[0.0], np.cumsum(pattern[(tooth + np.arange(ahead_most)) % size])]).tolist()
    # by interval and by places passed since the first: the cost, and the chain of what was read
    readings: dict[int, dict[int, tuple[float, _Chain]]] = {0: {0: (0.0, None)}}
    for at in range(end - begin):
        for ahead, (cost, chain) in readings.pop(at, {}).items():
            for extra, lost in _EDITS:
                no_more = at + 1 + extra >= len(passed)
                if no_more or (lost and size > 1 and begin + at >= units.size - _CERTAIN):  # no gap after it decides
                    continue
                teeth = wheel[ahead + 1 + lost] - wheel[ahead]
                misfit = _misfit(passed[at + 1 + extra] - passed[at], teeth, (extra, lost), size == 1)
                if misfit is None:
                    continue
                total = cost + misfit**2 + _EDIT * (extra + lost)
                behind = readings.setdefault(at + 1 + extra, {})
                if ahead + 1 + lost not in behind or total < behind[ahead + 1 + lost][0]:
                    behind[ahead + 1 + lost] = (total, _Step(chain, begin + at, extra, lost, ahead, teeth, misfit))
    chain = min((way for ways in readings.values() for way in ways.values()), key=lambda way: way[0])[1]
    return _keep(chain, begin + _CERTAIN, reading, tooth, size)


class _Step(NamedTuple):
    """One interval of a reading, and the reading of those before it."""

    before: _Step | None
    at: int
    extra: int
    lost: int
    ahead: int
    teeth: float
    misfit: float


_Chain = _Step | None


def _misfit(measured: float, teeth: float, edit: tuple[int, int], full: bool) -> float | None:
    """Return the logarithm of an interval over its teeth; None where pulses lost or too many do not explain it."""
    misfit = abs(math.log(measured / teeth))
    if edit == (0, 0):
        return misfit
    if full and (misfit > _NEAR or (edit[1] and abs(measured - teeth) > _TEETH_OFF)):
        return None
    return misfit if misfit <= _AGREES else None


def _keep(chain: _Chain, end: int, reading: _Reading, tooth: int, size: int) -> tuple[int, int]:
    """Write down a reading up to an interval; return the interval and the place behind it."""
    steps = []
    while chain is not None:
        steps.append(chain)
        chain = chain.before
    at = 0
    ahead = 0
    for step in reversed(steps):
        if step.at >= end:
            break
        reading.teeth[step.at] = step.teeth
        if step.extra or step.lost:
            reading.edits.append((step.at, step.extra, step.lost))
        elif step.misfit > _DOUBTFUL:
            reading.unsure.append(step.at)
        at = step.at + 1 + step.extra
        ahead = step.ahead + 1 + step.lost
    return at, (tooth + ahead) % size


def _refuse_another_wheel(times: Array, units: Array, reading: _Reading, pattern: Array) -> None:
    """Refuse gaps that do not come where the wheel has them, except for a start or a stop at the ends.

    PulseError where the wheel's intervals do not repeat somewhere.
    """
    for at in reading.unsure:
        misfit = abs(math.log(units[at] / reading.teeth[at]))
        if misfit > 0.8 * math.log(pattern.max()) and _CERTAIN <= at < units.size - _CERTAIN:
            rule = f"the intervals do not follow the wheel at {times[at]:.6g} s, whichever pulses are left out or added"
            raise PulseError(rule, "cut with start and end, check missing, or raise the hysteresis")


def _only_certain(times: Array, units: Array, reading: _Reading, per_turn: float) -> _Reading:
    """Undo repairs that a real motion of the shaft may explain.

    PulseError where more pulses in a row are missing than can be counted.
    """
    logarithms = _repaired(times, reading)
    certain = []
    unsure = list(reading.unsure)
    for at in reading.unsure:
        if units[at] > _EDITS[5][1] + 1 + _TEETH_OFF and not _slows(logarithms, at, at):
            rule = f"no pulse comes from {times[at]:.6g} s to {times[at + 1]:.6g} s, {units[at]:.3g} times as long as"
            rule += " the intervals around it: the lost ones cannot be counted"
            raise PulseError(rule, "cut with start and end, or lower the threshold")
    for at, extra, lost in reading.edits:
        slows = lost > 0 and _slows(logarithms, at, at + extra)
        strict = per_turn < _FINE or not _CERTAIN <= at < units.size - _CERTAIN
        if not slows and not (strict and not _fits_closely(units, reading.teeth, at, extra)):
            certain.append((at, extra, lost))
            continue
        reading.teeth[at : at + extra + 1] = 1.0
        unsure.append(at)
    return reading._replace(edits=certain, unsure=sorted(unsure))


def _repaired(times: Array, reading: _Reading) -> Array:
    """Return logarithms of the time for a tooth, interval by interval, as a reading has them."""
    steps = np.diff(times) / np.maximum(reading.teeth, 1.0)
    for at, extra, _ in reading.edits:
        steps[at : at + extra + 1] = (times[at + extra + 1] - times[at]) / reading.teeth[at]
    return np.asarray(np.log(steps), dtype=np.float64)


def _slows(logarithms: Array, first: int, last: int) -> bool:
    """Return whether intervals grow towards given ones on either side: the shaft stops there."""
    sides = (logarithms[max(first - 6, 0) : first][::-1], logarithms[last + 1 : last + 7])
    return any(side.size == 6 and float(np.median(side[:3]) - np.median(side[3:])) > _SLOWS for side in sides)


def _fits_closely(units: Array, teeth: Array, at: int, extra: int) -> bool:
    """Return whether a repair is certain without both sides or on few teeth: it fits, and all around is even."""
    last = at + extra + 1
    sides = (slice(max(at - 5, 0), at), slice(last, last + 5))
    around = np.concatenate([np.log(units[side] / np.maximum(teeth[side], 1.0)) for side in sides])
    misfit = np.log(units[at:last].sum() / teeth[at])
    return bool(around.size and np.abs(around).max() <= _EVEN and abs(misfit) <= _EVEN_FIT)


def _refuse_recurring(times: Array, units: Array, per_turn: float) -> None:
    """Refuse a wheel taken for full whose long intervals come back every turn."""
    long = np.flatnonzero(np.log(units) > _DOUBTFUL)
    if per_turn < _FINE:
        return
    for gaps in range(1, 5):
        apart = long[gaps:] - long[:-gaps]
        if apart.size < _FEWEST_RECURRING:
            return
        turn, alike = Counter(apart.tolist()).most_common(1)[0]
        if alike < _RECURS * apart.size:
            continue
        sizes = np.rint(units[long[:gaps]]).astype(int) - 1
        rule = f"an interval some {units[long[0]]:.2g} times as long as its neighbours comes every {turn} pulses"
        rule += f", the first at {times[long[0]]:.6g} s: this is a gap of the wheel"
        missing = str(sizes[0]) if gaps == 1 else str(sizes.tolist())
        raise PulseError(rule, f"pulses_per_turn = {turn + int(sizes.sum())}, missing = {missing}")


def _told(times: Array, reading: _Reading) -> Teeth:
    """Return the pulses that count, their teeth, and when pulses were lost or too many.

    PulseError where these are more than ``SHARE``.
    """
    lost: list[float] = []
    extra: list[int] = []
    for at, more, missing in reading.edits:
        extra += range(at + 1, at + 1 + more)
        begin = times[at]
        lost += (begin + (times[at + 1] - begin) * np.arange(1, missing + 1) / (missing + 1)).tolist()
    count = len(lost) + len(extra)
    if count > max(1.0, SHARE * times.size):
        rule = f"{len(lost)} pulses lost and {len(extra)} too many among {times.size}: more than {SHARE:.0%}"
        raise PulseError(rule, "check pulses_per_turn and missing, set threshold and hysteresis, or cut with start")
    counts = np.ones(times.size, dtype=np.bool_)
    counts[extra] = False
    passed = np.concatenate([[0.0], np.cumsum(reading.teeth)])
    return Teeth(times[counts], passed[counts], np.array(lost), times[extra], times[reading.unsure])
