"""The reproduction as a result: "paper, ours, why they differ"."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gearrattle.report.page import Section as PageSection
from gearrattle.report.presentation import Presentation
from gearrattle.report.record_dataset import records_dataset, texts
from gearrattle.report.tables import Table
from gearrattle.reproduction.reproduction_record import DIFFERS, Reproduction, Section

if TYPE_CHECKING:
    import xarray as xr

_SOURCE = (
    "Padmanabhan, Barlow, Rook, Singh, ASME Journal of Mechanical Design 117 (1995) 185-192. The paper prints neither "
    "its loads nor its tolerances nor a dimensional model; what we inferred and assumed stands in the manual "
    "(Reproduction). Nothing was tuned to look alike."
)
_QUICK = "A quick run: lengths are about a tenth of the paper's, so figures are samples, not results."


class ReproductionPage(Presentation[Reproduction]):
    """The paper's numbers beside ours."""

    kind = "reproduction"

    @property
    def title(self) -> str:
        return "The paper, ours, and why they differ"

    @property
    def sentence(self) -> str:
        counts = "; ".join(f"{number} {status}" for status, number in self.result.counts().items())
        return f"{len(self.result.rows)} in all: {counts}."

    def sections(self) -> tuple[PageSection, ...]:
        result = self.result
        words = (*([_QUICK] if result.quick else []), f"{_SOURCE} Everything took {result.seconds:.0f} s.")
        sections = [
            PageSection(
                section.key,
                section.title,
                words=(section.words,),
                charts=section.charts,
                tables=(rows_table(section), *section.tables),
            )
            for section in result.sections
        ]
        return PageSection("summary", "Summary", self.sentence, words), *sections

    def answer(self) -> tuple[Table, ...]:
        rows = [(f"{number}", status) for status, number in self.result.counts().items()]
        counts = Table(("rows", "status"), (*rows, (f"{len(self.result.rows)}", "in all")), frozenset({1}))
        differing = tuple((row.item, row.why) for row in self.result.rows if row.status == DIFFERS)
        return counts, Table(("what differs", "because"), differing, frozenset({0, 1}), note="The page has all rows.")

    def content(self) -> dict[str, Any]:
        return self.result.to_dict()

    def numbers(self) -> xr.Dataset:
        import xarray as xr

        keys = [section.key for section in self.result.sections for _ in section.rows]
        rows = records_dataset(self.result.rows, "row").assign(section=("row", texts(keys)))
        figures = [(row.item, *figure) for row in self.result.rows for figure in row.figures.items()]
        attributes = {"quick": int(self.result.quick), "seconds": self.result.seconds}
        values = {
            "figure_item": ("figure", texts(item for item, *_ in figures)),
            "figure_name": ("figure", texts(name for _, name, _ in figures)),
            "figure_value": ("figure", [value for *_, value in figures]),
        }
        return rows.merge(xr.Dataset(values)).assign_attrs(attributes)


def rows_table(section: Section) -> Table:
    """A section's rows as a table of words."""
    lines = tuple((row.item, row.paper, row.ours, row.verdict, row.why) for row in section.rows)
    return Table(("", "paper", "ours", "status", "why"), lines, frozenset(range(5)))
