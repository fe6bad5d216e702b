"""The page of a basin study: the map of initial states, the attractors with their shares, and their separation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.json_types import json_value
from gearrattle.model.path_labels import INITIAL
from gearrattle.report.page import Section
from gearrattle.report.plots.axis_names import measure_of
from gearrattle.report.plots.basins_figure import basin_map, keys_of, name_of
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.study_pages.study_page import Messages, StudyPage, joined
from gearrattle.report.study_tables import failure_table
from gearrattle.report.tables import Table, shortened
from gearrattle.studies.basin_attractors import ATTRACTOR, CHAOS, FAR, NOTHING, UNSETTLED, orbit_of, quiet_share
from gearrattle.studies.plan import SAMPLE
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_MOST_SAID = 6
_MOST_ROWS = 40
_ROOM = 10.0
_UNVERIFIED = "not verified"


def charts(data: xr.Dataset) -> list[Chart]:
    """Return the map of the basins."""
    return [basin_map(data)]


def summary_of(data: xr.Dataset) -> str:
    """Return sentences: the number of attractors, their shares, and the share of those that do not rattle."""
    # attractors by their share
    count = data.sizes[ATTRACTOR]
    shares = [
        f"{name_of(data, n).partition(': ')[2]} from {_percent(float(data['share'][n - 1]))}"
        for n in range(1, min(count, _MOST_SAID) + 1)
    ]
    more = f", and {count - _MOST_SAID} more" if count > _MOST_SAID else ""
    sentences = [f"{counted(count, 'periodic motion')}: {joined(shares)} of the initial states{more}."] if count else []
    if np.any(data["family"].values):
        sentences.append("A family is a continuum of motions, as of a body that floats anywhere within its gap.")
    # the share of motions that do not rattle, with its interval
    quiet = quiet_share(data)
    interval = ""
    if np.isfinite(quiet["low"]):
        interval = f" (95 % interval {_percent(quiet['low'])} to {_percent(quiet['high'])})"
    sentences.append(f"A motion that does not rattle is reached from {_percent(quiet['share'])} of them{interval}.")
    # shares of initial states without an attractor
    for code, words in ((CHAOS, "lead to chaos"), (UNSETTLED, "had not settled and are counted to no motion")):
        share = int(np.count_nonzero(data["basin"].values == code)) / max(1.0, quiet["among"])
        if share > 0.0:
            sentences.append(f"{_percent(share)} {words}.")
    failed = int(np.count_nonzero(data["basin"].values == NOTHING))
    if failed:
        sentences.append(f"{failed} of {counted(data['basin'].size, 'case')} failed; they are counted nowhere.")
    return " ".join([*sentences, _least_distance(data)])


def _least_distance(data: xr.Dataset) -> str:
    """Return a sentence on the separation of the attractors."""
    between = float(data.attrs["between"])
    same = float(data.attrs["same"])
    if data.sizes[ATTRACTOR] < 2 or between >= FAR:
        return ""
    within = float(data.attrs["within"])
    sentence = (
        f"Orbits of one motion differ by {numeral(within, 2)} of half the clearance at most, those of two by "
        f"{numeral(between, 2)} at least; {numeral(same, 2)} parts them."
    )
    if between < _ROOM * same or within > same / _ROOM:
        sentence += " That leaves little room: another threshold may find other motions."
    return sentence


def _percent(share: float) -> str:
    return f"{numeral(100.0 * share, 3)} %"


def setting_of(data: xr.Dataset) -> str:
    """Return the initial states and the section in words."""
    tolerance = numeral(float(data.attrs["tolerance"]), 2)
    names = [measure_of(data, INITIAL + str(name)).words for name in np.atleast_1d(data.attrs["over"])]
    how = "drawn from a box of" if SAMPLE in data["basin"].dims else "on a grid over"
    return (
        f"{data['basin'].size} initial states {how} {joined(names)}. Seen at {float(data.attrs['phase']):g} of every "
        f"period; a motion is settled if it repeats within {tolerance} of half the clearance."
    )


def counts_of(data: xr.Dataset) -> Table:
    """Initial states by where they lead."""
    rows = []
    for code, key in keys_of(data).items():
        rows.append((key.name, f"{int(np.count_nonzero(data['basin'].values == code))}"))
    return Table(("motion", "initial states"), tuple(rows))


def attractor_table(data: xr.Dataset) -> Table:
    """The attractors: share, interval, largest multiplier, and a point of each."""
    # one row per motion: cases, share with Wilson's interval, largest multiplier, points of the section
    section = [str(name) for name in np.atleast_1d(data.attrs["section"])]
    measures = [measure_of(data, name) for name in section]
    rows = []
    for n in range(1, min(data.sizes[ATTRACTOR], _MOST_ROWS) + 1):
        one = data.isel({ATTRACTOR: n - 1})
        low = float(one["low"])
        high = float(one["high"])
        interval = f"{_percent(low)} to {_percent(high)}" if np.isfinite(low) else "a grid has none"
        points = [
            ", ".join(numeral(float(v) * measure.factor, 4) for v in orbit_of(data, n, name))
            for name, measure in zip(section, measures, strict=True)
        ]
        modulus = numeral(float(one["attractor multiplier"]), 4) if int(one["verified"]) else _UNVERIFIED
        rows.append(
            (name_of(data, n), f"{int(one['cases'])}", _percent(float(one["share"])), interval, modulus, *points)
        )
    # notes on the samples and on motions that are not verified
    note = (
        "Wilson's interval (1927), for independent samples; Latin hypercube and Sobol samples scatter less."
        if SAMPLE in data["basin"].dims
        else "Shares of a grid are shares of its points."
    )
    if not np.all(data["verified"].values):
        note += " Not verified: shooting led to no stable motion nearby, so verdict and period are those of the cases."
    return Table(
        ("motion", "cases", "share", "95 % interval", "largest multiplier", *(measure.title for measure in measures)),
        tuple(rows),
        note=note,
    )


def sections(data: xr.Dataset, messages: Messages) -> list[Section]:
    """The tables, those that have rows."""
    all_sections = [
        Section(
            "attractors",
            "Attractors",
            words=("The motions that the initial states lead to, seen once a period.",),
            tables=(attractor_table(data),),
        ),
        Section("failures", "Cases that failed", tables=(failure_table(data, messages),)),
    ]
    return [section for section in all_sections if any(table.rows for table in section.tables)]


def answer(data: xr.Dataset) -> tuple[Table, ...]:
    """The settled motions with their shares of the initial states."""
    whole = attractor_table(data)
    return (shortened(Table(whole.head[:4], tuple(row[:4] for row in whole.rows))),)


def content(data: xr.Dataset) -> dict[str, Any]:
    """The same for machines, and how likely a quiet motion is."""
    motions = [
        {
            "number": n,
            "motion": name_of(data, n),
            "period": int(data["attractor period"].values[n - 1]),
            "multiplier": json_value(data["attractor multiplier"].values[n - 1]),
            **{key: json_value(data[key].values[n - 1]) for key in ("cases", "share", "low", "high")},
        }
        for n in range(1, data.sizes[ATTRACTOR] + 1)
    ]
    quiet = quiet_share(data)
    others = {"chaotic": CHAOS, "undecided": UNSETTLED, "failed": NOTHING}
    return {
        "motions": motions,
        "quiet": {key: json_value(quiet[key]) for key in ("share", "low", "high")},
        **{word: int(np.count_nonzero(data["basin"].values == code)) for word, code in others.items()},
    }


PAGE = StudyPage(
    charts=charts,
    summary=summary_of,
    setting=setting_of,
    counts=counts_of,
    sections=sections,
    answer=answer,
    content=content,
)
