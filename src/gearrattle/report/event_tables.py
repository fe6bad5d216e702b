"""Tiles and tables of a transient: first and hardest impact, peak torques."""

from __future__ import annotations

from gearrattle.quantities.event import Event
from gearrattle.quantities.verdict import Verdict
from gearrattle.report.plots.numerals import engineering
from gearrattle.report.tables import Table, Tile

EVENT_HEADLINES = {
    "quiet": "No impact",
    "touches": "Touches only",
    "single-sided": "Impacts on one side",
    "double-sided": "Impacts on both sides",
}


def event_tiles(event: Event) -> list[Tile]:
    """Return the most important numbers of an event."""
    second, joule, torque = ("s", "J", "N m") if event.is_si else ("", "", "")
    tiles = []
    if event.hardest is not None and event.first_impact is not None:
        hardest = event.hardest
        location = f"{hardest.part} · at {engineering(hardest.time, second, 4)}"
        last = "" if event.last_impact is None else f"the last at {engineering(event.last_impact, second, 4)}"
        tiles.append(Tile("First impact", engineering(event.first_impact, second, 4), "of any gap"))
        tiles.append(Tile("Hardest impact", engineering(hardest.energy, joule), location))
        tiles.append(Tile("Impacts", f"{event.impacts}", last or "none that counts"))
    largest = max(event.peak_torque.items(), key=lambda item: abs(item[1].value), default=None)
    if largest is not None:
        name, peak = largest
        location = f"{name} · at {engineering(peak.time, second, 4)}"
        tiles.append(Tile("Peak torque", engineering(peak.value, torque), location))
    return tiles


def event_parts(verdict: Verdict) -> Table:
    """Return one row for every mesh and clearance, worst first, with number and hardness of its impacts."""
    rows = tuple(
        (
            part.name,
            part.severity,
            part.regime,
            f"{round(part.impacts_per_cycle * verdict.window.cycles)}",
            engineering(part.max_approach_speed, part.speed_unit),
            engineering(part.max_impact_energy, part.energy_unit),
            engineering(part.max_impact_momentum, part.impulse_unit),
        )
        for part in verdict.parts
    )
    head = ("part", "severity", "regime", "impacts", "approach speed", "impact energy", "momentum")
    return Table(head, rows, frozenset({0, 1, 2}))


def peak_torques(event: Event) -> Table:
    """Return one row for every element with its largest torque and the time of it."""
    second, torque = ("s", "N m") if event.is_si else ("", "")
    rows = tuple(
        (name, engineering(peak.value, torque), engineering(peak.time, second, 4))
        for name, peak in event.peak_torque.items()
    )
    settled = "not within the run" if event.settled is None else f"from {engineering(event.settled, second, 4)} on"
    note = f"At the first end of each. Torques stay within 5 % of their largest change about the last cycle {settled}."
    return Table(("element", "peak torque", "time"), rows, frozenset({0}), title="Peak torques", note=note)
