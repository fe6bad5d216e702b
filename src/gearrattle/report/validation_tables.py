"""The tables of the page on a validation."""

from __future__ import annotations

import math

from gearrattle.measured.validation import Explained, Level, Pair, Validation
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.tables import Table
from gearrattle.wording import counted


def levels_table(validation: Validation) -> Table:
    """The paper's Table 5, with intervals."""
    head = ("channel", "level", "unit", "measured", "simulated", "sigma, %", "95 % interval", "budget, %", "verdict")
    rows = tuple(
        (
            pair.name,
            _unbroken(level.measure),
            pair.unit,
            numeral(level.measured),
            numeral(level.simulated),
            numeral(level.sigma, 3),
            _span(level.low, level.high),
            f"± {numeral(level.expanded, 3)}",
            _verdict(level),
        )
        for pair in validation.pairs
        for level in pair.levels
    )
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


def budget_table(validation: Validation) -> Table:
    """Every contribution to every level [%]."""
    sources = [term.source for term in validation.pairs[0].levels[0].budget]
    head = ("channel", "level", *sources, "expanded", "sigma", "remainder")
    rows = tuple(
        (
            pair.name,
            _unbroken(level.measure),
            *(_percent(term.value) for term in level.budget),
            *(_percent(value) for value in (level.expanded, level.sigma, level.remainder)),
        )
        for pair in validation.pairs
        for level in pair.levels
    )
    note = (
        "Standard uncertainties in % of the measured level; a dash: not known or not stated, and not in the sum. "
        "Squares add up; the expanded sum takes Student's t for the scatters and 1.96 for the others."
    )
    return Table(head, rows, frozenset({0, 1}), "", note)


def ways_table(validation: Validation) -> Table:
    """Return a table of how each contribution was obtained."""
    ways = {term.source: term.how for pair in validation.pairs for level in pair.levels for term in level.budget}
    return Table(("source", "how it was obtained"), tuple(ways.items()), frozenset({0, 1}), "How each was obtained")


def parameter_tables(validation: Validation) -> list[Table]:
    """Return tables of uncertain parameters: effects, pulls of the levels, and correlations; none without any."""
    if validation.parameters is None:
        return []
    made = (_effects(validation.parameters), _pulls(validation.parameters), _together(validation.parameters))
    return [table for table in made if table.rows]


def rms_effects_table(validation: Validation) -> Table:
    """Return effects of uncertain parameters on the rms of every channel, and the pulls of the levels; short."""
    if validation.parameters is None:
        return Table((), ())
    head = (
        "parameter",
        *(f"{name} rms, %" for name in validation.parameters.channels),
        "pulled, s.e.",
        "error left, %",
    )
    rows = []
    for parameter in validation.parameters.parameters:
        effects = {effect.channel: effect for effect in parameter.effects if effect.measure == "rms"}
        by_channel = [effects[name] for name in validation.parameters.channels]
        cells = (f"{effect.value:.3g} ± {effect.error:.2g}" for effect in by_channel)
        rows.append((parameter.path, *cells, f"{parameter.shift:.3g}", f"{100.0 * parameter.left:.3g}"))
    return Table(head, tuple(rows))


def _effects(explanation: Explained) -> Table:
    rows = tuple(
        (
            parameter.path,
            effect.channel,
            _unbroken(effect.measure),
            f"{numeral(effect.value, 3)} %",
            f"{numeral(effect.error, 2)} %",
            numeral(effect.needed, 3),
        )
        for parameter in explanation.parameters
        for effect in parameter.effects
    )
    head = ("parameter", "channel", "level", "by one standard error", "± s.e.", "alone, standard errors")
    note = (
        f"From a straight line through {counted(explanation.runs, 'run')}. "
        "Alone: by how many of its standard errors the parameter would "
        "have to be off to explain the whole difference; a dash: its effect is less than two of its errors."
    )
    return Table(head, rows, frozenset({0, 1, 2}), "Parameters, each alone", note)


def _pulls(explanation: Explained) -> Table:
    head = ("parameter", "value, SI", "standard error", "pulled by, standard errors", "error left")
    rows = tuple(
        (p.path, numeral(p.value), numeral(p.standard_error, 3), numeral(p.shift, 3), f"{numeral(100.0 * p.left, 3)} %")
        for p in explanation.parameters
    )
    before, after = explanation.chi_square
    note = (
        f"All together, to first order, by the rms of {', '.join(explanation.channels)}: "
        "the squared differences fall from "
        f"{numeral(before, 3)} to {numeral(after, 3)}. A pull of more than two speaks against the error stated."
    )
    return Table(head, rows, frozenset({0}), "Parameters, all together", note)


def _together(explanation: Explained) -> Table:
    names = [p.path for p in explanation.parameters]
    rows = tuple(
        (names[j], names[i], numeral(explanation.stated[i][j], 2), numeral(explanation.estimated[i][j], 2))
        for i in range(len(names))
        for j in range(i)
    )
    note = "Near 1 or −1 after the levels: they tell the two only together."
    return Table(
        ("parameter", "and", "correlation as stated", "after the levels"),
        rows,
        frozenset({0, 1}),
        "Which go together",
        note,
    )


def orders_table(pair: Pair) -> Table:
    """Orders of one channel."""
    # orders measured and simulated, the difference in amplitude and in phase
    head = (
        "order",
        "Hz",
        "measured",
        "± s.e.",
        "simulated",
        "± s.e.",
        "sigma, %",
        "95 % interval",
        "phase, deg",
        "95 % interval",
    )
    # standard errors beside amplitudes, intervals of 95 % beside differences
    rows = tuple(
        (
            numeral(o.order, 6),
            numeral(o.frequency, 5),
            numeral(o.measured),
            numeral(o.measured_error, 2),
            numeral(o.simulated),
            numeral(o.simulated_error, 2),
            numeral(o.sigma, 3),
            _span(o.low, o.high),
            numeral(o.phase, 3),
            _span(o.phase_low, o.phase_high),
        )
        for o in pair.orders
    )
    return Table(head, rows, frozenset(), f"{pair.name}, {pair.unit}")


def impacts_table(validation: Validation) -> Table:
    """Impact rates [1/cycle]."""
    head = ("clearance", "exact, run", "± s.e.", "counted, simulated", "counted, measured", "difference, 95 %", "how")
    rows = tuple(
        (
            impact.clearance,
            numeral(impact.exact),
            numeral(impact.exact_error, 2),
            numeral(impact.simulated),
            numeral(impact.measured),
            _span(impact.low, impact.high),
            impact.words,
        )
        for impact in validation.impacts
    )
    note = (
        "Impacts per cycle. Exact: from the crossings of the run. Counted: passings of a stated threshold, both in the "
        "same band; what counting misses shows against the exact rate."
    )
    return Table(head, rows, frozenset({0, 6}), "", note)


def setting_table(validation: Validation) -> Table:
    """Return the two sides of the comparison and its settings."""
    clock = validation.clock
    low, high = validation.band
    blocks = f"{validation.measured_block} and {validation.simulated_block}"
    rows: list[tuple[str, str]] = [
        ("measurement", validation.source),
        ("simulation", f"{validation.model}, {validation.algorithm}"),
        ("cycles", f"{validation.measured_cycles} measured, {validation.simulated_cycles} simulated"),
        ("cycles in a block of the bootstrap", blocks),
        ("rate of both", f"{numeral(validation.rate, 6)} Hz"),
        ("band of both", f"{numeral(low)} to {numeral(high)} Hz"),
        (
            "taken away from both",
            {"none": "nothing", "mean": "the mean", "linear": "a straight line"}[validation.trend],
        ),
        ("clock", f"{clock.method}{f', by {clock.channel}' if clock.channel else ''}"),
        ("added to the measured times", f"{numeral(clock.delay, 6)} s, s.e. {numeral(clock.standard_error, 2)} s"),
        ("correlation there, elsewhere", f"{numeral(clock.agreement)}, {numeral(clock.rival)}"),
        ("cycle by the model, by the record", f"{numeral(clock.period, 7)} s, {numeral(clock.measured_period, 7)} s"),
        ("measured, not simulated", ", ".join(validation.unmatched_measured) or "–"),
        ("simulated, not measured", ", ".join(validation.unmatched_simulated) or "–"),
    ]
    return Table(("", ""), tuple(rows), frozenset({0, 1}))


def _unbroken(words: str) -> str:
    return words.replace("-", "\u2011")


def _percent(value: float) -> str:
    return "< 0.001" if 0.0 < abs(value) < 1e-3 else numeral(value, 2)


def _span(low: float, high: float) -> str:
    return "–" if math.isnan(low) or math.isnan(high) else f"{numeral(low, 3)} to {numeral(high, 3)}"
