"""What drives a driveline: the reference speed, torques and harmonics.

``T(t) = mean + sum_j amplitude_j sin(order_j Omega t + phase_j)``, eqs. (20)-(22) of Padmanabhan et al. (1995); the
orders refer to ``Omega``, the mean speed of the reference shaft.

Takes value kinds from ``quantity``; gives the nouns of a ``Model``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar

from pydantic import PrivateAttr

from gearrattle.model import units
from gearrattle.model.over_speed import OverSpeed
from gearrattle.model.quantity import Name, Order, Quantity
from gearrattle.model.table import Breach, Table


class Harmonic(Table):
    """One sine of a transmission error: ``amplitude sin(order Omega t + phase)``."""

    order: Order
    """Multiple of the reference speed; need not be whole."""
    amplitude: Annotated[float, Quantity(units.LENGTH)]
    """Amplitude [m]; of a torque's harmonic [N m]."""
    phase: Annotated[float, Quantity(units.ANGLE)] = 0.0
    """Phase of the sine [rad]."""


class TorqueHarmonic(Harmonic):
    """One sine of a torque; its amplitude is a torque."""

    amplitude: Annotated[float, OverSpeed(units.TORQUE)]
    """Amplitude [N m]; may be a table over speed."""


class Torque(Table):
    """An applied torque on one inertia."""

    later: ClassVar[frozenset[str]] = frozenset({"signal"})

    on: Name
    """Name of the inertia it acts on."""
    mean: Annotated[float, OverSpeed(units.TORQUE)] = 0.0
    """Mean torque [N m]; may be a table over speed."""
    harmonics: tuple[TorqueHarmonic, ...] = ()
    """Its sines."""


class Excitation(Table):
    """The reference speed, which fixes the period; exactly one of ``speed`` and ``frequency``."""

    speed: Annotated[float, Quantity(units.ANGULAR_VELOCITY, "positive")] | None = None
    """Mean speed of the reference shaft [rad/s]."""
    frequency: Annotated[float, Quantity(units.FREQUENCY, "positive")] | None = None
    """The same as a frequency [Hz]; in a dimensionless model Omega itself."""
    _dimensionless: bool = PrivateAttr(default=False)

    @property
    def omega(self) -> float:
        """Reference speed Omega [rad/s]; dimensionless in a dimensionless model."""
        if self.speed is not None:
            return self.speed
        frequency = self.frequency or 0.0
        return frequency if self._dimensionless else 2.0 * math.pi * frequency

    def without_units(self) -> Excitation:
        """Return the same table read as part of a dimensionless model."""
        other = self.model_copy()
        other._dimensionless = True
        return other

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: both or none of speed and frequency."""
        given = [key for key in ("speed", "frequency") if table.get(key) is not None]
        if len(given) == 2:
            rule = "speed and frequency exclude each other: give one of them"
            yield Breach(("frequency",), table["frequency"], rule, "remove one")
        if not given and not {"speed", "frequency"} & set(table):
            yield Breach((), ..., "needs speed or frequency: it fixes the period", 'such as speed = "1500 rpm"')
