"""The torque of a four-stroke engine: gas forces from a pressure trace, and the forces of its oscillating masses.

A piston at x(phi) from top dead centre, x = r (1 - cos phi) + l (1 - sqrt(1 - lambda^2 sin^2 phi)), lambda = r / l,
turns its crank with

    T = (p - p_0) A x'  -  m Omega^2 x' x'',                                  ' = d/d phi,

(H. Maass, H. Klier, Kraefte, Momente und deren Ausgleich in der Verbrennungskraftmaschine, 1981). The gas torque has a
period of two turns, so its orders are multiples of 1/2. The torque of the masses is -d/d phi of their energy; it has
whole orders and no mean, and grows with Omega^2. The torques of the cylinders add up, shifted by their firing angles;
with even firing only multiples of half the number of cylinders remain as orders.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Self

from pydantic import model_validator

from gearrattle.model import units
from gearrattle.model.cylinder_pressure import missing, pressure_at
from gearrattle.model.signal import OverTime, Signal
from gearrattle.model.table import Breach, Table, breach
from gearrattle.model.value_kinds import Count, Quantity, value_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_LENGTH = Quantity(units.LENGTH, "positive")
CYCLE = 4.0 * math.pi
"""Crank angle of one cycle [rad]."""
_POINTS = 16384  # samples of one cycle
_NOTHING = 1e-9  # share of the number of cylinders: smaller sums of their phases are zero up to rounding


class SquareOfSpeed(float):
    """A number that grows with the square of the speed; as a float it has the value at the model's speed."""

    per_square: float

    def __new__(cls, per_square: float, speed: float) -> SquareOfSpeed:
        """Make the number: ``per_square`` times the speed squared [rad/s]."""
        made = super().__new__(cls, per_square * speed**2)
        made.per_square = per_square
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how to make an equal number, for copies and pickles."""
        return _square, (float(self), self.per_square)


def _square(value: float, per_square: float) -> SquareOfSpeed:
    made = float.__new__(SquareOfSpeed, value)
    made.per_square = per_square
    return made


class Wave(NamedTuple):
    """One harmonic ``amplitude sin(order phi + phase)`` [N m, rad]."""

    order: float
    amplitude: float
    phase: float


class Engine(Table):
    """A four-stroke engine; crank angle 0 is a top dead centre of the first cylinder."""

    cylinders: Annotated[int, Count(1, 24)]
    """Number of cylinders."""
    bore: Annotated[float, _LENGTH]
    """Diameter of a cylinder [m]."""
    stroke: Annotated[float, _LENGTH]
    """Twice the crank radius [m]."""
    rod: Annotated[float, _LENGTH]
    """Length of a connecting rod [m]."""
    mass: Annotated[float, Quantity(units.MASS, "non-negative")] = 0.0
    """Oscillating mass of one cylinder [kg]."""
    pressure: Annotated[Signal, OverTime(units.PRESSURE, key="angle", along=units.ANGLE, derivatives=0)]
    """Absolute pressure in a cylinder over one cycle, 720 deg of crank angle [Pa, rad]."""
    crankcase: Annotated[float, Quantity(units.PRESSURE, "non-negative")] = 101325.0
    """Pressure below the pistons [Pa]."""
    firing: tuple[Annotated[float, Quantity(units.ANGLE)], ...] = ()
    """Crank angle at which each cylinder is where the trace begins [rad]; left out: even intervals."""
    orders: Annotated[int, Count(1, 100)] = 12
    """The highest order of the torque."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: trace without a whole cycle, rod too short, firing angle missing, dimensionless model."""
        if dimensionless:
            yield Breach((), ..., "an engine needs units: this model is dimensionless", "give harmonics instead")
            return
        firing = table.get("firing")
        cylinders = value_of(cls, table, "cylinders", dimensionless)
        if isinstance(firing, list | tuple) and firing and cylinders not in (None, len(firing)):
            yield Breach(("firing",), firing, f"must have one angle for each of the {cylinders} cylinders")

    @model_validator(mode="after")
    def _whole(self) -> Self:
        """Refuse a trace that is not a whole cycle, and a rod too short for the crank to turn."""
        if rule := missing(self.pressure):
            raise breach(rule)
        if self.rod <= 0.5 * self.stroke:
            raise breach("the rod must be longer than half the stroke")
        return self

    @property
    def firing_angles(self) -> tuple[float, ...]:
        """For every cylinder, the crank angle at which its pressure trace begins [rad]."""
        return self.firing or tuple(k * CYCLE / self.cylinders for k in range(self.cylinders))

    def piston(self, angle: Array) -> tuple[Array, Array]:
        """First and second derivative of a piston's position by crank angle [m], at crank angles [rad]."""
        import numpy as np

        radius = 0.5 * self.stroke
        share = radius / self.rod
        sine = np.sin(angle)
        cosine = np.cos(angle)
        root = np.sqrt(1.0 - (share * sine) ** 2)
        first = radius * sine * (1.0 + share * cosine / root)
        second = radius * (cosine + share * (cosine**2 - sine**2) / root + share**3 * (sine * cosine) ** 2 / root**3)
        return first, second

    def gas_torque(self, angle: Array) -> Array:
        """Gas torque of one cylinder [N m] at its crank angles [rad]."""
        area = 0.25 * math.pi * self.bore**2
        return (pressure_at(self.pressure, angle) - self.crankcase) * area * self.piston(angle)[0]

    def mass_torque(self, angle: Array) -> Array:
        """Torque of one cylinder's oscillating mass at Omega = 1 rad/s [N m s^2]."""
        first, second = self.piston(angle)
        return -self.mass * first * second

    def mean_torque(self) -> float:
        """Mean gas torque of all cylinders [N m]: the work of a cycle over 4 pi."""
        import numpy as np

        angle = np.linspace(0.0, CYCLE, _POINTS, endpoint=False, dtype=float)
        return float(self.cylinders * self.gas_torque(angle).mean())

    def waves(self) -> tuple[tuple[Wave, ...], tuple[Wave, ...]]:
        """Harmonics of the gas torque [N m] and of the masses' torque at 1 rad/s [N m s^2], all cylinders together."""
        import numpy as np

        angle = np.linspace(0.0, CYCLE, _POINTS, endpoint=False, dtype=float)
        series = []
        for torque in (self.gas_torque(angle), self.mass_torque(angle)):
            lines = np.fft.rfft(torque) * (2.0 / _POINTS)
            largest = float(np.abs(lines).max())
            waves = []
            for k in range(1, 2 * int(self.orders) + 1):
                turned = sum(np.exp(-0.5j * k * shift) for shift in self.firing_angles)
                line = lines[k] * turned
                if abs(turned) > _NOTHING * self.cylinders and abs(lines[k]) > 1e-12 * largest:
                    waves.append(Wave(0.5 * k, float(abs(line)), float(np.angle(line) + 0.5 * np.pi)))
            series.append(tuple(waves))
        return series[0], series[1]
