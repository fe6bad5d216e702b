"""Tables of a study's page: counts of regimes, probabilities of rattle, regime boundaries, failed cases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.report.plots.axis_names import labels_of, measure_of, paths_of, title_of
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.tables import Table
from gearrattle.studies.case_runs import DONE, OUTCOMES
from gearrattle.studies.dataset_layout import (
    axes_in,
    chosen_codes,
    has_probabilities,
    lacking_in,
    subject_names,
    subject_of,
    values_of,
    words_of,
)
from gearrattle.studies.output import REGIME, SEVERITY
from gearrattle.studies.plan import SAMPLE
from gearrattle.studies.probability import rattle_probability, samples_needed
from gearrattle.studies.regime_boundary import CROSSING, regime_boundary
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_MOST = 40


def code_counts(data: xr.Dataset, output: str) -> dict[str, dict[str, int]]:
    """Return the number of cases by subject and by the word of the code, such as a regime."""
    words = words_of(data[output])
    subject = subject_of(data, output)
    names = subject_names(data, output) if subject else [output]
    codes = values_of(data, output).transpose(*([subject] if subject else []), ...).values.reshape(len(names), -1)
    return {
        name: {word: int(np.count_nonzero(row == code)) for code, word in enumerate(words)}
        for name, row in zip(names, codes, strict=True)
    }


def count_table(data: xr.Dataset) -> Table:
    """Number of cases by part, severity and regime; in a study without such codes, number of cases by outcome."""
    output = chosen_codes(data)
    if not output:
        cases_by_outcome = [(word, f"{int((data['outcome'] == code).sum())}") for code, word in enumerate(OUTCOMES)]
        return Table(("outcome", "cases"), tuple(row for row in cases_by_outcome if row[1] != "0"))
    counts = code_counts(data, output)
    words = words_of(data[output])
    note = f"Cases by {output}."
    if output == SEVERITY and REGIME in data:
        sides = code_counts(data, REGIME)
        counts = {name: {**sides.get(name, {}), **by_word} for name, by_word in counts.items()}
        words = tuple(dict.fromkeys([*words, *words_of(data[REGIME])]))
        note = "Cases by severity; single-sided and double-sided: by regime, however soft the impacts."
    rows = tuple((name, *(f"{by_word.get(word, 0)}" for word in words)) for name, by_word in counts.items())
    return Table(("part" if subject_of(data, output) else "", *words), rows, note=note)


def lacking_said(data: xr.Dataset, case: str) -> list[str]:
    """Say in how many cases a part has no impact, or a body no sub-harmonic; nothing if no case lacks any."""
    among = counted(int((data["outcome"] == DONE).sum()), f"computed {case}")
    return [
        f"{name or 'driveline'}: {lacking} in {count} of {among}."
        for (name, lacking), count in lacking_in(data).items()
    ]


def lacking_values(data: xr.Dataset) -> list[dict[str, Any]]:
    """Return the same counts as plain values."""
    among = int((data["outcome"] == DONE).sum())
    return [
        {"subject": name, "lacking": lacking, "cases": count, "of": among}
        for (name, lacking), count in lacking_in(data).items()
    ]


def probability_table(data: xr.Dataset) -> Table:
    """Probability of rattle by part, for a study of samples without axes; no rows for other studies."""
    head = ("part", "rattling", "of samples", "probability", "95 % interval")
    output = chosen_codes(data)
    if not output or not has_probabilities(data) or axes_in(data):
        return Table(head, ())
    return probabilities_table(rattle_probability(data, output))


def probabilities_table(dataset: xr.Dataset) -> Table:
    """Probability of rattle by part and position on the axes, from ``rattle_probability``."""
    # axes and subjects
    subject = str(dataset.attrs["subject"])
    dims = [str(name) for name in dataset["probability"].dims]
    axes = [name for name in dims if name != subject]
    labels = {axis: labels_of(dataset, axis) if axis in dataset.coords else _numbers(dataset, axis) for axis in axes}
    names = [str(name) for name in dataset[subject].values] if subject else [str(dataset.attrs["output"])]
    head = (
        "part",
        *(title_of(dataset, axis) for axis in axes),
        "rattling",
        "of samples",
        "probability",
        _level(dataset),
    )
    # counts and probabilities, the subject last
    columns = [
        dataset[name].transpose(*axes, ...).values for name in ("rattling", "samples", "probability", "low", "high")
    ]
    # one row per point of the grid and subject
    rows = []
    for at in np.ndindex(columns[0].shape):
        k, n, p, low, high = (float(column[at]) for column in columns)
        position = (labels[axis][i] for axis, i in zip(axes, at, strict=False))
        interval = f"{percent(low)} to {percent(high)}"
        rows.append((names[at[-1] if subject else 0], *position, f"{int(k)}", f"{int(n)}", percent(p), interval))
    if not rows:
        return Table(head, ())
    # the number of samples for half the widest interval
    widest = float(np.nanmax(columns[4] - columns[3], initial=0.0))
    half_width = max(0.001, float(f"{widest / 4.0:.1g}")) if widest else 0.05
    note = (
        "Wilson's interval (1927), for independent samples; Latin hypercube and Sobol samples scatter less. "
        f"An interval of ±{100.0 * half_width:g} % needs up to {samples_needed(half_width)} samples."
    )
    return Table(head, tuple(rows), note=note)


def _level(dataset: xr.Dataset) -> str:
    return f"{100.0 * float(dataset.attrs['level']):g} % interval"


def _numbers(data: xr.Dataset, dimension: str) -> list[str]:
    return [str(i) for i in range(data.sizes[dimension])]


def boundary_table(data: xr.Dataset) -> Table:
    """Return a table of changes of severity or regime along every axis; no rows for a study of samples."""
    output = chosen_codes(data)
    if not output or SAMPLE in data.dims:
        return Table(("along",), ())
    subject = subject_of(data, output)
    places = [paths_of(data, axis)[0] for axis in axes_in(data)]
    return changes_table(regime_boundary(data, output), data, places, subject)


def changes_table(dataset: xr.Dataset, measured: xr.Dataset, places: Sequence[str], subject: str) -> Table:
    """Return a table of where an output of codes changes, one row per change.

    ``measured`` has the axes and ``places``, the names of positions, as variables with names and units. ``subject`` is
    the variable that names the part; empty if there is none.
    """
    count = dataset.sizes.get(CROSSING, 0)
    names = [*([subject] if subject else []), "along", *places, "from", "to"]
    measures = {path: measure_of(measured, path) for path in places}
    head = tuple(measures[name].title if name in measures else name for name in names)
    if not count:
        return Table(head, ())
    order = np.lexsort([dataset[name].values for name in (*reversed(places), "along", *([subject] if subject else []))])
    columns = [dataset[name].values[order[:_MOST]] for name in names]
    axes = {str(axis): measure_of(measured, str(axis)).words for axis in dataset["along"].values}
    rows = [
        tuple(
            axes[str(value)] if name == "along" else _cell(value, measures[name].factor if name in measures else 1.0)
            for name, value in zip(names, row, strict=True)
        )
        for row in zip(*columns, strict=True)
    ]
    more = f" {count - _MOST} more: see gr.studies.regime_boundary." if count > _MOST else ""
    note = f"Midpoints between neighbouring values of the axis along which the {dataset.attrs['output']} changes.{more}"
    numeric = {i for i, name in enumerate(names) if dataset[name].values.dtype.kind in "iuf"}
    return Table(head, tuple(rows), frozenset(range(len(names))) - numeric, note=note)


def failure_table(data: xr.Dataset, messages: Mapping[tuple[int, ...], str]) -> Table:
    """Failed cases: their position in the grid, and the error message."""
    dims = [str(name) for name in data["outcome"].dims]
    labels = {dim: labels_of(data, dim) if dim != SAMPLE else list(map(str, range(data.sizes[dim]))) for dim in dims}
    rows = []
    for index, text in list(messages.items())[:_MOST]:
        word = OUTCOMES[int(data["outcome"].values[index])]
        rows.append((*(labels[dim][i] for dim, i in zip(dims, index, strict=True)), word, text))
    note = f"{len(messages) - _MOST} more failed; their messages are in done/." if len(messages) > _MOST else ""
    head = (*(title_of(data, dim) if dim != SAMPLE else dim for dim in dims), "outcome", "message")
    return Table(head, tuple(rows), frozenset({len(dims), len(dims) + 1}), note=note)


def _cell(value: object, factor: float) -> str:
    return numeral(factor * float(value), 4) if isinstance(value, int | float | np.number) else str(value)


def percent(share: float) -> str:
    """Write a share in whole per cents; a dash where there is none."""
    return f"{100.0 * share:.0f} %" if np.isfinite(share) else "–"
