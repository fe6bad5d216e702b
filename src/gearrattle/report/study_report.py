"""A study as a result: its outcome in a sentence, its figures, and the tables behind them.

The kind of study decides what is said, drawn and tabulated (``study_pages``). The page loads nothing.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.report.numbers import write_csv
from gearrattle.report.page import Page, Section, figure_sections, notes_section
from gearrattle.report.plots.axis_names import measure_of
from gearrattle.report.plots.chart import Chart
from gearrattle.report.presentation import Presentation
from gearrattle.report.saved import SUMMARY, summary, write_json
from gearrattle.report.study_pages import page_of
from gearrattle.report.tables import Table
from gearrattle.report.written_page import fill_page
from gearrattle.studies.sound_output import LOOP_SAMPLE, SOUND_LOOP
from gearrattle.studies.stored_studies import messages_of
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

    from gearrattle.report.study_pages.study_page import Inlay

_LISTS = (
    "sampled",
    "failures",
    "section",
    "scale",
    "over",
    "variables",
    "low",
    "high",
    "log",
    "senses",
    "units",
    "constraints",
    "ideal",
    "reference",
)
"""Attributes that are lists; netCDF keeps one of a single value as that value."""
_SHOWN = 5


class StudyReport(Presentation["xr.Dataset"]):
    """A study of any kind: the Dataset that ``study``, or the call of another kind of study, returned."""

    kind = "study"
    is_data = True

    def __init__(
        self,
        result: xr.Dataset,
        messages: Mapping[tuple[int, ...], str] | None = None,
        *,
        title: str = "",
        cost: str = "",
        facts: Mapping[str, Any] | None = None,
        remarks: Sequence[str] = (),
    ) -> None:
        """Present the Dataset of a study, whose ``attrs["kind"]`` is the kind of study.

        ``messages`` say why cases failed, by their place in the grid; by default ``attrs["failures"]`` does. The page's
        title is by default the name of the model. Machines get ``facts`` besides.
        """
        lists = {name: np.atleast_1d(result.attrs[name]).tolist() for name in _LISTS if name in result.attrs}
        super().__init__(result.assign_attrs(lists))
        self.messages = messages_of(lists.get("failures", ())) if messages is None else messages
        self.study = page_of(result)
        self.cost = cost
        self.facts = facts or {}
        self.remarks = tuple(remarks)
        self._title = title

    @property
    def title(self) -> str:
        name = tomllib.loads(str(self.result.attrs.get("model", ""))).get("name", "")
        return self._title or str(name) or "study"

    @cached_property
    def _sentence(self) -> str:
        return self.study.summary(self.result)

    @property
    def sentence(self) -> str:
        return self._sentence

    @property
    def notes(self) -> tuple[str, ...]:
        first = [f"case {self._at(case)}: {text}" for case, text in list(self.messages.items())[:_SHOWN]]
        left = len(self.messages) - _SHOWN
        more = (f"{counted(left, 'more case')} failed; the page and attrs hold the messages",) if left > 0 else ()
        return (*self.remarks, *first, *more)

    def sections(self) -> tuple[Section, ...]:
        data = self.result
        setting = f"{self.study.setting(data)} {self.cost}".strip()
        first = Section("summary", "Summary", self.sentence, (setting,), tables=(self.study.counts(data),))
        figures = tuple(
            replace(section, inlay=self._inlay.html) if self._inlay and section.key == self._inlay.key else section
            for section in figure_sections(self.study.charts(data))
        )
        return first, *figures, *self.study.sections(data, self.messages), *notes_section(self.remarks)

    @cached_property
    def _inlay(self) -> Inlay | None:
        return self.study.inlay(self.result) if self.study.inlay else None

    def page(self) -> Page:
        page = super().page()
        return replace(page, script=self._inlay.script) if self._inlay else page

    def charts(self) -> list[Chart]:
        return [chart for chart in self.study.charts(self.result) if chart.panels]

    def answer(self) -> tuple[Table, ...]:
        return self.study.answer(self.result)

    def content(self) -> dict[str, Any]:
        kind = str(self.result.attrs.get("kind", "grid"))
        return {"kind": kind, **self.facts, **self.study.content(self.result)}

    def numbers(self) -> xr.Dataset:
        return self.result

    def write(self, path: Path) -> None:
        """Write a new file; a table leaves out the sounds."""
        if path.suffix == ".csv":
            write_csv(self.result.drop_vars([SOUND_LOOP, LOOP_SAMPLE], errors="ignore"), path)
        else:
            super().write(path)

    def fill(self, folder: Path) -> None:
        """Write page, summary and figures into an existing folder: the numbers of a study folder are results.zarr."""
        fill_page(self.page(), folder)
        write_json(summary(self), folder / SUMMARY)

    def _at(self, case: tuple[int, ...]) -> str:
        """Return the position of a case in the grid, in words."""
        return ", ".join(
            _place(self.result, str(name), index) for name, index in zip(self.result["outcome"].dims, case, strict=True)
        )


def _place(data: xr.Dataset, dimension: str, index: int) -> str:
    """Return the position of a case along a dimension, in words."""
    if dimension not in data.coords:
        return f"{dimension} {index}"
    measure = measure_of(data, dimension)
    return f"{measure.words} = {measure.with_unit(data[dimension].values[index])}"
