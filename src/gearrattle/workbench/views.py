"""Views of results for the page: sections, tables and names of figures in JSON types.

It is the same for all kinds of results: the sections of the page of a ``Presentation`` in JSON. A run also has
``verdict``: headline, numbers, parts with their shares of time, the driveline coloured by regime, and facts on
reliability.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from markupsafe import Markup

from gearrattle.analysis.statics import Modes
from gearrattle.design.remedies import Remedies
from gearrattle.design.threshold import Threshold
from gearrattle.json_types import json_value
from gearrattle.measured.identification.fit_result import Fit
from gearrattle.model.factors import FACTOR, Factor
from gearrattle.orbits import Branch
from gearrattle.pipeline import Findings
from gearrattle.report.motion_at_point import chosen_points, point_data
from gearrattle.report.page import Section
from gearrattle.report.presentation import Presentation
from gearrattle.report.run_report import headline_words
from gearrattle.report.tables import Table
from gearrattle.report.verdict_tables import side_shares
from gearrattle.wording import counted

_LONGEST_TABLE = 2000
"""Largest number of rows of a table on the page; results.nc has all rows."""


def view_of(presentation: Presentation[Any]) -> dict[str, Any]:
    """Return what the page shows of a result.

    Returns
    -------
    dict[str, Any]
        kind, title, sentence, notes; sections in reading order, each with key, title, lead, words, notes, figures
        (key, title, caption, tab, group, wide), tables (title, head, rows, words, note), in_columns, folds and text; of
        a run also verdict; of a result that proposes values also changes, each with words and values by path.
    """
    page = presentation.page()
    findings = page.values.get("findings")
    return {
        "kind": presentation.kind,
        "title": page.title,
        "sentence": presentation.sentence,
        "notes": list(presentation.notes),
        "sections": [section_json(section) for section in page.sections],
        **({"verdict": verdict_block(findings, page.values)} if isinstance(findings, Findings) else {}),
        **_moving(findings.modes if isinstance(findings, Findings) else presentation.result),
        **_changes(presentation.result),
    }


def _moving(result: object) -> dict[str, Any]:
    """Return the shapes of modes, which the page sets in motion; nothing of what has none."""
    if not isinstance(result, Modes):
        return {}
    is_si = result.model.units == "SI"
    frequencies = result.frequencies / (2.0 * np.pi if is_si else 1.0)
    shown = {
        "names": list(result.inertia_names),
        "frequencies": json_value(frequencies),
        "unit": "Hz" if is_si else "",
        "shapes": json_value(result.shapes.T),
        "damping": json_value(result.damping_ratios),
    }
    return {"modes": shown}


def _changes(result: object) -> dict[str, Any]:
    """Return the changes of the model that a result proposes, as edits take them; nothing of what proposes none."""
    changes: list[tuple[str, Mapping[str, Any]]] = []
    match result:
        case Fit():
            changes = [("the fitted values", {parameter.path: parameter.value for parameter in result.parameters})]
        case Threshold(value=float(value), variable=variable):
            changes = [(f"{variable.words} {variable.shown(value)}", variable.changes(value))]
        case Remedies():
            changes = [(remedy.change, remedy.changes) for remedy in result.remedies if remedy.changes]
    shown = [{"words": words, "values": _written_values(values)} for words, values in changes]
    return {"changes": shown} if shown else {}


def _written_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values by path as an edit takes them."""
    return {path: _written_value(value) for path, value in values.items()}


def _written_value(value: Any) -> Any:
    """Return a value as an edit takes it, to seven digits."""
    if isinstance(value, Factor):
        return {FACTOR: _rounded(value.times)}
    return _rounded(value) if isinstance(value, float) else value


def _rounded(number: float) -> float:
    return float(f"{number:.7g}")


def motions_json(branch: Branch) -> dict[str, Any] | None:
    """Return the motions at points of branches, as ``point_data`` has them, and what computes each.

    Every point has also ``point``, its number in the branch, ``value`` [SI] and ``start``, the state at t = 0. None: no
    point has a motion to show.
    """
    points = chosen_points(branch)
    if not points:
        return None
    data = point_data(branch, points)
    values = branch.data["value"].values[points].tolist()
    starts = [
        {"point": i, "value": value, "start": branch.orbit(i).state} for i, value in zip(points, values, strict=True)
    ]
    shown = [{**point, **start} for point, start in zip(data["points"], starts, strict=True)]
    return {**data, "path": branch.path, "points": shown}


def section_json(section: Section) -> dict[str, Any]:
    """Return a section of a page in JSON types."""
    charts = [
        {"key": chart.key, "title": chart.title, "caption": chart.caption, "tab": chart.tab, "is_chart": True}
        for chart in section.charts
        if chart.panels
    ]
    pictures = [
        {"key": picture.key, "title": "", "caption": picture.words, "tab": "", "is_chart": False}
        for picture in section.pictures
    ]
    return {
        "key": section.key,
        "title": section.title,
        "lead": section.lead,
        "words": list(section.words),
        "notes": list(section.notes),
        "figures": charts + pictures,
        "tables": [_table(table) for table in section.tables if table.rows],
        "in_columns": section.in_columns,
        "folds": section.folds,
        "text": None if section.text is None else {"title": section.text[0], "content": section.text[1]},
    }


def _table(table: Table) -> dict[str, Any]:
    left = len(table.rows) - _LONGEST_TABLE
    more = f"results.nc has {counted(left, 'more row')}."
    note = f"{table.note} {more}".strip() if left > 0 else table.note
    return {
        "title": plain(table.title),
        "head": [plain(cell) for cell in table.head],
        "rows": [[plain(cell) for cell in row] for row in table.rows[:_LONGEST_TABLE]],
        "words": sorted(table.words),
        "note": plain(note),
    }


def plain(cell: object) -> str:
    """Return the text of a cell; of HTML what a reader sees of it."""
    return cell.striptags() if isinstance(cell, Markup) else str(cell)


def verdict_block(findings: Findings, values: Any) -> dict[str, Any]:
    """Return what stands on top of a run: the answer, its numbers, its parts, the drawing, and reasons to trust it."""
    scores = values["scores"]
    return {
        **verdict_numbers(findings),
        "cause": None if findings.cause is None else findings.cause.sentence,
        "tiles": json_value(values["tiles"]),
        "table": _table(values["parts"]),
        "scores": _table(scores) if scores.rows else None,
        "drawing": without_styles(str(values["sketch"])),
        "trust": list(values["trust"]),
    }


def verdict_numbers(findings: Findings) -> dict[str, Any]:
    """Return the verdict and its parts as numbers, each with its shares of time on either side and in the centre."""
    verdict = findings.verdict
    shares = {part.name: side_shares(findings, part) for part in verdict.parts}
    parts = [
        {**json_value(part), "rattles": part.rattles, "separates": part.separates, "shares": shares[part.name]}
        for part in verdict.parts
    ]
    return {
        "verdict": verdict.verdict,
        "severity": verdict.severity,
        "state": verdict.headline,
        "headline": headline_words(verdict),
        "sentence": verdict.sentence,
        "rule": verdict.rule,
        "parts": parts,
    }


def without_styles(svg: str) -> str:
    """Return a drawing without style attributes, which the page's policy refuses; its classes say the same."""
    return re.sub(r' style="[^"]*"', "", svg)
