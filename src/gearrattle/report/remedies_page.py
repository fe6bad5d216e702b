"""Remedies as a result: changes that make the driveline quiet, their cost, and their side effects."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.design.remedies import Remedies, Remedy
from gearrattle.model.factors import Factor
from gearrattle.model.path_labels import in_shown_unit
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.palette import ACCENT
from gearrattle.report.plots.row_charts import Series, row_chart
from gearrattle.report.presentation import ModelPresentation
from gearrattle.report.record_dataset import texts
from gearrattle.report.tables import Table
from gearrattle.wording import counted, engineering, listed

if TYPE_CHECKING:
    import xarray as xr


class RemediesPage(ModelPresentation[Remedies]):
    """Presentation of remedies, the best first."""

    kind = "remedies"

    @property
    def title(self) -> str:
        return f"Remedies for {self.result.model.name or 'the driveline'}"

    @property
    def sentence(self) -> str:
        result = self.result
        reaching = [remedy for remedy in result.remedies if remedy.holds]
        own = f"As it is the driveline {self._state(result.own)}."
        if not result.remedies:
            return f"{own} No change was tried."
        if not reaching:
            best = result.remedies[0]
            hardest = f"the hardest impact is {self._energy(best)}"
            none = f"None of {counted(len(result.remedies), 'change')} makes it {result.target.words}."
            return f"{own} {none} The best one: {best.change}; {hardest}."
        first = reaching[0]
        effects = f" Beside that {listed(list(first.side_effects))}." if first.side_effects else ""
        makes = f"{counted(len(reaching), 'change makes', 'changes make')} it {result.target.words} {self._where()}"
        return f"{own} {makes}. The cheapest one: {first.change}.{effects}"

    def _energy(self, remedy: Remedy) -> str:
        """The hardest impact, in words."""
        energy = remedy.hardest_impact
        if not (energy > 0.0 and math.isfinite(energy)):
            return "none"
        return f"{engineering(energy, self._unit)} at {remedy.part}"

    def _state(self, remedy: Remedy) -> str:
        """Return the severity of a state in words."""
        state = remedy.verdict if remedy.verdict.endswith("s") else f"is {remedy.verdict}"
        return f"{state}, hardest impact {self._energy(remedy)}" if remedy.hardest_impact > 0.0 else state

    @property
    def _unit(self) -> str:
        return "J" if self.result.model.units == "SI" else ""

    def _where(self) -> str:
        """The speeds at which the changes were tried, in words."""
        result = self.result
        path = next(iter(model_paths(result)))
        unit = "rad/s" if result.model.units == "SI" else ""
        factor, shown = in_shown_unit(path, unit if path.endswith("speed") else "Hz" if unit else "")
        speeds = [f"{speed * factor:.4g}" for speed in result.speeds]
        return f"at {listed(speeds)} {shown}".rstrip()

    def figures(self) -> tuple[Chart, ...]:
        shown = (self.result.own, *self.result.remedies)
        energies = np.array([remedy.hardest_impact for remedy in shown])
        chart = row_chart(
            "remedies",
            "Hardest impact with every change",
            "Energy of the hardest impact of all motions that were tried with the change.",
            [remedy.change for remedy in shown],
            [Series("", energies, ACCENT)],
            level=f"hardest impact [{self._unit}]" if self._unit else "hardest impact",
        )
        return () if chart is None else (chart,)

    def answer(self) -> tuple[Table, ...]:
        head = ("change", "cost", "verdict", "hardest impact", "side effects", "certified")
        rows = tuple(
            (
                remedy.change,
                f"{remedy.cost:.3g}",
                remedy.verdict,
                self._energy(remedy),
                "; ".join(remedy.side_effects) or "none",
                "yes" if remedy.holds else "no",
            )
            for remedy in (self.result.own, *self.result.remedies)
        )
        return (Table(head, rows, frozenset({0, 2, 3, 4, 5}), title="Changes, the best first"),)

    def content(self) -> dict[str, Any]:
        result = self.result
        return {
            "until": result.target.words,
            "speeds": list(result.speeds),
            "own": _record(result.own),
            "remedies": [_record(remedy) for remedy in result.remedies],
        }

    def numbers(self) -> xr.Dataset:
        import xarray as xr

        result = self.result
        names = texts(remedy.change for remedy in result.remedies)
        energies = [remedy.hardest_impact for remedy in result.remedies]
        variables: dict[str, Any] = {
            "cost": ("change", [remedy.cost for remedy in result.remedies], {"units": "1"}),
            "hardest_impact_energy": ("change", energies, {"units": self._unit or "1"}),
            "verdict": ("change", texts(remedy.verdict for remedy in result.remedies)),
            "certified": ("change", np.array([remedy.holds for remedy in result.remedies], np.int8)),
        }
        return xr.Dataset(variables, {"change": names}, {"until": result.target.words})


def model_paths(result: Remedies) -> tuple[str, ...]:
    """The path of the speed of a model."""
    return result.model.paths("excitation.speed") or result.model.paths("excitation.frequency")


def _record(remedy: Remedy) -> dict[str, Any]:
    """A remedy for machines."""
    changes = {
        path: {"factor": value.times} if isinstance(value, Factor) else value for path, value in remedy.changes.items()
    }
    return {
        "change": remedy.change,
        "changes": changes,
        "cost": remedy.cost,
        "verdict": remedy.verdict,
        "hardest_impact_energy": remedy.hardest_impact,
        "part": remedy.part,
        "side_effects": list(remedy.side_effects),
        "certified": remedy.holds,
    }
