"""A study as one page: what came out in a sentence, then maps, sweeps or scatter, and the tables behind them.

``fill_study`` writes study.html and figures/ into a folder. The page has no script and loads nothing.

Takes the Dataset of a study and the messages of its failed cases.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from gearrattle.plots.chart import Chart
from gearrattle.plots.maps import number_maps, probability_map, regime_map
from gearrattle.plots.scatter import histograms, probability_bars, tornado
from gearrattle.plots.static import draw
from gearrattle.plots.sweeps import output_sweep, probability_sweep
from gearrattle.report.comparison import Section
from gearrattle.report.provenance import now, versions
from gearrattle.report.study_tables import (
    boundary_table,
    code_counts,
    count_table,
    failure_table,
    probability_table,
    sensitivity_tables,
)
from gearrattle.studies.cases import DONE, MISSING
from gearrattle.studies.layout import axes_in, chosen_codes, outputs_in, scattered, subject_of, words_of
from gearrattle.studies.plan import SAMPLE
from gearrattle.studies.probability import rattle_probability
from gearrattle.studies.sensitivity import sensitivities

if TYPE_CHECKING:
    import xarray as xr

_HERE = Path(__file__).parent
_MOST_MAPS, _MOST_NAMED = 8, 4


def fill_study(
    data: xr.Dataset, messages: Mapping[tuple[int, ...], str], folder: Path, *, title: str, cost: str
) -> None:
    """Write the page and the figures of a study into an existing folder.

    Args:
        data: what ``study`` or ``open_study`` returned.
        messages: why cases failed, by their place in the grid.
        folder: to write into; it holds neither study.html nor figures/.
        title: heading of the page.
        cost: a sentence on what it cost.
    """
    drawn = [(chart, draw(chart)) for chart in charts(data)]
    (folder / "figures").mkdir()
    for chart, _ in drawn:
        (folder / "figures" / f"{chart.key}.svg").write_bytes(draw(chart, legend=True))
    environment = Environment(
        loader=FileSystemLoader(_HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    page = environment.get_template("study.html.j2").render(
        title=title,
        summary=summary_of(data),
        setting=f"{setting_of(data)} {cost}".strip(),
        counts=count_table(data),
        figures=[(chart, f"data:image/svg+xml;base64,{b64encode(svg).decode('ascii')}") for chart, svg in drawn],
        sections=_sections(data, messages),
        created=now(),
        version=versions().get("gearrattle", ""),
        style=Markup((_HERE / "page.css").read_text(encoding="utf-8")),
    )
    (folder / "study.html").write_text(page, encoding="utf-8")


def charts(data: xr.Dataset) -> list[Chart]:
    """Return every figure that has something to show, in reading order."""
    numbers = [name for name in outputs_in(data) if not words_of(data[name])][:_MOST_MAPS]
    made = [
        regime_map(data), probability_map(data), probability_sweep(data), probability_bars(data), tornado(data),
        output_sweep(data), *(chart for name in numbers for chart in number_maps(data, name)), histograms(data),
    ]  # fmt: skip
    return [chart for chart in made if chart is not None]


def summary_of(data: xr.Dataset) -> str:
    """What came out, in a few sentences."""
    output = chosen_codes(data)
    cases, done = data["outcome"].size, int((data["outcome"] == DONE).sum())
    missing = int((data["outcome"] == MISSING).sum())
    told = []
    if done < cases:
        failed = cases - done - missing
        kinds = [f"{failed} failed"] * bool(failed) + [f"{missing} are not computed yet"] * bool(missing)
        told.append(f"Of {cases} cases {' and '.join(kinds)}; they are counted nowhere.")
    if not output:
        return " ".join([f"{done} cases were computed.", *told])
    if SAMPLE in data.dims and not axes_in(data):
        return " ".join([*_probable(data, output), *told])
    return " ".join([*_counted(data, output), *told])


def _counted(data: xr.Dataset, output: str) -> list[str]:
    """In how many cases each part does what."""
    told = []
    counts = code_counts(data, output)
    for name, by_word in list(counts.items())[:_MOST_NAMED]:
        there = {word: count for word, count in by_word.items() if count}
        who = name if subject_of(data, output) else "The driveline"
        total = sum(there.values())
        if len(there) == 1:
            told.append(f"{who} is {next(iter(there))} in all {total} cases.")
        elif there:
            told.append(
                f"{who} is {_joined([f'{word} in {count}' for word, count in there.items()])} of {total} cases."
            )
    return [*told, *_more(len(counts))]


def _probable(data: xr.Dataset, output: str) -> list[str]:
    """How likely each part rattles, and what decides it."""
    found, subject = rattle_probability(data, output), subject_of(data, output)
    follows = sensitivities(data, output) if scattered(data) else None
    told = []
    names = [str(name) for name in data[subject].values] if subject else [""]
    for name in names[:_MOST_NAMED]:
        one = found.sel({subject: name}) if subject else found
        p, low, high = (100.0 * float(one[key]) for key in ("probability", "low", "high"))
        if not np.isfinite(p):
            continue
        who = name or "The driveline"
        sentence = f"{who} rattles in {p:.0f} % of samples (95 % interval {low:.0f} to {high:.0f} %)"
        told.append(sentence + _decided(follows.sel({subject: name}) if subject and follows is not None else follows))
    return [*told, *_more(len(names))]


def _decided(found: xr.Dataset | None) -> str:
    """The value the regime follows most, if it does so beyond chance."""
    if found is None or not np.isfinite(found["spearman"].values).any():
        return "."
    strengths = found["spearman"].values
    most = int(np.nanargmax(np.abs(strengths)))
    if not abs(strengths[most]) > float(found["chance_correlation"]):
        return "; it follows no single value beyond chance."
    return f"; it follows {found['value'].values[most]} most (rank correlation {strengths[most]:.2f})."


def setting_of(data: xr.Dataset) -> str:
    """What was varied."""
    axes = [f"{axis} ({data.sizes[axis]} values)" for axis in axes_in(data)]
    parts = [f"Varied: {_joined(axes)}."] if axes else []
    if SAMPLE in data.dims:
        parts.append(f"{data.sizes[SAMPLE]} samples of {_joined(list(scattered(data)))}.")
    return " ".join([*parts, f"{data['outcome'].size} cases."])


def _joined(words: list[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _more(count: int) -> list[str]:
    left = count - _MOST_NAMED
    return [f"{left} more parts stand in the table."] if left > 0 else []


def _sections(data: xr.Dataset, messages: Mapping[tuple[int, ...], str]) -> list[Section]:
    found = [
        Section("probabilities", "Probabilities", "How likely each part rattles.", (probability_table(data),)),
        Section(
            "sensitivities", "Sensitivities", "How outputs follow the values that scatter.",
            tuple(sensitivity_tables(data)),
        ),
        Section("boundary", "Boundary", "Where the regime changes over the grid.", (boundary_table(data),)),
        Section("failures", "Cases that failed", "The others went on.", (failure_table(data, messages),)),
    ]  # fmt: skip
    return [section for section in found if any(table.rows for table in section.tables)]
