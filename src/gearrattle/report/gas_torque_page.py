"""The torque of an engine as a result: mean, work and harmonics."""

from __future__ import annotations

from typing import Any

from gearrattle.measured.gas_torque import GasTorque
from gearrattle.report.numbers import Arrays
from gearrattle.report.page import Section, figure_sections
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.engine_torque import engine_charts
from gearrattle.report.presentation import Presentation
from gearrattle.report.record_dataset import record_columns
from gearrattle.report.tables import Table
from gearrattle.wording import counted

_SOURCES = ("gas", "masses", "harmonics")
_WORDS = {"gas": "gas", "masses": "oscillating masses", "harmonics": "together"}


class GasTorquePage(Presentation[GasTorque]):
    """Mean torque and harmonics of an engine at one speed."""

    kind = "gas torque"

    @property
    def title(self) -> str:
        return "Torque of the engine"

    @property
    def sentence(self) -> str:
        engine = self.result
        harmonics = counted(len(engine.harmonics), "harmonic")
        return f"Mean torque {engine.mean:.6g} N m, work of a cycle {engine.work:.6g} J; {harmonics}."

    def sections(self) -> tuple[Section, ...]:
        figures = figure_sections(self.figures())
        harmonics = Section("table", "Amplitudes and phases", tables=self.answer(), folds=True)
        return Section("summary", "Summary", self.sentence), *figures, harmonics

    def answer(self) -> tuple[Table, ...]:
        rows = tuple(
            (_WORDS[source], f"{wave.order:g}", f"{wave.amplitude:.6g}", f"{wave.phase:.6g}")
            for source in _SOURCES
            for wave in getattr(self.result, source)
        )
        return (Table(("of", "order", "amplitude [N m]", "phase [rad]"), rows),)

    def figures(self) -> list[Chart]:
        return engine_charts(self.result)

    def content(self) -> dict[str, Any]:
        engine = self.result
        waves = {source: [wave._asdict() for wave in getattr(engine, source)] for source in _SOURCES}
        return {"mean": engine.mean, "work": engine.work, **waves}

    def numbers(self) -> Arrays:
        waves = [
            {"source": _WORDS[source], **wave._asdict()} for source in _SOURCES for wave in getattr(self.result, source)
        ]
        return Arrays(
            {
                **record_columns(waves, "wave", units={"order": "1", "amplitude": "N m", "phase": "rad"}),
                "mean": ((), self.result.mean, {"units": "N m"}),
                "work": ((), self.result.work, {"units": "J"}),
            }
        )
