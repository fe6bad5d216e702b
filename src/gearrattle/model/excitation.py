"""Excitation of a driveline: reference speed, torques and harmonics.

``T(t) = mean + sum_j amplitude_j sin(order_j Omega t + phase_j)``, eqs. (20)-(22) of Padmanabhan et al. (1995); the
orders refer to ``Omega``, the mean speed of the reference shaft.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Self

from pydantic import Field, PrivateAttr, ValidationInfo, model_validator

from gearrattle.json_types import TomlTable
from gearrattle.model import units
from gearrattle.model.balance import BALANCE, Balancing, OrBalance
from gearrattle.model.engine import Engine, SquareOfSpeed
from gearrattle.model.over_speed import OMEGA, OverSpeed
from gearrattle.model.ramps import Ramp, overlaps
from gearrattle.model.signal import OverTime, Signal
from gearrattle.model.table import Breach, Table
from gearrattle.model.table_symbol import Shown, Symbol
from gearrattle.model.value_kinds import Name, Plain, Quantity


class Harmonic(Table):
    """One sine of a transmission error: ``amplitude sin(order Omega t + phase)``."""

    order: Annotated[float, Plain("positive", "a constant error is no harmonic: leave it out")]
    """Multiple of the reference speed, above 0; need not be whole."""
    amplitude: Annotated[float, Quantity(units.LENGTH)]
    """Amplitude [m]; of a torque's harmonic [N m]."""
    phase: Annotated[float, Quantity(units.ANGLE)] = 0.0
    """Phase of the sine [rad]."""


class AngularHarmonic(Harmonic):
    """One sine of a kinematic error or of a prescribed motion; its amplitude is an angle."""

    order: Annotated[float, Plain("positive", "a constant angle is no harmonic: leave it out")]
    """Multiple of the reference speed, above 0; need not be whole."""
    amplitude: Annotated[float, Quantity(units.ANGLE)]
    """Amplitude [rad]."""


class TorqueHarmonic(Harmonic):
    """One sine of a torque; its amplitude is a torque."""

    order: Annotated[float, Plain("positive", "a constant torque is no harmonic: write it as mean")]
    """Multiple of the reference speed, above 0; need not be whole."""
    amplitude: Annotated[float, OverSpeed(units.TORQUE)]
    """Amplitude [N m]; may be a table over speed."""


class Torque(Shown):
    """An applied torque on one inertia."""

    noun: ClassVar[str] = "torque"
    symbol: ClassVar[Symbol] = Symbol("m4 12 a14 14 0 1 1 20 0 m-8 0 h8 v-8 m4 8", 28.0)
    template: ClassVar[Mapping[str, Any]] = {
        "on": "a",
        "mean": "0 N*m",
        "harmonics": [{"order": 2, "amplitude": "100 N*m"}],
    }
    on: Name
    """Name of the inertia it acts on."""
    mean: Annotated[float | Balancing, OrBalance(units.TORQUE)] = 0.0
    """Mean torque [N m]; may be a table over speed. "balance": balances all other means and drags of its free train."""
    harmonics: tuple[TorqueHarmonic, ...] = ()
    """Its sines."""
    signal: Annotated[Signal, OverTime(units.TORQUE, static=True)] | None = None
    """A torque over time, added to the mean and the sines."""
    ramps: tuple[Ramp, ...] = ()
    """Changes from the mean to other levels, such as a tip-in; the sines stay."""
    engine: Engine | None = None
    """An engine that gives the mean and the sines; with mean = "balance" the sines alone."""

    def to_plain(self, *, at_speed: bool = False) -> TomlTable:
        """Return the table; with ``at_speed``, mean and sines replace the engine from which they are computed."""
        plain = super().to_plain(at_speed=at_speed)
        if at_speed and self.engine is not None:
            del plain["engine"]
            sines = [h.to_plain(at_speed=True) for h in self.harmonics]
            plain |= {"mean": self.mean, "harmonics": sines}
        return plain

    @model_validator(mode="after")
    def _driven(self, info: ValidationInfo) -> Self:
        """Compute the sines from the engine, and the mean unless it is "balance"; sines of masses grow with speed^2."""
        if self.engine is not None:
            gas, masses = self.engine.waves()
            omega = (info.context or {}).get(OMEGA) or 0.0
            sines = [*gas, *(w._replace(amplitude=SquareOfSpeed(w.amplitude, omega)) for w in masses)]
            made = tuple(TorqueHarmonic.model_construct(**wave._asdict()) for wave in sines)
            mean = self.mean if self.mean == BALANCE else self.engine.mean_torque()
            self.__dict__.update(mean=mean, harmonics=made)
        return self

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: an engine with a mean or sines, ramps with a record, and ramps that overlap."""
        yield from overlaps(table.get("ramps"), dimensionless)
        if table.get("ramps") and table.get("signal") is not None:
            rule = "a torque has a record or ramps"
            yield Breach(("ramps",), table["ramps"], rule, "add another [[torque]] on the same inertia")
        if table.get("engine") is not None:
            for key in ("mean", "harmonics"):
                if table.get(key) and table[key] != BALANCE:
                    rule = f"an engine gives mean and harmonics; {key} cannot be given together with it"
                    remedy = "add another [[torque]] on the same inertia"
                    yield Breach((key,), table[key], rule, remedy + ', or say mean = "balance"' * (key == "mean"))


class Motion(Shown):
    """A prescribed motion of one inertia, such as a measured flywheel speed.

    Exactly one of ``speed``, ``angle`` and ``harmonics``.
    """

    noun: ClassVar[str] = "prescribed motion"
    symbol: ClassVar[Symbol] = Symbol("c4 -18 10 -18 14 0 c4 18 10 18 14 0", 28.0)
    template: ClassVar[Mapping[str, Any]] = {"on": "a", "harmonics": [{"order": 2, "amplitude": "0.5 deg"}]}
    on: Name
    """Name of the inertia that moves so."""
    speed: Annotated[Signal, OverTime(units.ANGULAR_VELOCITY, derivatives=0)] | None = None
    """Its speed over time [rad/s]."""
    angle: Annotated[Signal, OverTime(units.ANGLE, derivatives=1)] | None = None
    """Its angle over time [rad]."""
    harmonics: tuple[AngularHarmonic, ...] = ()
    """The sines of its angle: sum of amplitude sin(order Omega t + phase) [rad]."""
    about: Annotated[float, Quantity(units.ANGULAR_VELOCITY)] | None = None
    """The uniform speed about which the model's angles fluctuate [rad/s]; None: the mean of the record."""

    @property
    def signal(self) -> Signal | None:
        """The record, of the speed or of the angle; None for harmonics."""
        return self.angle if self.speed is None else self.speed

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: not exactly one of speed, angle and harmonics; no harmonic; ``about`` with harmonics."""
        keys_set = [key for key in ("speed", "angle", "harmonics") if table.get(key) is not None]
        if len(keys_set) != 1:
            value = table[keys_set[-1]] if keys_set else ...
            rule = "a motion needs one of speed, angle and harmonics"
            beyond_one = f", not {' and '.join(keys_set)}" if keys_set else ""
            yield Breach(tuple(keys_set[-1:]), value, f"{rule}{beyond_one}", "give exactly one of them")
        elif keys_set == ["harmonics"]:
            if table["harmonics"] in ([], ()):
                remedy = 'such as { order = 2, amplitude = "0.5 deg" }; an element to "ground" holds a body fast'
                yield Breach(("harmonics",), table["harmonics"], "needs at least one harmonic", remedy)
            if table.get("about") is not None:
                rule = "is the mean speed of a record; harmonics have none"
                yield Breach(("about",), table["about"], rule, "remove it")


class Sweep(Table):
    """A run-up or run-down: the reference speed changes steadily, then stays."""

    begin: Annotated[float, Field(alias="from"), Quantity(units.ANGULAR_VELOCITY, "positive")]
    """Speed at the start [rad/s]."""
    end: Annotated[float, Field(alias="to"), Quantity(units.ANGULAR_VELOCITY, "positive")]
    """Speed at the end [rad/s]."""
    over: Annotated[float, Quantity(units.TIME, "positive")]
    """How long the change takes [s]."""


class Excitation(Shown):
    """The reference speed, which fixes the period; exactly one of ``speed``, ``frequency`` and ``sweep``."""

    noun: ClassVar[str] = "speed"
    symbol: ClassVar[Symbol] = Symbol("m2 10 a14 14 0 1 1 24 0 m-12 -4 l7 -9 m7 3", 28.0)
    template: ClassVar[Mapping[str, Any]] = {"speed": "800 rpm"}
    speed: Annotated[float, Quantity(units.ANGULAR_VELOCITY, "positive")] | None = None
    """Mean speed of the reference shaft [rad/s]."""
    frequency: Annotated[float, Quantity(units.FREQUENCY, "positive")] | None = None
    """The same as a frequency [Hz]; in a dimensionless model Omega itself."""
    sweep: Sweep | None = None
    """A speed that changes; the period is that of the speed at the start."""
    duration: Annotated[float, Quantity(units.TIME, "positive")] | None = None
    """Length of the run [s], rounded up to whole periods, where simulation.cycles is not given."""
    _dimensionless: bool = PrivateAttr(default=False)

    @property
    def omega(self) -> float:
        """Reference speed Omega at the start [rad/s]; dimensionless in a dimensionless model."""
        if self.sweep is not None:
            return self.sweep.begin
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
        """Yield breaches: none, or more than one, of speed, frequency and sweep."""
        keys = ("speed", "frequency", "sweep")
        keys_set = [key for key in keys if table.get(key) is not None]
        if len(keys_set) > 1:
            rule = f"{' and '.join(keys_set)} exclude each other: give one of them"
            yield Breach((keys_set[-1],), table[keys_set[-1]], rule, "remove one")
        if not keys_set and not set(keys) & set(table):
            yield Breach((), ..., "needs speed or frequency: it fixes the period", 'such as speed = "1500 rpm"')
