"""Running a driveline written in decimals, and rewriting it: the two verbs of every law."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np

import gearrattle as gr
from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Mesh, Stage, Torque


def simulate(model: Driveline, cycles: int, samples_per_cycle: int = 24, **settings) -> gr.Run:
    """Run a driveline with the exact algorithm unless told otherwise."""
    settings = {"algorithm": "exact", "discard": 0, **settings}
    return gr.simulate(gr.loads(model.toml()), cycles=cycles, samples_per_cycle=samples_per_cycle, **settings)


def crossings(run: gr.Run, clearance: str) -> list[tuple[int, int]]:
    """Return the region changes of one clearance."""
    rows = run.events[run.events["clearance"] == clearance]
    return [(int(a), int(b)) for a, b in zip(rows["from_region"], rows["to_region"], strict=True)]


def times(run: gr.Run, clearance: str) -> np.ndarray:
    """Return the crossing times of one clearance."""
    return run.events.loc[run.events["clearance"] == clearance, "time"].to_numpy()


def scale_of(values: np.ndarray) -> np.ndarray:
    """Return the largest size of every column, 1 where it is zero."""
    size = np.abs(values).max(axis=0)
    return np.where(size > 0, size, 1.0)


def times_power_of_ten(number: str, power: int) -> str:
    """Return number x 10^power as a decimal, without rounding."""
    return f"{number if '.' in number or 'e' in number else number + '.0'}" if power == 0 else _decimal(number, power)


def _decimal(number: str, power: int) -> str:
    value = Fraction(number) * Fraction(10) ** power
    digits, exponent = value, 0
    while digits.denominator != 1:
        digits, exponent = digits * 10, exponent - 1
    return f"{digits.numerator}.0e{exponent}" if exponent >= 0 else f"{digits.numerator}e{exponent}"


def rescale(model: Driveline, angle: int, time: int, torque: int) -> Driveline:
    """Return the model measured in units that make angles, times and torques 10^power times their number.

    A stiffness then counts torque/angle, a damping torque time/angle, an inertia torque time^2/angle; lengths on a
    line of action go with the angle (radii keep their numbers).
    """

    def stages(parts: tuple[Stage, ...] | None) -> tuple[Stage, ...] | None:
        if parts is None:
            return None
        return tuple(
            Stage(
                _decimal(s.stiffness, torque - angle),
                _decimal(s.damping, torque + time - angle),
                None if s.until is None else _decimal(s.until, angle),
            )
            for s in parts
        )

    def waves(parts: tuple[Harmonic, ...], power: int) -> tuple[Harmonic, ...]:
        return tuple(replace(h, amplitude=_decimal(h.amplitude, power)) for h in parts)

    return replace(
        model,
        bodies=tuple(
            Body(
                b.name,
                _decimal(b.J, torque + 2 * time - angle),
                _decimal(b.drag, torque + time - angle),
                _decimal(b.drag_torque, torque),
            )
            for b in model.bodies
        ),
        couplings=tuple(
            replace(
                c,
                stiffness=_decimal(c.stiffness, torque - angle),
                damping=_decimal(c.damping, torque + time - angle),
                clearance=None if c.clearance is None else _decimal(c.clearance, angle),
                stages=stages(c.stages),
                coast_stages=stages(c.coast_stages),
                preload=_decimal(c.preload, torque),
            )
            for c in model.couplings
        ),
        meshes=tuple(
            replace(
                m,
                stiffness=_decimal(m.stiffness, torque - angle),
                damping=_decimal(m.damping, torque + time - angle),
                backlash=None if m.backlash is None else _decimal(m.backlash, angle),
                error=waves(m.error, angle),
            )
            for m in model.meshes
        ),
        torques=tuple(Torque(t.on, _decimal(t.mean, torque), waves(t.harmonics, torque)) for t in model.torques),
        speed=_decimal(model.speed, -time),
        angle=None if model.angle is None else tuple(_decimal(x, angle) for x in model.angle),
        velocity=None if model.velocity is None else tuple(_decimal(x, angle - time) for x in model.velocity),
    )


def reorder(model: Driveline, bodies: list[int]) -> Driveline:
    """Return the same driveline with its inertias listed in another order."""
    return replace(
        model,
        bodies=tuple(model.bodies[i] for i in bodies),
        angle=None if model.angle is None else tuple(model.angle[i] for i in bodies),
        velocity=None if model.velocity is None else tuple(model.velocity[i] for i in bodies),
    )


def negate(number: str) -> str:
    """Return -number."""
    return number[1:] if number.startswith("-") else f"-{number}"


def mirror(model: Driveline) -> Driveline:
    """Return the driveline turning the other way: loads and angles negated, drive and coast sides exchanged."""

    def waves(parts: tuple[Harmonic, ...]) -> tuple[Harmonic, ...]:
        return tuple(replace(h, amplitude=negate(h.amplitude)) for h in parts)

    torques = [Torque(t.on, negate(t.mean), waves(t.harmonics)) for t in model.torques]
    torques += [Torque(b.name, b.drag_torque) for b in model.bodies if float(b.drag_torque)]
    return replace(
        model,
        bodies=tuple(replace(b, drag_torque="0.0") for b in model.bodies),
        couplings=tuple(
            replace(c, stages=c.coast_stages or c.stages, coast_stages=c.stages, preload=negate(c.preload))
            for c in model.couplings
        ),
        meshes=tuple(replace(m, error=waves(m.error)) for m in model.meshes),
        torques=tuple(torques),
        angle=None if model.angle is None else tuple(negate(x) for x in model.angle),
        velocity=None if model.velocity is None else tuple(negate(x) for x in model.velocity),
    )


def shift_time(model: Driveline, seconds: float, angle: np.ndarray, velocity: np.ndarray) -> Driveline:
    """Return the driveline seen from ``seconds`` on, started from the state reached there."""

    def waves(parts: tuple[Harmonic, ...]) -> tuple[Harmonic, ...]:
        return tuple(
            replace(h, phase=repr(float(h.phase) + float(h.order) * float(model.speed) * seconds)) for h in parts
        )

    return replace(
        model,
        meshes=tuple(replace(m, error=waves(m.error)) for m in model.meshes),
        torques=tuple(Torque(t.on, t.mean, waves(t.harmonics)) for t in model.torques),
        angle=tuple(repr(float(x)) for x in angle),
        velocity=tuple(repr(float(x)) for x in velocity),
    )


def elements_of(model: Driveline) -> tuple[Coupling | Mesh, ...]:
    """Return all elements in file order."""
    return model.elements
