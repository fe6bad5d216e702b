"""The tables of a comparison: cost, errors, statistics, transmissibility by distance, coherence."""

from __future__ import annotations

import math
from collections.abc import Iterator

from gearrattle.comparison.comparison_rows import Comparison, Row
from gearrattle.report.plots.numerals import grouped, numeral
from gearrattle.report.tables import Table
from gearrattle.wording import counted

_MOST_REGIONS = 12
"""Largest number of columns in the table of growths: a train of twelve clearances visits hundreds of regions."""


def short_table(comparison: Comparison) -> Table:
    """Return the table of a terminal: cost, error, impacts and verdict of every algorithm."""
    head = ("algorithm", "steps", "calls", "time, s", "error", "missed", "invented", "statistics off", "verdict")
    rows: list[tuple[str, ...]] = []
    for row in comparison.rows:
        verdict = ": ".join(part for part in (row.verdict, ", ".join(row.reasons)) if part) or row.status
        if row.cost is None or row.error is None or row.impacts is None:
            rows.append((row.label, *["–"] * 7, verdict))
            continue
        impacts = row.impacts.total
        off = "–"
        if row.statistics is not None and row.statistics.decided:
            off = f"{row.statistics.different}/{row.statistics.decided}"
        work = (f"{row.cost.steps}", f"{row.cost.function_calls}", f"{row.cost.wall_time:.3g}")
        wrong = (f"{row.error.worst:.1e}", f"{impacts.missed}", f"{impacts.invented}", off)
        rows.append((row.label, *work, *wrong, verdict))
    return Table(head, tuple(rows), frozenset({0, 8}))


def verdict_table(comparison: Comparison) -> Table:
    """For every algorithm, whether it can be trusted or why not, and its cost relative to the reference."""
    unit = next((row.error.unit for row in comparison.rows if row.error is not None), "half-gaps")
    own = comparison.rows[0].cost
    rows = []
    for row in comparison.rows[:-1]:
        times = "–" if row.cost is None or own is None else numeral(row.cost.wall_time / own.wall_time, 3)
        error = "–" if row.error is None else _number(row.error.worst)
        rows.append((row.label, row.verdict or "–", error, times, ", ".join(row.reasons)))
    head = ("algorithm", "verdict", f"error, {unit}", f"time over {comparison.reference}'s", "because")
    return Table(head, tuple(rows), frozenset({0, 1, 4}), "Who can be trusted")


def cost_table(comparison: Comparison) -> Table:
    """The columns of Tables 3 and 4 in the 1995 paper, and further ones."""
    head = (
        "algorithm",
        "average step, s",
        "average trial step, s",
        "smallest step, s",
        "steps",
        "rejected",
        "function calls",
        "Jacobian calls",
        "time, s",
        "outcome",
    )
    # one row per algorithm; the last row is the motion with a slightly different initial state
    rows = []
    for row in comparison.rows[:-1]:
        cost = row.cost
        if cost is None:
            rows.append((row.label, *["–"] * 8, row.status))
            continue
        # step sizes, counts, and growth of an unstable mode
        steps = (cost.average_step, cost.average_trial_step, cost.smallest_step)
        counts = (cost.steps, cost.rejected_steps, cost.function_calls, cost.jacobian_calls)
        unstable = row.growth is not None and row.growth > 1.0 + 1e-9
        outcome = f"unstable: a mode grows by {row.growth:.4g} a step" if unstable else row.status
        rows.append(
            (
                row.label,
                *(_number(step) for step in steps),
                *(grouped(n) for n in counts),
                _number(cost.wall_time),
                outcome,
            )
        )
    # definitions of the counts
    note = (
        "Trial steps are those tried, accepted or not. Function calls are those the algorithm asked for; samples and "
        "located crossings are not counted. Times are of one process, warm."
    )
    return Table(head, tuple(rows), frozenset({0, 9}), "What it took", note)


def truth_table(comparison: Comparison) -> Table:
    """True errors inside the window, and the time from which a motion is wrong."""
    unit = next((row.error.unit for row in comparison.rows if row.error is not None), "half-gaps")
    head = (
        "algorithm",
        f"error, {unit}",
        "wrong by a tenth from cycle",
        "crossings",
        "missed",
        "invented",
        "time error, s",
        "impacts missed",
        "invented",
        "statistics that differ",
    )
    note = (
        "Errors, crossings and impacts: up to the window's end, "
        f"{counted(comparison.window / comparison.period, 'cycle')}, "
        "where errors of 1e-6, or of the tolerance if finer, have grown to a thousandth at most. Statistics: of the "
        "cycles beyond the predictability horizon, those outside all exact motions begun nearby, with how many chance "
        "puts there."
    )
    rows = tuple(_truth(row, comparison.period) for row in comparison.rows[1:])
    return Table(head, rows, frozenset({0}), "How true it is", note)


def _truth(row: Row, period: float) -> tuple[str, ...]:
    if row.error is None or row.crossings is None or row.impacts is None or row.cost is None:
        return (row.label, *["–"] * 9)
    crossings = row.crossings.total
    impacts = row.impacts.total
    wrong = float(row.error.passed[-1])
    differ = "–"
    if row.statistics is not None and row.statistics.decided:
        differ = f"{row.statistics.different} of {row.statistics.decided} (chance: {_chance(row)})"
    return (
        row.label,
        _number(row.error.worst),
        "never" if math.isinf(wrong) else _number(wrong / period),
        grouped(row.cost.events),
        grouped(crossings.missed),
        grouped(crossings.invented),
        _number(crossings.largest),
        grouped(impacts.missed),
        grouped(impacts.invented),
        differ,
    )


def _chance(row: Row) -> str:
    return "–" if row.statistics is None else f"{row.statistics.different_by_chance:.2g}"


def statistics_tables(comparison: Comparison) -> Iterator[Table]:
    """One table per algorithm: the statistics that are outside the range of all exact motions."""
    head = ("quantity", "of", "exact, mean", "given", "measure", "value", "exact between")
    for row in comparison.rows[1:]:
        items = [] if row.statistics is None else [i for i in row.statistics.items if i.verdict == "different"]
        if items:
            rows = tuple(
                (
                    i.quantity,
                    i.subject,
                    _unit(i.reference, i.unit),
                    _unit(i.candidate, i.unit),
                    i.measure,
                    _number(i.value),
                    f"{_number(i.low)} and {_number(i.high)}",
                )
                for i in items
            )
            yield Table(head, rows, frozenset({0, 1, 4}), row.label)


def coherence_table(comparison: Comparison) -> Table:
    """Kappa of every inertia, with the value for independent signals."""
    some = next((row.coherence for row in comparison.rows if row.coherence), {})
    names = list(some)
    first = next(iter(some.values()), None)
    rows = tuple(
        (row.label, *(_number(row.coherence[name].mean) for name in names))
        for row in comparison.rows[1:]
        if row.coherence
    )
    note = ""
    if first is not None:
        chance = first.chance
        note = (
            f"Mean of gamma^2 over the first {counted(len(first.frequency), 'harmonic')}, "
            f"{counted(first.ensembles, 'segment')} of {counted(first.points, 'sample')} at "
            f"{first.rate:.5g} Hz. Two independent signals give "
            f"{chance.bias:.2g} on average "
            f"(between {chance.mean_low:.2g} and {chance.mean_high:.2g} in 90 of 100 cases; a single bin stays below "
            f"{chance.threshold:.2g} in 95): below that a coherence says nothing."
        )
    return Table(("algorithm", *names), rows, frozenset({0}), "", note)


def transmissibility_table(comparison: Comparison) -> Table:
    """Errors of rms and peak transmissibility, inertias by their distance from the driving point."""
    shown = [row for row in comparison.rows[1:] if row.transmissibility is not None]
    if not shown:
        return Table(("algorithm",), ())
    first = shown[0].transmissibility
    assert first is not None
    order = sorted(range(len(first.inertias)), key=lambda i: int(first.distance[i]))
    heads = [f"{first.inertias[i]} ({int(first.distance[i])})" for i in order]
    rows = []
    for row in shown:
        t = row.transmissibility
        assert t is not None
        rows.append((f"{row.label}, rms", *(_percent(t.rms_error[i]) for i in order)))
        rows.append((f"{row.label}, peak", *(_percent(t.peak_error[i]) for i in order)))
    note = "Relative error of TR rms and TR peak over the last cycles; in brackets: elements between it and the driven."
    return Table(("algorithm", *heads), tuple(rows), frozenset({0}), "", note)


def stability_table(comparison: Comparison) -> Table:
    """Growth of a mode per fixed step, by region."""
    shown = [row for row in comparison.rows if row.growths]
    largest: dict[str, float] = {}
    for row in shown:
        for region, growth in row.growths.items():
            largest[region] = max(growth, largest.get(region, 0.0))
    worst = set(sorted(largest, key=largest.__getitem__, reverse=True)[:_MOST_REGIONS])
    regions = [region for region in largest if region in worst]
    left = len(largest) - len(regions)
    rows = tuple((row.label, *(_number(row.growths[region]) for region in regions)) for row in shown)
    note = (
        "max |R(h lambda)| over the eigenvalues of every region the true motion visits; a region is told by the labels "
        "of its clearances. Above 1 a mode grows in it that really decays. A rigid motion gives exactly 1."
        + (f" Of {counted(len(largest), 'region')} the {len(regions)} with the largest are shown." if left else "")
    )
    return Table(("algorithm", *regions), rows, frozenset({0}), "", note)


def _number(value: float | None) -> str:
    return "–" if value is None else numeral(float(value), 3)


def _unit(value: float, unit: str) -> str:
    return "–" if math.isnan(value) else f"{numeral(value, 3)} {unit}".removesuffix(" 1")


def _percent(value: float) -> str:
    return "–" if math.isnan(value) else f"{numeral(100.0 * float(value), 3)} %"
