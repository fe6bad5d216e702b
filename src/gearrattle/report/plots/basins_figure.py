"""Basins of attraction: every initial state has the colour of the motion to which it leads.

A grid over two initial values is a map; over one it is a strip; over more it is a section at the middle of the other
values. States drawn at random are points. If both axes are quantities of the Poincare section, and the phase of the
section is the phase at which motions begin, the points of the attractors are marked.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.model.path_labels import INITIAL
from gearrattle.report.plots.axis_names import edges_of, measure_of
from gearrattle.report.plots.chart import Cells, Chart, Key, Line, Panel
from gearrattle.report.plots.palette import INK, NO_VALUE, PAPER
from gearrattle.studies.basin_attractors import ATTRACTOR, CHAOS, NOTHING, UNSETTLED, attractors_that_rattle, orbit_of
from gearrattle.studies.plan import SAMPLE
from gearrattle.trajectory import Array

if TYPE_CHECKING:
    import xarray as xr

QUIET = ("#8497aa", "#5d6b7a", "#b3c0cc")
RATTLING = ("#e69f00", "#a8123e", "#56b4e9", "#009e73", "#cc79a7", "#6a51a3", "#8c6d31")
"""Colours of attractors that do not rattle (``QUIET``) and of the others; further attractors share the last colour."""
OTHERS = {CHAOS: Key("chaotic", "#1b2631"), UNSETTLED: Key("undecided", "#e8dcc0"), NOTHING: Key("no result", NO_VALUE)}
_MARGIN = 0.03


def name_of(data: xr.Dataset, number: int) -> str:
    """Return number and name of an attractor."""
    return f"{number}: {data['attractor name'].values[number - 1]}"


def keys_of(data: xr.Dataset) -> dict[int, Key]:
    """Colour and name of every code of ``basin`` that occurs."""
    keys = {}
    quiet = list(QUIET)
    rattling = list(RATTLING)
    for n, rattles in enumerate(attractors_that_rattle(data).tolist(), start=1):
        colours = rattling if rattles else quiet
        keys[n] = Key(name_of(data, n), colours.pop(0) if len(colours) > 1 else colours[0])
    there = set(np.unique(data["basin"].values).tolist())
    return keys | {code: key for code, key in OTHERS.items() if code in there}


def basin_map(data: xr.Dataset) -> Chart:
    """Draw the basins."""
    keys = keys_of(data)
    drawn = SAMPLE in data["basin"].dims
    panel, names, words = _points(data, keys) if drawn else _cells(data, keys)
    marked = _marks(data, names)
    caption = f"The settled motion of every initial state, by {words}."
    if marked:
        caption += " Rings: the attractors themselves, once a period."
    panel = replace(
        panel,
        lines=(*panel.lines, *marked),
        x_range=_reaching(panel.x_range, [line.x for line in marked]),
        y_range=_reaching(panel.y_range, [line.y for line in marked]),
    )
    height = 120 if panel.y_ticks else 420
    return Chart("basins", "Basins of attraction", caption, (panel,), panel_height=height, legend=tuple(keys.values()))


def _reaching(limits: tuple[float, float] | None, values: list[Array]) -> tuple[float, float] | None:
    """Limits that leave room around some values as well."""
    if limits is None or not values:
        return limits
    (low, high) = limits
    shown = np.concatenate(values)
    room = _MARGIN * (max(high, float(shown.max())) - min(low, float(shown.min())))
    return min(low, float(shown.min()) - room), max(high, float(shown.max()) + room)


def _cells(data: xr.Dataset, keys: dict[int, Key]) -> tuple[Panel, list[str], str]:
    """A map over the first two initial values, or a strip over the only one; their names, and how to read it."""
    # the first two axes; the others at their middle
    names = [str(name) for name in data["basin"].dims]
    others = {name: data.sizes[name] // 2 for name in names[2:]}
    codes = data["basin"].isel(others).transpose(*names[:2]).values
    # cells along x and y, ascending
    across = measure_of(data, names[0])
    x = across.factor * np.asarray(data[names[0]].values, dtype=np.float64)
    order = np.argsort(x)
    x_edges = edges_of(x[order], False)
    codes = codes[order]
    if len(names) > 1:
        y = measure_of(data, names[1]).factor * np.asarray(data[names[1]].values, dtype=np.float64)
        rising = np.argsort(y)
        y_edges = edges_of(y[rising], False)
        codes = codes[:, rising]
    else:
        y_edges = np.array([0.0, 1.0])
        codes = codes[:, None]
    # rectangles by code, and the values of the other axes in words
    cells = tuple(_boxes(codes == code, x_edges, y_edges, key) for code, key in keys.items() if np.any(codes == code))
    measures = {name: measure_of(data, name) for name in others}
    held = ", ".join(
        f"{measures[name].words} = {measures[name].with_unit(data[name].values[i])}" for name, i in others.items()
    )
    ends = (float(x_edges[0]), float(x_edges[-1])), (float(y_edges[0]), float(y_edges[-1]))
    panel, words = _frame(data, names[:2], ends)
    return replace(panel, cells=cells), names[:2], words + (f"; {held}" if held else "")


def _frame(
    data: xr.Dataset, names: list[str], ends: tuple[tuple[float, float], tuple[float, float]]
) -> tuple[Panel, str]:
    """Axes of one or two initial values, and which stands where."""
    across = measure_of(data, names[0])
    up = measure_of(data, names[1]) if len(names) > 1 else None
    panel = Panel(
        up.words if up else "",
        up.unit if up else "",
        across.title,
        x_range=ends[0],
        y_range=ends[1],
        y_ticks=() if up else ((-9.0, ""),),
    )
    return panel, f"{across.words} (horizontal)" + (f" and {up.words} (vertical)" if up else "")


def _boxes(mask: NDArray[np.bool_], x_edges: Array, y_edges: Array, key: Key) -> Cells:
    """Cells where the mask holds, (nx, ny), those side by side in a column joined."""
    padded = np.pad(mask.astype(np.int8), ((0, 0), (1, 1)))
    change = np.diff(padded, axis=1)
    at, low = np.nonzero(change == 1)
    _, high = np.nonzero(change == -1)
    return Cells(x_edges[at], x_edges[at + 1], y_edges[low], y_edges[high], key.name, key.colour)


def _points(data: xr.Dataset, keys: dict[int, Key]) -> tuple[Panel, list[str], str]:
    """A point for every state drawn, over the first two initial values or the only one; as ``_cells``."""
    names = [INITIAL + str(name) for name in np.atleast_1d(data.attrs["over"])][:2]
    columns = [measure_of(data, name).factor * np.asarray(data[name].values, dtype=np.float64) for name in names]
    x, y = columns if len(columns) > 1 else (columns[0], np.zeros(columns[0].size))
    codes = data["basin"].values
    size = float(np.clip(160.0 / np.sqrt(max(1, x.size)), 2.5, 7.0))
    lines = tuple(
        Line(x[codes == code], y[codes == code], key.name, key.colour, "points", size) for code, key in keys.items()
    )
    ends = [(float(v.min() - _MARGIN * np.ptp(v)), float(v.max() + _MARGIN * np.ptp(v))) for v in (x, y)]
    panel, words = _frame(data, names, (ends[0], ends[1] if len(names) > 1 else (-1.0, 1.0)))
    return replace(panel, lines=lines), names, words


def _marks(data: xr.Dataset, names: list[str]) -> tuple[Line, ...]:
    """The attractors' own points, as rings; none unless both axes show what the section holds at the start's phase."""
    plain = [name.removeprefix(INITIAL) for name in names]
    section = [str(name) for name in np.atleast_1d(data.attrs["section"])]
    if len(plain) < 2 or not set(plain) <= set(section) or float(data.attrs["phase"]) != 0.0:
        return ()
    factors = [measure_of(data, name).factor for name in names]
    orbits = [
        [factor * orbit_of(data, n, name) for name, factor in zip(plain, factors, strict=True)]
        for n in range(1, data.sizes[ATTRACTOR] + 1)
    ]
    if not orbits:
        return ()
    x, y = (np.concatenate([orbit[i] for orbit in orbits]) for i in range(2))
    return tuple(Line(x, y, "attractors", colour, "points", size) for colour, size in ((INK, 9.0), (PAPER, 5.0)))
