"""Tables of a screening, gear by gear: cases that are quiet, undecided or lift off, and simulated cases that rattle.

The margin is 20 log10 of the lift ratio [dB]. It is a range, because several linear drivelines may be equivalent to the
real one. A gear is quiet if the largest margin is below zero, lifts off if the least margin is above zero, and is
undecided otherwise. A gear whose equilibrium is inside its gap has no contact, and its margin is infinite. Screenings
of earlier versions have one margin instead of a range.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.report.plots.axis_names import measure_of, paths_of
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.screening_figure import loads_of, speeds_of
from gearrattle.report.tables import Table
from gearrattle.signals import SEVERITIES
from gearrattle.studies.output import REGIMES
from gearrattle.studies.screening import BY_PATH, LOAD
from gearrattle.studies.screening_check import (
    FORECASTS,
    LIFTS,
    QUIET,
    UNDECIDED,
    Checked,
    checked,
    forecasts_of,
    rattles_in,
)
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
    quiet, undecided, lifts
        number of cases in which it is quiet, is undecided, lifts off.
    margin
        largest margin of all cases [dB]; infinite if the equilibrium is inside the gap.
    least
        least margin in the case with the largest margin [dB].
    speed, load
        indices of this case along the axes.
    classical
        largest margin of the separation ratio [dB].
    rattles
        number of cases in which the simulation rattles; None without simulations.
    judged
        number of cases whose simulation has a verdict; None without simulations.
    agree
        number of these cases in which forecast and simulation agree, without undecided forecasts; None without
        simulations.
    checked
        counts of agreement by forecast; None without simulations.
    """

    gear: str
    loose: str
    driver: str
    cases: int
    quiet: int
    undecided: int
    lifts: int
    margin: float
    least: float
    speed: int
    load: int
    classical: float
    rattles: int | None = None
    judged: int | None = None
    agree: int | None = None
    checked: Checked | None = None


def gears_of(data: xr.Dataset) -> list[Screened]:
    """Return every gear, the one with the largest margin first."""
    # margins and forecasts of all cases
    low, high = margins(data)
    forecast = forecasts(data)
    gears = []
    for k, gear in enumerate(data["gear"].values.tolist()):
        # the case of the largest margin
        own = high[:, :, k]
        at = np.unravel_index(int(np.argmax(np.nan_to_num(own, nan=-np.inf))), own.shape)
        # number of cases by forecast
        quiet, undecided, lifts = (int((forecast[:, :, k] == code).sum()) for code in range(len(FORECASTS)))
        screened = Screened(
            gear=str(gear),
            loose=str(data["loose"].values[k]),
            driver=str(data["driver"].values[k]),
            cases=own.size,
            quiet=quiet,
            undecided=undecided,
            lifts=lifts,
            margin=float(own[at]),
            least=float(low[:, :, k][at]),
            speed=int(at[0]),
            load=int(at[1]),
            classical=float(np.nanmax(data["margin"].values[:, :, k])),
        )
        # agreement of forecast and simulation
        if "regime" in data:
            rattles, judged = (some[:, :, k] for some in rattles_in(data))
            done = checked(forecast[:, :, k], rattles, judged)
            screened = replace(
                screened,
                rattles=int(rattles.sum()),
                judged=int(judged.sum()),
                agree=done.ran_quiet + done.ran_rattling,
                checked=done,
            )
        gears.append(screened)
    return sorted(gears, key=lambda gear: -gear.margin)


def margins(data: xr.Dataset) -> tuple[Array, Array]:
    """(speed, load, gear) 20 log10 of the least and of the largest lift ratio [dB]."""
    names = ("lift_low", "lift_high") if "lift_high" in data else ("lift_ratio", "lift_ratio")
    with np.errstate(divide="ignore"):
        low, high = (20.0 * np.log10(np.asarray(data[name].values, dtype=np.float64)) for name in names)
    return low, high


def forecasts(data: xr.Dataset) -> NDArray[np.int8]:
    """(speed, load, gear) codes of ``FORECASTS``."""
    if "forecast" in data:
        return np.asarray(data["forecast"].values, dtype=np.int8)
    ratio = np.asarray(data["lift_ratio"].values, dtype=np.float64)
    return forecasts_of(ratio, ratio)


def inside(data: xr.Dataset) -> NDArray[np.bool_]:
    """(speed, load) whether the linear motion is an exact motion of the real driveline."""
    return np.asarray(data["inside"].values, dtype=np.bool_)


def place(data: xr.Dataset, speed: int, load: int) -> str:
    """Return speed and load of a case in words."""
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


def decibels(margin: float, least: float | None = None) -> str:
    """Return a margin in words, or the range from the least to the largest margin."""
    if np.isnan(margin):
        return "–"
    if margin == np.inf:
        return "within its gap"
    largest = numeral(margin, 3)
    smallest = numeral(margin if least is None else least, 3)
    return f"{largest} dB" if largest == smallest else f"{smallest} to {largest} dB"


def summary_of(data: xr.Dataset) -> str:
    """Return the outcome of a screening in a few sentences."""
    # a sentence a gear, the first by margin
    gears = gears_of(data)
    sentences = []
    for gear in gears[:_MOST_NAMED]:
        where = f"{place(data, gear.speed, gear.load)}"
        margin = decibels(gear.margin, gear.least)
        if gear.quiet == gear.cases:
            sentences.append(f"{gear.gear} holds everywhere, nearest at {where}, by {margin}.")
        elif gear.undecided == gear.cases:
            sentences.append(f"{gear.gear} is undecided in {_all_of(gear.cases, gear.cases)} ({margin} at {where}).")
        elif gear.undecided:
            sentences.append(
                f"{gear.gear} is quiet in {gear.quiet} of {counted(gear.cases, 'case')}, undecided in {gear.undecided} "
                f"and lifts off in {gear.lifts}, most at {where} ({margin})."
            )
        else:
            sentences.append(f"{gear.gear} lifts off in {_all_of(gear.lifts, gear.cases)}, most at {where} ({margin}).")
    if len(gears) > _MOST_NAMED:
        sentences.append(f"{len(gears) - _MOST_NAMED} more gears stand in the table.")
    # cases in which the linear motion is exact
    exact = int(inside(data).sum())
    sentences.append(
        f"In {exact} of {counted(inside(data).size, 'case')} no clearance crosses a corner, and nothing rubs: there "
        "the linear motion is exact, and so are the margins."
    )
    if exact < inside(data).size:
        sentences.append(
            "In the others this is a linear forecast: quiet means that no linear driveline lifts the gear off, "
            "undecided that some do (friction stuck or let go, staged springs in the stages they reach, other gears "
            "on or off their flanks)."
        )
    # cases that were simulated
    if "regime" in data:
        sentences.append(_simulated(gears))
    return " ".join(sentences)


def _all_of(some: int, cases: int) -> str:
    """Return "in SOME of CASES cases" in words."""
    return f"all {counted(cases, 'case')}" if some == cases and cases > 1 else f"{some} of {counted(cases, 'case')}"


def _simulated(gears: list[Screened]) -> str:
    """Return a sentence on how often simulation and forecast agree, over all gears."""
    done = [gear.checked for gear in gears if gear.checked is not None]
    parts = [
        (sum(c.said_quiet for c in done), sum(c.ran_quiet for c in done), "said quiet", "ran quiet"),
        (sum(c.said_lifts for c in done), sum(c.ran_rattling for c in done), "said to lift off", "rattled"),
        (sum(c.undecided for c in done), sum(c.undecided_rattling for c in done), "undecided", "rattled"),
    ]
    words = [f"of {said} {what} {ran} {how}" for said, ran, what, how in parts if said]
    pairs = sum(gear.judged or 0 for gear in gears)
    return f"Simulated were {pairs} pairs of a gear and a case: {', '.join(words) or 'none could be judged'}."


def setting_of(data: xr.Dataset) -> str:
    """Return the ranges of a screening in words."""
    speeds, what = speeds_of(data)
    unit = " rpm" if what.endswith("[rpm]") else ""
    ends = f"{numeral(float(speeds.min()), 4)} to {numeral(float(speeds.max()), 4)}{unit}"
    words = f"{speeds.size} speeds, {ends}" if speeds.size > 1 else f"one speed, {numeral(float(speeds[0]), 4)}{unit}"
    labels, load = loads_of(data)
    if len(labels) > 1:
        words += f"; {len(labels)} loads, {load} {labels[0]} to {labels[-1]}"
    return f"{words}; {counted(data.sizes['gear'], 'loose gear')}."


def gears_table(data: xr.Dataset) -> Table:
    """One row per gear."""
    gears = gears_of(data)
    head: tuple[str, ...] = ("gear", "loose body", "driver", "quiet", "undecided", "lifts off")
    head = (*head, "largest margin", "at", "classical, largest")
    rows: list[tuple[str, ...]] = [
        (
            gear.gear,
            gear.loose,
            gear.driver,
            *(f"{some} of {gear.cases}" for some in (gear.quiet, gear.undecided, gear.lifts)),
            decibels(gear.margin, gear.least),
            place(data, gear.speed, gear.load),
            decibels(gear.classical),
        )
        for gear in gears
    ]
    if "regime" in data:
        head = (*head, "said quiet, ran quiet", "said to lift off, rattled", "undecided, rattled")
        more = [_counts(gear.checked) for gear in gears]
        rows = [(*row, *extra) for row, extra in zip(rows, more, strict=True)]
    note = (
        "Margins above 0 dB: the gear leaves the flank its drag presses it to; a range is over the linear drivelines "
        "that may stand for this one. Classical: the separation ratio of the engine's orders on a rigid mesh."
    )
    return Table(head, tuple(rows), frozenset({0, 1, 2, 7}), note=note)


def _counts(done: Checked | None) -> tuple[str, str, str]:
    """Return the number of confirmed forecasts by kind; for undecided forecasts, the number of cases that rattle."""
    if done is None:
        return ("–", "–", "–")
    pairs = (
        (done.ran_quiet, done.said_quiet),
        (done.ran_rattling, done.said_lifts),
        (done.undecided_rattling, done.undecided),
    )
    first, second, third = (f"{some} of {said}" if said else "–" for some, said in pairs)
    return first, second, third


def checks_table(data: xr.Dataset) -> Table:
    """One row per gear and simulated case: forecast, range, result; wrong forecasts first."""
    head = ("at", "gear", "forecast", "margin", "simulated", "")
    if "regime" not in data:
        return Table(head, ())
    # forecasts and simulations of all cases
    low, high = margins(data)
    forecast = forecasts(data)
    regime = np.asarray(data["regime"].values)
    rattles, judged = rattles_in(data)
    severity = np.asarray(data["severity"].values) if "severity" in data else None
    names = [str(name) for name in data["gear"].values]
    rows = []
    for i, j, k in np.argwhere(judged).tolist():
        # forecast and simulation of one case, and whether they agree
        said = int(forecast[i, j, k])
        words = REGIMES[regime[i, j, k]]
        ran = words if severity is None or words == "quiet" else f"{SEVERITIES[severity[i, j, k]]}, {words}"
        is_right = _is_right(said, rattles=bool(rattles[i, j, k]), separates=words != "quiet")
        margin = decibels(float(high[i, j, k]), float(low[i, j, k]))
        rows.append((place(data, i, j), names[k], FORECASTS[said], margin, ran, is_right))
    # wrong forecasts first
    rows.sort(key=lambda row: row[-1] != "wrong")
    note = (
        "Wrong forecasts come first. An undecided one is neither right nor wrong, and so is lift-off of a gear that "
        "only touches."
    )
    return Table(head, tuple(rows), frozenset({0, 1, 2, 4, 5}), "Simulated cases", note)


def _is_right(said: int, *, rattles: bool, separates: bool) -> str:
    """Return in words whether a forecast was right."""
    if said == UNDECIDED or (said == LIFTS and separates and not rattles):
        return ""
    return "right" if (said == QUIET) != rattles else "wrong"


def thresholds_table(data: xr.Dataset) -> Table:
    """For every speed and gear, the least load from which the gear may lift off at all higher loads of the map."""
    may_lift = forecasts(data) != QUIET
    labels, what = loads_of(data)
    names = [str(name) for name in data["gear"].values]
    head = (speeds_of(data)[1], *names)
    if len(labels) < 2:
        return Table(head, ())
    speeds = speeds_of(data)[0]
    rows = tuple(
        (numeral(float(speed), 4), *(_first(may_lift[i, :, k], labels) for k in range(len(names))))
        for i, speed in enumerate(speeds)
    )
    note = f"The first load of the map ({what}) from which on the gear may lift off; a dash: it holds at the last."
    return Table(head, rows, note=note)


def _first(lifts: NDArray[np.bool_], labels: list[str]) -> str:
    """Return the first label from which all further values are true."""
    holds = np.flatnonzero(~lifts)
    at = 0 if not holds.size else int(holds[-1]) + 1
    return labels[at] if at < len(labels) else "–"
