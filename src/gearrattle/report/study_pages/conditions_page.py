"""The page of a study of conditions: how many are quiet, the worst, the margin, a map, a table, what it is not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.json_types import json_value
from gearrattle.report.condition_sounds import ConditionMap, map_script
from gearrattle.report.page import Section
from gearrattle.report.plots.axis_names import labels_of, measure_of, paths_of, title_of
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.conditions_figure import axis_of, conditions_map
from gearrattle.report.plots.numerals import engineering_column, numeral
from gearrattle.report.study_pages.study_page import Inlay, Messages, StudyPage, joined
from gearrattle.report.study_tables import code_counts, failure_table
from gearrattle.report.tables import Table, shortened
from gearrattle.studies.case_runs import DONE
from gearrattle.studies.conditions_study import HARDEST_PART, MARGIN, RATING, ROLES
from gearrattle.studies.dataset_layout import axes_in, headlines_in, words_of
from gearrattle.studies.output import HARDEST, VERDICT_SEVERITY
from gearrattle.studies.sound_output import SOUND_LEVEL
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_IMPACTS = "impacts per cycle"
_MOST_LINES = 12
_NONE = "–"
_JOINED = "\N{NON-BREAKING HYPHEN}"
_WHAT_IT_IS_NOT = (
    "These are conditions like those of SAE J2555 (idle gear rattle: parked, in neutral, clutch engaged; oil cold, "
    "middling and hot; accessories on and off). They are not the test of that standard: its paid text is not read, so "
    "its loads, its soak, its microphones and who rates are unknown here.",
    "The standard's rating, from 1 to 10, is a person's. None is computed.",
)
_OWN_RATING = (
    "The ratings in the table are not the standard's: they are straight lines between calibration points of the "
    "user's own ({points}), by the sound level alone, and there is none beyond these levels, nor in silence."
)
_LEVEL = (
    "The sound level is that of {source}, in dB re 20 µPa, as gr.listen tells it, "
    "through one path at one gain for all conditions: {path}. So differences between conditions, and between designs "
    "through this path, hold; a level by itself is that of no room. Engine and background are not in it{whine}."
)
_OF_IMPACTS = "the momenta of all impacts of gear meshes"
_OF_CASING = "the forces of all bearings on the casing"
_MARGIN_WORDS = (
    "The threshold margin is the drag torque over the torque that a loose gear needs to follow its driver, of the gear "
    "nearest to lifting off: above 1 it stays on its flank. It is taken in the motion as it is; where gears rattle, "
    "the driver's acceleration has their impacts in it, and less drag than the margin says may do."
)


def charts(data: xr.Dataset) -> list[Chart]:
    """Return the map of the conditions."""
    return [conditions_map(data)]


def inlay(data: xr.Dataset) -> Inlay:
    """Return the map as buttons, which show and play the conditions."""
    return Inlay("map", ConditionMap(data, condition_table(data)), map_script())


def summary_of(data: xr.Dataset) -> str:
    """Return sentences: how many conditions are quiet, the worst one, and the margin closest to 1."""
    done = int((data["outcome"] == DONE).sum())
    cases = data["outcome"].size
    counts = code_counts(data, VERDICT_SEVERITY)[VERDICT_SEVERITY]
    verbs = {"quiet": "is quiet" if counts["quiet"] == 1 else "are quiet", "touches": "touch", "rattles": "rattle"}
    said = joined([f"{count} {verbs[word]}" for word, count in counts.items() if count or word == "quiet"])
    sentences = [f"Of {counted(done, 'condition')} {said}."]
    sentences += [sentence for sentence in (_worst(data), _closest(data)) if sentence]
    if done < cases:
        sentences.append(f"{counted(cases - done, 'more condition')} failed or are missing; they are counted nowhere.")
    return " ".join(sentences)


def worst_condition(data: xr.Dataset) -> tuple[int, ...] | None:
    """Return where the hardest impact is; None without any impact."""
    energies = np.nan_to_num(data[HARDEST].values)
    if not energies.size or energies.max() <= 0.0:
        return None
    return tuple(int(i) for i in np.unravel_index(int(energies.argmax()), energies.shape))


def closest_margin(data: xr.Dataset) -> tuple[int, ...] | None:
    """Return where the threshold margin is closest to 1, by ratio; None without loose gears, or where none moves."""
    if MARGIN not in data:
        return None
    margins = data[MARGIN].values
    there = np.isfinite(margins) & (margins > 0.0)
    if not there.any():
        return None
    distance = np.full(margins.shape, np.inf)
    distance[there] = np.abs(np.log(margins[there]))
    return tuple(int(i) for i in np.unravel_index(int(distance.argmin()), distance.shape))


def _worst(data: xr.Dataset) -> str:
    at = worst_condition(data)
    if at is None:
        return "No condition has an impact."
    (energy,) = engineering_column([float(data[HARDEST].values[at])], _unit(data, HARDEST))
    part = _part(data, at)
    level = float(data[SOUND_LEVEL].values[at]) if SOUND_LEVEL in data else np.nan
    where = f" at {part}" if part else ""
    sound = f", its sound level is {numeral(level, 3)} dB" if np.isfinite(level) else ""
    return f"The worst is {_condition(data, at)}: its hardest impact has {energy}{where}{sound}."


def _closest(data: xr.Dataset) -> str:
    at = closest_margin(data)
    if at is None:
        return ""
    margin = numeral(float(data[MARGIN].values[at]), 3)
    return f"The threshold margin is closest to 1 ({margin}) at {_condition(data, at)}."


def _unit(data: xr.Dataset, output: str) -> str:
    unit = str(data[output].attrs.get("units", ""))
    return "" if unit == "1" else unit


def _part(data: xr.Dataset, at: tuple[int, ...]) -> str:
    """Return the part of the hardest impact of a condition; empty where there is none."""
    if HARDEST_PART not in data:
        return ""
    code = int(data[HARDEST_PART].values[at])
    return words_of(data[HARDEST_PART])[code] if code >= 0 else ""


def _condition(data: xr.Dataset, at: tuple[int, ...]) -> str:
    """Return a condition in words."""
    parts = []
    for axis, index in zip(axes_in(data), at, strict=True):
        path = paths_of(data, axis)[0]
        measure = measure_of(data, path)
        parts.append(f"{measure.words} {measure.with_unit(data[path].values[index])}")
    return "; ".join(parts)


def setting_of(data: xr.Dataset) -> str:
    """Return what was varied."""
    axes = [f"{measure_of(data, paths_of(data, axis)[0]).words} ({data.sizes[axis]})" for axis in axes_in(data)]
    load = "" if axis_of(data, "load") else " The load is the model's own."
    return f"{counted(data['outcome'].size, 'condition')}: {joined(axes)}.{load}"


def counts_of(data: xr.Dataset) -> Table:
    """Conditions by severity and temperature."""
    rows = axis_of(data, "temperature")
    words = words_of(data[VERDICT_SEVERITY])
    codes = data[VERDICT_SEVERITY].transpose(rows, ...).values.reshape(data.sizes[rows], -1)
    cells = [
        (label, *(f"{int(np.count_nonzero(row == code))}" for code in range(len(words))))
        for label, row in zip(labels_of(data, rows), codes, strict=True)
    ]
    return Table((title_of(data, rows), *words), tuple(cells), frozenset(), note="Conditions by severity.")


def condition_table(data: xr.Dataset) -> Table:
    """Return the table of all conditions, the conditions of one load after the other."""
    # columns that the driveline has
    grid = axes_in(data)
    shape = data["outcome"].shape
    labels = {axis: labels_of(data, axis) for axis in grid}
    headlines = headlines_in(data)
    hardest = data[HARDEST].values.ravel()
    energies = engineering_column(np.where(hardest > 0.0, hardest, np.nan).tolist(), _unit(data, HARDEST))
    rates = impacts_of(data)
    numbers = {
        **({} if rates is None else {_IMPACTS: (rates, 3)}),
        **({"sound level [dB]": (data[SOUND_LEVEL].values, 3)} if SOUND_LEVEL in data else {}),
        **({MARGIN: (data[MARGIN].values, 3)} if MARGIN in data else {}),
        **({"rating by own points": (data[RATING].values, 2)} if data.attrs.get("calibration") else {}),
    }
    # a row per condition
    severities = (*words_of(data[VERDICT_SEVERITY]), "failed")
    rows = []
    for k, at in enumerate(np.ndindex(*shape)):
        position = (labels[axis][i] for axis, i in zip(grid, at, strict=True))
        severity = severities[int(data[VERDICT_SEVERITY].values[at])]
        verdict = str(headlines[at]).replace("-", _JOINED) or _NONE
        values = (numeral(float(column[at]), digits) for column, digits in numbers.values())
        rows.append((*position, severity, verdict, energies[k], _part(data, at) or _NONE, *values))
    # heads, and what is a word
    heads = (*(title_of(data, axis) for axis in grid), "severity", "verdict", HARDEST, "at", *numbers)
    first = len(grid)
    return Table(heads, tuple(rows), frozenset({first, first + 1, first + 3}), note=_note(data))


def _note(data: xr.Dataset) -> str:
    silent = " No sound level: no gear mesh has an impact." if _hears_impacts(data) else ""
    return f"Impacts of all parts that can separate together.{silent}" if _IMPACTS in data else silent.strip()


def impacts_of(data: xr.Dataset) -> Any:
    """Return impacts per cycle of all parts that can separate together, over the grid; None without any."""
    gaps = str(data["severity"].attrs.get("can_rattle", "")).split() if "severity" in data else []
    if _IMPACTS not in data or not gaps:
        return None
    counts = data[_IMPACTS].sel(part=gaps).transpose(*axes_in(data), "part").values
    return np.where(data["outcome"].values == DONE, np.nansum(counts, axis=-1), np.nan)


def sections(data: xr.Dataset, messages: Messages) -> list[Section]:
    """Return the table of all conditions, what the study is not, and the conditions that failed."""
    failures = failure_table(data, messages)
    return [
        Section("conditions", "All conditions", tables=(condition_table(data),), folds=True),
        Section("limits", "What this is not", words=remarks(data)),
        *([Section("failures", "Conditions that failed", tables=(failures,))] if failures.rows else []),
    ]


def remarks(data: xr.Dataset) -> tuple[str, ...]:
    """Return in sentences what the study is not, and what its numbers mean."""
    points = str(data.attrs.get("calibration", ""))
    path = str(data.attrs.get("sound_path", ""))
    own = path if path.startswith("assumed") else f"modes of the user's ({path})"
    return (
        *_WHAT_IT_IS_NOT,
        *([_OWN_RATING.format(points=points)] if points else []),
        *([_LEVEL.format(path=own, **_source_words(data))] if SOUND_LEVEL in data else []),
        *([_MARGIN_WORDS] if MARGIN in data else []),
    )


def _hears_impacts(data: xr.Dataset) -> bool:
    """Return whether the sound level is that of impacts, not of forces on the casing."""
    return SOUND_LEVEL in data and "lacking" in data[SOUND_LEVEL].attrs


def _source_words(data: xr.Dataset) -> dict[str, str]:
    """Return the words for what is heard, and for what is not."""
    if _hears_impacts(data):
        return {"source": _OF_IMPACTS, "whine": ", nor is whine"}
    return {"source": _OF_CASING, "whine": ""}


def answer(data: xr.Dataset) -> tuple[Table, ...]:
    """Return the table that a terminal shows."""
    table = condition_table(data)
    return (counts_of(data), shortened(table, _MOST_LINES))


def content(data: xr.Dataset) -> dict[str, Any]:
    """Return the same for machines: every condition with its values in SI."""
    grid = axes_in(data)
    rates = impacts_of(data)
    columns = {name: data[name].values for name in (HARDEST, SOUND_LEVEL, MARGIN, RATING) if name in data}
    columns |= {} if rates is None else {_IMPACTS: rates}
    headlines = headlines_in(data)
    severities = np.array([*words_of(data[VERDICT_SEVERITY]), ""])[data[VERDICT_SEVERITY].values]

    def condition(at: tuple[int, ...]) -> dict[str, Any]:
        values = {path: data[path].values[i] for axis, i in zip(grid, at, strict=True) for path in paths_of(data, axis)}
        said = {"severity": str(severities[at]) or None, "verdict": str(headlines[at]) or None}
        part = {HARDEST_PART: _part(data, at) or None} if HARDEST_PART in data else {}
        numbers = {name: column[at] for name, column in columns.items()}
        return dict(json_value({**values, **said, **part, **numbers}))

    return {
        "counts": code_counts(data, VERDICT_SEVERITY)[VERDICT_SEVERITY],
        "axes": {role: axis_of(data, role) for role in ROLES},
        "sound path": str(data.attrs.get("sound_path", "")),
        "calibration": str(data.attrs.get("calibration", "")),
        "conditions": [condition(at) for at in np.ndindex(*data["outcome"].shape)],
        "limits": list(remarks(data)),
    }


PAGE = StudyPage(
    charts=charts,
    summary=summary_of,
    setting=setting_of,
    counts=counts_of,
    sections=sections,
    answer=answer,
    content=content,
    inlay=inlay,
)
