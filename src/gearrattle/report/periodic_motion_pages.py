"""Periodic motions as results: period, stability, and contacts in the clearances."""

from __future__ import annotations

from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gearrattle.json_types import json_value
from gearrattle.orbits import Orbit, PeriodicMotions
from gearrattle.report.numbers import write_csv
from gearrattle.report.orbit_tables import (
    RATTLE,
    family_table,
    impacts_of,
    impacts_table,
    motions_table,
    multiplier_table,
    state_table,
    unit_of,
)
from gearrattle.report.page import Section, figure_sections, notes_section
from gearrattle.report.plots.clearance_figures import deflections, forces
from gearrattle.report.plots.history_figures import accelerations, speeds
from gearrattle.report.plots.numerals import engineering, numeral
from gearrattle.report.plots.periodic_motion_figures import multipliers_chart, overlaid_chart, phase_chart
from gearrattle.report.plots.region_figures import regions
from gearrattle.report.presentation import ModelPresentation, Presentation
from gearrattle.report.record_dataset import stacked, texts
from gearrattle.report.tables import Table, shortened
from gearrattle.report.verdict_tables import criteria_tables, verdict_table
from gearrattle.results import Run
from gearrattle.signals import by_parts, parts_of
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

    from gearrattle.model import Model
    from gearrattle.quantities.verdict import Verdict


class _Shown(NamedTuple):
    """One period of a motion in the form that the figures of a run need."""

    motion: Run
    verdict: Verdict

    @property
    def model(self) -> Model:
        """The driveline."""
        return self.motion.model


class PeriodicMotionPage(ModelPresentation[Orbit]):
    """Presentation of one periodic motion."""

    kind = "periodic motion"
    is_interactive = True

    @property
    def sentence(self) -> str:
        orbit = self.result
        stability = "A stable" if orbit.stable else "An unstable"
        length = f" ({engineering(orbit.period, unit_of(orbit, 's'), 4)})"
        return (
            f"{stability} motion that repeats after {orbit.cycles} T{length}: {RATTLE[orbit.verdict.headline]}; "
            f"the largest multiplier has the modulus {_number(orbit.largest_modulus)}."
        )

    @property
    def model(self) -> Model:
        """The driveline, whose simulation begins on the motion."""
        return self.result.model.with_simulation({"initial": self.result.state})

    def sections(self) -> tuple[Section, ...]:
        orbit = self.result
        first = Section("summary", "Summary", self.sentence, (self._facts(),), tables=(verdict_table(orbit.verdict),))
        multipliers = Section(
            "multipliers",
            "Multipliers",
            charts=(multipliers_chart([("multiplier", orbit)]),),
            tables=(multiplier_table(orbit), *([family_table(orbit)] if orbit.free else [])),
        )
        order = Section("order", "Impacts", tables=(impacts_table(orbit),), folds=True)
        state = Section("state", "State", tables=(state_table(orbit),), folds=True)
        criteria = Section("criteria", "Criteria", tables=tuple(criteria_tables(orbit.verdict)), folds=True)
        phase = figure_sections([chart for chart in (phase_chart(orbit),) if chart.panels])
        return first, *phase, *self._histories(), multipliers, order, state, criteria, *notes_section(self.notes)

    def answer(self) -> tuple[Table, ...]:
        orbit = self.result
        family = (family_table(orbit),) if orbit.free else ()
        return (
            verdict_table(orbit.verdict),
            shortened(multiplier_table(orbit)),
            *family,
            shortened(impacts_table(orbit)),
        )

    def content(self) -> dict[str, Any]:
        orbit = self.result
        return {
            "model": orbit.model.name,
            "cycles": orbit.cycles,
            "period": orbit.period,
            "stable": orbit.stable,
            "free_directions": orbit.free,
            "family": [json_value(asdict(free)) for free in orbit.family],
            "residual": orbit.residual,
            "multipliers": [{"real": m.real, "imaginary": m.imag} for m in orbit.multipliers.tolist()],
            "pattern": [{"clearance": name, "side": side} for name, side in orbit.pattern],
            "state": json_value(orbit.state),
            "verdict": orbit.verdict.to_dict(),
        }

    def numbers(self) -> xr.Dataset:
        return self._dataset

    @cached_property
    def _dataset(self) -> xr.Dataset:
        """One period of the motion, its multipliers, its state and its impacts."""
        orbit = self.result
        data = orbit.run.data
        impacts = impacts_of(orbit)
        names = texts(parts_of(orbit.run.trajectory.layout).clearance_names[k] for k in impacts.clearance)
        angle, rate, time = (unit_of(orbit, unit) or "1" for unit in ("rad", "rad/s", "s"))
        added = {
            "multiplier_real": ("mode", orbit.multipliers.real.copy()),
            "multiplier_imaginary": ("mode", orbit.multipliers.imag.copy()),
            "state_angle": ("inertia", np.array(orbit.state["angle"]), {"units": angle}),
            "state_velocity": ("inertia", np.array(orbit.state["velocity"]), {"units": rate}),
            "impact_time": ("impact", impacts.time, {"units": time}),
            "impact_clearance": ("impact", names),
            "impact_side": ("impact", texts(np.where(impacts.drive, "drive", "coast"))),
            "impact_velocity": (
                "impact",
                impacts.velocity,
                {"units": rate if time == "1" else "rad/s, or m/s for a mesh"},
            ),
        }
        facts = {"cycles": orbit.cycles, "stable": int(orbit.stable), "residual": orbit.residual}
        return data.assign(added).assign_attrs(facts)

    def write(self, path: Path) -> None:
        """Write a new file; a CSV file has the samples of one period."""
        if path.suffix == ".csv":
            self.result.run.write(path)
        else:
            super().write(path)

    def _facts(self) -> str:
        orbit = self.result
        impacts = counted(len(orbit.pattern), "impact") if orbit.pattern else "No impact"
        return (
            f"{orbit.verdict.sentence} {impacts} in {orbit.cycles} T. The end of the motion differs "
            f"from its start by {_number(orbit.residual)} of the largest corner or of the size of the state."
        )

    def _histories(self) -> tuple[Section, ...]:
        shown = _Shown(Run(by_parts(self.result.run.trajectory), self.result.model), self.result.verdict)
        clearances = tuple(chart for chart in (deflections(shown), forces(shown), regions(shown)) if chart.panels)
        bodies = tuple(chart for chart in (accelerations(shown), speeds(shown)) if chart.panels)
        return (
            Section("clearances", "Clearances", charts=clearances),
            Section("histories", "Time histories", charts=bodies),
        )


class PeriodicMotionsPage(Presentation[PeriodicMotions]):
    """Presentation of several periodic motions of one driveline."""

    kind = "periodic motions"
    is_interactive = True

    @property
    def title(self) -> str:
        return self.result.model.name or "Driveline"

    @property
    def sentence(self) -> str:
        orbits = self.result.orbits
        if not orbits:
            return "No motion that repeats was met."
        stable = sum(orbit.stable for orbit in orbits)
        verb = "repeats" if len(orbits) == 1 else "repeat"
        return f"{counted(len(orbits), 'motion')} {verb}: {stable} stable, {len(orbits) - stable} unstable."

    def sections(self) -> tuple[Section, ...]:
        orbits = self.result.orbits
        words = (
            "Small swings stand first. An unstable motion is never seen in a simulation: its neighbours leave it.",
        )
        first = Section("summary", "Summary", self.sentence, words if orbits else (), tables=self.answer())
        if not orbits:
            return first, *notes_section(self.notes)
        named = [(f"motion {number}", orbit) for number, orbit in enumerate(orbits, 1)]
        figures = figure_sections(
            [chart for chart in (overlaid_chart(named), multipliers_chart(named)) if chart.panels]
        )
        states = tuple(
            Table(t.head, t.rows, t.words, f"Motion {number}")
            for number, t in enumerate((state_table(orbit) for orbit in orbits), 1)
        )
        state = Section("states", "States at the start of a period", tables=states, in_columns=True)
        return first, *figures, state, *notes_section(self.notes)

    def answer(self) -> tuple[Table, ...]:
        return (motions_table(self.result.orbits),)

    def content(self) -> dict[str, Any]:
        names = ("notes", "model")
        motions = [
            {name: value for name, value in PeriodicMotionPage(orbit).content().items() if name not in names}
            for orbit in self.result.orbits
        ]
        return {"model": self.result.model.name, "motions": motions}

    def numbers(self) -> xr.Dataset:
        import xarray as xr

        # Floquet multipliers (motion, mode), filled up with NaN
        orbits = self.result.orbits
        model = self.result.model
        multipliers = [orbit.multipliers for orbit in orbits]
        # states at the start of a period
        bodies = [inertia.name for inertia in model.inertias]
        shape = (len(orbits), len(bodies))
        states = {key: np.array([o.state[key] for o in orbits]).reshape(shape) for key in ("angle", "velocity")}
        # peak-to-peak deflections of the clearances
        clearances = orbits[0].run.trajectory.layout.clearance_names if orbits else ()
        swings = [np.ptp(orbit.run.trajectory.deflection, axis=0) for orbit in orbits]
        # variables over motions, with units of SI models
        is_si = model.units == "SI"
        variables = {
            "cycles": ("motion", np.array([orbit.cycles for orbit in orbits], dtype=np.int64)),
            "stable": ("motion", np.array([orbit.stable for orbit in orbits], dtype=np.bool_)),
            "verdict": ("motion", texts(orbit.verdict.verdict for orbit in orbits)),
            "severity": ("motion", texts(orbit.verdict.severity for orbit in orbits)),
            "residual": ("motion", np.array([orbit.residual for orbit in orbits], dtype=np.float64)),
            "multiplier_real": (("motion", "mode"), stacked([values.real for values in multipliers])),
            "multiplier_imaginary": (("motion", "mode"), stacked([values.imag for values in multipliers])),
            "angle": (("motion", "inertia"), states["angle"], {"units": "rad" if is_si else "1"}),
            "velocity": (("motion", "inertia"), states["velocity"], {"units": "rad/s" if is_si else "1"}),
            "peak_to_peak": (
                ("motion", "clearance"),
                np.array(swings).reshape(len(orbits), len(clearances)),
                {"units": "rad, or m for a mesh" if is_si else "1"},
            ),
        }
        return xr.Dataset(variables, {"inertia": bodies, "clearance": list(clearances)}, {"title": model.name})

    def write(self, path: Path) -> None:
        """Write a new file; as CSV a row for every motion."""
        if path.suffix == ".csv":
            write_csv(self._table(), path)
        else:
            super().write(path)

    def _table(self) -> xr.Dataset:
        """The data as a table with a row for every motion and a column for every number."""
        data = self.numbers()
        columns = {str(name): data[name] for name in data.data_vars if data[name].dims == ("motion",)}
        for name in ("peak_to_peak", "angle", "velocity", "multiplier_real", "multiplier_imaginary"):
            axis = str(data[name].dims[1])
            for i in range(data.sizes[axis]):
                label = data[axis].values[i] if axis in data.coords else i + 1
                columns[f"{name}.{label}"] = data[name].isel({axis: i}, drop=True)
        import xarray as xr

        return xr.Dataset(columns)


def _number(value: float) -> str:
    return numeral(value, 4)
