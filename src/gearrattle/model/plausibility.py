"""Values that no driveline is likely to have: a forgotten unit, millimetres taken as metres, degrees as radians.

A model file takes any number of the right sign. ``RANGES`` says, kind by kind of value, between which ends the parts of
real machines lie, from watches to ships, with a wide margin, and what a value beyond them mostly comes from. A value
outside gets a note; it is never refused. A dimensionless model has no such ranges.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from gearrattle.model.balance import BALANCE
from gearrattle.model.components.component import Element
from gearrattle.model.model import Model
from gearrattle.wording import engineering, quantity


class Range(NamedTuple):
    """Range in which a kind of value lies in real machines, in SI, and the reason for its ends.

    No warning is made of zero itself.
    """

    noun: str
    unit: str
    low: float
    high: float
    reason: str


RANGES = {
    "inertia": Range(
        "moments of inertia",
        "kg m²",
        1e-10,
        2e4,
        "a watch's wheel has 1e-9, a large ship's propeller 1e4; kg cm² are 1e-4 kg m², and kg mm² 1e-6",
    ),
    "radius": Range("base radii", "m", 2e-4, 10.0, "a mill's girth gear has 5 m; a number without a unit is in metres"),
    "backlash": Range(
        "backlashes", "m", 1e-8, 0.02, "an open gear of 5 m has some mm; a number without a unit is in metres"
    ),
    "clearance": Range(
        "clearances and stages of couplings",
        "rad",
        1e-8,
        6.3,
        "one turn is 6.28 rad; a number without a unit is in radians, and one degree is 0.0175",
    ),
    "mesh stiffness": Range(
        "mesh stiffnesses",
        "N/m",
        1e3,
        1e12,
        "14e9 N/m a metre of face width, in steel; N/µm are 1e6 N/m, and N/mm 1e3",
    ),
    "bearing stiffness": Range(
        "bearing stiffnesses", "N/m", 1e4, 1e12, "a rolling bearing has 1e7 to 1e9; N/µm are 1e6 N/m, and N/mm 1e3"
    ),
    "bearing clearance": Range(
        "clearances of bearings", "m", 1e-7, 5e-3, "a ball bearing has 5 to 50 µm; a number without a unit is in metres"
    ),
    "mass": Range("masses", "kg", 1e-6, 1e5, "a large ship's propeller has 1e5; grams are 1e-3 kg"),
    "torsional stiffness": Range(
        "torsional stiffnesses", "N m/rad", 1e-6, 1e11, "a ship's shaft has 1e8; N m/deg are 57.3 N m/rad"
    ),
    "transmission error": Range(
        "transmission errors", "m", 0.0, 5e-3, "a rough gear has 0.1 mm; a number without a unit is in metres"
    ),
    "kinematic error": Range("kinematic errors", "rad", 0.0, 1.0, "a bent joint has 0.05; one degree is 0.0175 rad"),
    "torque": Range("torques", "N m", 0.0, 1e8, "a ship's propeller takes 1e7; kN m are 1e3 N m"),
    "speed": Range("speeds", "rad/s", 1e-3, 6e4, "the fastest turbochargers have 3e4; 1000 rpm are 105 rad/s"),
}
"""By kind of value."""


def plausibility_notes(model: Model) -> tuple[str, ...]:
    """Say which values of a model lie outside the ranges of real machines; nothing of a dimensionless one."""
    if model.units != "SI":
        return ()
    notes = []
    for path, kind, value in _values(model):
        known = RANGES[kind]
        if value and not known.low <= abs(value) <= known.high:
            ends = f"{quantity(known.low)} and {quantity(known.high, known.unit)}"
            notes.append(
                f"{path} is {engineering(value, known.unit, 4)}; {known.noun} lie between {ends}: {known.reason}. "
                "Is the unit right?"
            )
    return tuple(dict.fromkeys(notes))


def _values(model: Model) -> Iterator[tuple[str, str, float]]:
    """Yield the path in the file, the kind and the value of what has a range."""
    for body in model.inertias:
        yield f"inertia.{body.name}.J", "inertia", body.J
        yield f"inertia.{body.name}.drag_torque", "torque", body.drag_torque
        yield f"inertia.{body.name}.mass", "mass", body.mass or 0.0
    for element in model.elements:
        if element.radii[0] > 0.0:
            yield from _of_element(element)
    for bearing in model.bearings:
        yield f"bearing.{bearing.name}.stiffness", "bearing stiffness", bearing.stiffness
        yield f"bearing.{bearing.name}.clearance", "bearing clearance", bearing.clearance
    for i, torque in enumerate(model.torques):
        if torque.mean != BALANCE:
            yield f"torque.{i}.mean", "torque", torque.mean
        for j, harmonic in enumerate(torque.harmonics):
            yield f"torque.{i}.harmonics.{j}.amplitude", "torque", harmonic.amplitude
    yield "excitation.speed", "speed", model.excitation.omega


def _of_element(element: Element) -> Iterator[tuple[str, str, float]]:
    """Yield the radii, stages, gaps and errors of an element."""
    stiffness = "torsional stiffness"
    gap = "clearance"
    error = "kinematic error"
    if element.along_line:
        stiffness = "mesh stiffness"
        gap = "backlash"
        error = "transmission error"
        for radius in element.radii:
            yield f"{element.path}.radii", "radius", radius
    for piece in (*element.drive, *element.coast):
        yield f"{element.path}: a stiffness", stiffness, piece.stiffness
        if piece.until is not None:
            width = 2.0 * piece.until if element.along_line else piece.until
            yield f"{element.path}: its {'backlash' if element.along_line else 'clearance or stage'}", gap, width
    for harmonic in element.errors:
        yield f"{element.path}.{element.error_key or 'errors'}", error, harmonic.amplitude
