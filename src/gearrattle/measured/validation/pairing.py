"""Pairs of measured and simulated channels: by quantity and subject, or by given names.

A channel whose subject is not said is that of the body or element whose name it has.

A speed of a body is its velocity with the mean rotation: it has the simulated velocity as partner, and is compared
without its mean, unless the velocity itself was measured.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from gearrattle.errors import ModelError, Problem
from gearrattle.model.table import listed
from gearrattle.recording import Channel, Recording


@dataclass(frozen=True)
class Pairing:
    """Channels with partners, and names of those without.

    A simulated one is named only where nothing else of its subject or quantity was measured either.
    """

    measured: tuple[Channel, ...]
    simulated: tuple[Channel, ...]
    measured_alone: tuple[str, ...]
    simulated_alone: tuple[str, ...]
    notes: tuple[str, ...]


def paired(measured: Recording, simulated: Recording, match: Mapping[str, str]) -> Pairing:
    """Return the pairs; ModelError for a name that is not there, no pair at all, or units that differ."""
    # pairs stated by name
    problems = [
        Problem("match", name, f"is no channel of {recording.source}; there are {listed(recording.names)}")
        for recording, names in ((measured, match.keys()), (simulated, match.values()))
        for name in names
        if name not in recording.names
    ]
    if problems:
        raise ModelError(problems)
    pairs: list[tuple[Channel, Channel]] = [(measured[one], simulated[other]) for one, other in match.items()]
    # pairs by quantity and subject; a velocity comes before a speed
    notes = []
    for channel in sorted(measured.channels, key=lambda channel: channel.quantity == "speed"):
        if channel.name in match or not channel.quantity:
            continue
        quantity = "velocity" if channel.quantity == "speed" else channel.quantity
        partner = simulated.find(quantity, channel.subject or channel.name)
        if partner is None:
            continue
        if not channel.subject:
            notes.append(f"{channel.name}: taken for {partner.name} by its name")
        taken = [one.name for one, other in pairs if other is partner]
        if taken:
            notes.append(f"{channel.name}: {partner.name} is compared with {taken[0]} already; left out")
            continue
        pairs.append((channel, partner))
    # refuse no pair at all, and units that do not agree
    if not pairs:
        raise ModelError(_nothing(measured, simulated))
    wrong = [_unit(one, other, measured.source) for one, other in pairs if other.unit not in one.unit.split(" or ")]
    if wrong:
        raise ModelError(wrong)
    # a speed is compared without its mean; channels without partner
    pairs = [(_like(replace(one, unit=other.unit), other, notes), other) for one, other in pairs]
    with_partner = {one.name for one, _ in pairs}, {other.name for _, other in pairs}
    alone = tuple(name for name in measured.names if name not in with_partner[0])
    other_alone = tuple(name for name in simulated.names if name not in with_partner[1])
    ones, others = zip(*pairs, strict=True)
    return Pairing(ones, others, alone, other_alone, tuple(notes))


def _like(one: Channel, other: Channel, notes: list[str]) -> Channel:
    """Return a measured channel without its mean rotation where it is a speed and its partner a velocity; note it."""
    if (one.quantity, other.quantity) != ("speed", "velocity"):
        return one
    mean = float(one.values.mean())
    notes.append(f"{one.name}: a speed, compared with {other.name} without its mean, {mean:.6g} {one.unit}")
    return replace(one, quantity="velocity", values=one.values - mean)


def _nothing(measured: Recording, simulated: Recording) -> Problem:
    descriptions = [
        f"{c.name} ({c.quantity or 'quantity unknown'} of {c.subject or 'an unknown subject'})"
        for c in measured.channels
    ]
    rule = f"has no channel in common with the simulation, which has {listed(simulated.names)}"
    remedy = "name partners with match, or write a mapping that says quantity and of"
    return Problem(
        measured.source, ", ".join(descriptions[:6]) + (", ..." if len(descriptions) > 6 else ""), rule, remedy
    )


def _unit(one: Channel, other: Channel, source: str) -> Problem:
    if other.unit == "1":
        remedy = "the model has no units: gr.nondimensionalize(...).restore(run) gives them back"
    else:
        remedy = "a mapping names quantity, unit and scale"
    return Problem(f"{source}: {one.name}", f'unit "{one.unit}"', f'{other.name} has "{other.unit}"', remedy)
