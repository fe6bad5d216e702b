"""Tables of sensitivities by the design of the samples: rank coefficients, Sobol' indices, one value at a time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from gearrattle.report.plots.axis_names import Measure, measure_of
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.study_tables import percent
from gearrattle.report.tables import Table
from gearrattle.studies.dataset_layout import axes_in, outputs_in, scattered
from gearrattle.studies.designs import ONE_AT_A_TIME, PAIRS, SALTELLI
from gearrattle.studies.plan import SAMPLE
from gearrattle.studies.sensitivity import sensitivities
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_MOST_PAIRS = 10
Words = Mapping[str, Measure]


def sensitivity_tables(data: xr.Dataset) -> list[Table]:
    """Return the sensitivities of every output that varies, over samples alone; the strongest on top."""
    if SAMPLE not in data.dims or axes_in(data) or not scattered(data):
        return []
    return [table for output in outputs_in(data) for table in output_tables(sensitivities(data, output), data)]


def output_tables(dataset: xr.Dataset, measured: xr.Dataset) -> list[Table]:
    """Return the sensitivities of one output, a table or two a subject that varies.

    ``measured`` holds the values that scatter, with their words and units.
    """
    subject = str(dataset.attrs["subject"])
    output = str(dataset.attrs["output"])
    tables = []
    for name in [str(name) for name in dataset[subject].values] if subject else [""]:
        one = dataset.sel({subject: name}) if subject else dataset
        tables += _tables(one, f"{name}: {output}" if name else output, str(one["output_unit"].item()), measured)
    return tables


def _tables(dataset: xr.Dataset, title: str, unit: str, data: xr.Dataset) -> list[Table]:
    method = str(dataset.attrs.get("sampling", ""))
    names = {str(path): measure_of(data, str(path)) for path in dataset["value"].values}
    if method == ONE_AT_A_TIME:
        swings = np.nanmax(dataset["swing"].values, initial=0.0) > 0.0
        return [_swing_table(dataset, f"{title} [{unit}]" if unit else title, names)] if swings else []
    if not np.isfinite(dataset["spearman"].values).any():
        return []
    if method not in (SALTELLI, PAIRS):
        return [_rank_table(dataset, title, names)]
    return [_index_table(dataset, title, names), *([_pair_table(dataset, title, names)] if method == PAIRS else [])]


def _rank_table(dataset: xr.Dataset, title: str, words: Words) -> Table:
    order = np.argsort(-np.abs(np.nan_to_num(dataset["rank_regression"].values)), kind="stable")
    columns = [dataset[name].values[order] for name in ("rank_regression", "spearman", "first_order")]
    names = [words[str(path)].words for path in dataset["value"].values[order]]
    limit = float(dataset["chance_correlation"])
    shares = float(dataset["chance_first_order"])
    rows = [
        (name, *(_marked(float(v), bound) for v, bound in zip(row, (limit, limit, shares), strict=True)))
        for name, *row in zip(names, *columns, strict=True)
    ]
    note = (
        f"{counted(int(dataset['samples']), 'sample')}; the regression of ranks explains "
        f"{percent(float(dataset['explained']))}. "
        f"* beyond what chance gives 19 times out of 20: correlations {limit:.2f}, shares {shares:.2f}."
    )
    return Table(("value", "rank regression", "Spearman", "first-order share"), tuple(rows), title=title, note=note)


def _index_table(dataset: xr.Dataset, title: str, words: Words) -> Table:
    order = np.argsort(-np.nan_to_num(dataset["total_order"].values), kind="stable")
    names = ("first_order", "first_order_half_width", "total_order", "total_order_half_width", "rank_regression")
    rows = []
    for i in order.tolist():
        first, around, total, about, rank = (float(dataset[name].values[i]) for name in names)
        rows.append(
            (words[str(dataset["value"].values[i])].words, _within(first, around), _within(total, about), _short(rank))
        )
    interactions = 1.0 - float(np.sum(dataset["first_order"].values))
    note = (
        f"{counted(int(dataset['base_points']), 'base point')}; ± is the half-width of a 95 % interval (bootstrap). "
        f"First orders leave {_short(interactions)} of the variance to interactions. "
        f"Ranks: {counted(int(dataset['samples']), 'independent sample')}."
    )
    return Table(("value", "first order", "total order", "rank regression"), tuple(rows), title=title, note=note)


def _pair_table(dataset: xr.Dataset, title: str, words: Words) -> Table:
    shares = dataset["second_order"].values
    half = dataset["second_order_half_width"].values
    names = [words[str(path)].words for path in dataset["value"].values]
    pairs = [(i, j) for i in range(len(names)) for j in range(i + 1, len(names)) if np.isfinite(shares[i, j])]
    pairs.sort(key=lambda pair: -abs(float(shares[pair])))
    rows = [(names[i], names[j], _within(float(shares[i, j]), float(half[i, j]))) for i, j in pairs[:_MOST_PAIRS]]
    left = len(pairs) - _MOST_PAIRS
    note = f"The share that two values explain together, beyond each alone.{f' {left} more.' if left > 0 else ''}"
    return Table(("value", "with", "second order"), tuple(rows), frozenset({0, 1}), f"{title}, pairs", note)


def _swing_table(dataset: xr.Dataset, title: str, words: Words) -> Table:
    order = np.argsort(-np.nan_to_num(dataset["swing"].values), kind="stable")
    names = ("low_value", "base_value", "high_value", "low", "base", "high", "swing")
    rows = []
    for i in order.tolist():
        cells = [float(dataset[name].values[i] if dataset[name].dims else dataset[name].values) for name in names]
        measure = words[str(dataset["value"].values[i])]
        ends = (numeral(measure.factor * cell, 4) for cell in cells[:3])
        rows.append((measure.title, *ends, *(numeral(cell, 4) for cell in cells[3:])))
    head = ("value", "lower", "model", "upper", "output at lower", "at model", "at upper", "swing")
    return Table(head, tuple(rows), title=title, note="All other values are the model's own.")


def _marked(value: float, bound: float) -> str:
    return f"{_short(value)}{' *' if np.isfinite(value) and abs(value) > bound else ''}"


def _within(value: float, half: float) -> str:
    return f"{_short(value)} ± {_short(half)}"


def _short(value: float) -> str:
    return numeral(round(value, 3), 3)
