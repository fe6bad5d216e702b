"""The validation of a run-up as one page: what differs most, orders over speed, and a row an order.

``fill_run_up`` writes report.html, summary.json and figures/ into a folder. The page has no script and loads nothing.

Takes a RunUp.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gearrattle.plots.numerals import numeral
from gearrattle.report.drawn import charts_of
from gearrattle.report.page import Page, Section, fill_page, notes_section
from gearrattle.report.provenance import now, versions
from gearrattle.report.saved import write_json
from gearrattle.report.tables import Table
from gearrattle.validation import RunUp


def run_up_content(found: RunUp) -> dict[str, Any]:
    """Return everything for machines, in JSON types."""
    return {**found.to_dict(), "versions": versions(), "created": now()}


def tracks_table(found: RunUp) -> Table:
    """A row a channel and order."""
    si = found.units == "SI"
    turning, unit = (30.0 / np.pi, " rpm") if si else (1.0, "")
    head = ("channel", "order", "unit", "measured", "simulated", "sigma, %", "largest measured at", "simulated at",
            "speeds outside")  # fmt: skip
    rows = []
    for track in found.tracks:
        first, second = (f"{numeral(turning * at, 4)}{unit}: {numeral(size)}" for at, size in track.peaks)
        outside = numeral(100.0 * track.outside, 3) + " %" if np.isfinite(track.outside) else "–"
        one, other = (numeral(level) for level in track.levels)
        rows.append((track.channel, numeral(track.order, 6), track.unit, one, other, numeral(track.sigma, 3), first,
                     second, outside))  # fmt: skip
    note = (
        "Measured, simulated: root mean square of the amplitude over the speeds in common. Speeds outside: where the "
        "simulation lies beyond the 95 % interval of repeated run-ups; a dash: there was one run-up, and nothing tells "
        "what chance does."
    )
    return Table(head, tuple(rows), frozenset({0, 2}), note=note)


def fill_run_up(found: RunUp, folder: Path) -> None:
    """Write all files into an existing empty folder."""
    title = f"{found.model} against {', '.join(Path(source).name for source in found.sources)}"
    setting = f"Simulated by {found.algorithm}; orders fitted over blocks of {found.turns:g} turns."
    summary = Section("summary", "Summary", found.verdict, (setting,), tables=(tracks_table(found),))
    figures = [Section(chart.key, chart.title, charts=(chart,)) for chart in charts_of(found)]
    fill_page(
        Page("validation of a run-up", title, (summary, *figures, *notes_section(tuple(found.notes)))),
        folder,
    )
    write_json(run_up_content(found), folder / "summary.json", "run-up validation summary")
