"""Contents of a measured file as a result: one row per channel; saved as .toml it is a first mapping file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearrattle.measured.look import Contents
from gearrattle.model.schema_line import with_schema_line
from gearrattle.report.page import Section, figure_sections, notes_section
from gearrattle.report.plots.channels_figure import channels_chart
from gearrattle.report.presentation import RESULT_ENDINGS, Presentation
from gearrattle.report.record_dataset import records_dataset, stacked
from gearrattle.report.tables import Table
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_HEADS = ("channel", "unit", "quantity", "samples", "rate [Hz]", "from [s]", "to [s]", "smallest", "largest", "first")
_UNITS = {"rate": "Hz", "begin": "s", "end": "s", "samples": "1", "not_numbers": "1"}


class ContentsPage(Presentation[Contents]):
    """The channels of a measured file."""

    kind = "contents"
    endings = (*RESULT_ENDINGS, ".toml")

    @property
    def title(self) -> str:
        return Path(self.result.source).name

    @property
    def sentence(self) -> str:
        return f"{self.result.source}: {self.result.format}, {counted(len(self.result.table), 'channel')}."

    def sections(self) -> tuple[Section, ...]:
        text = ("A mapping file to begin with", self.result.mapping(self.folder))
        summary = Section("summary", "Summary", self.sentence, tables=self.answer(), text=text)
        chart = channels_chart(self.result)
        channels = figure_sections([] if chart is None else [chart])
        return summary, *channels, *notes_section(self.notes)

    def answer(self) -> tuple[Table, ...]:
        rows = []
        for row in self.result.table.to_dict("records"):
            quantity = f"{row['quantity'] or '?'}{' of ' + row['subject'] if row['subject'] else ''}"
            rate = f"{row['rate']:.6g}{'' if row['uniform'] else ' (mean)'}"
            numbers = (f"{row[key]:.6g}" for key in ("begin", "end", "smallest", "largest"))
            first = " ".join(f"{value:.4g}" for value in row["first"])
            rows.append((row["channel"], row["unit"], quantity, str(row["samples"]), rate, *numbers, first))
        return (Table(_HEADS, tuple(rows)),)

    def content(self) -> dict[str, Any]:
        content = self.result.to_dict()
        return {"file_format": content.pop("format"), **content}  # "format" names that of the summary

    def numbers(self) -> xr.Dataset:
        table = self.result.table
        first = ("channel_number", "first_sample"), stacked(table["first"].tolist())
        attributes = {"source": self.result.source, "file_format": self.result.format}
        columns = records_dataset(table.to_dict("records"), "channel_number", units=_UNITS)
        return columns.assign(first=first).assign_attrs(attributes)

    def write(self, path: Path) -> None:
        """Write the mapping file (.toml), or a file with another of the ``endings``."""
        if path.suffix == ".toml":
            path.write_text(
                with_schema_line(self.result.mapping(self.folder), self.folder, "mapping"), encoding="utf-8"
            )
        else:
            super().write(path)
