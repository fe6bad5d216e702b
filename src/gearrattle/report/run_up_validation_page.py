"""The validation of a run-up as a result: the largest difference, orders over speed, and one row per order."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.measured.validation import RunUp
from gearrattle.report.numbers import write_csv
from gearrattle.report.page import Section, figure_sections, notes_section
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.run_up_validation_figures import run_up_charts
from gearrattle.report.presentation import Presentation
from gearrattle.report.record_dataset import records_dataset, stacked
from gearrattle.report.tables import Table

if TYPE_CHECKING:
    import xarray as xr


class RunUpPage(Presentation[RunUp]):
    """A simulated run-up against measured ones."""

    kind = "validation of a run-up"

    @property
    def title(self) -> str:
        return f"{self.result.model} against {', '.join(Path(source).name for source in self.result.sources)}"

    @property
    def sentence(self) -> str:
        return self.result.verdict

    def sections(self) -> tuple[Section, ...]:
        setting = f"Simulated by {self.result.algorithm}; orders fitted over blocks of {self.result.turns:g} turns."
        charts = [chart for chart in run_up_charts(self.result) if chart.panels]
        return (
            Section("summary", "Summary", self.sentence, (setting,), tables=self.answer()),
            *figure_sections(charts),
            *notes_section(self.notes),
        )

    def answer(self) -> tuple[Table, ...]:
        return (tracks_table(self.result),)

    def content(self) -> dict[str, Any]:
        content = self.result.to_dict()
        del content["verdict"]  # it is the sentence
        return content

    def numbers(self) -> xr.Dataset:
        run_up = self.result
        speed = {"units": "rad/s" if run_up.units == "SI" else "1"}
        over_speed: dict[str, Any] = {
            name: (("track", "point"), stacked([getattr(track, field) for track in run_up.tracks]))
            for name, field in (
                ("measured_over_speed", "measured"),
                ("simulated_over_speed", "simulated"),
                ("standard_error", "error"),
                ("interval_half_width", "reach"),
            )
        }
        speeds = (("track", "point"), stacked([track.speed for track in run_up.tracks]), speed)
        shared = {name: getattr(run_up, name) for name in ("model", "algorithm", "turns", "units")}
        return self._rows().assign(speed=speeds, **over_speed).assign_attrs({**shared, "sources": list(run_up.sources)})

    def write(self, path: Path) -> None:
        """Write all numbers, or as CSV a row for every channel and order."""
        if path.suffix == ".csv":
            write_csv(self._rows(), path)
        else:
            super().write(path)

    def _rows(self) -> xr.Dataset:
        """Return one row per channel and order: levels over speed, sigma, the peaks and their speeds."""
        speed = "rad/s" if self.result.units == "SI" else "1"
        units = {"order": "1", "sigma": "%", "outside": "1", "peak_speed": speed, "simulated_peak_speed": speed}
        return records_dataset([track.summary() for track in self.result.tracks], "track", units=units)


def tracks_table(run_up: RunUp) -> Table:
    """One row per channel and order."""
    si = run_up.units == "SI"
    turning, unit = (30.0 / np.pi, " rpm") if si else (1.0, "")
    head = (
        "channel",
        "order",
        "unit",
        "measured",
        "simulated",
        "sigma, %",
        "largest measured at",
        "simulated at",
        "speeds outside",
    )
    # one row per order of a channel: levels, sigma, peaks, share of speeds outside the interval
    rows = []
    for track in run_up.tracks:
        first, second = (f"{numeral(turning * at, 4)}{unit}: {numeral(size)}" for at, size in track.peaks)
        outside = numeral(100.0 * track.outside, 3) + " %" if np.isfinite(track.outside) else "–"
        one, other = (numeral(level) for level in track.levels)
        rows.append(
            (
                track.channel,
                numeral(track.order, 6),
                track.unit,
                one,
                other,
                numeral(track.sigma, 3),
                first,
                second,
                outside,
            )
        )
    # definitions
    note = (
        "Measured, simulated: root mean square of the amplitude over the speeds in common. Speeds outside: where the "
        "simulation lies beyond the 95 % interval of repeated run-ups; a dash: there was one run-up, and nothing tells "
        "what chance does."
    )
    return Table(head, tuple(rows), frozenset({0, 2}), note=note)
