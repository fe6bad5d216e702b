"""The tables of a data file, each key with its rule: ``[[mode]]``, ``[[response]]`` and ``[[drag]]``.

A frequency must name its unit: a plain number could be Hz or rad/s. In a dimensionless model it is plain, Omega itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from gearrattle.measured.identification.measured_modes import QUANTITIES
from gearrattle.model import units
from gearrattle.model.table import Breach, Table, breach
from gearrattle.model.value_kinds import Choice, Count, Label, Plain, Quantity, Reader, SchemaVersion, Text

FREQUENCY_EXAMPLE = 'such as "55 Hz" or "346 rad/s"'


class Frequency(Reader):
    """An angular frequency [rad/s], written with its unit."""

    def read(self, value: Any, dimensionless: bool, /) -> float:
        """Return rad/s."""
        if dimensionless:
            return Plain("positive").read(value, True)
        if not isinstance(value, str):
            raise breach("must name its unit: a plain number could be Hz or rad/s", FREQUENCY_EXAMPLE)
        return read_frequency(value)

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema."""
        return {"type": "string", "examples": ["55 Hz", "346 rad/s"]}


def read_frequency(text: str) -> float:
    """Return an angular frequency [rad/s] > 0 from a text in Hz, kHz, rad/s or rpm; raise the breach of its rule."""
    if any(text.rstrip().endswith(symbol) for symbol in units.FREQUENCY.symbols):
        return math.tau * Quantity(units.FREQUENCY, "positive").read(text, False)
    return Quantity(units.ANGULAR_VELOCITY, "positive").read(text, False)


class Numbers(Reader):
    """A table of name = number."""

    def read(self, value: Any, _dimensionless: bool, /) -> dict[str, float]:
        """Return the numbers by name."""
        if not isinstance(value, Mapping):
            raise breach("must be a table of names and numbers", "such as { hub = 1.0, gear = 0.98 }")
        for name, number in value.items():
            try:
                Plain().read(number, True)
            except ValueError as error:
                raise breach(f"{name}: {error}") from None
        return {str(name): float(number) for name, number in value.items()}

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema."""
        return {"type": "object", "additionalProperties": {"type": "number"}}


class _Samples(Reader):
    """An array of finite numbers, real or complex."""

    def read(self, value: Any, _dimensionless: bool, /) -> Any:
        """Return a one-dimensional array."""
        try:
            array = np.asarray(value)
            array = array.astype(np.complex128 if np.iscomplexobj(array) else np.float64)
        except (TypeError, ValueError):
            raise breach("must be an array of numbers") from None
        if array.ndim != 1 or not array.size:
            raise breach("must be an array of numbers in one dimension, with at least one entry")
        if not np.isfinite(array).all():
            raise breach(f"must be finite numbers; sample {int(np.argmin(np.isfinite(array)))} is none")
        return array

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema."""
        return {"type": "array", "items": {"type": "number"}}


class StateTable(Table):
    """Keys for the state of the driveline."""

    contact_ratio: Annotated[dict[str, float], Numbers()] | None = None
    """Factor on the slope of the last drive stage, by element."""
    region: Annotated[dict[str, float], Numbers()] | None = None
    """Region by element."""
    rigid: tuple[Annotated[str, Label()], ...] = ()
    """Elements that may not deflect."""


class ModeTable(StateTable):
    """One measured mode."""

    number: Annotated[int, Count(1)] | None = None
    """Number in ascending order, from 1, rigid motions counted; absent: the mode whose shape fits best."""
    frequency: Annotated[float, Frequency()] | None = None
    """Natural frequency, with its unit."""
    omega: Annotated[float, Plain("positive")] | None = None
    """The same as a plain number in rad/s."""
    standard_error: Annotated[float, Frequency()] | None = None
    """Standard error of the frequency, with its unit."""
    relative_error: Annotated[float, Plain("positive")] | None = None
    """The same as a part of the frequency."""
    shape: Annotated[dict[str, float], Numbers()] | None = None
    """Amplitudes by inertia, scale and sign free."""
    shape_error: Annotated[float, Plain("positive")] | None = None
    """Standard error of each amplitude, as a part of the largest."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: nothing measured, mode not identified, two statements of one thing."""
        yield from _not_both(table, "frequency", "omega")
        yield from _not_both(table, "standard_error", "relative_error")
        has_frequency = table.get("frequency") is not None or table.get("omega") is not None
        shape = table.get("shape")
        if not has_frequency and shape is None:
            yield Breach((), ..., "a mode needs a frequency, a shape, or both", FREQUENCY_EXAMPLE)
        if table.get("number") is None and shape is None:
            yield Breach((), ..., "a mode needs its number, or a shape to be known by", "such as number = 2")
        for key in ("standard_error", "relative_error"):
            if table.get(key) is not None and not has_frequency:
                yield Breach((key,), table[key], "belongs to a frequency, which is missing")
        if table.get("shape_error") is not None and shape is None:
            yield Breach(("shape_error",), table["shape_error"], "belongs to a shape, which is missing")
        if isinstance(shape, Mapping):
            numbers = [x for x in shape.values() if isinstance(x, (int, float))]
            if len(shape) < 2 or not any(numbers):
                rule = "must have amplitudes of two inertias or more, not all zero: its scale is free"
                yield Breach(("shape",), dict(shape), rule)


class ResponseTable(StateTable):
    """One measured frequency response: a CSV file, or arrays from Python."""

    at: Annotated[str, Label()]
    """Inertia whose motion was measured."""
    torque_on: Annotated[str, Label()]
    """Inertia on which the torque acted."""
    file: Annotated[str, Text()] | None = None
    """CSV file, relative to the data file."""
    quantity: Annotated[str, Choice(QUANTITIES)] | None = None
    """angle, velocity or acceleration, per torque; a CSV file with units says it itself."""
    omega: Annotated[Any, _Samples()] = None
    """(F,) angular frequencies [rad/s]."""
    value: Annotated[Any, _Samples()] = None
    """(F,) complex response in SI."""
    error: Annotated[Any, _Samples()] = None
    """(F,) standard error of real and imaginary part, in SI; a CSV file has a column for it."""
    relative_error: Annotated[float, Plain("positive")] | None = None
    """Standard error of real and imaginary part, as a part of each sample's magnitude."""
    floor: Annotated[float, Plain("non-negative")] = 0.0
    """The same as a part of the largest magnitude; the squares of both add up."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: neither file nor arrays, or both; arrays of different lengths."""
        arrays = [key for key in ("omega", "value") if table.get(key) is not None]
        if (table.get("file") is None) == (not arrays) or len(arrays) == 1:
            yield Breach((), ..., "a response needs either file, or omega and value", 'such as file = "hub.csv"')
        errors = table.get("error")
        if errors is not None and (len(arrays) < 2 or np.size(errors) != np.size(table["value"])):
            yield Breach(("error",), ..., "must have one entry for each sample of value")
        elif errors is not None and (np.iscomplexobj(errors) or not np.all(_numbers(errors) > 0)):
            yield Breach(("error",), ..., "must be real numbers greater than zero")
        if arrays and table.get("quantity") is None:
            rule = "a response in arrays needs quantity: " + ", ".join(f'"{word}"' for word in QUANTITIES)
            yield Breach((), ..., rule)
        if len(arrays) == 2 and np.size(table["omega"]) != np.size(table["value"]):
            yield Breach(("value",), ..., f"must have as many samples as omega, {np.size(table['omega'])}")
        if len(arrays) == 2 and (np.iscomplexobj(table["omega"]) or not np.all(_numbers(table["omega"]) > 0)):
            yield Breach(("omega",), ..., "must be real numbers greater than zero")


class DragTable(Table):
    """Measured drag torques of one body: a CSV file, or arrays from Python."""

    of: Annotated[str, Label()]
    """Inertia whose drag was measured."""
    parts: tuple[Annotated[int, Count(0)], ...] | None = None
    """Which of its drag parts were measured, counted from 0; absent: all."""
    file: Annotated[str, Text()] | None = None
    """CSV file, relative to the data file."""
    speed: Annotated[Any, _Samples()] = None
    """(N,) speeds against what the parts act on [rad/s]."""
    temperature: Annotated[Any, _Samples()] = None
    """(N,) temperatures of the oil [degC]; absent: that of the model."""
    torque: Annotated[Any, _Samples()] = None
    """(N,) drag torques [N m]."""
    error: Annotated[Any, _Samples()] = None
    """(N,) standard errors [N m]; a CSV file has a column for it."""
    relative_error: Annotated[float, Plain("positive")] | None = None
    """Standard error as a part of each torque."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: neither file nor arrays, or both; arrays of different lengths or signs."""
        needed = [key for key in ("speed", "torque") if table.get(key) is not None]
        if (table.get("file") is None) == (not needed) or len(needed) == 1:
            yield Breach((), ..., "a drag needs either file, or speed and torque", 'such as file = "gear5.csv"')
        elif needed:
            for key in ("temperature", "torque", "error"):
                if table.get(key) is not None and np.size(table[key]) != np.size(table["speed"]):
                    yield Breach((key,), ..., f"must have as many entries as speed, {np.size(table['speed'])}")
        for key in ("speed", "torque", "error"):
            values = table.get(key)
            if values is not None and (np.iscomplexobj(values) or not np.all(_numbers(values) > 0)):
                yield Breach((key,), ..., "must be real numbers greater than zero")


class DataTables(Table):
    """A data file."""

    schema_version: Annotated[int, Field(alias="schema"), SchemaVersion()] = 1
    """Version of the file format."""
    modes: Annotated[tuple[ModeTable, ...], Field(alias="mode")] = ()
    """Measured modes."""
    responses: Annotated[tuple[ResponseTable, ...], Field(alias="response")] = ()
    """Measured frequency responses."""
    drags: Annotated[tuple[DragTable, ...], Field(alias="drag")] = ()
    """Measured drag torques; they stand alone."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield a breach if there are no data, or drags together with what knows nothing of them."""
        if table.get("drag") and (table.get("mode") or table.get("response")):
            yield Breach(("drag",), ..., "no mode and no response knows a mean torque", "fit drags by themselves")
        if not table.get("mode") and not table.get("response") and not table.get("drag"):
            yield Breach((), ..., "data need at least one [[mode]], [[response]] or [[drag]], or a [recording]")


def _not_both(table: Mapping[str, Any], one: str, other: str) -> Iterator[Breach]:
    if table.get(one) is not None and table.get(other) is not None:
        yield Breach((other,), table[other], f"{one} and {other} say the same; give one of them")


def _numbers(values: Any) -> Any:
    """Return an array of real numbers; zeros where there are none."""
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        return np.ones(1)
