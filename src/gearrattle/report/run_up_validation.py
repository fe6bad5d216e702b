"""The validation of a run-up as one page: what differs most, orders over speed, and a row an order.

``fill_run_up`` writes report.html, summary.json and figures/ into a folder. The page has no script and loads nothing.

Takes a RunUp.
"""

from __future__ import annotations

from base64 import b64encode
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from gearrattle.plots.numerals import numeral
from gearrattle.report.comparison import Section
from gearrattle.report.drawn import charts_of
from gearrattle.report.ink import fill_figures
from gearrattle.report.provenance import now, versions
from gearrattle.report.saved import write_json
from gearrattle.report.tables import Table
from gearrattle.report.templates import templates
from gearrattle.validation import RunUp
from gearrattle.wording import noun_of

_HERE = Path(__file__).parent


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
    drawn = fill_figures(charts_of(found), folder)
    notes = Table(("",), tuple((note,) for note in found.notes))
    environment = templates()
    page = environment.get_template("study.html.j2").render(
        brand="validation of a run-up",
        title=f"{found.model} against {', '.join(Path(source).name for source in found.sources)}",
        summary=found.verdict,
        setting=f"Simulated by {found.algorithm}; orders fitted over blocks of {found.turns:g} "
        f"{noun_of(found.turns, 'turn')}.",
        counts=tracks_table(found),
        figures=[(chart, f"data:image/svg+xml;base64,{b64encode(svg).decode('ascii')}") for chart, svg in drawn],
        sections=[Section("notes", "Notes", "What the reader must know.", (notes,))] if found.notes else [],
        created=now(),
        version=versions().get("gearrattle", ""),
        style=Markup((_HERE / "page.css").read_text(encoding="utf-8")),
    )
    (folder / "report.html").write_text(page, encoding="utf-8")
    write_json(run_up_content(found), folder / "summary.json", "run-up validation summary")
