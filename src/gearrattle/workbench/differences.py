"""Differences between jobs: values of their models, and their results.

For numbers that should be small, the best job is marked if its number is the smallest beyond the scatter of the runs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gearrattle.errors import ModelError
from gearrattle.json_types import TomlTable, json_value
from gearrattle.model.model_file import read_tables
from gearrattle.model.path_labels import si_unit
from gearrattle.model.paths import path_names, value_at
from gearrattle.quantities.verdict_parts import REGIME_RANKS
from gearrattle.report.saved import SUMMARY
from gearrattle.signals import RANKS
from gearrattle.workbench.job_files import stored_object, stored_text
from gearrattle.workbench.kept_results import RESULT
from gearrattle.workbench.number_scatter import Errors, best_of, standard_errors

_NUMBERS = (
    ("impacts_per_second", "impacts per second", "1/s"),
    ("max_approach_speed", "fastest approach", ""),
    ("max_impact_energy", "hardest impact", "J"),
    ("contact_share", "share of time in contact", ""),
)
"""Numbers of a part of the verdict: key, words, unit (empty: the unit of the part, or none)."""
_WORDS: Mapping[str, Mapping[Any, int]] = {"severity": RANKS, "regime": REGIME_RANKS}
"""Words of a part of the verdict: key, and ranks of the words, the mildest first."""


def differences(folders: Sequence[Path]) -> dict[str, Any]:
    """Return where models of jobs differ, and their verdicts side by side.

    Returns
    -------
    dict[str, Any]
        model: ``{path, unit, values}`` for every path whose values are not all the same, as they are written, None
        where it is absent, and the unit of plain numbers; verdicts: the headline of every job, None of what is no run;
        numbers:
        ``{part, quantity, unit, values, best, in_scatter}``: the column of the best value, None where there is none,
        and whether the smallest two may differ by chance.
    """
    models = [_model(folder) for folder in folders]
    summaries = [_summary(folder) for folder in folders]
    errors = [
        standard_errors(folder) if _parts(summary) else {} for folder, summary in zip(folders, summaries, strict=True)
    ]
    return {
        "model": _paths(models),
        "verdicts": [summary.get("headline", summary.get("verdict")) for summary in summaries],
        "sentences": [summary.get("sentence") for summary in summaries],
        "numbers": _numbers([_parts(summary) for summary in summaries], errors),
    }


def _model(folder: Path) -> TomlTable:
    tables, _ = read_tables(stored_text(folder / "model.toml"), f"{folder.name}/model.toml")
    return tables


def _summary(folder: Path) -> dict[str, Any]:
    path = folder / RESULT / SUMMARY
    return stored_object(path) if path.is_file() else {}


def _paths(models: Sequence[TomlTable]) -> list[dict[str, Any]]:
    paths = dict.fromkeys(path for model in models for path in path_names(model))
    has_units = all(model.get("units") != "dimensionless" for model in models)
    rows = []
    for path in paths:
        values = [json_value(_value(model, path)) for model in models]
        if any(value != values[0] for value in values):
            unit = si_unit(path) if has_units and _has_numbers(values) else ""
            rows.append({"path": path, "unit": unit, "values": values})
    return rows


def _has_numbers(values: list[Any]) -> bool:
    """Whether values are plain numbers, or absent; the others name their units."""
    return all(value is None or isinstance(value, int | float) for value in values)


def _value(model: TomlTable, path: str) -> Any:
    """Return the value at a path; None where the model has no such table."""
    try:
        return value_at(model, path)
    except ModelError:
        return None


def _parts(summary: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {part["name"]: part for part in summary.get("parts", ()) if "regime" in part}


def _numbers(jobs: Sequence[dict[str, dict[str, Any]]], errors: Sequence[Errors]) -> list[dict[str, Any]]:
    """Return the numbers of every part that some job has, and its severity and regime before them."""
    rows = []
    for name in dict.fromkeys(name for parts in jobs for name in parts):
        parts = [job.get(name, {}) for job in jobs]
        for key, ranks in _WORDS.items():
            words = [part.get(key) for part in parts]
            if any(word is not None for word in words):
                best, _ = best_of([None if word is None else ranks[word] for word in words], [0.0] * len(parts))
                rows.append(
                    {"part": name, "quantity": key, "unit": "", "values": words, "best": best, "in_scatter": False}
                )
        for key, title, unit in _NUMBERS:
            values = [part.get(key) for part in parts]
            if any(value is not None for value in values):
                shown = next((part["speed_unit"] for part in parts if "speed_unit" in part), "")
                unit_of_row = shown if key == "max_approach_speed" else unit
                best, in_scatter = best_of(values, [of_run.get(name, {}).get(key) for of_run in errors])
                row = {"part": name, "quantity": title, "unit": unit_of_row, "values": values}
                rows.append({**row, "best": best, "in_scatter": in_scatter})
    return rows
