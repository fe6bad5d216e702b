"""Verdicts and recommendation from the numbers of a comparison.

An algorithm is *sound* here if it came to an end, its error inside the window stays below ``SOUND``, no step lies
outside its stability region, it missed and invented no impact, and no more than a third of its statistics beyond the
horizon lie outside those of all exact motions: chance puts one in twenty-two there, in groups that go together. The
cheapest sound one is recommended next to exact.
Against a reference that is itself wrong none is called sound or unsound.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from gearrattle.comparison.comparison_rows import Comparison, Row
from gearrattle.wording import counted, listed, noun_of

SOUND = 1e-2  # half-gaps, or of the rms velocity without clearances
STRANGE = 1.0 / 3.0
_STABLE = 1.0 + 1e-9


def is_sound(row: Row) -> bool:
    """Whether no reason speaks against an algorithm."""
    if row.error is None or row.impacts is None:
        return False
    impacts = row.impacts.total
    stable = row.growth is None or row.growth <= _STABLE
    exact_enough = row.error.worst <= SOUND and impacts.missed == 0 and impacts.invented == 0
    return stable and exact_enough and not _is_strange(row)


def _is_strange(row: Row) -> bool:
    """Whether too many statistics of a motion lie outside those of exact ones."""
    return row.statistics is not None and row.statistics.different > STRANGE * len(row.statistics.items)


def with_verdicts(comparison: Comparison) -> tuple[Row, ...]:
    """Return the rows with a verdict, "sound" or "not sound", and what speaks against them.

    The reference and the exact motion from nearby have neither, and against a reference that is not exact none has
    one; but why there is no motion is said in any case.
    """
    first, *others, away = comparison.rows
    rows = []
    for row in others:
        ended = row.error is not None
        reasons = tuple(_reasons(row)) if ended else (row.status,)
        verdict = "sound" if is_sound(row) else "not sound" if ended else "no motion"
        if comparison.reference != "exact" and ended:
            verdict = ""
            reasons = ()
        rows.append(replace(row, verdict=verdict, reasons=reasons))
    return (first, *rows, away)


def _reasons(row: Row) -> Iterator[str]:
    """Return the reasons against a motion."""
    assert row.error is not None and row.impacts is not None  # noqa: PT018 - it came to an end
    impacts = row.impacts.total
    if row.growth is not None and row.growth > _STABLE:
        yield f"step outside its stability region (a mode grows by {row.growth:.4g} a step)"
    if row.error.worst > SOUND:
        yield f"error of {row.error.worst:.1g} {row.error.unit}"
    if impacts.missed:
        yield f"{counted(impacts.missed, 'impact')} missed"
    if impacts.invented:
        yield f"{counted(impacts.invented, 'impact')} invented"
    if row.statistics is not None and _is_strange(row):
        yield f"{row.statistics.different} of {row.statistics.decided} statistics outside those of all exact motions"


def recommendation(comparison: Comparison) -> str:
    """Return three sentences: what to use, what not to trust, and what no algorithm can do here."""
    return " ".join((_use(comparison), _trust(comparison), _limits(comparison)))


def _use(comparison: Comparison) -> str:
    judge, *others = comparison.rows[:-1]
    if comparison.reference != "exact":
        away = comparison.rows[-1]
        own = "" if away.error is None else f", which is itself wrong by {away.error.worst:.1g} {away.error.unit}"
        return (
            f"Errors are relative to {comparison.reference}{own}: which algorithm to use, only reference = exact can "
            "tell."
        )
    stepping = [row for row in others if row.algorithm != "exact"]
    sound = [row for row in stepping if row.verdict == "sound"]
    assert judge.cost is not None
    if not sound:
        return f"Use {judge.label}{': of the algorithms that step, none is sound here' if stepping else ''}."
    best = min(sound, key=lambda row: row.cost.wall_time if row.cost else float("inf"))
    assert best.cost is not None and best.error is not None  # noqa: PT018 - a sound row has both
    ratio = best.cost.wall_time / judge.cost.wall_time
    than = f"{ratio:.3g} times as long" if ratio >= 1.0 else f"1/{1 / ratio:.3g} of the time"
    return (
        f"Use {judge.label}; of the algorithms that step, {best.label} is the cheapest sound one and takes {than} "
        f"for an error of {best.error.worst:.1g} {best.error.unit}."
    )


def _trust(comparison: Comparison) -> str:
    others = [row for row in comparison.rows[1:-1] if row.algorithm != "exact"]
    if comparison.reference != "exact":
        lost = [row.label for row in others if row.verdict == "no motion"]
        return f"No motion came of {listed(lost)}." if lost else "All algorithms came to their end."
    wrong = [row.label for row in others if row.verdict != "sound"]
    if not others:
        return "No other algorithm took part."
    return f"Do not trust {listed(wrong)} here; the table says why." if wrong else "All that took part are sound here."


def _limits(comparison: Comparison) -> str:
    if comparison.horizon == float("inf"):
        own = ": differences are errors of the algorithms" if comparison.reference == "exact" else ""
        return f"The motion is predictable to its end{own}."
    cycles = comparison.horizon / comparison.period
    away = comparison.rows[-1]
    own = ""
    if away.error is not None and away.error.passed[-1] < float("inf") and comparison.reference == "exact":
        later = float(away.error.passed[-1]) / comparison.period
        unit = away.error.unit
        own = f" Two exact motions that begin 1e-12 {unit} apart are {away.error.thresholds[-1]:g} {unit} apart after "
        own += f"{later:.3g} {noun_of(later, 'cycle')}."
    sentence = f"The motion is predictable for {cycles:.3g} {noun_of(cycles, 'cycle')}"
    return f"{sentence}; after that only statistics can be compared.{own}"
