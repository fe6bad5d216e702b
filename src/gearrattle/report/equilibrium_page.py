"""The static equilibrium as a result: deflections and regions of all elements under the mean loads."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearrattle.analysis.statics import Equilibrium
from gearrattle.assembly import free_names
from gearrattle.report.linear_tables import elements_table
from gearrattle.report.numbers import Arrays
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.equilibrium_figure import rest_chart
from gearrattle.report.plots.numerals import engineering, quantity
from gearrattle.report.presentation import Presentation
from gearrattle.report.record_dataset import texts
from gearrattle.report.tables import Table
from gearrattle.wording import counted


class EquilibriumPage(Presentation[Equilibrium]):
    """Presentation of the static equilibrium under the mean loads."""

    kind = "equilibrium"

    @property
    def title(self) -> str:
        return self.result.model.name or "driveline"

    @property
    def sentence(self) -> str:
        equilibrium = self.result
        region = equilibrium.region
        centre = [name for name, label in region.items() if label == 0]
        accelerates = np.any(equilibrium.acceleration != 0.0)
        moves = "; the mean torques do not balance, so it accelerates" if accelerates else ""
        if not region:
            return f"Under the mean loads, transmission errors at zero, every element is linear{moves}."
        of = counted(len(region), "element with corners", "elements with corners")
        where = f"{len(centre)} of {of} {'rests' if len(centre) == 1 else 'rest'} in the centre"
        return f"Under the mean loads, transmission errors at zero, {where}{moves}."

    def answer(self) -> tuple[Table, ...]:
        equilibrium = self.result
        si = self.result.model.units == "SI"
        bodies = tuple(
            (name, engineering(angle, "rad" if si else "", 4), engineering(acceleration, "rad/s²" if si else "", 4))
            for name, angle, acceleration in zip(
                free_names(equilibrium.model),
                equilibrium.angle.tolist(),
                equilibrium.acceleration.tolist(),
                strict=True,
            )
        )
        tables = (
            elements_table(equilibrium.model, equilibrium, "Elements"),
            Table(("inertia", "angle", "acceleration"), bodies, title="Inertias"),
        )
        if not equilibrium.balance:
            return tables
        balance = tuple((name, quantity(mean, "N m" if si else "")) for name, mean in equilibrium.balance.items())
        return (*tables, Table(("torque on", "mean that balances its train"), balance, title="Balance"))

    def figures(self) -> list[Chart]:
        chart = rest_chart(self.result)
        return [] if chart is None else [chart]

    def content(self) -> dict[str, Any]:
        equilibrium = self.result
        names = free_names(self.result.model)
        return {
            "model": {"name": equilibrium.model.name, "units": equilibrium.model.units},
            "angle": dict(zip(names, equilibrium.angle.tolist(), strict=True)),
            "deflection": equilibrium.deflection,
            "region": equilibrium.region,
            "acceleration": dict(zip(names, equilibrium.acceleration.tolist(), strict=True)),
            "balance": equilibrium.balance,
        }

    def numbers(self) -> Arrays:
        equilibrium = self.result
        si = self.result.model.units == "SI"
        meshes = {element.name for element in equilibrium.model.elements if element.along_line}
        units = [("m" if name in meshes else "rad") if si else "1" for name in equilibrium.deflection]
        balance = {"balance": ("balanced", list(equilibrium.balance.values()), {"units": "N m" if si else "1"})}
        return Arrays(
            {
                "angle": ("inertia", equilibrium.angle, {"units": "rad" if si else "1"}),
                "acceleration": ("inertia", equilibrium.acceleration, {"units": "rad/s^2" if si else "1"}),
                "deflection": ("element", list(equilibrium.deflection.values())),
                "deflection_unit": ("element", texts(units)),
                "region": ("clearance", list(equilibrium.region.values())),
                **(balance if equilibrium.balance else {}),
            },
            {
                "inertia": texts(free_names(equilibrium.model)),
                "element": texts(equilibrium.deflection),
                "clearance": texts(equilibrium.region),
                **({"balanced": texts(equilibrium.balance)} if equilibrium.balance else {}),
            },
            {"model": equilibrium.model.name},
        )
