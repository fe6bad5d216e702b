"""Variables of a driveline in an FMU: names, units and descriptions, and where each is in a co-simulation.

Names follow the structured convention of FMI: ``velocity.flywheel``; a part that is no identifier stands in quotes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal

from gearrattle.model import Model
from gearrattle.model.path_labels import path_label
from gearrattle.simulation.co_simulation import CoSimulation
from gearrattle.simulation.co_simulation_ports import Ports
from gearrattle.trajectory import Layout

_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
Causality = Literal["input", "output", "parameter"]

UNITS = {
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s2": {"rad": 1, "s": -2},
    "m": {"m": 1},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "N.m/s": {"kg": 1, "m": 2, "s": -3},
    "J": {"kg": 1, "m": 2, "s": -2},
}
"""Units of variables, and their exponents of base units."""


@dataclass(frozen=True)
class Variable:
    """One variable of an FMU.

    Attributes
    ----------
    unit
        one of ``UNITS``; empty without one.
    words
        what it is.
    source
        in a co-simulation: the channel and 0 or 1, for value or rate, of an input; the path of a parameter; field of
        ``Now`` and index of an output, or "energy_residual".
    """

    name: str
    causality: Causality
    unit: str
    words: str
    source: tuple[Any, ...]
    is_whole: bool = False


def variables_of(motion: CoSimulation) -> tuple[Variable, ...]:
    """Return all variables of a co-simulation: inputs, then parameters, then outputs."""
    model = motion.original
    every = (
        *_inputs(motion.ports),
        *_parameters(model, motion.ports),
        *_of_bodies(motion.layout),
        *_of_elements(motion.layout),
    )
    if motion.audit:
        words = "energy that the balance of all works and losses since the start does not explain, over their sum"
        every = (*every, Variable("energy_residual", "output", "", words, ("energy_residual",)))
    return every if model.units == "SI" else tuple(replace(variable, unit="") for variable in every)


def structured(name: str) -> str:
    """Return a name in parts, those in quotes that are no identifiers."""
    return ".".join(part if _IDENTIFIER.fullmatch(part) else f"'{part}'" for part in name.split("."))


def _inputs(ports: Ports) -> Iterator[Variable]:
    for c, body in enumerate(ports.torques):
        words = f"torque on {body}, beside those of the model"
        yield Variable(structured(f"torque.{body}"), "input", "N.m", words, (c, 0))
        words = f"rate of the torque on {body}: it is a straight line within a step"
        yield Variable(structured(f"torque_rate.{body}"), "input", "N.m/s", words, (c, 1))
    for c, body in enumerate(ports.speeds, len(ports.torques)):
        words = f"speed of {body} about uniform rotation"
        yield Variable(structured(f"speed.{body}"), "input", "rad/s", words, (c, 0))
        words = f"rate of the speed of {body}: value + rate h is reached at the end of a step h"
        yield Variable(structured(f"speed_rate.{body}"), "input", "rad/s2", words, (c, 1))


def _parameters(model: Model, ports: Ports) -> Iterator[Variable]:
    for path in ports.paths:
        label = path_label(path, model)
        words = f"{label.words} [{label.unit}]" if label.unit else label.words
        yield Variable(structured(path), "parameter", "", words, (path,))


def _of_bodies(layout: Layout) -> Iterator[Variable]:
    kinds = (("angle", "rad"), ("velocity", "rad/s"), ("acceleration", "rad/s2"))
    for i, body in enumerate(layout.inertia_names):
        for kind, unit in kinds:
            yield Variable(structured(f"{kind}.{body}"), "output", unit, f"{kind} of {body}", (kind, i))
    for i, direction in enumerate(layout.direction_names):
        words = f"displacement of {direction}"
        yield Variable(structured(f"displacement.{direction}"), "output", "m", words, ("displacement", i))


def _of_elements(layout: Layout) -> Iterator[Variable]:
    for i, element in enumerate(layout.element_names):
        words = f"torque of {element} on its first inertia, with the sign of the deflection"
        yield Variable(structured(f"element_torque.{element}"), "output", "N.m", words, ("element_torque", i))
    for i, (clearance, index) in enumerate(zip(layout.clearance_names, layout.clearance.tolist(), strict=True)):
        unit = "m" if layout.is_mesh[index] else "rad"
        words = f"deflection of {clearance}"
        yield Variable(structured(f"deflection.{clearance}"), "output", unit, words, ("deflection", i))
        whole = {
            "region": f"stage of {clearance}: 0 the centre, 1, 2 ... on the drive side, -1, -2 ... on the coast side",
            "regime": f"sides on which {clearance} crossed corners in this period or the last: 0 quiet, 1, 2",
            "impacts": f"impacts of {clearance} since the start, without touches",
        }
        for kind, words in whole.items():
            yield Variable(structured(f"{kind}.{clearance}"), "output", "", words, (kind, i), is_whole=True)
        words = f"sum of the energies of these impacts of {clearance}"
        yield Variable(structured(f"impact_energy.{clearance}"), "output", "J", words, ("impact_energy", i))
