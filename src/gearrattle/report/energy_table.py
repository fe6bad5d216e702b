"""The energy balance of a run: work, losses of every element with the share of friction, stored energy, residual."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearrattle.assembly import coordinate_names
from gearrattle.engine.system.energy_audit import EnergyAudit
from gearrattle.model import Model
from gearrattle.model.element_groups import element_groups
from gearrattle.pipeline import Findings
from gearrattle.report.plots.numerals import engineering, numeral
from gearrattle.report.tables import Table


def energy_table(findings: Findings) -> Table | None:
    """Return the energy balance of the whole run; None without an audit."""
    # work of torques, errors and prescribed motions
    energy = findings.motion.trajectory.energy
    layout = findings.motion.trajectory.layout
    if energy is None:
        return None
    unit = "J" if findings.model.units == "SI" else ""
    bodies = len(layout.inertia_names) - len(layout.prescribed)
    rows = [
        (f"work of the {'weight along' if k >= bodies else 'torques on'} {name}", engineering(work, unit), "")
        for k, (name, work) in enumerate(
            zip(coordinate_names(findings.model), energy.torque_work.tolist(), strict=True)
        )
        if work
    ]
    rows += [
        (f"work of {cause}", engineering(work, unit), "")
        for cause, work in zip(_causes(findings.model), energy.error_work.tolist(), strict=True)
        if work
    ]
    # losses: drag, then every element with its share of friction
    if energy.drag_loss.any():
        rows.append(("taken by drag", engineering(float(energy.drag_loss.sum()), unit), ""))
    losses = zip(layout.element_names, energy.element_loss.tolist(), _friction(energy).tolist(), strict=True)
    known = {name: (loss, friction) for name, loss, friction in losses}
    for name, elements in element_groups(findings.model).items():
        loss, friction = (sum(parts) for parts in zip(*(known[element.name] for element in elements), strict=True))
        if loss:
            share = f"{numeral(100.0 * friction / loss, 3)} % of it friction" if friction else ""
            rows.append((f"taken by {name}", engineering(loss, unit), share))
    # stored energy
    rows.append(("more stored at the end", engineering(energy.stored[1] - energy.stored[0], unit), ""))
    return Table(("energy", "", ""), tuple(rows), frozenset({0, 2}), "Energy")


def energy_dict(findings: Findings) -> dict[str, Any] | None:
    """Return the energy balance by name [J]; it does not contain inertias with prescribed motion.

    ``error_work`` is the work of transmission errors and prescribed motions through every element.
    """
    energy = findings.motion.trajectory.energy
    layout = findings.motion.trajectory.layout
    if energy is None:
        return None
    inertia_names = coordinate_names(findings.model)
    by_inertia = {name: getattr(energy, name) for name in ("torque_work", "drag_loss")}
    by_element = {"error_work": energy.error_work, "element_loss": energy.element_loss}
    by_element["friction_loss"] = _friction(energy)
    return {
        **{key: dict(zip(inertia_names, values.tolist(), strict=True)) for key, values in by_inertia.items()},
        **{key: dict(zip(layout.element_names, values.tolist(), strict=True)) for key, values in by_element.items()},
        "stored": list(energy.stored),
        "residual": energy.residual,
    }


def _causes(model: Model) -> list[str]:
    """Return in words the errors and prescribed motions that act on every element."""
    prescribed = {motion.on for motion in model.motions}
    causes = []
    for element in model.elements:
        motions = [f"the motion of {name} through {element.name}" for name, _ in element.arms if name in prescribed]
        if element.errors or not motions:
            motions.append(f"the {element.error_words}")
        causes.append(" and ".join(motions))
    return causes


def _friction(energy: EnergyAudit) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """(m,) losses by friction; zero if the run did not record them."""
    return energy.friction_loss if energy.friction_loss.size else np.zeros(energy.element_loss.size)
