"""The page of a grid: maps, sweeps or scatter, the outcome in a few sentences, and the tables behind them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from gearrattle.report.grid_answers import answer, content
from gearrattle.report.page import Section
from gearrattle.report.plots.axis_names import measure_of
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.convergence import probability_convergence
from gearrattle.report.plots.sample_figures import histograms, probability_bars, tornado
from gearrattle.report.plots.sensitivities import sobol_bars, swing_bars
from gearrattle.report.plots.study_maps import code_maps, number_maps, probability_map
from gearrattle.report.plots.study_sweep_figures import output_sweep, probability_sweep
from gearrattle.report.sensitivity_tables import sensitivity_tables
from gearrattle.report.study_pages.study_page import StudyPage, joined
from gearrattle.report.study_tables import (
    boundary_table,
    code_counts,
    count_table,
    failure_table,
    lacking_said,
    probability_table,
)
from gearrattle.studies.case_runs import DONE, MISSING
from gearrattle.studies.dataset_layout import (
    axes_in,
    base_case,
    chosen_codes,
    has_probabilities,
    independent,
    outputs_in,
    sampling_of,
    scattered,
    subject_of,
    words_of,
)
from gearrattle.studies.plan import SAMPLE
from gearrattle.studies.probability import rattle_probability
from gearrattle.studies.sensitivity import sensitivities
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_MOST_MAPS = 8
_MOST_NAMED = 4
_VERBS = ("touches", "rattles")


def charts(data: xr.Dataset) -> list[Chart]:
    """Return every figure that has something to show, in reading order."""
    numbers = [name for name in outputs_in(data) if not words_of(data[name])][:_MOST_MAPS]
    apart = independent(data) if has_probabilities(data) else base_case(data)
    made = [
        *code_maps(apart),
        probability_map(apart),
        probability_sweep(apart),
        probability_bars(apart),
        probability_convergence(apart),
        sobol_bars(data),
        swing_bars(data),
        tornado(data),
        output_sweep(apart),
        *(chart for name in numbers for chart in number_maps(apart, name)),
        histograms(apart),
    ]
    return [chart for chart in made if chart is not None]


def summary_of(data: xr.Dataset) -> str:
    """Return the outcome in a few sentences."""
    output = chosen_codes(data)
    cases = data["outcome"].size
    done = int((data["outcome"] == DONE).sum())
    missing = int((data["outcome"] == MISSING).sum())
    sentences = []
    if done < cases:
        failed = cases - done - missing
        kinds = [f"{failed} failed"] * bool(failed) + [f"{missing} are not computed yet"] * bool(missing)
        sentences.append(f"Of {counted(cases, 'case')} {' and '.join(kinds)}; they are counted nowhere.")
    sentences += lacking_said(data, "case")
    if not output:
        return " ".join([f"{counted(int(done), 'case')} {'was' if done == 1 else 'were'} computed.", *sentences])
    if has_probabilities(data) and not axes_in(data):
        return " ".join([*_probable(data, output), *sentences])
    return " ".join([*_counted(data, output), *sentences])


def _counted(data: xr.Dataset, output: str) -> list[str]:
    """In how many cases each part does what."""
    sentences = []
    counts = code_counts(data, output)
    for name, by_word in list(counts.items())[:_MOST_NAMED]:
        there = {word: count for word, count in by_word.items() if count}
        who = name if subject_of(data, output) else "The driveline"
        total = sum(there.values())
        if len(there) == 1:
            sentences.append(f"{who} {_does(next(iter(there)))} in all {counted(total, 'case')}.")
        elif there:
            is_said = not set(_VERBS) & set(there)
            does = joined([f"{word if is_said else _does(word)} in {count}" for word, count in there.items()])
            sentences.append(f"{who} {'is ' if is_said else ''}{does} of {counted(total, 'case')}.")
    return [*sentences, *_more(len(counts))]


def _does(word: str) -> str:
    """Return the words for what a part of this severity or regime does."""
    return word if word in _VERBS else f"is {word}"


def _probable(data: xr.Dataset, output: str) -> list[str]:
    """Return a sentence on the probability of rattle of every part, and on the value that decides it."""
    probability = rattle_probability(data, output)
    subject = subject_of(data, output)
    follows = sensitivities(data, output) if scattered(data) else None
    sentences = []
    names = [str(name) for name in probability[subject].values] if subject else [""]
    if not names:
        return ["No part has a gap: nothing can rattle."]
    for name in names[:_MOST_NAMED]:
        one = probability.sel({subject: name}) if subject else probability
        p, low, high = (100.0 * float(one[key]) for key in ("probability", "low", "high"))
        if not np.isfinite(p):
            continue
        who = name or "The driveline"
        sentence = f"{who} rattles in {p:.0f} % of samples (95 % interval {low:.0f} to {high:.0f} %)"
        sentences.append(
            sentence + _decided(data, follows.sel({subject: name}) if subject and follows is not None else follows)
        )
    return [*sentences, *_more(len(names))]


def _decided(data: xr.Dataset, dataset: xr.Dataset | None) -> str:
    """The value that decides most, or that the codes follow most, if it does so beyond chance."""
    if dataset is not None and "total_order" in dataset and np.isfinite(dataset["total_order"].values).any():
        most = int(np.nanargmax(dataset["total_order"].values))
        share, half = (float(dataset[name].values[most]) for name in ("total_order", "total_order_half_width"))
        words = measure_of(data, str(dataset["value"].values[most])).words
        return f"; {words} decides most (total index {share:.2f} ± {half:.2f})."
    if dataset is None or not np.isfinite(dataset["spearman"].values).any():
        return "."
    strengths = dataset["spearman"].values
    most = int(np.nanargmax(np.abs(strengths)))
    if not abs(strengths[most]) > float(dataset["chance_correlation"]):
        return "; it follows no single value beyond chance."
    words = measure_of(data, str(dataset["value"].values[most])).words
    return f"; it follows {words} most (rank correlation {strengths[most]:.2f})."


def setting_of(data: xr.Dataset) -> str:
    """Return in words what was varied."""
    axes = [f"{measure_of(data, axis).words} ({counted(data.sizes[axis], 'value')})" for axis in axes_in(data)]
    parts = [f"Varied: {joined(axes)}."] if axes else []
    if SAMPLE in data.dims:
        method = f" ({sampling_of(data)})" if sampling_of(data) else ""
        word = "samples" if has_probabilities(data) else "cases"
        names = joined([measure_of(data, path).words for path in scattered(data)])
        parts.append(f"{data.sizes[SAMPLE]} {word}{method} of {names}.")
    return " ".join([*parts, f"{counted(data['outcome'].size, 'case')}."])


def _more(count: int) -> list[str]:
    left = count - _MOST_NAMED
    return [f"In the table: {counted(left, 'part')} more."] if left > 0 else []


def sections(data: xr.Dataset, messages: Mapping[tuple[int, ...], str]) -> list[Section]:
    """The tables, those that have rows."""
    all_sections = [
        Section(
            "probabilities",
            "Probabilities",
            words=("How likely each part rattles.",),
            tables=(probability_table(data),),
        ),
        Section(
            "sensitivities",
            "Sensitivities",
            words=("How outputs follow the values that scatter.",),
            tables=tuple(sensitivity_tables(data)),
        ),
        Section(
            "boundary",
            "Boundary",
            words=("Where severity or regime changes over the grid.",),
            tables=(boundary_table(data),),
        ),
        Section("failures", "Cases that failed", tables=(failure_table(data, messages),)),
    ]
    return [section for section in all_sections if any(table.rows for table in section.tables)]


PAGE = StudyPage(
    charts=charts,
    summary=summary_of,
    setting=setting_of,
    counts=count_table,
    sections=sections,
    answer=answer,
    content=content,
)
