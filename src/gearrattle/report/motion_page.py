"""A motion as a result: its page is the report of a run; after a simulation the terminal shows its cost.

The report, its verdict and its figures are imported when they are needed: a motion that is only saved, or listed on a
terminal, does not need them.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.json_types import json_value
from gearrattle.report.page import Page, Section
from gearrattle.report.presentation import Presentation
from gearrattle.report.tables import Table
from gearrattle.results import Run
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

    from gearrattle.report.plots.chart import Chart
    from gearrattle.report.run_report import RunReport


class MotionReport(Presentation[Run]):
    """A simulated motion, new or opened from a file; the verdict is computed when it is shown. It has no advice."""

    kind = "motion"
    is_interactive = True

    @cached_property
    def _report(self) -> RunReport:
        from gearrattle.pipeline import judged
        from gearrattle.report.run_report import RunReport

        return RunReport(judged(self.result))

    @property
    def title(self) -> str:
        return self.result.model.name or "Driveline"

    @property
    def sentence(self) -> str:
        return self._report.sentence

    @property
    def further(self) -> tuple[str, ...]:
        return self._report.further

    @property
    def notes(self) -> tuple[str, ...]:
        return self._report.notes

    def sections(self) -> tuple[Section, ...]:
        return self._report.sections()

    def charts(self) -> list[Chart]:
        return self._report.charts()

    def answer(self) -> tuple[Table, ...]:
        return self._report.answer()

    def content(self) -> dict[str, Any]:
        return self._report.content()

    def numbers(self) -> xr.Dataset:
        return self.result.data

    def write(self, path: Path) -> None:
        self.result.write(path)

    def page(self) -> Page:
        return replace(self._report.page(), brand=self.kind)


class SimulationReport(MotionReport):
    """A motion whose answer is its cost and its crossings; the verdict is computed only for a page."""

    @property
    def sentence(self) -> str:
        cost = self.result.cost
        cycles = counted(self.result.trajectory.cycles, "cycle")
        return f"{cycles} by {cost.algorithm}: {counted(cost.steps, 'step')} in {cost.wall_time:.3g} s."

    @property
    def further(self) -> tuple[str, ...]:
        return ()

    @property
    def notes(self) -> tuple[str, ...]:
        return tuple(self.result.notes)

    def answer(self) -> tuple[Table, ...]:
        rows = tuple((name, str(count)) for name, count in self._crossings().items())
        return (Table(("clearance", "crossings"), rows),)

    def content(self) -> dict[str, Any]:
        trajectory = self.result.trajectory
        return {
            "model": self.result.model.name,
            "cycles": trajectory.cycles,
            "discard": trajectory.discard,
            "samples_per_cycle": trajectory.samples_per_cycle,
            "period": trajectory.layout.period,
            "crossings": self._crossings(),
            "cost": json_value(self.result.cost),
        }

    def _crossings(self) -> dict[str, int]:
        trajectory = self.result.trajectory
        counts = np.bincount(trajectory.events.clearance, minlength=len(trajectory.layout.clearance_names))
        return dict(zip(trajectory.layout.clearance_names, counts.tolist(), strict=True))
