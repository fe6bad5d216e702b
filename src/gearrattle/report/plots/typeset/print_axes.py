"""Axes of a panel: limits, scales, labels with units, and ticks.

Limits are those of the static SVG (``plots.svg_axes``). Ticks adapt when other limits are set later, except ticks that
the chart prescribes. Their number depends on the size of their words (``overlap_removal``).
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

from gearrattle.report.plots.chart import Panel
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.svg_axes import limits
from gearrattle.report.plots.typeset.row_names import Rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.text import Text

_STEPS = (1.0, 2.0, 5.0, 10.0)
_FEW_DECADES = 1.5
_MANY_DECADES = 4.0
MOST_ACROSS = 8
MOST_UP = 6
"""Largest numbers of intervals between ticks, on x axes (``MOST_ACROSS``) and y axes (``MOST_UP``)."""
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_UNBROKEN = "\u00a0"
_LONGEST = 14  # letters in one line of a prescribed word on an x axis


def prepare(axes: Axes, rows: Rows, *, labelled: bool, inches: float) -> Text:
    """Set limits, scales, labels and ticks of the axes of a panel; return their title.

    The figure is ``inches`` wide.
    """
    from matplotlib import rcParams

    # limits and scales
    chosen: Any = rcParams
    panel = rows.panel
    x_limits, y_limits = limits(panel)
    axes.set_xscale("log" if panel.x_log else "linear")
    axes.set_yscale("log" if panel.y_log else "linear")
    axes.set_xlim(*x_limits)
    axes.set_ylim(*y_limits)
    axes.set_autoscale_on(False)
    if panel.equal_scales:
        axes.set_aspect("equal", adjustable="box")
    # title and labels with units
    unit = label_of(panel.unit)
    title = axes.set_title(f"{panel.title} [{unit}]" if unit and rows.wordy else panel.title, parse_math=False)
    axes.set_ylabel("" if rows.wordy else unit, parse_math=False)
    if labelled:
        axes.set_xlabel(label_of(panel.x_title), parse_math=False)
    # ticks: positions, words, sizes and colours
    family = chosen["font.family"]
    for axis, ticks, most in ((axes.xaxis, panel.x_ticks, MOST_ACROSS), (axes.yaxis, panel.y_ticks, MOST_UP)):
        longest = _LONGEST if axis is axes.xaxis else round(11.5 + 3.2 * inches)
        _tick(axis, tuple((at, broken(word, longest)) for at, word in ticks), most)
        name = "x" if axis is axes.xaxis else "y"
        for which in ("major", "minor"):
            keys = {key: chosen[f"{name}tick.{which}.{key}"] for key in ("size", "width", "pad")}
            colour = chosen[f"{name}tick.color"]
            axis.set_tick_params(
                which=which,
                length=keys["size"],
                width=keys["width"],
                pad=keys["pad"],
                color=colour,
                labelsize=chosen[f"{name}tick.labelsize"],
                labelcolor=chosen[f"{name}tick.labelcolor"],
                labelfontfamily=family,
            )
    # parts that are not drawn
    axes.tick_params(axis="x", labelbottom=labelled)
    if rows.wordy:
        axes.tick_params(axis="y", length=0.0)
    if _is_bare(panel):
        axes.set_axis_off()
    return title


def label_of(words: str) -> str:
    """Return the words of an axis: single blanks, and no arrow, as they stand next to the axis here."""
    return re.sub(r"\s+", " ", words).replace("^2", "²").removeprefix("↑ ").strip()


def _is_bare(panel: Panel) -> bool:
    """Whether a panel holds nothing but its note, or nothing at all."""
    drawn = (panel.lines, panel.bars, panel.cells, panel.rules, panel.labels, panel.bands)
    return panel.heat is None and not any(drawn)


def _tick(axis: Axis, ticks: tuple[tuple[float, str], ...], most: int) -> None:
    """Give an axis the ticks that a chart prescribes, else round ones."""
    from matplotlib import ticker

    low, high = axis.get_view_interval()
    axis.set_minor_locator(ticker.NullLocator())
    axis.set_minor_formatter(ticker.NullFormatter())
    if ticks:
        shown = [(at, word) for at, word in ticks if low <= at <= high]
        axis.set_major_locator(ticker.FixedLocator([at for at, _ in shown]))
        axis.set_major_formatter(ticker.FixedFormatter([word for _, word in shown]))
        return
    spread(axis, most)


def spread(axis: Axis, most: int) -> None:
    """Put round ticks on an axis, at most that many intervals."""
    from matplotlib import ticker

    if axis.get_scale() != "log":
        axis.set_major_formatter(ticker.FuncFormatter(number_label))
        axis.set_major_locator(ticker.MaxNLocator(nbins=most, steps=list(_STEPS), min_n_ticks=2))
        return
    low, high = axis.get_view_interval()
    decades = math.log10(high / low)
    axis.set_major_formatter(ticker.FuncFormatter(power_label if decades > _MANY_DECADES else number_label))
    if decades >= _FEW_DECADES:
        axis.set_major_locator(ticker.LogLocator(numticks=most + 1))
        axis.set_minor_locator(ticker.LogLocator(subs="all" if decades <= _MANY_DECADES else (1.0,), numticks=99))
    else:
        subs = (1.0, 2.0, 5.0) if most > 3 else (1.0, 3.0)
        axis.set_major_locator(ticker.LogLocator(subs=subs, numticks=most + 1))


def power_label(value: float, _place: int | None = None) -> str:
    """Write the word of a tick of an axis over many decades."""
    power = round(math.log10(value)) if value > 0.0 else 0
    return f"10{str(power).translate(_RAISED)}" if math.isclose(value, 10.0**power) else numeral(value, 6)


def number_label(value: float, _place: int | None = None) -> str:
    """Write the word of a tick."""
    return numeral(value, 6)


def broken(word: str, longest: int) -> str:
    """Return long words in several lines, broken after a blank, a dot or an underscore, but not before a unit."""
    lines = [""]
    word = re.sub(r" (?=[%×])|(?<=×) | (?=(\S{1,2} )*\S{1,2}$)", _UNBROKEN, word)
    for part in re.findall(r"[^. _]+(?:\.(?=\d)[^. _]+)*[. _]?|[. _]", word):
        if lines[-1] and len(lines[-1]) + len(part.rstrip(" ")) > longest:
            lines.append("")
        lines[-1] += part
    return "\n".join(line.rstrip(" ") for line in lines)
