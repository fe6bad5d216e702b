"""The map of motions over two values as a result: regions where all, some or none of the known motions rattle."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.orbits.motion_map import WORDS, MotionMap
from gearrattle.orbits.two_parameters.event_boundary import Border
from gearrattle.report.numbers import write_csv
from gearrattle.report.page import Section, figure_sections, notes_section
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.motion_map_figure import SPECIAL, map_chart, measures_of
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.presentation import ModelPresentation
from gearrattle.report.tables import Table, shortened

if TYPE_CHECKING:
    import xarray as xr

_TRUST = (
    "A sum of signs that is right is no proof: motions may be "
    "missing in pairs, a stable one with an unstable one. Such a pair begins in a fold; where isolated branches were "
    "sought as well, it is less likely."
)


class MotionMapPage(ModelPresentation[MotionMap]):
    """Motions over two values of a model."""

    kind = "map of motions"
    is_interactive = True

    @property
    def sentence(self) -> str:
        across, up = measures_of(self.result)
        parts = [f"in {self._share(code)} {words}" for code, words in WORDS.items() if self._counts[code]]
        plane = f"{across.words} and {up.words}"
        return f"Motions that repeat after {self.result.cycles} T, over {plane}: {'; '.join(parts)}."

    @cached_property
    def _counts(self) -> dict[int, int]:
        codes = self.result.data["code"].values
        return {code: int(np.count_nonzero(codes == code)) for code in WORDS}

    def _share(self, code: int) -> str:
        return f"{numeral(100.0 * self._counts[code] / self.result.data['code'].size, 3)} %"

    def sections(self) -> tuple[Section, ...]:
        summary = Section("summary", "Summary", self.sentence, (_TRUST,), tables=(self._count_table(),))
        curves = Section("curves", "Curves", tables=(self._border_table(), self._special_table()))
        return summary, *figure_sections(self.figures()), curves, *notes_section(self.notes)

    def figures(self) -> tuple[Chart, ...]:
        return (map_chart(self.result),)

    def answer(self) -> tuple[Table, ...]:
        return self._count_table(), shortened(self._border_table()), shortened(self._special_table())

    def _count_table(self) -> Table:
        rows = tuple((words, f"{self._counts[code]}", self._share(code)) for code, words in WORDS.items())
        return Table(("motions", "cells", "share"), tuple(row for row in rows if row[1] != "0"), title="What cells say")

    def _border_table(self) -> Table:
        across, up = measures_of(self.result)
        low, high = self.result.second_range

        def ends(border: Border, index: int) -> tuple[str, str]:
            return (
                numeral(border.value[index] * across.factor, 6),
                numeral(border.second[index] * up.factor, 6),
            )

        rows = []
        for border in self.result.borders:
            reasons = (("below", border.ends_below), ("above", border.ends_above))
            inside = ", ".join(f"{where}: {reason}" for where, reason in reasons if reason)
            rows.append((border.kind, border.clearance, *ends(border, 0), *ends(border, -1), inside))
        head = (
            "curve",
            "clearance",
            *(f"{end}: {measure.title}" for end in ("from", "to") for measure in (across, up)),
            "ends inside the range",
        )
        ends_of_range = f"{up.with_unit(low)} and {up.with_unit(high)}"
        note = f"Followed from the model's own {up.words} to both ends of its range, {ends_of_range}."
        return Table(head, tuple(rows), frozenset({0, 1, 6}), "Folds, grazings and ends of families", note)

    def _special_table(self) -> Table:
        across, up = measures_of(self.result)
        rows = tuple(
            (SPECIAL[point.kind].name, numeral(point.value * across.factor, 8), numeral(point.second * up.factor, 8))
            for point in self.result.special_points
        )
        return Table(("point", across.title, up.title), rows, title="Special points")

    def content(self) -> dict[str, Any]:
        # the grid of cells and their codes
        motions = self.result
        return {
            "model": motions.model.name,
            "path": motions.path,
            "second": motions.second,
            "range": list(motions.range),
            "second_range": list(motions.second_range),
            "cycles": motions.cycles,
            "value": motions.value.tolist(),
            "seconds": motions.seconds.tolist(),
            # codes row by row, with their meanings and counts
            "code": motions.data["code"].values.tolist(),
            "meanings": list(WORDS.values()),
            "counts": {words: self._counts[code] for code, words in WORDS.items()},
            # borders and special points
            "borders": [
                {
                    "event": border.event,
                    "kind": border.kind,
                    "clearance": border.clearance,
                    "value": border.value.tolist(),
                    "second": border.second.tolist(),
                }
                for border in motions.borders
            ],
            "special_points": [
                {"kind": point.kind, "value": point.value, "second": point.second} for point in motions.special_points
            ],
        }

    def numbers(self) -> xr.Dataset:
        return self.result.data

    def write(self, path: Path) -> None:
        """Write a new file; as CSV a row for every cell."""
        if path.suffix == ".csv":
            data = self.result.data
            write_csv(data.drop_vars([name for name in data.data_vars if data[name].dims != ("second", "value")]), path)
        else:
            super().write(path)
