"""The map of a screening: margin of lift-off of every loose gear over speed and load.

Every gear has a panel. In blue cells the gear keeps contact, in crimson cells it lifts off; cells are darker further
from the threshold. Yellow cells are undecided: in some of the possible equivalent linear drivelines the gear lifts off.
A dark line separates blue cells from all others. Dots mark simulated cases that rattle. A screening over speed alone
has curves instead of cells.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from gearrattle.report.plots.axis_names import cell_ticks, labels_of, measure_of, paths_of
from gearrattle.report.plots.chart import Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.palette import COLOURS, INK
from gearrattle.report.plots.study_maps import NOTHING, cells_of, edge_between
from gearrattle.studies.screening import BY_PATH, LOAD
from gearrattle.studies.screening_check import rattles_in
from gearrattle.trajectory import Array

if TYPE_CHECKING:
    import xarray as xr

STEPS = (1.0, 2.0, 3.0, 6.0, 10.0, 15.0, 20.0, 30.0, 40.0, 60.0)
"""Possible widths of a shade [dB]; on every side of 0 dB, the least width with which three shades cover all margins."""
SHADES = ("#08519c", "#4f93c6", "#c3dbee", "#f3c9d2", "#cf5573", "#7d0a2c")
"""Blues that hold, crimsons that lift off; neighbours keep apart for every form of colour vision (tests)."""
UNSURE = "#d9b32c"
"""Colour of undecided cells."""
_UNSURE = Key("undecided", UNSURE)
_BELIEVE = (
    " Lift-off takes in mesh stiffness and transmission errors, the separation ratio neither: where the two maps "
    "disagree, believe lift-off."
)
_BELIEVE_DOTS = f"{_BELIEVE} Where the dots of the simulation disagree with either, believe the dots."
_DOTS = Key("rattles when simulated", INK)
Measure = Literal["lift_ratio", "separation_ratio"]


def screening_map(data: xr.Dataset, measure: Measure = "lift_ratio") -> Chart:
    """Draw the data of ``gearrattle.screen`` by one ratio.

    "separation_ratio" is the classical one, of the engine's orders alone.
    """
    # margins [dB], and cells that are undecided
    margin, low, undecided = _margins(data, measure)
    speeds, what = speeds_of(data)
    # title and caption by the measure
    word = "lift-off" if measure == "lift_ratio" else "separation"
    title = f"Screening by {word}"
    said = "deflection of the mesh" if measure == "lift_ratio" else "driver's acceleration at the engine's orders"
    caption = f"Margin of every loose gear by the {said} in the linear driveline; above 0 dB it leaves its flank."
    caption += _BELIEVE if "regime" not in data else _BELIEVE_DOTS
    if undecided.any():
        caption += (
            " Undecided: some linear drivelines lift the gear off and some do not, by friction stuck or let go, staged "
            "springs in the stages they reach, other gears on or off their flanks. Shades: the margin nearest to 0 dB."
        )
    if np.isinf(margin).any():
        caption += " A gear that rests within its gap is off its flank already: its margin is without bounds."
    key = "screening" if measure == "lift_ratio" else "screening_separation"
    # over speed alone: curves
    if data.sizes["load"] == 1:
        return _curves(data, (low[:, 0, :], margin[:, 0, :]), speeds, what, (key, title, caption))
    # shades of the margin nearest to 0 dB
    shaded = np.where(undecided, np.nan, np.where(low > 0.0, low, margin))
    bounds = bounds_of(shaded)
    edges = (-np.inf, *bounds, np.inf)
    legend = tuple(Key(_between(low, high), s) for low, high, s in zip(edges[:-1], edges[1:], SHADES, strict=True))
    unsure = (_UNSURE,) if undecided.any() else ()
    # a map of every gear, with the boundary at 0 dB
    across = [numeral(v, 4) for v in speeds]
    (up, load) = loads_of(data)
    panels = []
    for k, gear in enumerate(data["gear"].values.tolist()):
        margins = shaded[:, :, k].T
        codes = np.where(np.isnan(margins), -1, np.searchsorted(bounds, margins, "right"))
        codes = np.where(undecided[:, :, k].T, len(legend), codes)
        lines = edge_between(margin[:, :, k].T > 0.0, ~np.isnan(margin[:, :, k].T))
        panels.append(
            Panel(
                str(gear),
                f"↑ {load}",
                what,
                x_range=(-0.5, len(across) - 0.5),
                y_range=(-0.5, len(up) - 0.5),
                x_ticks=cell_ticks(across, 6),
                y_ticks=cell_ticks(up, 10),
                lines=(*lines, *_dots(data, k)),
                cells=cells_of(codes, (*legend, *unsure, NOTHING)),
            )
        )
    dots = (*unsure, *((NOTHING,) if np.isnan(margin).any() else ()), *((_DOTS,) if "regime" in data else ()))
    return Chart(
        key,
        title,
        caption,
        tuple(panels),
        columns=min(2, len(panels)),
        panel_height=220,
        share_x=False,
        legend=(*legend, *dots),
    )


def bounds_of(margin: Array) -> tuple[float, ...]:
    """Return the bounds of shades [dB]: those below 0 reach to the least margin, those above to the largest."""
    finite = margin[np.isfinite(margin)]
    below, above = (
        next((step for step in STEPS if 3.0 * step >= reach), STEPS[-1])
        for reach in (float((-finite).max(initial=0.0)), float(finite.max(initial=0.0)))
    )
    return (-2.0 * below, -below, 0.0, above, 2.0 * above)


def _margins(data: xr.Dataset, measure: Measure) -> tuple[Array, Array, NDArray[np.bool_]]:
    """(speed, load, gear) largest and least margin [dB], and where the forecast is undecided."""
    names: tuple[str, str] = (measure, measure)
    if measure == "lift_ratio" and "lift_high" in data:
        names = ("lift_high", "lift_low")
    with np.errstate(divide="ignore"):
        high, low = (20.0 * np.log10(np.asarray(data[name].values, dtype=np.float64)) for name in names)
    return high, low, (high > 0.0) & (low <= 0.0)


def _curves(
    data: xr.Dataset, margins: tuple[Array, Array], speeds: Array, what: str, words: tuple[str, str, str]
) -> Chart:
    """Margins over speed, a line a gear, dashed the least where it is a range; dots where a simulation rattles."""
    lines = []
    legend = []
    low, margin = margins
    # whether the margin is a range over linear drivelines
    is_range = bool(np.any(low < margin))
    for k, gear in enumerate(data["gear"].values.tolist()):
        key = Key(str(gear), COLOURS[k % len(COLOURS)])
        legend.append(key)
        # the largest margin of a gear, and the least
        y = np.where(np.isfinite(margin[:, k]), margin[:, k], np.nan)
        lines.append(Line(speeds, y, key.name, key.colour, width=1.6))
        lines.append(Line(speeds, y, key.name, key.colour, "points", 5.0))
        if is_range:
            least = np.where(np.isfinite(low[:, k]), low[:, k], np.nan)
            lines.append(Line(speeds, least, f"{key.name}, least", key.colour, width=1.0, dash="dashed"))
        # cases that rattle when simulated
        if "regime" in data:
            rattles = rattles_in(data)[0][:, 0, k]
            lines.append(Line(speeds[rattles], y[rattles], _DOTS.name, INK, "points", 2.5))
    dots = (*((NOTHING,) if np.isnan(margin).any() else ()), *((_DOTS,) if "regime" in data else ()))
    if is_range:
        words = (*words[:2], f"{words[2]} Dashed: the least over the linear drivelines; the line is the largest.")
    panel = Panel("Margin", "dB", what, tuple(lines), rules=(Rule(0.0, label="lifts off"),))
    return Chart(*words, (panel,), panel_height=260, legend=(*legend, *dots))


def loads_of(data: xr.Dataset) -> tuple[list[str], str]:
    """Loads as people say them, and what they are: factors, values of a path, or numbers of several together."""
    if data[LOAD].attrs.get("long_name") != BY_PATH:
        return [numeral(float(v), 3) for v in data[LOAD].values], "load factor"
    paths = paths_of(data, LOAD)
    title = measure_of(data, paths[0]).title
    return labels_of(data, LOAD), title if len(paths) == 1 else f"{title} (and {len(paths) - 1} more)"


def speeds_of(data: xr.Dataset) -> tuple[Array, str]:
    """Speeds as people say them, and the title of their axis."""
    values = np.asarray(data["speed"].values, dtype=np.float64)
    return (values * 30.0 / np.pi, "speed [rpm]") if data.attrs.get("units") == "SI" else (values, "speed")


def _between(low: float, high: float) -> str:
    if np.isinf(low):
        return f"below {numeral(high)} dB"
    return f"above {numeral(low)} dB" if np.isinf(high) else f"{numeral(low)} to {numeral(high)} dB"


def _dots(data: xr.Dataset, gear: int) -> tuple[Line, ...]:
    """A dot in every cell whose simulation rattles."""
    if "regime" not in data:
        return ()
    speed, load = (indices.astype(np.float64) for indices in np.nonzero(rattles_in(data)[0][:, :, gear]))
    return (Line(speed, load, _DOTS.name, INK, "points", 5.0),)
