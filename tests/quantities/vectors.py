"""One motion or recording a metric, whose every value is known by hand.

The plate is that of ``tests.signals.handmade``: a driver of 2 kg m^2 on a spring to ground, a loose gear of 0.5 kg m^2
with 3 N m of drag, radii 0.06 and 0.02 m, Omega = 2 pi rad/s, T = 1 s. 64 samples a period.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from gearrattle.engine.system.energy_audit import EnergyAudit
from gearrattle.quantities.contact import ContactSides
from gearrattle.quantities.force import ForceStatistics
from gearrattle.quantities.impact_energy import ContactWork, ImpactLoss
from gearrattle.quantities.intensity import ImpactIntensity
from gearrattle.quantities.irregularity import SpeedIrregularity
from gearrattle.quantities.loose_motion import LooseMotion
from gearrattle.quantities.metric_inputs import Inputs
from gearrattle.quantities.metric_sources import inputs_of_motion, inputs_of_recording
from gearrattle.quantities.quantity import Quantity
from gearrattle.quantities.rattle_level import RattleLevel
from gearrattle.quantities.separation import HarmonicSeparation, SeparationRatio
from gearrattle.quantities.transmissibility import OrderTransmissibility
from gearrattle.recording import Channel, Recording
from gearrattle.trajectory import Array, Layout, Trajectory
from tests.signals.handmade import OMEGA, Row, layout, sine, still, trajectory

MASS = 1.0 / 0.0026  # 1 / (0.06^2 / 2 + 0.02^2 / 0.5)
ROWS: list[Row] = [
    (0.25, 0, 0, 1, 0.5, 0.0),
    (0.75, 0, 1, 0, -0.4, 3.0),
    (1.50, 0, 0, -1, -0.7, 3.0),
    (1.75, 0, -1, 0, 0.6, 1.0),
    (2.00, 0, 0, -1, -0.2, 1.0),
    (2.25, 0, -1, 0, 0.1, 0.5),
]
"""Drive, coast, coast: 0.5 s of 4 s on the drive side, 0.5 s on the coast side."""
PUSHED = MASS * (0.9 + 1.3 + 0.3)
TAKEN = 0.5 * MASS * (0.25 - 0.16 + 0.49 - 0.36 + 0.04 - 0.01)


@dataclass(frozen=True)
class Vector:
    """The inputs, and what a metric must give for them by (subject, quantity)."""

    metric: Quantity[Inputs]
    inputs: Inputs
    known: dict[tuple[str, str], float]


def inputs(motion: Trajectory, *orders: float) -> Inputs:
    return inputs_of_motion(motion, np.array(orders or (1.0,)))


def _audited() -> Trajectory:
    audit = EnergyAudit(np.zeros(2), np.zeros(2), np.zeros(2), np.array([1.0, 6.0]), (0.0, 0.0))
    return trajectory(rows=ROWS, energy=audit)


Terms = tuple[tuple[float, float, float], ...]


def moving(driver: Terms, loose: Terms = (), plate: Layout | None = None) -> Inputs:
    """Return a motion of both bodies by amplitude, order and phase of the acceleration's sines."""
    motion = trajectory(plate)
    columns = np.zeros((2, 3, motion.time.size))
    for body, terms in enumerate((driver, loose)):
        for amplitude, order, phase in terms:
            turn = order * OMEGA * motion.time + phase
            rate = order * OMEGA
            columns[body] += amplitude * np.array([-np.sin(turn) / rate**2, -np.cos(turn) / rate, np.sin(turn)])
    angle, velocity, acceleration = np.stack(columns, axis=-1)
    return inputs(replace(motion, angle=angle, velocity=velocity, acceleration=acceleration))


def rig(values: Array, quantity: str, subject: str, unit: str, period: float = 1.0) -> Recording:
    time = np.arange(values.size) * (period / 64)
    return Recording(time, (Channel("one", quantity, subject, unit, values),), "by hand")


def _sine_force() -> Inputs:
    time = np.arange(257) / 64
    return inputs_of_recording(rig(sine(7.0)(time), "force", "gear", "N"), layout(), OMEGA, ())


def _deflection() -> Inputs:
    """2 s: 16 samples at 0, 32 at 2 (drive), 16 at 0, 16 at -2 (coast), 16 at 0, 16 at -2, 16 at 0; the end at 0."""
    steps = [(16, 0.0), (32, 2.0), (16, 0.0), (16, -2.0), (16, 0.0), (16, -2.0), (17, 0.0)]
    values = np.concatenate([np.full(count, value) for count, value in steps])
    return inputs_of_recording(rig(values, "deflection", "gear", "m"), layout(), OMEGA, ())


_DRIVEN = inputs(trajectory(accelerations=(sine(12.0), still)))
_TWO = moving(((12.0, 1.0, 0.0), (4.0, 2.0, 0.7)), plate=layout(orders=np.array([1.0, 2.0])))
_RINGING = inputs(trajectory(accelerations=(still, lambda t: 9.0 + sine(3.0)(t) + sine(2.0, 5.0)(t))))
_GEAR, _LOOSE = "gear", "loose"

VECTORS: tuple[Vector, ...] = (
    Vector(
        SeparationRatio(),
        _DRIVEN,
        {  # 0.5 x 3 x 12 / 3
            (_GEAR, "separation ratio"): 6.0,
            (_GEAR, "separation margin"): 20.0 * math.log10(6.0),
        },
    ),
    Vector(
        HarmonicSeparation(),
        _TWO,
        {
            (_GEAR, "separation ratio at order 1"): 6.0,
            (_GEAR, "separation ratio at order 2"): 2.0,
            (_GEAR, "largest separation ratio of an order"): 6.0,
        },
    ),
    Vector(
        ImpactIntensity(),
        inputs(trajectory(rows=ROWS)),
        {
            (_GEAR, "mean restitution"): (0.4 / 0.5 + 0.6 / 0.7 + 0.1 / 0.2) / 3.0,
            (_GEAR, "mean impact intensity"): PUSHED / 4.0,
        },
    ),
    Vector(
        ImpactLoss(),
        inputs(trajectory(rows=ROWS)),
        {
            (_GEAR, "impact loss rate"): TAKEN / 4.0,
            (_GEAR, "mean loss of an impact"): TAKEN / 3.0,
        },
    ),
    Vector(ContactWork(), inputs(_audited()), {(_GEAR, "contact work rate"): 6.0 / 4.0}),
    Vector(
        RattleLevel(40.0, 2.0),
        inputs(trajectory(rows=ROWS)),
        {
            (_GEAR, "rattle level"): 10.0 * math.log10(1e4 + 2.0 * PUSHED / 4.0),
            ("all meshes", "rattle level of all meshes"): 10.0 * math.log10(1e4 + 2.0 * PUSHED / 4.0),
        },
    ),
    Vector(
        ForceStatistics(),
        _sine_force(),
        {
            (_GEAR, "force standard deviation"): 7.0 / math.sqrt(2.0),
            (_GEAR, "force crest factor"): math.sqrt(2.0),
            (_GEAR, "force kurtosis"): 1.5,
        },
    ),
    Vector(
        ForceStatistics(),
        inputs_of_recording(rig(np.arange(101.0), "force", "gear", "N"), None, None, ()),
        {
            (_GEAR, "force exceeded 5 % of the time"): 0.95 * 99.0,
            (_GEAR, "force standard deviation"): math.sqrt(833.5),  # integral 3333.5 - 2500 of the trapezoids
        },
    ),
    Vector(
        LooseMotion(),
        _RINGING,
        {
            (_LOOSE, "rms acceleration"): math.sqrt(6.5),
            (_LOOSE, "peak acceleration"): 5.0,
            (_LOOSE, "rms acceleration above the engine orders"): math.sqrt(2.0),
            (_LOOSE, "peak acceleration above the engine orders"): 2.0,
        },
    ),
    Vector(
        ContactSides(),
        inputs(trajectory(rows=ROWS)),
        {
            (_GEAR, "drive-side share"): 0.125,
            (_GEAR, "coast-side share"): 0.125,
            (_GEAR, "free share"): 0.75,
            (_GEAR, "single-sided impacts per cycle"): 0.5,
            (_GEAR, "double-sided impacts per cycle"): 0.25,
        },
    ),
    Vector(
        ContactSides(),
        _deflection(),
        {
            (_GEAR, "drive-side share"): 0.25,
            (_GEAR, "coast-side share"): 0.25,
            (_GEAR, "free share"): 0.5,
            (_GEAR, "single-sided impacts per cycle"): 1.0,
            (_GEAR, "double-sided impacts per cycle"): 0.5,
        },
    ),
    Vector(
        OrderTransmissibility(),
        moving(((4.0, 1.0, 0.3),), ((1.0, 1.0, 0.0), (5.0, 3.0, 1.0))),
        {
            (_LOOSE, "transmissibility at order 1"): 0.25,
        },
    ),
    Vector(
        SpeedIrregularity(),
        moving(((0.1 * OMEGA, 1.0, 0.0),), ((0.3 * OMEGA, 1.0, 0.4), (0.5, 2.0, 0.1))),
        {
            ("driver", "irregularity"): 0.2 / OMEGA,
            ("driver", "peak-to-peak speed"): 0.2,
            (_LOOSE, "peak-to-peak speed at order 1"): 0.6,
        },
    ),
)
