"""A sampled signal of a run or a recording, and the shaft that turns with it, for spectra and orders.

A run is sampled on its output grid, from the end of its discarded cycles on; nothing filters it, so frequencies above
half the rate fold back, and a note says where that can be. A recording is taken as it is, if its samples are uniform.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from gearrattle.assembly import ramp_of
from gearrattle.errors import ModelError, Problem
from gearrattle.model import units
from gearrattle.model.table import did_you_mean, listed, shown
from gearrattle.model.units import Dimension
from gearrattle.model.value_kinds import Quantity
from gearrattle.recording import Channel, Recording
from gearrattle.results import Run, check_run
from gearrattle.signals.order_tracking import TURN, angle_of, speed_of
from gearrattle.trajectory import Layout
from gearrattle.wording import counted

Array = NDArray[np.float64]
Source = Run | Recording

_OF_INERTIAS = {"angle": "rad", "velocity": "rad/s", "acceleration": "rad/s^2"}
_OF_CLEARANCES = {"deflection": ("rad", "m"), "force": ("N m", "N")}
_SIDEWAYS = {"displacement": "m", "bearing_force": "N", "casing_force": "N"}
_TURNING = ("shaft angle", "angle", "speed", "velocity")
FEWEST = 16
"""Samples that every spectrum needs."""


@dataclass(frozen=True)
class Sampled:
    """A signal at uniform times.

    Attributes
    ----------
    unit
        of the values, in SI; "1" for pure numbers.
    values
        (N,).
    start
        time of the first sample [s].
    interval
        between samples [s].
    """

    name: str
    unit: str
    values: Array
    start: float
    interval: float
    source: str
    dimensionless: bool = False
    notes: tuple[str, ...] = ()

    @property
    def rate(self) -> float:
        """Samples a second [Hz]."""
        return 1.0 / self.interval

    @property
    def place(self) -> str:
        """Location of the signal in error messages."""
        return f"{self.source}: {self.name}"


@dataclass(frozen=True)
class Shaft:
    """Angle and speed of a shaft at the samples of a signal.

    Attributes
    ----------
    angle
        (N,) at the signal's samples [rad].
    speed
        (N,) its derivative [rad/s].
    """

    angle: Array
    speed: Array
    name: str


def sampled(source: Source, channel: str) -> Sampled:
    """Return one signal: of a run "quantity.subject", such as "acceleration.hub"; of a recording also a channel's name.

    A ModelError refuses a signal that is not there, samples that are not uniform, no numbers, or too few.
    """
    check_run(source, (Recording,))
    samples = _of_run(source, channel) if isinstance(source, Run) else _of_recording(source, channel)
    if samples.values.size < FEWEST:
        rule = f"a spectrum needs {FEWEST} samples at least"
        raise ModelError(Problem(samples.place, counted(samples.values.size, "sample"), rule, "take a longer record"))
    _finite(samples.place, samples.values)
    return samples


def shaft_of(source: Source, signal: Sampled, speed: str | float | None) -> Shaft | None:
    """Return the shaft of a signal; None if its speed is not given.

    Parameters
    ----------
    speed
        a channel of a recording, with the speed or angle of the shaft; or a constant speed, "1500 rpm" or a
        plain number [rad/s]; None: of a run its reference shaft, of a recording its shaft angle or speed.

    Raises
    ------
    ModelError
        no such channel or speed.
    """
    count = signal.values.size
    time: Array = np.asarray(signal.start + signal.interval * np.arange(count), dtype=np.float64)
    if isinstance(source, Run):
        ramp = ramp_of(source.model)
        if speed is None and ramp is not None:
            ramped = np.minimum(time, ramp.over)
            angle = ramp.begin * ramped + 0.5 * ramp.rate * ramped**2 + ramp.end * (time - ramped)
            return Shaft(angle, ramp.speed(time), "the reference shaft")
        constant = source.model.excitation.omega if speed is None else _constant(source, signal, speed)
        return Shaft(constant * time, np.full(count, constant), "the reference shaft" if speed is None else str(speed))
    turning = _turning(source, speed)
    if isinstance(turning, Channel):
        _finite(f"{signal.source}: {turning.name}", turning.values)
        if turning.quantity in ("shaft angle", "angle"):
            return Shaft(turning.values, speed_of(turning.values, signal.interval), turning.name)
        return Shaft(angle_of(turning.values, signal.interval), turning.values, turning.name)
    if turning is None:
        return None
    return Shaft(turning * (time - signal.start), np.full(count, turning), f"{turning * 30.0 / np.pi:.6g} rpm")


def required(source: Source, signal: Sampled, speed: str | float | None) -> Shaft:
    """Return the shaft of a signal, turned forward; ModelError without its speed, or if it stands or turns back."""
    shaft = shaft_of(source, signal, speed)
    if shaft is None:
        pulses = isinstance(source, Recording) and source.find("pulses") is not None
        rule = "has no channel of the shaft's speed or angle, and orders need one"
        remedy = 'speed="NAME" names one, speed="1500 rpm" a constant one'
        more = '; a mapping makes a speed of pulses: measured = "pulses", tacho = { pulses_per_turn = 60 }'
        raise ModelError(Problem(signal.source, "", rule, remedy + more * pulses))
    if np.all(shaft.speed < 0.0):
        shaft = Shaft(-shaft.angle, -shaft.speed, f"{shaft.name}, its sign turned")
    wrong = ~(shaft.speed > 0.0)
    wrong[1:] |= ~(np.diff(shaft.angle) > 0.0)
    if wrong.any():
        at = int(np.argmax(wrong))
        when = signal.start + at * signal.interval
        rule = "the shaft stands or turns back there; orders need one that turns one way"
        remedy = "cut the record (start, end in a mapping), or filter the speed"
        raise ModelError(
            Problem(f"{signal.source}: {shaft.name}", f"{shaft.speed[at]:.6g} rad/s at {when:.6g} s", rule, remedy)
        )
    return shaft


def quantity(location: str, value: str | float, dimension: Dimension, dimensionless: bool = False) -> float:
    """Return a positive quantity in SI; ModelError where it is not positive, or no quantity of this dimension."""
    try:
        return float(Quantity(dimension, "positive").read(value, dimensionless))
    except PydanticCustomError as error:
        context = error.context or {}
        raise ModelError(Problem(location, shown(value), context["rule"], context["remedy"])) from None


def _finite(location: str, values: Array) -> None:
    """Refuse samples that are no numbers."""
    bad = ~np.isfinite(values)
    if bad.any():
        at = int(np.argmax(bad))
        rule = "samples must be finite numbers"
        remedy = 'a mapping with gaps = "bridge" fills them'
        raise ModelError(Problem(location, f"{values[at]} at sample {at}", rule, remedy))


def column_of(layout: Layout, channel: str) -> tuple[str, int]:
    """Return which quantity of a run a channel names, and of which inertia, clearance, element, direction or bearing
    force, by number.

    ModelError where the run of this driveline has no such signal.
    """
    kind, _, subject = channel.partition(".")
    inertias = layout.inertia_names
    clearances = layout.clearance_names
    elements = layout.element_names
    axes = dict.fromkeys(_OF_INERTIAS, inertias) | dict.fromkeys(_OF_CLEARANCES, clearances) | {"torque": elements}
    if layout.direction_names:
        axes |= {"displacement": layout.direction_names, "bearing_force": layout.bearing_names}
        axes["casing_force"] = ("x", "y")
    if subject not in axes.get(kind, ()):
        names = [f"{quantity}.{name}" for quantity, names in axes.items() for name in names]
        rule = f"no signal of a run; {listed(axes)} of {listed((*inertias, *elements))} are, as in {names[0]}"
        raise ModelError(Problem("channel", shown(channel), rule, did_you_mean(channel, names)))
    return kind, axes[kind].index(subject)


def _of_run(run: Run, channel: str) -> Sampled:
    """Return a signal of a run."""
    t = run.trajectory
    plain = run.model.units == "dimensionless"
    kind, column = column_of(t.layout, channel)
    motion = t.sideways if kind in _SIDEWAYS else t
    values: Array = getattr(motion, "element_torque" if kind == "torque" else kind)[:, column]
    mesh = kind in _OF_CLEARANCES and bool(t.layout.is_mesh[t.layout.clearance[column]])
    unit = {**_OF_INERTIAS, **_SIDEWAYS, "torque": "N m"}.get(kind) or _OF_CLEARANCES[kind][mesh]
    interval = float(t.time[-1] - t.time[0]) / (t.time.size - 1)
    first = t.discard * t.samples_per_cycle if t.discard < t.cycles else 0
    notes = _folds(run, 1.0 / interval)
    source = f"run of {run.model.name}" if run.model.name else "run"
    start = float(t.time[first])
    return Sampled(channel, "1" if plain else unit, values[first:], start, interval, source, plain, notes)


def _folds(run: Run, rate: float) -> tuple[str, ...]:
    """Return a note where excited orders lie above half the rate."""
    ramp = ramp_of(run.model)
    layout = run.trajectory.layout
    fastest = layout.omega if ramp is None else max(ramp.begin, ramp.end)
    highest = float(layout.orders.max(initial=0.0)) * fastest / TURN
    if highest < 0.5 * rate:
        return ()
    return (
        f"order {layout.orders.max():g} reaches {highest:.6g} Hz and the samples show {0.5 * rate:.6g} Hz: what lies "
        "above folds back; raise samples_per_cycle",
    )


def _of_recording(recording: Recording, channel: str) -> Sampled:
    """Return a signal of a recording."""
    selected = _channel(recording, channel)
    if selected is None:
        selected = recording[channel]  # refuses by name
    interval = recording.interval
    if interval is None:
        steps = np.diff(recording.time)
        value = f"steps from {steps.min():.6g} s to {steps.max():.6g} s" if steps.size else "one sample"
        remedy = 'a mapping with rate = "10 kHz" makes them so'
        raise ModelError(Problem(recording.source, value, "samples must be uniform in time", remedy))
    return Sampled(selected.name, selected.unit, selected.values, float(recording.time[0]), interval, recording.source)


def _channel(recording: Recording, name: str) -> Channel | None:
    """Return a channel by its name, or by quantity and subject."""
    if name in recording.names:
        return recording[name]
    kind, _, subject = name.partition(".")
    return recording.find(kind, subject) if subject else None


def _turning(recording: Recording, speed: str | float | None) -> Channel | float | None:
    """Return the channel of the shaft, or a constant speed; None if there is none."""
    if speed is None:
        return recording.find("shaft angle") or recording.find("speed")
    if isinstance(speed, str):
        selected = _channel(recording, speed)
        if selected is not None:
            if selected.quantity not in _TURNING:
                rule = f"is {selected.quantity or 'of no known quantity'}; the shaft needs {listed(_TURNING)}"
                remedy = "a mapping says what a channel is"
                raise ModelError(Problem(f"{recording.source}: {selected.name}", selected.quantity, rule, remedy))
            return selected
        if not speed[:1].isdigit():
            rule = f"no channel and no speed; the channels are {listed(recording.names)}"
            raise ModelError(Problem("speed", shown(speed), rule, did_you_mean(speed, recording.names) or '"1500 rpm"'))
    return quantity("speed", speed, units.ANGULAR_VELOCITY)


def _constant(run: Run, signal: Sampled, speed: str | float) -> float:
    """Return a constant speed given for a run."""
    if isinstance(speed, str) and not speed[:1].isdigit():
        rule = "a run is tracked by its reference shaft, or by a constant speed"
        raise ModelError(Problem("speed", shown(speed), rule, 'leave speed out, or give "1500 rpm"'))
    if ramp_of(run.model) is not None:
        rule = "the speed of this run changes along its sweep"
        raise ModelError(Problem("speed", shown(speed), rule, "leave speed out"))
    return quantity("speed", speed, units.ANGULAR_VELOCITY, signal.dimensionless)
