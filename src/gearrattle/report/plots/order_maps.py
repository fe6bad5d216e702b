"""Run-ups as static SVG: spectra over speed as a map, orders over speed, cuts along orders, coherence with its limits.

Levels are in decibels: 20 log10 of an amplitude, or 10 log10 of a density, over a stated reference (default: one SI
unit). With orders and natural frequencies drawn over it (``overlays``) a map is a Campbell diagram of the measured or
simulated motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gearrattle.report.plots.chart import Chart, Heat, Key, Line, Panel
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.overlays import Turning, lines_told, overlay
from gearrattle.report.plots.palette import ACCENT, CENTRE, MUTED, shade
from gearrattle.report.plots.raster import largest_along
from gearrattle.report.plots.thinning import thin
from gearrattle.trajectory import Array
from gearrattle.wording import noun_of

if TYPE_CHECKING:
    import xarray as xr

COLUMNS = 220
ROWS = 160
"""Largest numbers of cells of a map (``COLUMNS``, ``ROWS``); a cell shows its largest value, so no line disappears."""
SPAN = 60.0
"""Range of a map below its largest value [dB]."""
CUTS = (ACCENT, "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6bb1", "#7a5c3e")
_HEIGHT = 260
_KEYS = 7
_POINTS = 2000
_FLOOR = 1e-300


def levels(values: Array, *, squared: bool, reference: float = 1.0) -> Array:
    """Return levels [dB] of amplitudes over a reference, or of densities over its square a hertz."""
    with np.errstate(invalid="ignore"):
        return np.asarray((10.0 if squared else 20.0) * np.log10(np.maximum(values, _FLOOR) / reference))


def level_unit(unit: str, reference: float = 1.0) -> str:
    """Return the unit of a level, with what it refers to."""
    return f"dB re {numeral(reference)} {raised(unit)}".removesuffix(" 1")


def raised(unit: str) -> str:
    """Return a unit as it is printed."""
    return unit.replace("^2", "²")


def round_up(level: float) -> float:
    """Return the next whole five decibels, for the end of a map's shades."""
    return float(5.0 * np.ceil(level / 5.0 - 1e-9))


def map_panel(
    data: xr.DataArray,
    title: str,
    *,
    top: float | None = None,
    si: bool = True,
    orders: Sequence[float] = (),
    natural: Sequence[float] = (),
) -> Panel:
    """Draw one map: frequency or order over speed; over time where there is no speed, or it comes back.

    ``data`` is from ``waterfall``, or the amplitude of ``order_map``. ``top`` is the highest level drawn [dB], by
    default the largest. In SI speeds [rad/s] are drawn in rpm, and frequencies in Hz. ``orders`` of the excitation and
    ``natural`` frequencies [rad/s] are drawn over it (``overlays``).
    """
    vertical = str(data.dims[1])
    places, x_title = _level_axis(data, si)
    rising = np.argsort(places, kind="stable")
    shown = levels(data.values, squared=data.name == "density")[rising]
    places = places[rising]
    height = data[vertical].values
    x_edges = _edges(places, COLUMNS)
    bins = np.diff(height).min() if height.size > 1 else 1.0
    y_edges = np.linspace(max(0.0, height[0] - 0.5 * bins), height[-1] + 0.5 * bins, min(ROWS, height.size) + 1)
    cells = largest_along(largest_along(shown, places, x_edges).T, height, y_edges)
    highest = round_up(float(np.nanmax(cells))) if top is None else top
    unit = level_unit(str(data.attrs["units"]))
    x_range = (float(x_edges[0]), float(x_edges[-1]))
    y_range = (float(y_edges[0]), float(y_edges[-1]))
    heat = Heat(x_range, y_range, cells, highest - SPAN, highest, unit)
    turning = Turning.along(x_range, si=si) if "speed" in x_title else _turning(data)
    lines, labels = overlay(x_range, y_range, turning, by_order=vertical == "order", orders=orders, natural=natural)
    units = ("Hz" if si else "") if vertical == "frequency" else "orders"
    return Panel(title, units, x_title, lines=lines, labels=labels, x_range=x_range, y_range=y_range, heat=heat)


def scale_keys(high: float, unit: str) -> tuple[Key, ...]:
    """Return what shades of a map stand for."""
    shares = np.linspace(0.0, 1.0, _KEYS).tolist()
    words = [numeral(high - SPAN * (1.0 - share), 3) for share in shares]
    words[-1] = f"{words[-1]} {unit}"
    words[0] = f"≤ {words[0]}"
    return tuple(Key(word, shade(share)) for word, share in zip(words, shares, strict=True))


def map_chart(
    data: xr.DataArray, *, si: bool = True, orders: Sequence[float] = (), natural: Sequence[float] = ()
) -> Chart:
    """Draw one map by itself, with what its shades stand for."""
    panel = map_panel(data, str(data.attrs["channel"]), si=si, orders=orders, natural=natural)
    assert panel.heat is not None
    by_order = data.dims[1] == "order"
    title = "Orders over speed" if by_order else "Spectra over speed"
    caption = f"{title}: {data.attrs['channel']} of {data.attrs['source']}, {_window(data)}."
    caption += lines_told(panel.lines, by_order=by_order)
    keys = scale_keys(panel.heat.high, panel.heat.name)
    return Chart("order_map" if by_order else "waterfall", title, caption, (panel,), panel_height=420, legend=keys)


def cuts_panel(amplitude: xr.DataArray, title: str, *, si: bool = True) -> Panel:
    """Draw amplitudes of orders over speed, or over time where it comes back."""
    places, x_title = _level_axis(amplitude, si)
    lines: list[Line] = []
    for k, order in enumerate(amplitude.order.values.tolist()):
        y = amplitude.sel(order=order).values
        kept = thin(y, _POINTS)
        colour = CUTS[k] if k < len(CUTS) else CENTRE
        lines.append(Line(places[kept], y[kept], f"order {order:g}", colour, width=1.6))
    top = max(float(np.nanmax(amplitude.values)) * 1.12, 1e-300)
    unit = str(amplitude.attrs["units"])
    return Panel(
        title,
        "" if unit == "1" else raised(unit),
        x_title,
        lines=tuple(lines),
        x_range=(float(places.min()), float(places.max())),
        y_range=(0.0, top),
    )


def cuts_chart(data: xr.Dataset, *, si: bool = True) -> Chart:
    """Draw the cuts of ``order_cuts`` by themselves."""
    legend = tuple(
        Key(f"order {order:g}", CUTS[k] if k < len(CUTS) else CENTRE)
        for k, order in enumerate(data.order.values.tolist())
    )
    caption = (
        f"Amplitudes of orders, fitted over blocks of {data.attrs['turns']:g} "
        f"{noun_of(data.attrs['turns'], 'turn')}: {data.attrs['channel']} of "
        f"{data.attrs['source']}."
    )
    panel = cuts_panel(data.amplitude, str(data.attrs["channel"]), si=si)
    return Chart("order_cuts", "Orders over speed", caption, (panel,), panel_height=_HEIGHT, legend=legend)


def coherence_chart(data: xr.Dataset, *, si: bool = True) -> Chart:
    """Draw a coherence between its limits, and what chance alone stays below."""
    # coherence and its limits, thinned
    frequency = data.frequency.values
    words = f"{100.0 * data.attrs['level']:g} %"
    lines = []
    for name, colour, width in (("low", MUTED, 0.7), ("high", MUTED, 0.7), ("coherence", ACCENT, 1.4)):
        y = data[name].values
        kept = thin(np.nan_to_num(y), _POINTS)
        label = "coherence" if name == "coherence" else f"{words} limit"
        lines.append(Line(frequency[kept], y[kept], label, colour, width=width))
    # the level below which independent signals stay
    chance = float(data.attrs["threshold"])
    lines.append(Line(frequency[[0, -1]], np.full(2, chance), f"chance stays below, {words}", "#d55e00", width=1.0))
    caption = (
        f"Coherence of {data.attrs['channel']} and {data.attrs['reference']}, {data.attrs['averages']:.3g} averages; "
        f"thin lines enclose it with a probability of {words}; independent signals stay below {chance:.3g} as often."
    )
    panel = Panel(
        f"{data.attrs['channel']} and {data.attrs['reference']}",
        "",
        "frequency, Hz" if si else "frequency",
        lines=tuple(lines),
        x_range=(0.0, float(frequency[-1])),
        y_range=(0.0, 1.02),
    )
    legend = (Key("coherence", ACCENT), Key(f"{words} limits", MUTED), Key("chance", "#d55e00"))
    return Chart("coherence", "Coherence", caption, (panel,), panel_height=_HEIGHT, legend=legend)


def _level_axis(data: xr.DataArray, si: bool) -> tuple[Array, str]:
    """Return where rows stand: at their speeds if these rise or fall throughout, else at their times."""
    if "speed" in data.coords:
        speed = np.asarray(data["speed"].values, np.float64)
        steps = np.diff(speed)
        if np.all(steps > 0.0) or np.all(steps < 0.0):
            return (speed * 30.0 / np.pi, "speed, rpm") if si else (speed, "speed")
    return np.asarray(data["time"].values, np.float64), "time, s" if si else "time"


def _turning(data: xr.DataArray) -> Turning | None:
    """Return how the shaft turns along a map over time; None where unknown."""
    if "speed" not in data.coords:
        return None
    time = np.asarray(data["time"].values, np.float64)
    rising = np.argsort(time, kind="stable")
    return Turning(time[rising], np.asarray(data["speed"].values, np.float64)[rising])


def _edges(places: Array, most: int) -> Array:
    """Return equal cells that cover rows and half a step on either side."""
    if places.size < 2:
        return np.asarray([places[0] - 0.5, places[0] + 0.5])
    low = places[0] - 0.5 * (places[1] - places[0])
    high = places[-1] + 0.5 * (places[-1] - places[-2])
    return np.linspace(low, high, max(2, min(most, places.size)) + 1)


def _window(data: xr.DataArray) -> str:
    if data.dims[1] == "order":
        return (
            f"blocks of {data.attrs['turns']:g} {noun_of(data.attrs['turns'], 'turn')}"
            if "turns" in data.attrs
            else "read along orders"
        )
    return f"bins of {numeral(float(data.attrs['resolution']))} Hz"
