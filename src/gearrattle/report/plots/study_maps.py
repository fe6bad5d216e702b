"""Maps of a study: codes, probabilities or numbers over two axes; codes of every part over one.

Cells with the same meaning have the same colour; a thick line separates cells that rattle from all others. If a study
has more than two axes, the largest value over the other axes is drawn.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.report.plots.axis_names import cell_ticks, labels_of, title_of, words_of_axis
from gearrattle.report.plots.chart import Cells, Chart, Key, Line, Panel
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.palette import INK, NO_VALUE, STATES
from gearrattle.studies.dataset_layout import (
    axes_in,
    chosen_codes,
    numbers_of,
    outputs_in,
    rattling_from,
    subject_names,
    subject_of,
    units_of,
    values_of,
    words_of,
)
from gearrattle.studies.output import REGIME, SEVERITY
from gearrattle.studies.plan import SAMPLE
from gearrattle.studies.probability import rattle_probability
from gearrattle.trajectory import Array
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

Codes = NDArray[np.int64]
NOTHING = Key("no value", NO_VALUE)
MOST_PANELS = 12
_HEIGHT = 260
_ROW = 26
_SHADES = 8
_LEAST = 0.01
_BELIEVE = (
    " One loss of contact within the cycles kept makes a part rattle here and hardly changes a mean: where this map "
    "and one of numbers disagree, believe this one on whether a part rattles, that one on how much."
)
_SEPARATED = (
    "quiet from what crosses corners: a gap separates, however softly, and a staged spring changes stage",
    "what rattles from what touches or is quiet",
)
"""Words on the cells that the thick line separates, in maps of regimes and of severities."""
_MEDIAN = (
    " Median over the samples: that of a typical one. Where it is small and the probability of rattle is not, believe "
    "the probability."
)
_RED = ("#f6e9ed", "#7d0a2c")
_BLUE = ("#d3e3ef", "#083d60")


def two_axes(data: xr.Dataset) -> tuple[str, str]:
    """The two axes of most values, in the order of the study."""
    longest = sorted(axes_in(data), key=lambda axis: -data.sizes[axis])[:2]
    first, second = (axis for axis in axes_in(data) if axis in longest)
    return first, second


def code_maps(data: xr.Dataset) -> list[Chart]:
    """Draw the codes that a study shows; with a severity the regime, where it was kept as well."""
    chosen = chosen_codes(data)
    outputs = [chosen, *([REGIME] if chosen == SEVERITY and REGIME in data else [])]
    return [
        chart for output in outputs if (chart := code_map(data, output, "map" if output == chosen else "map-regime"))
    ]


def code_map(data: xr.Dataset, output: str, key: str = "map") -> Chart | None:
    """Draw codes over two axes, one panel per part; over one, one row per part. None without codes or with samples."""
    if not output or SAMPLE in data.dims or not axes_in(data):
        return None
    words = words_of(data[output])
    legend = (*(Key(word, STATES[word]) for word in words), NOTHING)
    if len(axes_in(data)) == 1:
        return _strip(data, output, legend, key)
    x, y = two_axes(data)
    lowest = rattling_from(data[output])
    panels = []
    for name, codes in _by_subject(values_of(data, output), subject_of(data, output), x, y):
        regimes = np.nan_to_num(codes, nan=-1.0).astype(np.int64)
        frame = _frame(data, x, y, name)
        panels.append(_with(frame, cells_of(regimes, legend), edge_between(regimes >= lowest, regimes >= 0)))
    if not panels:
        return None
    caption = (
        f"{_name(output)} {_over(data, x, y)}; the thick line separates {_SEPARATED[lowest > 1]}."
        f"{_others(data, x, y)}{_BELIEVE if _has_numbers(data) else ''}"
    )
    return _chart(key, f"Map of the {output}", caption, panels, legend)


def probability_map(data: xr.Dataset) -> Chart | None:
    """Draw the share of samples that rattle over two axes, one panel per part; None for fewer axes, or no samples."""
    output = chosen_codes(data)
    if not output or SAMPLE not in data.dims or len(axes_in(data)) < 2:
        return None
    x, y = two_axes(data)
    probability = rattle_probability(data, output)["probability"]
    panels, legend = _shaded(data, probability, subject_of(data, output), np.linspace(0.0, 1.0, 11), _RED)
    if not panels:
        return None
    caption = f"Share of samples in which a part rattles, {_over(data, x, y)}.{_others(data, x, y)}"
    return _chart("probability-map", "Probability of rattle", caption, panels, legend)


def number_maps(data: xr.Dataset, output: str) -> list[Chart]:
    """Draw an output of numbers over two axes: one chart per scale, one panel per subject that varies by 1 %."""
    if len(axes_in(data)) < 2:
        return []
    # numbers over two axes, the median over samples
    x, y = two_axes(data)
    units = units_of(data, output)
    subject = subject_of(data, output)
    values = numbers_of(values_of(data, output))
    if SAMPLE in values.dims:
        values = values.median(SAMPLE)
    over = _MEDIAN if SAMPLE in data.dims else ""
    charts: list[Chart] = []
    # maps by unit, as values of different units share no scale
    for unit in dict.fromkeys(units.values()):
        drawn = [name for name, one in units.items() if one == unit and _varies_over(_of(values, subject, name).values)]
        # subjects share a scale unless one spans less than a shade of it
        scales = _scales({name: _of(values, subject, name).values for name in drawn})
        for names in scales:
            some = values.sel({subject: names}) if subject else values
            bounds = np.linspace(float(np.nanmin(some.values)), float(np.nanmax(some.values)), _SHADES + 1)
            panels, legend = _shaded(data, some, subject, bounds, _BLUE)
            words = f"{_name(output)}{f', {unit}' if unit else ''}"
            left_out = _left_out(units, drawn, unit) if names is scales[-1] else ""
            caption = f"{words}, {_over(data, x, y)}.{over}{_others(data, x, y)}{left_out}"
            number = f"-{len(charts) + 1}" if charts else ""
            key = "map-" + "".join(c if c.isalnum() else "-" for c in output) + number
            title = f"Map of the {output}" + (f", {unit}" if len(set(units.values())) > 1 else "")
            title += f": {', '.join(names)}" if len(scales) > 1 else ""
            charts.append(_chart(key, title, caption, panels, legend))
    return charts


def _scales(values: Mapping[str, Array]) -> list[list[str]]:
    """Names that share a scale: a subject that spans less than a shade of another's has one of its own."""
    extent = {name: (float(np.nanmin(one)), float(np.nanmax(one))) for name, one in values.items()}
    scales = []
    left = list(extent)
    while left:
        shade = (max(extent[name][1] for name in left) - min(extent[name][0] for name in left)) / _SHADES
        widest = max(left, key=lambda name: extent[name][1] - extent[name][0])
        scales.append([name for name in left if name == widest or extent[name][1] - extent[name][0] > shade])
        left = [name for name in left if name not in scales[-1]]
    return scales


def _of(values: xr.DataArray, subject: str, name: str) -> xr.DataArray:
    return values.sel({subject: name}) if subject else values


def _left_out(units: Mapping[str, str], drawn: list[str], unit: str) -> str:
    left = [name for name, one in units.items() if one == unit and name not in drawn]
    return f" Not drawn, varying by less than a hundredth: {', '.join(left)}." if left else ""


def _varies_over(values: Array) -> bool:
    """Whether finite values differ by a hundredth of the largest or more: less is no map."""
    finite = values[np.isfinite(values)]
    return bool(finite.size and np.ptp(finite) >= _LEAST * np.abs(finite).max() and np.ptp(finite) > 0.0)


def _varies(values: Array) -> bool:
    return len(np.unique(values[np.isfinite(values)])) > 1


def _chart(key: str, title: str, caption: str, panels: list[Panel], legend: tuple[Key, ...]) -> Chart:
    """Two panels per row; as high as wide enough."""
    columns = min(2, len(panels))
    left = len(panels) - MOST_PANELS
    drawn = {cells.name for panel in panels for cells in panel.cells}
    legend = tuple(key for key in legend if key is not NOTHING or key.name in drawn)
    more = f" Not drawn: {counted(left, 'part')} more." if left > 0 else ""
    return Chart(
        key,
        title,
        caption + more,
        tuple(panels[:MOST_PANELS]),
        columns=columns,
        panel_height=_HEIGHT,
        share_x=False,
        legend=legend,
    )


def _strip(data: xr.Dataset, output: str, legend: tuple[Key, ...], key: str) -> Chart:
    """Codes over one axis: one row per subject."""
    (axis,) = axes_in(data)
    subject = subject_of(data, output)
    values = values_of(data, output).transpose(*([subject] if subject else []), axis).values
    codes = np.nan_to_num(np.atleast_2d(values).astype(np.float64), nan=-1.0).astype(np.int64)
    names = subject_names(data, output) if subject else [output]
    labels = labels_of(data, axis)
    panel = Panel(
        _name(output),
        "",
        title_of(data, axis),
        cells=cells_of(codes, legend),
        x_range=(-0.5, codes.shape[1] - 0.5),
        y_range=(-0.5, len(names) - 0.5),
        x_ticks=cell_ticks(labels, 12),
        y_ticks=tuple((float(i), name[:10]) for i, name in enumerate(names)),
    )
    caption = f"{_name(output)} of every part over {words_of_axis(data, axis)}."
    legend = legend if (codes < 0).any() else legend[:-1]
    return Chart(key, f"Map of the {output}", caption, (panel,), panel_height=_ROW * len(names) + 14, legend=legend)


def _shaded(
    data: xr.Dataset, values: xr.DataArray, subject: str, bounds: Array, ends: tuple[str, str]
) -> tuple[list[Panel], tuple[Key, ...]]:
    """Panels of numbers in shades, and what each shade means."""
    shades = [_between(*ends, share) for share in np.linspace(0.0, 1.0, len(bounds) - 1).tolist()]
    pairs = zip(bounds[:-1].tolist(), bounds[1:].tolist(), shades, strict=True)
    legend = (*(Key(f"{numeral(a, 3)}–{numeral(b, 3)}", shade) for a, b, shade in pairs), NOTHING)
    panels = []
    axes = two_axes(data)
    for name, subject_values in _by_subject(values, subject, *axes):
        codes = np.clip(np.searchsorted(bounds, subject_values, "right") - 1, 0, len(bounds) - 2)
        panels.append(
            _with(_frame(data, *axes, name), cells_of(np.where(np.isfinite(subject_values), codes, -1), legend), ())
        )
    return panels, legend


def _by_subject(values: xr.DataArray, subject: str, x: str, y: str) -> list[tuple[str, Array]]:
    """For every subject its numbers over (y, x), the largest over all other axes; those that vary come first."""
    numbers = numbers_of(values)
    others = [name for name in numbers.dims if name not in (x, y, subject)]
    largest = numbers.max(others).transpose(*([subject] if subject else []), y, x)
    arrays = largest.values if subject else largest.values[None, :, :]
    names = [str(name) for name in values[subject].values] if subject else [str(values.name or "")]
    parts = list(zip(names, arrays, strict=True))
    return sorted(parts, key=lambda pair: not _varies(pair[1]))


def _frame(data: xr.Dataset, x: str, y: str, name: str) -> Panel:
    """A panel with axes of cells and nothing in it."""
    across = labels_of(data, x)
    up = labels_of(data, y)
    return Panel(
        name,
        f"↑ {title_of(data, y)}",
        title_of(data, x),
        x_range=(-0.5, len(across) - 0.5),
        y_range=(-0.5, len(up) - 0.5),
        x_ticks=cell_ticks(across, 6),
        y_ticks=cell_ticks(up, 10),
    )


def _with(frame: Panel, cells: tuple[Cells, ...], lines: tuple[Line, ...]) -> Panel:
    return replace(frame, cells=cells, lines=lines)


def cells_of(codes: Codes, legend: tuple[Key, ...]) -> tuple[Cells, ...]:
    """Cells of every code (rows, columns), -1 the last of the legend; neighbours of a row joined."""
    cells = []
    for code, key in zip([*range(len(legend) - 1), -1], legend, strict=True):
        edges = np.diff(np.pad((codes == code).astype(np.int8), ((0, 0), (1, 1))), axis=1)
        (row, begin) = np.nonzero(edges == 1)
        (_, end) = np.nonzero(edges == -1)
        if row.size:
            left, right, middle = (edges.astype(np.float64) for edges in (begin - 0.5, end - 0.5, row))
            cells.append(Cells(left, right, middle - 0.5, middle + 0.5, key.name, key.colour))
    return tuple(cells)


def edge_between(rattles: NDArray[np.bool_], there: NDArray[np.bool_]) -> tuple[Line, ...]:
    """The line between cells that rattle and cells that do not, pieces parted by NaN; none if there are none."""
    neighbours = (rattles[:, 1:] != rattles[:, :-1]) & there[:, 1:] & there[:, :-1]
    above = (rattles[1:] != rattles[:-1]) & there[1:] & there[:-1]
    pieces = [(j + 0.5, i - 0.5, j + 0.5, i + 0.5) for i, j in np.argwhere(neighbours).tolist()]
    pieces += [(j - 0.5, i + 0.5, j + 0.5, i + 0.5) for i, j in np.argwhere(above).tolist()]
    x = np.array([v for x0, _, x1, _ in pieces for v in (x0, x1, np.nan)])
    y = np.array([v for _, y0, _, y1 in pieces for v in (y0, y1, np.nan)])
    return (Line(x, y, "quiet to rattling", INK, width=2.0),) if pieces else ()


def _between(first: str, last: str, share: float) -> str:
    a, b = ([int(colour[k : k + 2], 16) for k in (1, 3, 5)] for colour in (first, last))
    return "#" + "".join(f"{round(p + share * (q - p)):02x}" for p, q in zip(a, b, strict=True))


def _name(output: str) -> str:
    return output[:1].upper() + output[1:]


def _others(data: xr.Dataset, x: str, y: str) -> str:
    others = [axis for axis in axes_in(data) if axis not in (x, y)]
    names = ", ".join(words_of_axis(data, axis) for axis in others)
    return f" The largest over {names} is drawn." if others else ""


def _over(data: xr.Dataset, x: str, y: str) -> str:
    """Return in words which axis is across and which is up."""
    return f"over {words_of_axis(data, x)} (horizontal) and {words_of_axis(data, y)} (vertical)"


def _has_numbers(data: xr.Dataset) -> bool:
    """Whether maps of numbers are drawn next to the map of codes."""
    return any(not words_of(data[name]) for name in outputs_in(data))
