"""The reproduction as one page and one file: "paper, ours, why they differ".

``fill`` writes reproduction.html, reproduction.json and figures/ into a folder. The page has no script and loads
nothing.

Takes a Reproduction.
"""

from __future__ import annotations

from pathlib import Path

from gearrattle.report.page import Page, fill_page
from gearrattle.report.page import Section as PageSection
from gearrattle.report.provenance import now, versions
from gearrattle.report.saved import write_json
from gearrattle.report.tables import Table
from gearrattle.reproduction.record import Reproduction, Section

_SOURCE = (
    "Padmanabhan, Barlow, Rook, Singh, ASME Journal of Mechanical Design 117 (1995) 185-192. The paper prints neither "
    "its loads nor its tolerances nor a dimensional model; what we inferred and assumed stands in the manual "
    "(Reproduction). Nothing was tuned to look alike."
)
_QUICK = "A quick run: lengths are about a tenth of the paper's, so figures are samples, not results."


def fill(found: Reproduction, folder: Path) -> None:
    """Write all files of a reproduction into an existing folder."""
    counts = "; ".join(f"{number} {status}" for status, number in found.counts().items())
    words = (*([_QUICK] if found.quick else []), f"{_SOURCE} Everything took {found.seconds:.0f} s.")
    sections = [
        PageSection(
            section.key,
            section.title,
            words=(section.words,),
            charts=section.charts,
            tables=(rows_table(section), *section.tables),
        )
        for section in found.sections
    ]
    summary = PageSection("summary", "Summary", f"{counts}.", words)
    title = "The paper, ours, and why they differ"
    fill_page(Page("reproduction", title, (summary, *sections), has_legends=False), folder, "reproduction.html")
    content = {**found.to_dict(), "created": now(), "versions": versions()}
    write_json(content, folder / "reproduction.json", "reproduction summary")


def rows_table(section: Section) -> Table:
    """A section's rows as a table of words."""
    lines = tuple((each.item, each.paper, each.ours, each.verdict, each.why) for each in section.rows)
    return Table(("", "paper", "ours", "status", "why"), lines, frozenset(range(5)))
