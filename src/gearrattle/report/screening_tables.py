"""What a screening found, gear by gear: in how many cases it lifts off, where most, and from which load on.

The margin is 20 log10 of the lift ratio [dB]; a gear lifts off where it is above zero. Where a gear rests within its
gap it is off its flank already, and the margin is infinite.

Takes the Dataset of ``gearrattle.screen``; gives numbers, sentences and Tables.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.report.plots.axis_names import measure_of, paths_of
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.screening import loads_of, speeds_of
from gearrattle.report.tables import Table
from gearrattle.studies.screening import BY_PATH, LOAD
from gearrattle.trajectory import Array
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_MOST_NAMED = 4


@dataclass(frozen=True)
class Screened:
    """One gear of a screening.

    Attributes
    ----------
    gear, loose, driver
        its mesh and the two bodies.
    cases
        of the map.
    lifts
        in how many of them it lifts off.
    margin
        the largest [dB]; infinite where it rests within its gap.
    speed, load
        where that is, as indices into the axes.
    classical
        the largest margin of the separation ratio [dB].
    rattles
        in how many cases the simulation rattles; None where nothing was simulated.
    judged
        in how many cases the simulation was judged; None as above.
    agree
        in how many of these lift-off and simulation say the same; None as above.
    """

    gear: str
    loose: str
    driver: str
    cases: int
    lifts: int
    margin: float
    speed: int
    load: int
    classical: float
    rattles: int | None = None
    judged: int | None = None
    agree: int | None = None


def gears_of(data: xr.Dataset) -> list[Screened]:
    """Return every gear, the one with the largest margin first."""
    margin = margins(data)
    gears = []
    for k, gear in enumerate(data["gear"].values.tolist()):
        own = margin[:, :, k]
        at = np.unravel_index(int(np.argmax(np.nan_to_num(own, nan=-np.inf))), own.shape)
        lifts = own > 0.0
        counts: tuple[int, ...] = ()
        if "regime" in data:
            regime = np.asarray(data["regime"].values)[:, :, k]
            judged = regime >= 0
            counts = int((regime > 0).sum()), int(judged.sum()), int((judged & ((regime > 0) == lifts)).sum())
        names = str(gear), str(data["loose"].values[k]), str(data["driver"].values[k])
        classical = float(np.nanmax(data["margin"].values[:, :, k]))
        gears.append(
            Screened(*names, own.size, int(lifts.sum()), float(own[at]), int(at[0]), int(at[1]), classical, *counts)
        )
    return sorted(gears, key=lambda gear: -gear.margin)


def margins(data: xr.Dataset) -> Array:
    """(speed, load, gear) 20 log10 of the lift ratio [dB]."""
    with np.errstate(divide="ignore"):
        return np.asarray(20.0 * np.log10(np.asarray(data["lift_ratio"].values, dtype=np.float64)))


def inside(data: xr.Dataset) -> NDArray[np.bool_]:
    """(speed, load) whether the linear motion is an exact motion of the driveline."""
    return np.asarray(data["inside"].values, dtype=np.bool_)


def place(data: xr.Dataset, speed: int, load: int) -> str:
    """Say where a case is."""
    speeds, _ = speeds_of(data)
    unit = " rpm" if data.attrs.get("units") == "SI" else ""
    at = f"{numeral(float(speeds[speed]), 4)}{unit}"
    if data.sizes["load"] == 1:
        return at
    labels, what = loads_of(data)
    if data[LOAD].attrs.get("long_name") != BY_PATH:
        return f"{at}, {what} {labels[load]}"
    path = paths_of(data, LOAD)[0]
    measure = measure_of(data, path)
    return f"{at}, {measure.words} = {measure.with_unit(data[path].values[load])}"


def decibels(margin: float) -> str:
    """Say a margin."""
    if np.isnan(margin):
        return "–"
    return "within its gap" if margin == np.inf else f"{numeral(margin, 3)} dB"


def summary_of(data: xr.Dataset) -> str:
    """What came out, in a few sentences."""
    gears = gears_of(data)
    sentences = []
    for gear in gears[:_MOST_NAMED]:
        if gear.lifts == 0:
            sentences.append(
                f"{gear.gear} holds everywhere, nearest at {place(data, gear.speed, gear.load)}, by "
                f"{decibels(gear.margin)}."
            )
        else:
            where = "in all" if gear.lifts == gear.cases else f"in {gear.lifts} of"
            sentences.append(
                f"{gear.gear} lifts off {where} {counted(gear.cases, 'case')}, most at "
                f"{place(data, gear.speed, gear.load)} ({decibels(gear.margin)})."
            )
    if len(gears) > _MOST_NAMED:
        sentences.append(f"{len(gears) - _MOST_NAMED} more gears stand in the table.")
    exact = int(inside(data).sum())
    sentences.append(
        f"In {exact} of {counted(inside(data).size, 'case')} no clearance crosses a corner: there the linear motion is "
        "exact, and so are the margins. In the others the margins are estimates."
    )
    if "regime" in data:
        judged = sum(gear.judged or 0 for gear in gears)
        agree = sum(gear.agree or 0 for gear in gears)
        sentences.append(f"Lift-off and simulation say the same of {agree} of {judged} pairs of a gear and a case.")
    return " ".join(sentences)


def setting_of(data: xr.Dataset) -> str:
    """What was screened."""
    speeds, what = speeds_of(data)
    unit = " rpm" if what.endswith("[rpm]") else ""
    ends = f"{numeral(float(speeds.min()), 4)} to {numeral(float(speeds.max()), 4)}{unit}"
    words = f"{speeds.size} speeds, {ends}" if speeds.size > 1 else f"one speed, {numeral(float(speeds[0]), 4)}{unit}"
    labels, load = loads_of(data)
    if len(labels) > 1:
        words += f"; {len(labels)} loads, {load} {labels[0]} to {labels[-1]}"
    return f"{words}; {counted(data.sizes['gear'], 'loose gear')}."


def gears_table(data: xr.Dataset) -> Table:
    """A row a gear."""
    gears = gears_of(data)
    head: tuple[str, ...] = ("gear", "loose body", "driver", "lifts off", "largest margin", "at", "classical, largest")
    rows: list[tuple[str, ...]] = [
        (
            gear.gear,
            gear.loose,
            gear.driver,
            f"{gear.lifts} of {gear.cases}",
            decibels(gear.margin),
            place(data, gear.speed, gear.load),
            decibels(gear.classical),
        )
        for gear in gears
    ]
    if "regime" in data:
        head = (*head, "rattles when simulated", "said alike")
        more = [(f"{gear.rattles} of {gear.judged}", f"{gear.agree} of {gear.judged}") for gear in gears]
        rows = [(*row, *extra) for row, extra in zip(rows, more, strict=True)]
    note = (
        "Margins above 0 dB: the gear leaves the flank its drag presses it to. Classical: the separation ratio of the "
        "engine's orders on a rigid mesh."
    )
    return Table(head, tuple(rows), frozenset({0, 1, 2, 5}), note=note)


def thresholds_table(data: xr.Dataset) -> Table:
    """For every speed and gear the least load from which on, as far as the map goes, the gear lifts off."""
    margin, (labels, what) = margins(data), loads_of(data)
    names = [str(name) for name in data["gear"].values]
    head = (speeds_of(data)[1], *names)
    if len(labels) < 2:
        return Table(head, ())
    speeds = speeds_of(data)[0]
    rows = tuple(
        (numeral(float(speed), 4), *(_first(margin[i, :, k] > 0.0, labels) for k in range(len(names))))
        for i, speed in enumerate(speeds)
    )
    note = f"The first load of the map ({what}) from which on the gear lifts off; a dash: it holds at the last."
    return Table(head, rows, note=note)


def _first(lifts: NDArray[np.bool_], labels: list[str]) -> str:
    """Return the label from which on all are true."""
    holds = np.flatnonzero(~lifts)
    at = 0 if not holds.size else int(holds[-1]) + 1
    return labels[at] if at < len(labels) else "–"
