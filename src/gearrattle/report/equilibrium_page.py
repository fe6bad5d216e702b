"""The static equilibrium as a result: deflections and regions of all elements under the mean loads."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearrattle.analysis.statics import Equilibrium
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
        rest = self.result
        centre = [name for name, label in rest.region.items() if label == 0]
        moves = "; the mean torques do not balance, so it accelerates" if np.any(rest.acceleration != 0.0) else ""
        if not rest.region:
            return f"Under the mean loads, transmission errors at zero, every element is linear{moves}."
        of = counted(len(rest.region), "element with corners", "elements with corners")
        where = f"{len(centre)} of {of} {'rests' if len(centre) == 1 else 'rest'} in the centre"
        return f"Under the mean loads, transmission errors at zero, {where}{moves}."

    def answer(self) -> tuple[Table, ...]:
        rest = self.result
        si = self.result.model.units == "SI"
        bodies = tuple(
            (name, engineering(angle, "rad" if si else "", 4), engineering(acceleration, "rad/s²" if si else "", 4))
            for name, angle, acceleration in zip(
                _inertias(rest), rest.angle.tolist(), rest.acceleration.tolist(), strict=True
            )
        )
        tables = (
            elements_table(rest.model, rest, "Elements"),
            Table(("inertia", "angle", "acceleration"), bodies, title="Inertias"),
            *_sideways_tables(rest, si=si),
        )
        if not rest.balance:
            return tables
        balance = tuple((name, quantity(mean, "N m" if si else "")) for name, mean in rest.balance.items())
        return (*tables, Table(("torque on", "mean that balances its train"), balance, title="Balance"))

    def figures(self) -> list[Chart]:
        chart = rest_chart(self.result)
        return [] if chart is None else [chart]

    def content(self) -> dict[str, Any]:
        rest = self.result
        names = _inertias(rest)
        return {
            "model": {"name": rest.model.name, "units": rest.model.units},
            "angle": dict(zip(names, rest.angle.tolist(), strict=True)),
            "deflection": rest.deflection,
            "region": rest.region,
            "acceleration": dict(zip(names, rest.acceleration.tolist(), strict=True)),
            "balance": rest.balance,
            **({"displacement": rest.displacement, "bearing_force": rest.bearing_force} if rest.displacement else {}),
        }

    def numbers(self) -> Arrays:
        rest = self.result
        si = self.result.model.units == "SI"
        # units, and what only some drivelines have
        meshes = {element.name for element in rest.model.elements if element.along_line}
        units = [("m" if name in meshes else "rad") if si else "1" for name in rest.deflection]
        balance = {"balance": ("balanced", list(rest.balance.values()), {"units": "N m" if si else "1"})}
        sideways = {
            "displacement": ("direction", list(rest.displacement.values()), {"units": "m" if si else "1"}),
            "bearing_force": ("bearing", list(rest.bearing_force.values()), {"units": "N" if si else "1"}),
        }
        directions = {"direction": texts(rest.displacement), "bearing": texts(rest.bearing_force)}
        # variables, then coordinates
        return Arrays(
            {
                "angle": ("inertia", rest.angle, {"units": "rad" if si else "1"}),
                "acceleration": ("inertia", rest.acceleration, {"units": "rad/s^2" if si else "1"}),
                "deflection": ("element", list(rest.deflection.values())),
                "deflection_unit": ("element", texts(units)),
                "region": ("clearance", list(rest.region.values())),
                **(balance if rest.balance else {}),
                **(sideways if rest.displacement else {}),
            },
            {
                "inertia": texts(_inertias(rest)),
                "element": texts(rest.deflection),
                "clearance": texts(rest.region),
                **({"balanced": texts(rest.balance)} if rest.balance else {}),
                **(directions if rest.displacement else {}),
            },
            {"model": rest.model.name},
        )


def _inertias(rest: Equilibrium) -> tuple[str, ...]:
    """Names of all inertias."""
    return tuple(inertia.name for inertia in rest.model.inertias)


def _sideways_tables(rest: Equilibrium, *, si: bool) -> tuple[Table, ...]:
    """Displacements of bodies with a mass, and forces of bearings; none where no body has one."""
    if not rest.displacement:
        return ()
    moved = tuple((name, engineering(value, "m" if si else "", 4)) for name, value in rest.displacement.items())
    forces = tuple((name, engineering(value, "N" if si else "", 4)) for name, value in rest.bearing_force.items())
    return (
        Table(("direction", "displacement"), moved, title="Displacements"),
        Table(("bearing", "force on its body"), forces, title="Bearing forces"),
    )
