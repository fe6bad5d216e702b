"""The tables of the page on a validation.

Takes a Validation; gives Tables.
"""

from __future__ import annotations

import math

from gearrattle.plots.numerals import numeral
from gearrattle.report.tables import Table
from gearrattle.validation import Level, Pair, Validation


def levels_table(found: Validation) -> Table:
    """The paper's Table 5, with intervals."""
    head = ("channel", "level", "unit", "measured", "simulated", "sigma, %", "95 % interval", "budget, %", "verdict")
    rows = tuple(
        (
            pair.name, _unbroken(level.measure), pair.unit, numeral(level.measured), numeral(level.simulated),
            numeral(level.sigma, 3), _span(level.low, level.high), f"± {numeral(level.expanded, 3)}", _verdict(level),
        )
        for pair in found.pairs
        for level in pair.levels
    )  # fmt: skip
    note = (
        "sigma = (measured − simulated) / measured, positive where the simulation reads low. Interval: from the "
        "scatter of the cycles alone. Budget: all known sources. Peak to peak: the mean over the cycles of the "
        "largest less the smallest sample in each."
    )
    return Table(head, rows, frozenset({0, 1, 2, 8}), "", note)


def _verdict(level: Level) -> str:
    if not math.isfinite(level.sigma):
        return "nothing measured"
    if level.by_chance:
        return "within chance"
    if not level.remainder:
        return "within the budget"
    return f"{numeral(abs(level.remainder), 2)} % unexplained"


def budget_table(found: Validation) -> Table:
    """Every contribution to every level [%]."""
    sources = [each.source for each in found.pairs[0].levels[0].budget]
    head = ("channel", "level", *sources, "expanded", "sigma", "remainder")
    rows = tuple(
        (
            pair.name, _unbroken(level.measure), *(_percent(each.value) for each in level.budget),
            *(_percent(value) for value in (level.expanded, level.sigma, level.remainder)),
        )
        for pair in found.pairs
        for level in pair.levels
    )  # fmt: skip
    note = (
        "Standard uncertainties in % of the measured level; a dash: not known or not stated, and not in the sum. "
        "Squares add up; the expanded sum takes Student's t for the scatters and 1.96 for the others."
    )
    return Table(head, rows, frozenset({0, 1}), "", note)


def ways_table(found: Validation) -> Table:
    """How each contribution was obtained."""
    told = {each.source: each.how for pair in found.pairs for level in pair.levels for each in level.budget}
    return Table(("source", "how it was obtained"), tuple(told.items()), frozenset({0, 1}), "How each was obtained")


def orders_table(pair: Pair) -> Table:
    """Orders of one channel."""
    head = (
        "order", "Hz", "measured", "± s.e.", "simulated", "± s.e.", "sigma, %", "95 % interval", "phase, deg",
        "95 % interval",
    )  # fmt: skip
    rows = tuple(
        (
            numeral(o.order, 6), numeral(o.frequency, 5), numeral(o.measured), numeral(o.measured_error, 2),
            numeral(o.simulated), numeral(o.simulated_error, 2), numeral(o.sigma, 3), _span(o.low, o.high),
            numeral(o.phase, 3), _span(o.phase_low, o.phase_high),
        )
        for o in pair.orders
    )  # fmt: skip
    return Table(head, rows, frozenset(), f"{pair.name}, {pair.unit}")


def impacts_table(found: Validation) -> Table:
    """Impact rates [1/cycle]."""
    head = ("clearance", "exact, run", "± s.e.", "counted, simulated", "counted, measured", "difference, 95 %", "how")
    rows = tuple(
        (
            each.clearance, numeral(each.exact), numeral(each.exact_error, 2), numeral(each.simulated),
            numeral(each.measured), _span(each.low, each.high), each.words,
        )
        for each in found.impacts
    )  # fmt: skip
    note = (
        "Impacts a cycle. Exact: from the crossings of the run. Counted: passings of a stated threshold, both in the "
        "same band; what counting misses shows against the exact rate."
    )
    return Table(head, rows, frozenset({0, 6}), "", note)


def setting_table(found: Validation) -> Table:
    """What was compared, and how."""
    clock = found.clock
    low, high = found.band
    blocks = f"{found.measured_block} and {found.simulated_block}"
    rows: list[tuple[str, str]] = [
        ("measurement", found.source),
        ("simulation", f"{found.model}, {found.algorithm}"),
        ("cycles", f"{found.measured_cycles} measured, {found.simulated_cycles} simulated"),
        ("cycles in a block of the bootstrap", blocks),
        ("rate of both", f"{numeral(found.rate, 6)} Hz"),
        ("band of both", f"{numeral(low)} to {numeral(high)} Hz"),
        ("taken away from both", {"none": "nothing", "mean": "the mean", "linear": "a straight line"}[found.trend]),
        ("clock", f"{clock.method}{f', by {clock.channel}' if clock.channel else ''}"),
        ("added to the measured times", f"{numeral(clock.delay, 6)} s, s.e. {numeral(clock.standard_error, 2)} s"),
        ("correlation there, elsewhere", f"{numeral(clock.agreement)}, {numeral(clock.rival)}"),
        ("cycle by the model, by the record", f"{numeral(clock.period, 7)} s, {numeral(clock.measured_period, 7)} s"),
        ("measured, not simulated", ", ".join(found.unmatched_measured) or "–"),
        ("simulated, not measured", ", ".join(found.unmatched_simulated) or "–"),
    ]
    return Table(("", ""), tuple(rows), frozenset({0, 1}))


def _unbroken(words: str) -> str:
    return words.replace("-", "\u2011")


def _percent(value: float) -> str:
    return "< 0.001" if 0.0 < abs(value) < 1e-3 else numeral(value, 2)


def _span(low: float, high: float) -> str:
    return "–" if math.isnan(low) or math.isnan(high) else f"{numeral(low, 3)} to {numeral(high, 3)}"
