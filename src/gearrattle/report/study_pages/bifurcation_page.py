"""The page of a bifurcation diagram: the points over the swept value, stretches of one motion, where two coexist."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.json_types import json_value
from gearrattle.report.page import Section
from gearrattle.report.plots.axis_names import Measure, measure_of, paths_of
from gearrattle.report.plots.bifurcation_figure import diagram
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.study_pages.study_page import Messages, StudyPage, joined
from gearrattle.report.study_tables import failure_table
from gearrattle.report.tables import Table, shortened
from gearrattle.studies.case_runs import DONE
from gearrattle.studies.coexistence import Stretch, stretches, sweeps_of, swept, swept_values
from gearrattle.studies.dataset_layout import words_of
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_MOST_CHARTS = 4
_MOST_SAID = 5
_MOST_ROWS = 60


def charts(data: xr.Dataset) -> list[Chart]:
    """Return a diagram for every combination of further axes, the first few."""
    diagrams = []
    for i, (held, one) in enumerate(itertools.islice(_combinations(data), _MOST_CHARTS)):
        diagrams.append(diagram(one, "bifurcation" + (f"-{i + 1}" if held else ""), held))
    return diagrams


def _combinations(data: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Every combination of further axes in words, and its sweeps."""
    others = [str(name) for name in data["outcome"].dims[1:-1]]
    for at in itertools.product(*(range(data.sizes[name]) for name in others)):
        measures = [measure_of(data, name) for name in others]
        held = ", ".join(
            f"{measure.words} = {measure.with_unit(data[name].values[i], 3)}"
            for name, measure, i in zip(others, measures, at, strict=True)
        )
        yield held, data.isel(dict(zip(others, at, strict=True)))


def summary_of(data: xr.Dataset) -> str:
    """Return sentences: kinds of motion over the swept value, and ranges of two coexisting motions."""
    # stretches of one kind of motion, by direction
    sentences = []
    shown = _swept_measure(data)
    for name, one in sweeps_of(data)[:2]:
        sweep_stretches = stretches(one)
        parts = [
            f"{stretch.words} {_span(stretch.low, stretch.high, shown)}" for stretch in sweep_stretches[:_MOST_SAID]
        ]
        left = len(sweep_stretches) - _MOST_SAID
        more = f", and {counted(left, 'more stretch', 'more stretches')}" if left > 0 else ""
        sentences.append(f"Going {name}: {'; '.join(parts)}{more}.")
    # ranges of two coexisting motions
    if "motions" in data:
        first = data.isel(dict.fromkeys((str(name) for name in data["motions"].dims[:-1]), 0))
        apart = _runs(first)
        where = joined([_span(low, high, shown) for low, high in apart[:_MOST_SAID]])
        sentences.append(
            f"Two motions coexist {where}."
            if apart
            else "Both directions end in the same motion wherever that is decided."
        )
    # failed cases
    missing = data["outcome"].size - int((data["outcome"] == DONE).sum())
    if missing:
        sentences.append(f"{missing} of {counted(data['outcome'].size, 'case')} failed.")
    return " ".join(sentences)


def _swept_measure(data: xr.Dataset) -> Measure:
    """Return name and unit of the swept value."""
    return measure_of(data, paths_of(data, swept(data))[0])


def _span(low: float, high: float, shown: Measure) -> str:
    if low == high:
        return f"at {shown.with_unit(low)}"
    return f"from {numeral(low * shown.factor, 4)} to {shown.with_unit(high)}"


def _runs(data: xr.Dataset) -> list[tuple[float, float]]:
    """Neighbouring values at which two motions coexist, as ranges."""
    values = swept_values(data)
    differ = data["motions"].values == 1
    edge = np.diff(np.concatenate([[0], differ.astype(int), [0]]))
    return [
        (float(values[a]), float(values[b - 1]))
        for a, b in zip(np.flatnonzero(edge == 1), np.flatnonzero(edge == -1), strict=True)
    ]


def setting_of(data: xr.Dataset) -> str:
    """Return the swept value and the section in words."""
    axis = swept(data)
    others = [measure_of(data, str(name)).words for name in data["outcome"].dims[1:-1]]
    combination = f" for every combination of {joined(others)}" if others else ""
    tolerance = numeral(float(data.attrs["tolerance"]), 2)
    ways = joined([str(way) for way in data["direction"].values])
    return (
        f"Swept: {_swept_measure(data).words} ({counted(data.sizes[axis], 'value')}, {ways}){combination}. "
        f"Seen at {float(data.attrs['phase']):g} of every period; points within {tolerance} of "
        f"the clearance are the same; periods up to {int(data.attrs['largest_period'])} T are looked for."
    )


def counts_of(data: xr.Dataset) -> Table:
    """Return a table of the number of values with each kind of motion, one row per direction."""
    words = words_of(data["motion"])
    rows = []
    for i, way in enumerate(data["direction"].values):
        codes = data["motion"].isel(direction=i).values
        rows.append((str(way), *(f"{int(np.count_nonzero(codes == code))}" for code in range(len(words)))))
    return Table(("direction", *words), tuple(rows), note="Values by kind of motion.")


def stretch_table(data: xr.Dataset) -> Table:
    """Stretches of one kind of motion, a row each."""
    rows = []
    shown = _swept_measure(data).factor
    for name, one in sweeps_of(data):
        for stretch in stretches(one):
            period = f"{stretch.period}" if stretch.period else ""
            rows.append(
                (
                    name,
                    _number(stretch.low * shown),
                    _number(stretch.high * shown),
                    f"{stretch.count}",
                    stretch.motion,
                    period,
                    stretch.verdict,
                )
            )
    left = len(rows) - _MOST_ROWS
    note = f"{left} more stretches stand in results.zarr." if left > 0 else ""
    head = ("sweep", *_ends(data), "values", "motion", "period [T]", "verdict")
    return Table(head, tuple(rows[:_MOST_ROWS]), frozenset({0, 4, 6}), note=note)


def coexistence_table(data: xr.Dataset) -> Table:
    """Return a table of the values at which both directions end in different motions."""
    rows = []
    shown = _swept_measure(data).factor
    for held, one in _combinations(data) if "motions" in data else ():
        rows += [(held or "all", _number(low * shown), _number(high * shown)) for low, high in _runs(one)]
    return Table(("held", *_ends(data)), tuple(rows[:_MOST_ROWS]))


def _ends(data: xr.Dataset) -> tuple[str, str]:
    """Heads of the columns of a range."""
    unit = _swept_measure(data).unit
    return (f"from [{unit}]", f"to [{unit}]") if unit else ("from", "to")


def _number(value: float) -> str:
    return numeral(value, 5)


def sections(data: xr.Dataset, messages: Messages) -> list[Section]:
    """The tables, those that have rows."""
    all_sections = [
        Section(
            "stretches",
            "Stretches",
            words=("Neighbouring values along which the motion keeps its kind.",),
            tables=(stretch_table(data),),
        ),
        Section(
            "coexistence",
            "Two motions",
            words=("Values at which going up and going down end in different motions.",),
            tables=(coexistence_table(data),),
        ),
        Section(
            "failures",
            "Cases that failed",
            words=("The sweep went on from the state before.",),
            tables=(failure_table(data, messages),),
        ),
    ]
    return [section for section in all_sections if any(table.rows for table in section.tables)]


def answer(data: xr.Dataset) -> tuple[Table, ...]:
    """The stretches of one motion, and where two coexist."""
    return shortened(stretch_table(data)), shortened(coexistence_table(data))


def content(data: xr.Dataset) -> dict[str, Any]:
    """The same for machines."""
    names = ("from", "to", "motion", "period", "verdict", "values")
    stretch_rows = [
        {"sweep": name, **dict(zip(names, map(json_value, _stretch(stretch)), strict=True))}
        for name, one in sweeps_of(data)
        for stretch in stretches(one)
    ]
    coexist = [
        {"held": held, "from": low, "to": high}
        for held, one in (_combinations(data) if "motions" in data else ())
        for low, high in _runs(one)
    ]
    path = paths_of(data, swept(data))[0]
    unit = str(data[path].attrs.get("units", ""))
    return {"swept": path, "unit": unit, "stretches": stretch_rows, "coexistence": coexist}


def _stretch(stretch: Stretch) -> tuple[float, float, str, int | float, str, int]:
    """A stretch as values; no period is NaN."""
    return stretch.low, stretch.high, stretch.motion, stretch.period or float("nan"), stretch.verdict, stretch.count


PAGE = StudyPage(
    charts=charts,
    summary=summary_of,
    setting=setting_of,
    counts=counts_of,
    sections=sections,
    answer=answer,
    content=content,
)
