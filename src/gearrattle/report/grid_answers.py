"""Answers of a grid for the terminal and summary.json: probabilities, deciding values, counts, boundary of regimes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.json_types import json_value
from gearrattle.report.plots.axis_names import measure_of, paths_of
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.study_tables import boundary_table, code_counts, count_table, lacking_values, probability_table
from gearrattle.report.tables import Table, shortened
from gearrattle.studies.dataset_layout import (
    axes_in,
    chosen_codes,
    has_probabilities,
    outputs_in,
    scattered,
    subject_names,
    subject_of,
    units_of,
)
from gearrattle.studies.plan import SAMPLE
from gearrattle.studies.probability import rattle_probability
from gearrattle.studies.regime_boundary import CROSSING, regime_boundary
from gearrattle.studies.sensitivity import sensitivities

if TYPE_CHECKING:
    import xarray as xr

_MEASURES = ("total_order", "swing", "rank_regression")
"""Measures of how much a value decides; the first one that the samples allow is used."""
_TOLD = (
    "total_order",
    "total_order_half_width",
    "first_order",
    "first_order_half_width",
    "rank_regression",
    "spearman",
    "low",
    "high",
    "swing",
)
_MOST_DECIDING = 3
_MOST_LINES = 12


def answer(data: xr.Dataset) -> tuple[Table, ...]:
    """Return the tables that a terminal shows."""
    tables: list[Table] = []
    output = chosen_codes(data)
    if output:
        tables.append(probability_table(data) if _is_probable(data) else count_table(data))
    if _is_scattered(data):
        tables.append(_deciding_table(data, _deciding(data)))
    if output and SAMPLE not in data.dims:
        tables.append(boundary_table(data))
    return tuple(shortened(table, _MOST_LINES) for table in tables if table.rows)


def content(data: xr.Dataset) -> dict[str, Any]:
    """Return these answers for summary.json."""
    values: dict[str, Any] = {}
    output = chosen_codes(data)
    if output and _is_probable(data):
        values["probability"] = _probabilities(data, output)
    elif output:
        values["counts"] = code_counts(data, output)
    if _is_scattered(data):
        values["decides"] = _deciding(data)
    if output and SAMPLE not in data.dims:
        values["boundary"] = _boundary(data, output)
    values["lacking"] = lacking_values(data)
    names = [path for axis in axes_in(data) for path in paths_of(data, axis)] + list(scattered(data))
    values["units"] = {name: str(data[name].attrs.get("units", "")) for name in names}
    return values


def _is_probable(data: xr.Dataset) -> bool:
    return has_probabilities(data) and not axes_in(data)


def _is_scattered(data: xr.Dataset) -> bool:
    return SAMPLE in data.dims and not axes_in(data) and bool(scattered(data))


def _probabilities(data: xr.Dataset, output: str) -> dict[str, Any]:
    """Probability of rattle by part, with its interval."""
    probability = rattle_probability(data, output)
    subject = subject_of(data, output)
    keys = ("probability", "low", "high", "rattling", "samples")
    names = [str(name) for name in probability[subject].values] if subject else [""]  # those that can separate
    return {
        name or output: {
            key: json_value((probability[key].sel({subject: name}) if subject else probability[key]).values.item())
            for key in keys
        }
        for name in names
    }


def _deciding(data: xr.Dataset) -> list[dict[str, Any]]:
    """For every output and subject that vary, the values with most effect, the strongest first."""
    deciding = []
    for output in outputs_in(data):
        result = sensitivities(data, output)
        subject = subject_of(data, output)
        measure = next(name for name in _MEASURES if name in result)
        for name in subject_names(data, output):
            one = result.sel({subject: name}) if subject else result
            strengths = np.abs(one[measure].values)
            if not np.nanmax(strengths, initial=0.0) > 0.0:
                continue
            order = np.argsort(-np.nan_to_num(strengths), kind="stable")[:_MOST_DECIDING]
            ranked = [
                {
                    "value": str(one["value"].values[i]),
                    **{key: json_value(float(one[key].values[i])) for key in _TOLD if key in one},
                }
                for i in order.tolist()
            ]
            deciding.append({"output": output, "subject": name, "by": measure, "values": ranked})
    return deciding


def _deciding_table(data: xr.Dataset, deciding: list[dict[str, Any]]) -> Table:
    """The values with most effect, one row per output and subject."""
    rows: list[tuple[str, ...]] = []
    for entry in deciding:
        unit = units_of(data, entry["output"])[entry["subject"]] if entry["by"] == "swing" else ""
        title = f"{entry['subject']}: {entry['output']}" if entry["subject"] else entry["output"]
        for value in entry["values"]:
            rows.append((title, measure_of(data, value["value"]).words, _strength(value, entry["by"], unit)))
            title = ""
    by = {"total_order": "total index", "swing": "swing", "rank_regression": "rank regression"}
    return Table(("output", "decided by", by[deciding[0]["by"]] if deciding else ""), tuple(rows), frozenset({0, 1}))


def _strength(value: dict[str, Any], by: str, unit: str) -> str:
    """Return in words how strong the effect of a value on an output is."""
    text = numeral(value[by], 2) if value[by] is not None else "–"
    half = value.get(f"{by}_half_width")
    return f"{text} ± {numeral(half, 2)}" if half is not None else f"{text} {unit}".strip()


def _boundary(data: xr.Dataset, output: str) -> list[dict[str, Any]]:
    """Every pair of neighbouring cases between which the severity or the regime changes."""
    boundary = regime_boundary(data, output)
    return [
        {str(name): json_value(boundary[name].values[i]) for name in boundary.data_vars}
        for i in range(boundary.sizes.get(CROSSING, 0))
    ]
