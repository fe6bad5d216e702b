"""``[recording]`` of a data file: a recorded motion and settings of its comparison, with the keys of ``validate``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from pydantic import Field

from gearrattle.measured.identification.data_tables import Numbers
from gearrattle.measured.validation.validation_arguments import TRENDS, Wanted
from gearrattle.model import units
from gearrattle.model.table import Breach, Table, breach, did_you_mean, listed
from gearrattle.model.value_kinds import FLAG, AnyTable, Choice, Plain, Quantity, Reader, SchemaVersion, Text
from gearrattle.recording import Recording
from gearrattle.signals.spectral.order_maps_of_signals import TURNS

SETTINGS = ("algorithm", "cycles", "samples_per_cycle", "discard", "tolerance", "step", "initial")
"""Of the simulation, as ``simulate`` takes them."""
CLOCKS = ("cycle", "none")


class _Files(Reader):
    """A file or several, or from Python Recordings."""

    def read(self, value: Any, _dimensionless: bool, /) -> tuple[str | Recording, ...]:
        """Return names or recordings."""
        files = tuple(value) if isinstance(value, list | tuple) else (value,)
        if not files or not all(isinstance(file, str | Recording) for file in files):
            rule = "must be the name of a measured file, or of a mapping for one; several repeat a run-up"
            raise breach(rule, 'such as file = "rig.csv", or file = ["first.csv", "second.csv"]')
        return files

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema."""
        return {"type": ["string", "array"], "items": {"type": "string"}, "minItems": 1}


class _Band(Reader):
    """Lowest and highest frequency."""

    def read(self, value: Any, _dimensionless: bool, /) -> tuple[float, float]:
        """Return both in Hz."""
        if not isinstance(value, list | tuple) or len(value) != 2:
            raise breach("must be the lowest and the highest frequency", 'such as band = ["20 Hz", "1 kHz"]')
        low, high = (Quantity(units.FREQUENCY, "non-negative").read(end, False) for end in value)
        return low, high

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema."""
        return {"type": "array", "minItems": 2, "maxItems": 2}


class _Clock(Reader):
    """How the clocks are made one."""

    def read(self, value: Any, dimensionless: bool, /) -> str | float:
        """Return "cycle", "none" or a delay [s]."""
        if isinstance(value, str) and not any(letter.isdigit() for letter in value):
            return Choice(CLOCKS).read(value, dimensionless)
        return Quantity(units.TIME).read(value, dimensionless)

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema."""
        return {"type": ["string", "number"]}


class _Percent(Reader):
    """A number, or a table of channels and numbers."""

    def read(self, value: Any, dimensionless: bool, /) -> float | dict[str, float]:
        """Return it."""
        if isinstance(value, Mapping):
            return Numbers().read(value, dimensionless)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise breach("must be a standard uncertainty in %, of all channels or by channel", "such as 1.0")
        return float(value)

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema."""
        return {"type": ["number", "object"]}


class _Orders(Reader):
    """Orders of a shaft."""

    def read(self, value: Any, _dimensionless: bool, /) -> tuple[float, ...]:
        """Return them."""
        is_list = isinstance(value, list | tuple) and value
        numbers = [order for order in value if not isinstance(order, bool)] if is_list else []
        if not numbers or not all(isinstance(order, int | float) and 0.0 < order < float("inf") for order in value):
            raise breach("must be positive numbers, one at least", "such as orders = [2, 4, 6]")
        return tuple(float(order) for order in value)

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema."""
        return {"type": "array", "items": {"type": "number", "exclusiveMinimum": 0}, "minItems": 1}


class RecordingTable(Table):
    """A recorded motion and how it is compared."""

    file: Annotated[Any, _Files()]
    """Measured file or mapping, relative to the data file; several repeat a run-up. From Python also Recordings."""
    match: Annotated[Mapping[str, Any], AnyTable()] = Field(default_factory=dict)
    """Simulated channels by measured ones; others go by quantity and subject."""
    start: Annotated[float, Quantity(units.TIME)] | None = None
    """First time used of the record [s]."""
    end: Annotated[float, Quantity(units.TIME)] | None = None
    """Last time used of the record [s]."""
    band: Annotated[tuple[float, float], _Band()] | None = None
    """Lowest and highest frequency [Hz]."""
    trend: Annotated[str, Choice(TRENDS)] = "mean"
    """What is taken away from both."""
    clock: Annotated[Any, _Clock()] = "cycle"
    """"cycle": the delay of the clocks is fitted; "none", or a delay that is known [s]."""
    phases: Annotated[bool, FLAG] = True
    """Whether phases of the orders are compared, or amplitudes alone."""
    noise: Annotated[dict[str, float], Numbers()] = Field(default_factory=dict)
    """Rms of the measuring noise by measured channel [SI]; the rms of these channels is compared as well."""
    calibration: Annotated[Any, _Percent()] | None = None
    """Standard uncertainty of the calibration [%]."""
    orders: Annotated[tuple[float, ...], _Orders()] = ()
    """Of a run-up: orders that are compared; none: those of the excitation that all samples show."""
    turns: Annotated[float, Plain("positive")] = float(TURNS)
    """Of a run-up: turns of the shaft in a block."""
    shaft: Annotated[str, Text()] = ""
    """Of a run-up: measured channel of the shaft's speed or angle; none: the recording's own."""
    settings: Annotated[Mapping[str, Any], AnyTable()] = Field(default_factory=dict)
    """Of the simulation, where the model file has others."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: settings that a simulation does not have, partners that are no texts."""
        settings = table.get("settings")
        for name in settings if isinstance(settings, Mapping) else ():
            if name not in SETTINGS:
                rule = f"is no setting of a simulation; these are {listed(SETTINGS)}"
                yield Breach(("settings", name), ..., rule, did_you_mean(name, SETTINGS))
        match = table.get("match")
        for name, partner in match.items() if isinstance(match, Mapping) else ():
            if not isinstance(partner, str):
                rule = "must be the name of a simulated channel, in quotes"
                yield Breach(("match", name), partner, rule, 'such as a3 = "acceleration.hub"')

    def wanted(self, seed: int) -> Wanted:
        """Return the arguments of the comparison."""
        low, high = self.band or (0.0, None)
        return Wanted(
            match=dict(self.match),
            start=self.start,
            end=self.end,
            band=(low, high),
            trend=self.trend,
            clock=self.clock,
            noise=self.noise,
            calibration=self.calibration,
            seed=seed,
        )


class RecordingTables(Table):
    """A data file with a recorded motion."""

    schema_version: Annotated[int, Field(alias="schema"), SchemaVersion()] = 1
    """Version of the file format."""
    recording: RecordingTable
    """The recorded motion."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield a breach of data that are fitted otherwise."""
        for key in ("mode", "response"):
            if table.get(key):
                rule = "modes and responses are fitted by themselves, a recorded motion by itself"
                yield Breach((key,), ..., rule, "two data files; hold in the second fit what the first one found")
