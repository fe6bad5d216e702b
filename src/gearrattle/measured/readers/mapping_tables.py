"""The tables of a ``measurement.toml``, each key with its rule.

A quantity is what the channel *becomes*; ``measured`` is what the sensor saw, where that is another one: a speed for an
angle, pulses for a shaft angle. The unit is that of what was measured.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from pydantic import Field

from gearrattle.measured.readers.quantities import factor
from gearrattle.model import units
from gearrattle.model.table import Breach, Table, breach
from gearrattle.model.units import UnitError
from gearrattle.model.value_kinds import Choice, Count, Label, Plain, Quantity, Reader, SchemaVersion, Text
from gearrattle.recording import QUANTITIES
from gearrattle.signals.wheel_teeth import Gaps
from gearrattle.wording import with_article

KINDS = {"lowpass": 1, "highpass": 1, "bandpass": 2, "bandstop": 2}
"""Kinds of filters, and how many cutoffs each has."""
DERIVATIVES = {"angle": 0, "shaft angle": 0, "velocity": 1, "speed": 1, "acceleration": 2}
"""Quantities of motion that follow from each other: which derivative of an angle each is."""
FROM_PULSES = ("shaft angle", "speed", "angle", "velocity")
_FREQUENCY = Quantity(units.FREQUENCY, "positive")
_WIDEST = 20  # teeth left out at one place
_SIZE = Count(1, _WIDEST)
_TOOTH = Count(1, 10_000)


class _Cutoff(Reader):
    """One frequency, or two that ascend."""

    def read(self, value: Any, dimensionless: bool, /) -> tuple[float, ...]:
        """Return the frequencies [Hz]."""
        entries = value if isinstance(value, list | tuple) else [value]
        if not 1 <= len(entries) <= 2:
            raise breach("must be one frequency, or two for a band", 'such as "2 kHz" or ["20 Hz", "2 kHz"]')
        frequencies = tuple(_FREQUENCY.read(entry, dimensionless) for entry in entries)
        if len(frequencies) == 2 and not frequencies[0] < frequencies[1]:
            raise breach("must ascend: the lower edge of the band first")
        return frequencies

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema."""
        one = _FREQUENCY.describe()
        return {"anyOf": [one, {"type": "array", "items": one, "minItems": 2, "maxItems": 2}]}


class FilterTable(Table):
    """A zero-phase Butterworth filter."""

    kind: Annotated[str, Choice(tuple(KINDS))]
    """Which band passes."""
    cutoff: Annotated[tuple[float, ...], _Cutoff()]
    """Where the gain is one half [Hz]; two for a band."""
    order: Annotated[int, Count(1, 12)] = 4
    """Order of one pass; the filter runs forwards and backwards."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield a breach if the kind has another number of cutoffs."""
        kind = table.get("kind")
        cutoff = table.get("cutoff")
        count = len(cutoff) if isinstance(cutoff, list | tuple) else 1
        if isinstance(kind, str) and kind in KINDS and cutoff is not None and count != KINDS[kind]:
            words = "one frequency" if KINDS[kind] == 1 else "two frequencies"
            yield Breach(("cutoff",), cutoff, f"{with_article(kind)} has {words}")


class _Missing(Reader):
    """Teeth left out: a number at one place, a number at each of several places, or the numbers of the teeth."""

    def read(self, value: Any, dimensionless: bool, /) -> Gaps:
        """Return the gaps."""
        if value == 0 and not isinstance(value, bool):
            return ()
        entries = value if isinstance(value, list | tuple) else [value]
        if all(isinstance(entry, list | tuple) for entry in entries) and entries:
            return tuple(tuple(_TOOTH.read(tooth, dimensionless) for tooth in entry) for entry in entries)
        return tuple(_SIZE.read(entry, dimensionless) for entry in entries)

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema."""
        sizes = {"type": "array", "items": _SIZE.describe()}
        teeth = {"type": "array", "items": {"type": "array", "items": _TOOTH.describe()}}
        return {"anyOf": [Count(0, _WIDEST).describe(), sizes, teeth]}


class TachoTable(Table):
    """Pulses of a wheel on a shaft: teeth, gaps, threshold."""

    pulses_per_turn: Annotated[float, Plain("positive")]
    """Teeth of the wheel, missing ones counted; with a gear between, any number."""
    missing: Annotated[Gaps, _Missing()] = ()
    """Teeth left out: 2 for a wheel 60-2, [2, 2, 2] for 36-2-2-2, or their numbers, [[1, 2], [19, 20], [22, 23]]."""
    threshold: Annotated[float, Plain()] | None = None
    """Where a pulse begins, in the unit of the signal; None: half-way between its low and its high level."""
    hysteresis: Annotated[float, Plain("non-negative")] | None = None
    """How far the signal must fall back before another pulse counts; None: a fifth of the height."""
    edge: Annotated[str, Choice(("rising", "falling"))] = "rising"
    """Which edge of a pulse counts."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield a breach if more teeth are missing than the wheel has, or its teeth are no whole number."""
        teeth = table.get("pulses_per_turn")
        missing = table.get("missing")
        if not isinstance(teeth, int | float) or not missing:
            return
        gaps = missing if isinstance(missing, list | tuple) else [missing]
        sizes = [len(gap) if isinstance(gap, list | tuple) else gap for gap in gaps]
        if not all(isinstance(size, int) for size in sizes):
            return
        if teeth != round(teeth):
            yield Breach(("pulses_per_turn",), teeth, "a wheel with missing teeth has a whole number of them")
        elif sum(sizes) + len(sizes) + 2 > teeth:
            rule = "must leave two teeth more on the wheel than there are gaps"
            yield Breach(("missing",), missing, rule)
        elif any(isinstance(gap, list | tuple) for gap in gaps):
            yield from _gap_breaches(list(gaps), int(teeth))


def _gap_breaches(gaps: list[Any], teeth: int) -> Iterator[Breach]:
    """Yield breaches of teeth given by their numbers: each gap is one of neighbours, and there is a tooth between."""
    left_out = {tooth for gap in gaps if isinstance(gap, list | tuple) for tooth in gap}
    for index, gap in enumerate(gaps):
        whole = isinstance(gap, list | tuple) and bool(gap) and all(isinstance(tooth, int) for tooth in gap)
        if not whole or gap != list(range(gap[0], gap[0] + len(gap))) or gap[-1] > teeth:
            rule = f"must be the numbers of neighbouring teeth from 1 to {teeth}, ascending"
            yield Breach(("missing", index), gap, rule, "such as [[1, 2], [19, 20], [22, 23]]")
        elif (gap[-1] % teeth + 1) in left_out:
            yield Breach(("missing", index), gap, "the next tooth is missing as well: this is one gap", "join them")


class AlignTable(Table):
    """Alignment of a second file's clock with that of the first."""

    with_: Annotated[str, Field(alias="with"), Label()]
    """Channel of another file that shows the same motion."""
    by: Annotated[str, Choice(("correlation", "order-phase"))] = "correlation"
    """Over the whole signals, or the phase of one frequency."""
    most: Annotated[float, Quantity(units.TIME, "positive")] = 1.0
    """Largest delay looked for by correlation, either way [s]."""
    frequency: Annotated[float, _FREQUENCY] | None = None
    """Whose phase is compared [Hz]: an order times the speed."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield a breach if the frequency is missing, or has no use."""
        by = table.get("by", "correlation")
        frequency = table.get("frequency")
        if by == "order-phase" and frequency is None:
            yield Breach((), ..., "order-phase needs the frequency that is compared", 'such as frequency = "50 Hz"')
        if by == "correlation" and frequency is not None:
            yield Breach(("frequency",), frequency, "belongs to order-phase", 'by = "order-phase"')
        if by == "order-phase" and table.get("most") is not None:
            yield Breach(("most",), table["most"], "belongs to correlation; a phase tells the delay nearest to zero")


class ChannelTable(Table):
    """One channel: its quantity, its column, its processing."""

    name: Annotated[str, Label()]
    """What the recording calls it."""
    source: Annotated[str, Text()] | None = None
    """What the file calls it; None: the same."""
    file: Annotated[str, Text()] | None = None
    """A second file, with a clock of its own; None: the file of the measurement."""
    quantity: Annotated[str, Choice(QUANTITIES)]
    """What it becomes."""
    measured: Annotated[str, Choice(QUANTITIES)] | None = None
    """What the sensor saw; None: the same."""
    of: Annotated[str, Label()] | None = None
    """The inertia, element or place it is about."""
    unit: Annotated[str, Text()] | None = None
    """Unit of ``scale`` times the stored number; None: as the file says."""
    scale: Annotated[float, Plain()] = 1.0
    """Factor on the stored numbers."""
    offset: Annotated[float, Plain()] = 0.0
    """Added after ``scale``, in ``unit``."""
    gaps: Annotated[str, Choice(("refuse", "bridge"))] = "refuse"
    """What becomes of samples that are no numbers: refused, or bridged by straight lines."""
    ends: Annotated[str, Choice(("cut", "keep"))] = "cut"
    """What becomes of both ends at another rate, where it is not known within 1e-4: left out, or kept."""
    starts_over: Annotated[float, Quantity(units.ANGLE, "positive")] | None = None
    """Angle at which an encoder starts over [rad]."""
    tacho: TachoTable | None = None
    """Set for pulses."""
    detrend: Annotated[str, Choice(("mean", "linear"))] | None = None
    """What is taken away, after resampling."""
    filter: FilterTable | None = None
    """Applied last."""
    align: AlignTable | None = None
    """Sets the clock of this channel's file."""

    @property
    def begins_at_zero(self) -> bool:
        """Whether it becomes an integral of what was measured, or a count of it, which is 0 at the first sample."""
        if self.measured == "pulses":
            return self.quantity in ("angle", "shaft angle")
        measured = self.measured or self.quantity
        are_known = {measured, self.quantity} <= set(DERIVATIVES)
        return are_known and DERIVATIVES[measured] > DERIVATIVES[self.quantity]

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches between what was measured, its unit and what it becomes."""
        # a quantity must follow from what was measured
        quantity = table.get("quantity")
        measured = table.get("measured") or quantity
        if quantity not in QUANTITIES or measured not in QUANTITIES:
            return
        if measured == "pulses" and quantity != "pulses":
            if quantity not in FROM_PULSES:
                yield Breach(("quantity",), quantity, f"pulses give {', '.join(FROM_PULSES)}")
            elif table.get("tacho") is None:
                rule = "pulses need tacho to become an angle or a speed"
                yield Breach((), ..., rule, "such as tacho = { pulses_per_turn = 60 }")
        elif measured != quantity and not _becomes(measured, quantity):
            rule = f"{with_article(measured)} does not become {with_article(quantity)}"
            remedy = "angle, velocity, acceleration, shaft angle and speed become one another"
            yield Breach(("measured",), measured, rule, f"{remedy}, but for an acceleration a mean rotation")
        # keys that belong to other channels
        if table.get("tacho") is not None and (measured != "pulses" or quantity == "pulses"):
            rule = "belongs to pulses that become an angle or a speed"
            yield Breach(("tacho",), table["tacho"], rule, 'measured = "pulses"')
        if table.get("starts_over") is not None and measured not in ("angle", "shaft angle"):
            yield Breach(("starts_over",), table["starts_over"], "belongs to a measured angle")
        if table.get("align") is not None and table.get("file") is None:
            rule = "belongs to a channel of a second file"
            yield Breach(("align",), table["align"], rule, 'such as file = "second.wav"')
        # the unit must be one of what was measured
        if isinstance(table.get("unit"), str):
            try:
                factor(table["unit"], measured)
            except UnitError as error:
                yield Breach(("unit",), table["unit"], error.rule, error.remedy)


class MeasurementTables(Table):
    """A mapping file."""

    schema_version: Annotated[int, Field(alias="schema"), SchemaVersion()] = 1
    """Version of the format."""
    file: Annotated[str, Text()]
    """The record, relative to the mapping."""
    format: Annotated[str, Text()] | None = None
    """Its format; None: recognised by its content."""
    time: Annotated[str, Text()] = ""
    """Name of the time column; needed if the file does not define it."""
    time_unit: Annotated[str, Text()] = ""
    """Unit of these times; the file's, or s."""
    sampled: Annotated[float, _FREQUENCY] | None = None
    """Rate of a file without times [Hz]."""
    start: Annotated[float, Quantity(units.TIME)] | None = None
    """Where the recording begins, by the clock of the file [s]."""
    end: Annotated[float, Quantity(units.TIME)] | None = None
    """Where it ends [s]."""
    rate: Annotated[float, _FREQUENCY] | None = None
    """Rate all channels are brought to [Hz]."""
    channels: Annotated[tuple[ChannelTable, ...], Field(alias="channel")]
    """What is taken, in this order."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: no channels, one name twice, alignments that lead nowhere, times stated twice."""
        rows = table.get("channel")
        rows = [row for row in rows if isinstance(row, Mapping)] if isinstance(rows, list | tuple) else []
        if not rows and isinstance(table.get("channel", []), list | tuple):
            yield Breach((), ..., "a measurement needs at least one [[channel]]")
        if table.get("sampled") is not None and (table.get("time") or table.get("time_unit")):
            yield Breach(("sampled",), table["sampled"], "is for a file without times; leave time and time_unit out")
        first: dict[str, int] = {}
        for index, row in enumerate(rows):
            if first.setdefault(str(row.get("name")), index) < index:
                yield Breach(("channel", index, "name"), row.get("name"), "another channel has this name")
            yield from _align_breaches(index, row, rows)


def _becomes(measured: str, quantity: str) -> bool:
    """Return whether a quantity follows from the measured one; an acceleration leaves the mean rotation open."""
    whole = quantity in ("speed", "shaft angle")
    return {measured, quantity} <= set(DERIVATIVES) and not (measured == "acceleration" and whole)


def _align_breaches(index: int, row: Mapping[str, Any], rows: list[Mapping[str, Any]]) -> Iterator[Breach]:
    """Yield breaches of an alignment: with an unknown channel, one of the same file, of another file to be aligned."""
    table = row.get("align")
    if not isinstance(table, Mapping) or not isinstance(table.get("with"), str):
        return
    at = ("channel", index, "align")
    if any(r.get("align") is not None and r.get("file") == row.get("file") for r in rows[:index]):
        yield Breach(at, table, "the clock of this file is set already", "leave one align a file")
    other = next((r for r in rows if r.get("name") == table["with"]), None)
    if other is None:
        yield Breach((*at, "with"), table["with"], "no channel has this name")
    elif other.get("file") is not None:
        yield Breach((*at, "with"), table["with"], "must be a channel of the measurement's own file")
