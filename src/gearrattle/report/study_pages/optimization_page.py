"""The page of an optimisation: the best design in words, the front and its growth, its members and their values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.json_types import json_value
from gearrattle.report.page import Section
from gearrattle.report.plots.axis_names import measure_of
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.front_figures import front_chart, growth_chart, parallel_chart
from gearrattle.report.plots.numerals import numeral, quantity
from gearrattle.report.study_pages.study_page import Messages, StudyPage, joined
from gearrattle.report.study_tables import failure_table, lacking_said, lacking_values
from gearrattle.report.tables import Table
from gearrattle.studies.pareto_front import certificate_of, in_order
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_MOST_ROWS = 60


def charts(data: xr.Dataset) -> list[Chart]:
    """Return the figures that have something to show."""
    return [chart for chart in (front_chart(data), growth_chart(data), parallel_chart(data)) if chart is not None]


def summary_of(data: xr.Dataset) -> str:
    """The best design in words, compared with the model itself."""
    best = int(data.attrs["best"])
    if best < 0:
        return f"{certificate_of(data)[:1].upper()}{certificate_of(data)[1:]}. {_least(data)}"
    values = _values(data, best)
    reached = joined([f"{name} {_against_model(data, i, best)}" for i, name in enumerate(_objectives(data))])
    word = "The best design" if len(_objectives(data)) == 1 else "Nearest to the best of every objective"
    sure = int(data["certified"][best]) == 1
    certificate = (
        "It is certified" if sure else "A run of its own, exact and audited, does not confirm it: see the front"
    )
    certified = certificate_of(data)
    sentence = f"{word}: {reached}, with {values}. {certificate}. {certified[:1].upper()}{certified[1:]}."
    return " ".join([sentence, *lacking_said(data, "design")])


def _values(data: xr.Dataset, i: int) -> str:
    """The values of a design, in words."""
    measures = {str(path): measure_of(data, str(path)) for path in data.attrs["variables"]}
    return ", ".join(
        f"{measure.words} = {measure.with_unit(float(data[path][i]))}" for path, measure in measures.items()
    )


def _against_model(data: xr.Dataset, i: int, best: int) -> str:
    """An objective's value, and the model's own."""
    unit = str(data.attrs["units"][i])
    text = numeral(float(data["value"][best, i]), 4) + (f" {unit}" if unit else "")
    if not bool(data.attrs.get("own", 0)) or not np.isfinite(float(data["value"][0, i])):
        return text
    missed = "" if float(data["violation"][0]) == 0.0 else ", which misses a limit"
    return f"{text} (the model itself {numeral(float(data['value'][0, i]), 4)}{missed})"


def _least(data: xr.Dataset) -> str:
    """Return a sentence on the design nearest to the limits, if none keeps them."""
    violation = data["violation"].values
    if (i := _nearest(data)) < 0:
        return "All of them failed."
    values = _values(data, i)
    share = numeral(100.0 * float(violation[i]), 3)
    return f"Nearest to the limits comes {values}: it misses them by {share} % in all. Widen ranges or limits."


def setting_of(data: xr.Dataset) -> str:
    """Return variables, objectives and limits in words."""
    low = data.attrs["low"]
    high = data.attrs["high"]
    measures = [measure_of(data, str(path)) for path in data.attrs["variables"]]
    ranges = [
        f"{measure.words} ({numeral(float(a) * measure.factor, 3)} to {measure.with_unit(float(b), 3)})"
        for measure, a, b in zip(measures, low, high, strict=True)
    ]
    word = {"min": "small", "max": "large"}
    sought = [f"{name} {word[sense]}" for name, sense in zip(_objectives(data), data.attrs["senses"], strict=True)]
    limits = list(data.attrs["constraints"])
    within = f" within the limits {joined(limits)}" if limits else ""
    return (
        f"Variables: {joined(ranges)}. Sought: {joined(sought)}{within}. NSGA-II, "
        f"{counted(data.sizes['generation'], 'generation')} of {counted(data.attrs['population'], 'design')}, "
        f"seed {data.attrs['seed']}."
    )


def counts(data: xr.Dataset) -> Table:
    """Return a table of the outcomes of all designs."""
    violation = data["violation"].values
    front = data["front"].values == 1
    rows = (
        ("on the front", f"{int(front.sum())}"),
        ("feasible, beaten by others", f"{int(((violation == 0.0) & ~front).sum())}"),
        ("miss a limit", f"{int((violation > 0.0).sum())}"),
        ("no value", f"{int(np.isnan(violation).sum())}"),
    )
    return Table(("designs", "count"), tuple(row for row in rows if row[1] != "0"))


def sections(data: xr.Dataset, messages: Messages) -> list[Section]:
    """The tables, those that have rows."""
    words = "By the first objective, the better first; each is front/NNN.toml, the one nearest to the ideal best.toml."
    all_sections = [
        Section("members", "Members of the front", words=(words,), tables=(_front_table(data),)),
        Section(
            "failures",
            "Designs that failed",
            words=("The search passed them over.",),
            tables=(failure_table(data, messages),),
        ),
    ]
    return [section for section in all_sections if any(table.rows for table in section.tables)]


def _front_table(data: xr.Dataset) -> Table:
    paths = [str(path) for path in data.attrs["variables"]]
    members = in_order(data)
    measures = [measure_of(data, path) for path in paths]
    best = int(data.attrs["best"])
    rows = []
    for rank, i in enumerate(members[:_MOST_ROWS]):
        objective_cells = [numeral(float(value), 4) for value in data["value"].values[i]]
        values = [numeral(float(data[path][i]) * m.factor, 4) for path, m in zip(paths, measures, strict=True)]
        sure = {1: "yes", 0: "no"}.get(int(data["certified"][i]), "–")
        rows.append((f"{rank + 1}{' (best)' if i == best else ''}", *objective_cells, *values, sure))
    units = [str(unit) for unit in data.attrs["units"]]
    heads = [f"{name} [{unit}]" if unit else name for name, unit in zip(_objectives(data), units, strict=True)]
    left = len(members) - _MOST_ROWS
    note = (
        "Certified: a run of its own by the algorithm exact gives the same values within a part in a million, keeps "
        f"all limits, and its energy is accounted for.{f' {left} more stand in front/.' if left > 0 else ''}"
    )
    last = 1 + len(heads) + len(paths)
    return Table(
        ("no.", *heads, *(measure.title for measure in measures), "certified"),
        tuple(rows),
        frozenset({0, last}),
        note=note,
    )


def answer(data: xr.Dataset) -> tuple[Table, ...]:
    """The best design: its objectives and its values, with the model's own and the ranges."""
    best, chosen, own = _chosen(data)
    rows = []
    for i, name in enumerate(_objectives(data)):
        unit = str(data.attrs["units"][i])
        values = data["value"].values[:, i]
        here = quantity(float(values[chosen]), unit) if chosen >= 0 else "–"
        rows.append((name, here, quantity(float(values[0]), unit) if own else "–", str(data.attrs["senses"][i])))
    for path, low, high in zip(data.attrs["variables"], data.attrs["low"], data.attrs["high"], strict=True):
        measure = measure_of(data, str(path))
        values = data[str(path)].values
        here = measure.with_unit(float(values[chosen])) if chosen >= 0 else "–"
        ends = f"{numeral(float(low) * measure.factor, 3)} to {measure.with_unit(float(high), 3)}"
        rows.append((measure.words, here, measure.with_unit(float(values[0])) if own else "–", ends))
    head = ("", "best" if best >= 0 else "nearest to the limits", "the model", "sought, or range")
    return (Table(head, tuple(rows)),)


def content(data: xr.Dataset) -> dict[str, Any]:
    """The best design, or the one nearest to the limits, and the model's own, for machines."""
    best, chosen, own = _chosen(data)
    designs: dict[str, Any] = {
        "feasible": int((data["violation"].values == 0.0).sum()),
        "lacking": lacking_values(data),
    }
    if chosen >= 0:
        designs["optimum" if best >= 0 else "nearest to the limits"] = _design(data, chosen)
    if own:
        designs["model"] = _design(data, 0)
    return designs


def _chosen(data: xr.Dataset) -> tuple[int, int, bool]:
    """The best design, -1 if none is feasible; the one to show; whether the first one is the model itself."""
    best = int(data.attrs["best"])
    return best, best if best >= 0 else _nearest(data), bool(data.attrs.get("own", 0))


def _nearest(data: xr.Dataset) -> int:
    """The design that misses the limits least; -1 if none has a value."""
    violation = data["violation"].values
    return int(np.nanargmin(violation)) if np.isfinite(violation).any() else -1


def _design(data: xr.Dataset, i: int) -> dict[str, Any]:
    """A design for machines."""
    certified = int(data["certified"].values[i])
    return {
        "design": i,
        "values": {str(path): json_value(data[str(path)].values[i]) for path in data.attrs["variables"]},
        "units": {str(path): str(data[str(path)].attrs.get("units", "")) for path in data.attrs["variables"]},
        "objectives": {
            name: json_value(value) for name, value in zip(_objectives(data), data["value"].values[i], strict=True)
        },
        "violation": json_value(data["violation"].values[i]),
        "certified": None if certified < 0 else bool(certified),
    }


def _objectives(data: xr.Dataset) -> list[str]:
    return [str(name) for name in data["objective"].values]


PAGE = StudyPage(
    charts=charts,
    summary=summary_of,
    setting=setting_of,
    counts=counts,
    sections=sections,
    answer=answer,
    content=content,
)
