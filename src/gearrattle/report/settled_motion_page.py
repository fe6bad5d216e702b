"""The settled motion as a result: the long-term behaviour of a driveline where no periodic motion is known."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.assembly import assemble
from gearrattle.orbits.attractors import KINDS
from gearrattle.orbits.settled_motion import SettledMotion
from gearrattle.orbits.settling_limits import LONGEST
from gearrattle.report.plots.chart import Bars, Chart, Key, Panel, Rule
from gearrattle.report.plots.corner_marks import units_of
from gearrattle.report.plots.numerals import engineering
from gearrattle.report.plots.palette import REGIMES
from gearrattle.report.presentation import ModelPresentation
from gearrattle.report.record_dataset import texts
from gearrattle.report.tables import Table
from gearrattle.wording import counted, listed

if TYPE_CHECKING:
    import xarray as xr

    from gearrattle.model import Model


class SettledMotionPage(ModelPresentation[SettledMotion]):
    """Presentation of a settled motion, from an exact run."""

    kind = "settled motion"

    @property
    def sentence(self) -> str:
        """Whether it repeats, and what rattles."""
        run = self.result.run
        names = self.result.clearance_names
        periods = counted(run.periods, "period")
        if run.cycles:
            first = f"After {periods} the motion about repeats every {counted(run.cycles, 'period')}"
        else:
            first = f"The motion is irregular: after {periods} it does not repeat within {LONGEST}"
        rattling = [name for name, word in zip(names, run.severities, strict=True) if word == "rattles"]
        of = f" of {listed(rattling)}" if rattling else ""
        return f"{first}. It is {KINDS[run.headline]}{of}."

    @property
    def model(self) -> Model:
        """The driveline, beginning where the run ends."""
        return self.result.begun_there

    def answer(self) -> tuple[Table, ...]:
        run = self.result.run
        layout = assemble(self.result.model).layout
        rows = tuple(
            (
                name,
                run.regimes[k],
                run.severities[k],
                f"{run.impacts[k]:.3g}",
                engineering(float(run.rms[k]), unit, 3),
                engineering(float(run.swing[k]), unit, 3),
            )
            for k, name in enumerate(self.result.clearance_names)
            for unit in [units_of(self.result.model, layout, k)["deflection"]]
        )
        head = ("clearance", "regime", "severity", "impacts a period", "rms", "peak to peak")
        note = "Deflections about their means, over the last 32 periods."
        return (Table(head, rows, frozenset({0, 1, 2}), "Clearances", note),)

    def figures(self) -> Sequence[Chart]:
        run = self.result.run
        names = self.result.clearance_names
        share = 50.0 * run.swing / np.maximum(run.scale, np.finfo(float).tiny)
        bars = tuple(
            Bars(np.array([k - 0.35, k + 0.35]), share[k : k + 1], f"{name}, {run.regimes[k]}", REGIMES[run.regimes[k]])
            for k, name in enumerate(names)
        )
        ticks = tuple((float(k), name) for k, name in enumerate(names))
        panel = Panel("peak to peak over the clearance", "%", bars=bars, rules=(Rule(100.0),), x_ticks=ticks)
        caption = (
            "Peak-to-peak deflection of every clearance as a share of its width, of a staged spring between its "
            "outermost corners. Above 100 % it reaches both sides."
        )
        used = dict.fromkeys(run.regimes)
        legend = tuple(Key(word, REGIMES[word]) for word in REGIMES if word in used)
        return (Chart("swings", "Swings", caption, (panel,), panel_height=230, legend=legend),)

    def content(self) -> dict[str, Any]:
        run = self.result.run
        return {
            "model": self.result.model.name,
            "speed": run.value,
            "cycles": run.cycles,
            "periods": run.periods,
            "verdict": run.headline,
            "clearances": [
                {
                    "name": name,
                    "regime": run.regimes[k],
                    "severity": run.severities[k],
                    "impacts_per_cycle": float(run.impacts[k]),
                    "rms": float(run.rms[k]),
                    "peak_to_peak": float(run.swing[k]),
                }
                for k, name in enumerate(self.result.clearance_names)
            ],
        }

    def numbers(self) -> xr.Dataset:
        import xarray as xr

        run = self.result.run
        unit = {"units": "1" if self.result.model.units != "SI" else "rad, or m for a mesh"}
        return xr.Dataset(
            {
                "rms": ("clearance", run.rms, unit),
                "peak_to_peak": ("clearance", run.swing, unit),
                "impacts": ("clearance", run.impacts),
                "regime": ("clearance", texts(run.regimes)),
                "severity": ("clearance", texts(run.severities)),
            },
            {"clearance": list(self.result.clearance_names)},
            {"cycles": run.cycles, "periods": run.periods},
        )
