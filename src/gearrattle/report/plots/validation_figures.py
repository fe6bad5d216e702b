"""Figures of a validation: sigma with its interval, error budgets, mean cycles, orders, spectra and their ratios."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gearrattle.measured.validation import Level, Pair, Validation
from gearrattle.report.plots.chart import Cells, Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.palette import CENTRE, COAST, DRIVE, INK, MUTED
from gearrattle.report.plots.row_charts import ROW, interval_lines, with_names
from gearrattle.trajectory import Array
from gearrattle.wording import prefixed

MOST = 8
MEASURED = INK
SIMULATED = DRIVE
_BOTH = (Key("measured", MEASURED), Key("simulated", SIMULATED))


def validation_charts(validation: Validation) -> list[Chart]:
    """Return every figure that has something to show, in reading order."""
    made = [
        sigma_chart(validation),
        budget_chart(validation),
        _grid(validation, _CYCLES, _cycle),
        _grid(validation, _ORDERS, _orders),
    ]
    made += [_grid(validation, _SPECTRA, _spectrum), _grid(validation, _BANDS, _bands)]
    return [chart for chart in made if chart is not None]


def sigma_chart(validation: Validation) -> Chart:
    """Draw sigma of every channel and level with its interval; behind it, what the error budget allows."""
    # sigma of every channel and measure with its interval and error budget
    rows = [(f"{pair.name}, {level.measure}", level) for pair in validation.pairs for level in pair.levels][::-1]
    at = np.arange(len(rows), dtype=np.float64)
    sigma, low, high = (np.array([getattr(level, key) for _, level in rows]) for key in ("sigma", "low", "high"))
    expanded = np.nan_to_num(np.array([level.expanded for _, level in rows]))
    # limits: wide budgets are cut at the edge
    widest = float(np.nanmax(np.abs([*low, *high]), initial=1e-9))
    most = 1.15 * max(widest, min(2.0 * widest, float(expanded.max(initial=0.0))))
    grey = np.minimum(expanded, most)
    # intervals and points, coloured by whether sigma is within chance
    off = np.array([not level.by_chance for _, level in rows])
    lines = [interval_lines(low, high, at, "95 % interval")]
    for colour, chosen, name in ((DRIVE, ~off, "within chance"), (COAST, off, "more than chance")):
        lines.append(Line(sigma[chosen], at[chosen], name, colour, mark="points", width=8.0))
    # the error budget as bars behind them
    panel = Panel(
        "sigma",
        "%",
        "(measured − simulated) / measured, %",
        tuple(lines),
        cells=(Cells(-grey, grey, at - 0.34, at + 0.34, "error budget", "#e6ebf0"),),
        rules=(Rule(0.0, "x", CENTRE, dashed=False),),
        x_range=(-most, most),
        y_range=(-0.6, len(rows) - 0.4),
        y_ticks=tuple((float(k), "") for k in at),
    )
    panel = with_names(panel, [name for name, _ in rows])
    # caption and legend
    caption = (
        "Right of zero the simulation reads low, as in the paper's Table 5. Points: sigma; lines: its 95 % interval "
        "from the scatter of the cycles; bands: what the error budget allows, cut at the edge."
    )
    legend = (Key("within chance", DRIVE), Key("more than chance", COAST), Key("error budget", "#e6ebf0"))
    return Chart("sigma", "Levels", caption, (panel,), panel_height=ROW * len(rows) + 14, legend=legend)


def budget_chart(validation: Validation) -> Chart | None:
    """Draw the budgets of the channels with the largest remainders: bars of each source, of sigma and what is left."""
    # of every channel the level with the largest remainder, the largest first
    chosen = [(pair, max(pair.levels, key=_remaining)) for pair in validation.pairs]
    chosen = [(pair, level) for pair, level in chosen if np.isfinite(level.sigma)]
    chosen.sort(key=lambda entry: -_remaining(entry[1]))
    if not chosen:
        return None
    panels = tuple(_budget(pair, level) for pair, level in chosen[: MOST // 2])
    count = max(len(level.budget) for _, level in chosen) + 3
    caption = (
        "Standard uncertainties of each source, their expanded sum, sigma, and what of it no source explains; for the "
        "level of each channel that leaves most."
    ) + _left(len(chosen), len(panels))
    legend = (Key("sources", MUTED), Key("expanded, 95 %", CENTRE), Key("sigma", DRIVE), Key("remainder", COAST))
    return Chart(
        "budget",
        "Error budget",
        caption,
        panels,
        columns=min(2, len(panels)),
        panel_height=21 * count + 10,
        share_x=False,
        legend=legend,
    )


def _budget(pair: Pair, level: Level) -> Panel:
    bars = [(term.source, term.value, MUTED) for term in level.budget]
    bars += [("expanded, 95 %", level.expanded, CENTRE), ("sigma", abs(level.sigma), DRIVE)]
    bars.append(("remainder", abs(level.remainder), COAST))
    rows = [(f"{name}: {_value(value)}", value, colour) for name, value, colour in bars][::-1]
    at = np.arange(len(rows), dtype=np.float64)
    values = np.nan_to_num([value for _, value, _ in rows])
    cells = tuple(
        Cells(np.zeros(1), values[[k]], at[[k]] - 0.32, at[[k]] + 0.32, name, colour)
        for k, (name, _, colour) in enumerate(rows)
    )
    high = 1.05 * max(float(values.max()), 1e-9)
    panel = Panel(
        f"{pair.name}, {level.measure}",
        "%",
        "% of the measured level",
        cells=cells,
        x_range=(0.0, high),
        y_range=(-0.6, len(rows) - 0.4),
        y_ticks=tuple((float(k), "") for k in at),
    )
    return with_names(panel, [name for name, _, _ in rows])


def _value(value: float) -> str:
    return "not known" if np.isnan(value) else f"{numeral(value, 2)} %"


def _remaining(level: Level) -> float:
    """Sort key of a level: the remainder, then sigma."""
    return abs(level.remainder) + 1e-6 * abs(level.sigma) if np.isfinite(level.sigma) else -1.0


_CYCLES = (
    "cycles",
    "Mean cycles",
    "The mean cycle of both records on one clock, from the model's time zero on; thin lines: one standard deviation of "
    "the cycles about it.",
)
_ORDERS = (
    "orders",
    "Orders",
    "Amplitudes of the strongest orders of the mean cycle, 95 % intervals; simulated ones stand a little right.",
)
_SPECTRA = (
    "spectra",
    "Spectra",
    "Power spectral densities of both records over the same segments of whole cycles.",
)
_BANDS = (
    "bands",
    "Power in bands",
    "Measured over simulated power in thirds of an octave, with its 95 % limits by the F distribution. Where lines "
    "dominate, limits are wider than they need be.",
)


def _grid(
    validation: Validation, words: tuple[str, str, str], draw: Callable[[Validation, Pair], Panel]
) -> Chart | None:
    panels = tuple(draw(validation, pair) for pair in validation.pairs[:MOST])
    panels = tuple(panel for panel in panels if panel.lines)
    if not panels:
        return None
    key, title, caption = words
    legend = (Key("within limits", DRIVE), Key("outside", COAST)) if key == "bands" else _BOTH
    return Chart(
        key,
        title,
        caption + _left(len(validation.pairs), min(len(validation.pairs), MOST)),
        panels,
        columns=min(2, len(panels)),
        panel_height=170,
        share_x=False,
        legend=legend,
    )


def _left(count: int, drawn: int) -> str:
    if count <= drawn:
        return ""
    return f" {count - drawn} more {'channel is' if count == drawn + 1 else 'channels are'} not drawn."


def _cycle(_found: Validation, pair: Pair) -> Panel:
    c = pair.curves
    factor, unit = prefixed(float(max(np.abs(c.measured).max(), np.abs(c.simulated).max())), pair.unit)
    at = np.arange(c.measured.size) / c.measured.size
    lines = []
    for values, scatter, name, colour in (
        (c.measured, c.measured_scatter, "measured", MEASURED),
        (c.simulated, c.simulated_scatter, "simulated", SIMULATED),
    ):
        for side in (-1.0, 1.0):
            around = factor * (values + side * scatter)
            lines.append(Line(at, around, f"{name}, scatter", colour, width=0.5, opacity=0.6))
        lines.append(Line(at, factor * values, name, colour, width=1.6))
    return Panel(pair.name, unit, "t / T", tuple(lines), x_range=(0.0, 1.0))


def _orders(_found: Validation, pair: Pair) -> Panel:
    # scale, spacing and floor of the logarithmic axis
    if not pair.orders:
        return Panel(pair.name)
    order = np.array([entry.order for entry in pair.orders])
    largest = max(max(entry.measured, entry.simulated) for entry in pair.orders)
    factor, unit = prefixed(largest, pair.unit)
    away = 0.012 * max(float(order[-1]), 1.0)
    floor = 1e-4 * largest
    # amplitudes with intervals of 1.96 standard errors, measured and simulated side by side
    lines = []
    for name, colour, side in (("measured", MEASURED, 0.0), ("simulated", SIMULATED, 1.0)):
        size = np.array([getattr(entry, name) for entry in pair.orders])
        far = 1.96 * np.array([getattr(entry, f"{name}_error") for entry in pair.orders])
        at = order + side * away
        low, high = (factor * np.maximum(size + s * far, floor) for s in (-1.0, 1.0))
        lines.append(_vertical(low, high, at, colour))
        lines.append(Line(at, factor * np.maximum(size, floor), name, colour, mark="points", width=6.5))
    # whole decades
    every = np.concatenate([line.y[np.isfinite(line.y)] for line in lines])
    bottom = 10.0 ** np.floor(np.log10(every.min() / 1.3))
    top = 10.0 ** np.ceil(np.log10(1.3 * every.max()))
    return Panel(
        pair.name,
        unit,
        "order",
        tuple(lines),
        y_log=True,
        y_range=(float(bottom), float(max(top, 10.0 * bottom))),
        x_range=(0.0, 1.05 * float(order[-1]) + away),
    )


def _spectrum(validation: Validation, pair: Pair) -> Panel:
    # measured and simulated density within the band
    c = pair.curves
    shown = (c.frequency > 0.0) & (c.frequency <= validation.band[1])
    lines = []
    largest = 0.0
    for density, name, colour in (
        (c.measured_density, "measured", MEASURED),
        (c.simulated_density, "simulated", SIMULATED),
    ):
        largest = max(largest, float(density[shown].max()))
        lines.append(Line(c.frequency[shown], np.maximum(density[shown], 1e-300), name, colour, width=1.0))
    if largest <= 0.0:
        return Panel(pair.name)
    # whole decades, at most twelve below the largest
    least = min(float(line.y[line.y > 1e-12 * largest].min(initial=largest)) for line in lines)
    ends = (10.0 ** np.floor(np.log10(least)), 10.0 ** np.ceil(np.log10(largest)))
    unit = f"({pair.unit})²/Hz" if pair.unit != "1" else "1/Hz"
    return Panel(
        pair.name,
        unit,
        "frequency, Hz",
        tuple(lines),
        x_log=True,
        y_log=True,
        x_range=(float(c.frequency[shown][0]), validation.band[1]),
        y_range=(float(ends[0]), float(max(ends[1], 10.0 * ends[0]))),
    )


def _bands(validation: Validation, pair: Pair) -> Panel:
    lines = []
    # ratios of the bands with their intervals, coloured by whether they are within chance
    for colour, chance in ((DRIVE, True), (COAST, False)):
        rows = [band for band in pair.bands if band.by_chance == chance]
        if not rows:
            continue
        at = np.array([np.sqrt(band.low * band.high) for band in rows])
        low, high = (np.array([getattr(band, key) for band in rows]) for key in ("least", "most"))
        lines.append(_vertical(low, high, at, colour))
        level = np.array([band.decibels for band in rows])
        lines.append(Line(at, level, "measured over simulated", colour, mark="points", width=6.5))
    if not lines:
        return Panel(pair.name)
    # limits symmetric about 0 dB
    most = 1.1 * float(np.max(np.abs(np.concatenate([line.y[np.isfinite(line.y)] for line in lines]))))
    return Panel(
        pair.name,
        "dB",
        "frequency, Hz",
        tuple(lines),
        rules=(Rule(0.0, "y", CENTRE, dashed=False),),
        x_log=True,
        x_range=(0.8 * pair.bands[0].low, 1.1 * validation.band[1]),
        y_range=(-most, most),
    )


def _vertical(low: Array, high: Array, at: Array, colour: str) -> Line:
    """Draw vertical lines from low to high, one per position."""
    gap = np.full(at.size, np.nan)
    xs = np.column_stack([at, at, gap]).ravel()
    ys = np.column_stack([low, high, gap]).ravel()
    return Line(xs, ys, "95 % interval", colour, width=1.2)
