"""What follows from the numbers of a comparison, in words.

An algorithm is *sound* here if it came to an end, its error inside the window stays below ``SOUND``, no step lies
outside its stability region, it missed and invented no impact, and no more than a third of its statistics beyond the
horizon lie outside those of all exact motions: chance puts one in twenty-two there, in groups that go together. The
cheapest sound one is recommended next to exact.
Against a reference that is itself wrong nobody is called sound or unsound.

Takes a Comparison; gives sentences.
"""

from __future__ import annotations

from collections.abc import Iterator

from gearrattle.comparison.rows import Comparison, Row

SOUND = 1e-2  # half-gaps, or of the rms velocity without clearances
STRANGE = 1.0 / 3.0
_STABLE = 1.0 + 1e-9


def is_sound(row: Row) -> bool:
    """Whether nothing in its row speaks against an algorithm."""
    if row.error is None or row.impacts is None:
        return False
    impacts = row.impacts.total
    stable = row.growth is None or row.growth <= _STABLE
    exact_enough = row.error.worst <= SOUND and impacts.missed == 0 and impacts.invented == 0
    return stable and exact_enough and not _is_strange(row)


def _is_strange(row: Row) -> bool:
    """Whether too many of its statistics lie outside."""
    return row.statistics is not None and row.statistics.different > STRANGE * len(row.statistics.items)


def recommendation(comparison: Comparison) -> str:
    """Sentences on what to use, what not to trust and why, and what no algorithm can do here."""
    return " ".join((*_use(comparison), *_warnings(comparison), *_limits(comparison)))


def _use(comparison: Comparison) -> Iterator[str]:
    judge, *others = comparison.rows[:-1]
    stepping = [row for row in others if row.algorithm != "exact"]
    sound = [row for row in stepping if is_sound(row)]
    assert judge.cost is not None
    if comparison.reference != "exact":
        yield from _of_the_judge(comparison)
        return
    if not sound:
        yield f"Use {judge.label}{': of the algorithms that step, none is sound here' if stepping else ''}."
        return
    best = min(sound, key=lambda row: row.cost.wall_time if row.cost else float("inf"))
    assert best.cost is not None and best.error is not None  # noqa: PT018 - a sound row has both
    ratio = best.cost.wall_time / judge.cost.wall_time
    than = f"{ratio:.3g} times as long" if ratio >= 1.0 else f"1/{1 / ratio:.3g} of the time"
    yield (
        f"Use {judge.label}. Of the algorithms that step, {best.label} is the cheapest sound one: it takes {than} "
        f"for an error of {best.error.worst:.1g} {best.error.unit}."
    )


def _of_the_judge(comparison: Comparison) -> Iterator[str]:
    """What a reference other than exact is worth: exact, from nearby, is as far from it as it is from the truth."""
    label, away = comparison.reference, comparison.rows[-1]
    own = "" if away.error is None else f", which is itself wrong by {away.error.worst:.1g} {away.error.unit}"
    yield f"Errors are told against {label}{own}: which algorithm to use, only reference = exact can tell."


def _warnings(comparison: Comparison) -> Iterator[str]:
    for row in comparison.rows[1:-1]:
        if row.error is None or row.impacts is None or row.crossings is None:
            yield f"{row.label}: {row.status}."
        elif row.growth is not None and row.growth > _STABLE:
            impacts = row.impacts.total
            invented = f" and invents {_count(impacts.invented, 'impact')}" if impacts.invented else ""
            yield f"{row.label} lies outside its stability region (a mode grows by {row.growth:.4g} a step){invented}."
        elif not is_sound(row) and comparison.reference == "exact":
            impacts = row.impacts.total
            parts = [f"an error of {row.error.worst:.1g} {row.error.unit}"] if row.error.worst > SOUND else []
            parts += [f"{_count(impacts.missed, 'impact')} missed"] if impacts.missed else []
            parts += [f"{_count(impacts.invented, 'impact')} invented"] if impacts.invented else []
            if parts:
                yield f"{row.label}: {', '.join(parts)} while the motion can still be predicted."
            if row.statistics is not None and _is_strange(row):
                outside = f"{row.statistics.different} of {len(row.statistics.items)}"
                yield f"{row.label}: {outside} statistics lie outside those of all exact motions."


def _limits(comparison: Comparison) -> Iterator[str]:
    if comparison.horizon == float("inf"):
        own = ": differences are errors of the algorithms" if comparison.reference == "exact" else ""
        yield f"The motion is predictable to its end{own}."
        return
    cycles, away = comparison.horizon / comparison.period, comparison.rows[-1]
    yield f"Within {cycles:.3g} cycles some perturbation grows ten-million-fold: beyond, compare statistics."
    wrong = float("inf") if away.error is None else float(away.error.passed[-1])
    if wrong < float("inf") and comparison.reference == "exact":
        yield (
            f"Even exact, begun 1e-12 half-gaps away, is off by a tenth after {wrong / comparison.period:.3g} cycles: "
            "no algorithm can do better."
        )


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
