"""Tables of motions that repeat: multipliers, impacts in their order, the state, several motions side by side."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gearrattle.model.path_labels import path_label
from gearrattle.orbits import Orbit
from gearrattle.report.plots.corner_marks import units_of
from gearrattle.report.plots.numerals import engineering_column, numeral, quantity
from gearrattle.report.tables import Table
from gearrattle.signals import Impacts, by_parts, find_impacts, parts_of
from gearrattle.wording import counted

_NOTHING = 1e-12
"""A multiplier with a smaller modulus is zero up to rounding: its disturbance vanishes within one period."""
_ONE = 1e-9
RATTLE = {
    "quiet": "no rattle",
    "touches": "touches, no rattle",
    "single-sided": "single-sided rattle",
    "double-sided": "double-sided rattle",
}


def unit_of(orbit: Orbit, unit: str) -> str:
    """Return a unit of SI, empty for a dimensionless model."""
    return unit if orbit.model.units == "SI" else ""


def multiplier_table(orbit: Orbit) -> Table:
    """Return a row for every multiplier: its value, and whether its disturbance grows or decays."""
    rows = []
    for value in orbit.multipliers.tolist():
        size = abs(value)
        angle = "–" if size < _NOTHING else f"{numeral(math.degrees(math.atan2(value.imag, value.real)), 4)}°"
        rows.append((_modulus(size), angle, lasting(size, orbit.cycles)))
    note = (
        f"A small disturbance is multiplied by these every {f'{orbit.cycles} ' if orbit.cycles > 1 else ''}T. "
        "An argument of 180° means that it changes its side from one passage to the next."
    )
    if exactly_one := len(orbit.multipliers) - len(orbit.own_multipliers):
        are = "is" if exactly_one == 1 else "are"
        note += (
            f" {counted(exactly_one, 'multiplier')} {are} exactly 1, for a free state or a train that turns as a "
            "whole, and not counted in the largest modulus."
        )
    return Table(("modulus", "argument", "a disturbance is"), tuple(rows), frozenset({2}), "Multipliers", note)


def lasting(size: float, cycles: int) -> str:
    """Return a text on the number of periods T after which a disturbance is halved or doubled.

    ``size`` is the modulus of its multiplier over ``cycles`` periods T.
    """
    if size < _NOTHING:
        return "gone at once"
    if abs(size - 1.0) < _ONE:
        return "kept"
    word = "halved" if size < 1.0 else "doubled"
    return f"{word} after {numeral(cycles * math.log(2.0) / abs(math.log(size)), 3)} T"


def _modulus(size: float) -> str:
    return "0" if size < _NOTHING else numeral(size, 6)


def impacts_of(orbit: Orbit) -> Impacts:
    """Return the impacts of one period of the motion, in their order."""
    return find_impacts(by_parts(orbit.run.trajectory))


def impacts_table(orbit: Orbit) -> Table:
    """Return a row for every impact, in their order."""
    impacts = impacts_of(orbit)
    layout = parts_of(orbit.run.trajectory.layout)
    speed, energy = ([""] * len(impacts) for _ in range(2))
    for k in range(len(layout.clearance_names)):  # one unit for all impacts of a clearance
        own = np.flatnonzero(impacts.clearance == k)
        unit = units_of(orbit.model, layout, k)
        of_own = (np.abs(impacts.velocity[own]), unit["rate"]), (impacts.energy[own], unit["energy"])
        for cells, (values, of_value) in zip((speed, energy), of_own, strict=True):
            for i, text in zip(own, engineering_column(values.tolist(), of_value, 4), strict=True):
                cells[i] = text
    rows = tuple(
        (numeral(time / layout.period, 5), layout.clearance_names[k], "drive" if drive else "coast", *sizes)
        for time, k, drive, *sizes in zip(
            impacts.time.tolist(), impacts.clearance.tolist(), impacts.drive.tolist(), speed, energy, strict=True
        )
    )
    head = ("time [T]", "clearance", "side", "approach speed", "impact energy")
    return Table(head, rows, frozenset({1, 2}), "Impacts in their order")


def family_table(orbit: Orbit) -> Table:
    """Return a row for every free state of a motion that is one of a family, with the values that it may take."""
    rows = []
    for free in orbit.family:
        unit = path_label(free.name, orbit.model).unit or unit_of(orbit, "rad")  # rad for a slider
        rows.append((free.name, *engineering_column((free.low, free.value, free.high), unit, 6)))
    note = "In this range neighbouring motions repeat as well, with the same impacts."
    return Table(("free state", "from", "here", "to"), tuple(rows), frozenset({0}), "Family", note)


def state_table(orbit: Orbit) -> Table:
    """Return angles and velocities at the start of a period."""
    names = [inertia.name for inertia in orbit.model.inertias]
    rows = tuple(
        (name, numeral(angle, 8), numeral(velocity, 8))
        for name, angle, velocity in zip(names, orbit.state["angle"], orbit.state["velocity"], strict=True)
    )
    angle_unit = unit_of(orbit, "rad")
    rate_unit = unit_of(orbit, "rad/s")
    head = (
        ("inertia", f"angle [{angle_unit}]", f"velocity [{rate_unit}]")
        if angle_unit
        else ("inertia", "angle", "velocity")
    )
    note = "At t = 0. A model file saved from this result (.toml) begins its simulation here."
    if orbit.period_map.system.memories:
        note += " It begins with all sliders unloaded: it comes to this motion, if that is stable, after some periods."
    return Table(head, rows, frozenset({0}), "State at the start of a period", note)


def swing(orbit: Orbit, clearance: int) -> float:
    """Return the peak-to-peak deflection of a clearance in the motion."""
    return float(np.ptp(orbit.run.trajectory.deflection[:, clearance]))


def motions_table(orbits: Sequence[Orbit]) -> Table:
    """Return a row for every motion, with the peak-to-peak deflection of its clearances."""
    if not orbits:
        return Table(("motion",), ())
    layout = orbits[0].run.trajectory.layout
    shown = layout.clearance_names[:4]
    swings = [
        engineering_column((swing(orbit, k) for orbit in orbits), units_of(orbits[0].model, layout, k)["deflection"], 4)
        for k in range(len(shown))
    ]
    head = ("motion", "repeats after", "", "severity", "regime", "impacts", "first at [T]", "largest modulus")
    rows = [
        (
            f"{number}",
            f"{orbit.cycles} T",
            "stable" if orbit.stable else "unstable",
            orbit.verdict.severity,
            orbit.verdict.verdict,
            f"{len(impacts_of(orbit))}",
            _first_impact(orbit),
            quantity(orbit.largest_modulus, "", 5),
            *own,
        )
        for number, (orbit, *own) in enumerate(zip(orbits, *swings, strict=True), 1)
    ]
    return Table((*head, *(f"swing of {name}" for name in shown)), tuple(rows), frozenset({2, 3, 4}))


def _first_impact(orbit: Orbit) -> str:
    """Return the time of the first impact, which distinguishes copies of one motion that are shifted in time."""
    time = impacts_of(orbit).time
    return numeral(float(time[0]) / orbit.run.trajectory.layout.period, 4) if time.size else "–"
