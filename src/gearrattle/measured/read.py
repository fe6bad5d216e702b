"""``read``: a ``Recording`` from a measured file, or from a mapping of one."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.files import Refused, allowed_root, within_limit
from gearrattle.measured.mapped_channel import Conditioned, Even, became, brought, finished, uniform
from gearrattle.measured.readers import READERS, Column, read_raw
from gearrattle.measured.readers.mapping import Mapped, Measurement, read_mapping
from gearrattle.measured.readers.mapping_tables import MeasurementTables
from gearrattle.measured.readers.quantities import DIMENSIONS, factor, guess
from gearrattle.model.table import listed, shown
from gearrattle.model.units import UnitError
from gearrattle.recording import QUANTITIES, Array, Channel, Recording
from gearrattle.signals.conditioning import REACH, resample
from gearrattle.signals.synchrony import Delay, delay_by_correlation, delay_by_phase
from gearrattle.wording import counted, with_article

WORST_CORRELATION = 0.5
LEAST_SHARE = 0.05
"""An alignment that agrees less is refused: correlation, or the part of the power at the frequency."""
_RIVAL = 0.95
_SMALL = 10  # a part that is so many times smaller than its array is copied
_KEEP = 'ends = "keep" in its [[channel]] keeps them, less accurate'


def read(
    source: str | os.PathLike[str] | Mapping[str, object],
    format: str = "",
    *,
    root: str | os.PathLike[str] | None = None,
) -> Recording:
    """Read a measured file.

    Parameters
    ----------
    source
        a file (CSV, Excel, MAT, HDF5, netCDF, ASAM MDF, TDMS, LVM, UFF, WAV, a saved run): all its channels, quantities
        as far as the file or its units tell; or a mapping, ``measurement.toml`` or its tables, which names channels and
        says what is done to them.
    format
        of a file; empty: recognised by its content.
    root
        folder of further files that a mapping may name. Always allowed are files under the mapping's own folder,
        and under the working directory if that holds the mapping.

    Returns
    -------
    Recording
        The recording, in SI.

    Raises
    ------
    ModelError
        what is wrong, with its place.

    Examples
    --------
    >>> load = gr.measured.Channel("load", "torque", "", "N m", np.array([0.0, 1.0, 0.5, 0.0]))
    >>> record = gr.measured.Recording(np.arange(4) / 1000.0, (load,), "rig")
    >>> gr.write(record, "rig.csv")
    >>> gr.read("rig.csv")["load"].values.tolist()
    [0.0, 1.0, 0.5, 0.0]
    """
    if isinstance(source, Mapping) or Path(source).suffix.lower() == ".toml":
        with allowed_root(root):
            return _measured(read_mapping(source))
    if format and format not in READERS:
        raise ModelError(Problem("format", shown(format), f"must be one of {listed(READERS)}"))
    raw = read_raw(source, format=format)
    time = raw.columns[0].time
    assert time is not None
    channels = []
    notes = list(raw.notes)
    for column in raw.columns:
        if column.time is None or not (column.time is time or np.array_equal(column.time, time)):
            rule = "its channels have different times; a recording has one"
            remedy = f"gearrattle look {raw.source} -o measurement.toml writes a mapping that brings them to one rate"
            raise ModelError(Problem(raw.source, f"{raw.columns[0].name} and {column.name}", rule, remedy))
        channel, said = _plain(column, raw.source)
        channels.append(channel)
        notes += said
    return Recording(time, tuple(channels), raw.source, tuple(notes))


def _plain(column: Column, source: str) -> tuple[Channel, list[str]]:
    """Return a column as a channel; without a quantity it keeps the numbers and the unit of the file."""
    # refuse samples that are no numbers
    finite = np.isfinite(column.values)
    if not finite.all():
        at = int(np.argmin(finite))
        rule = "samples must be finite numbers"
        remedy = 'a mapping can leave the channel out, or gaps = "bridge"'
        raise ModelError(Problem(f"{source}: {column.name}", f"{column.values[at]} at sample {at}", rule, remedy))
    # the quantity, as the file says it or by the unit
    said = column.quantity if column.quantity in QUANTITIES else ""
    if said and not column.unit and len(DIMENSIONS[said]) > 1:
        either = " or ".join(dimension.si for dimension in DIMENSIONS[said])
        note = f"{column.name}: in SI, taken to be {either}; the file does not say its unit"
        return Channel(column.name, said, column.subject, either, column.values), [note]
    quantity = said or guess(column.unit)
    if not quantity:
        return Channel(column.name, "", column.subject, column.unit or "1", column.values), []
    # to SI, in place
    try:
        by, unit = factor(column.unit, quantity)
    except UnitError:
        note = f"{column.name}: {column.unit or 'no unit'} is no unit of {with_article(quantity)}; "
        note += "the numbers stand as in the file"
        return Channel(column.name, "", column.subject, column.unit or "1", column.values), [note]
    notes = [] if said else [f"{column.name}: taken for {with_article(quantity)} by its unit, {column.unit}"]
    if by != 1.0:
        np.multiply(column.values, by, out=column.values)  # a long record leaves no room for a copy
    return Channel(column.name, quantity, column.subject, unit, column.values), notes


def _measured(measurement: Measurement) -> Recording:
    """Process the channels as a mapping states."""
    tables = measurement.tables
    notes = list(measurement.notes)
    own: dict[str, Conditioned] = {}
    for channel in measurement.channels:
        own[channel.table.name] = _became_within(channel, tables)
        notes += own[channel.table.name].notes
    for file, shift, note in _shifts(measurement.channels, own):
        notes.append(note)
        for channel in measurement.channels:
            name = channel.table.name
            if channel.table.file == file:
                own[name] = own[name]._replace(time=own[name].time + shift)
    time, brought_ones, said = _one_axis(measurement, own)
    notes += said
    interval = Recording(time, (), "").interval
    channels = []
    for channel, values in zip(measurement.channels, brought_ones, strict=True):
        row = channel.table
        done = finished(channel, time, values, interval)
        channels.append(Channel(row.name, row.quantity, row.of or "", own[row.name].unit, done))
    return Recording(time, tuple(channels), measurement.source, tuple(notes))


def _became_within(channel: Mapped, tables: MeasurementTables) -> Conditioned:
    """Convert a channel between start and end to its quantity; for another rate with the margin of its kernel."""
    exact = _cut(channel, tables.start, tables.end)
    if tables.rate is None or exact is channel or channel.table.begins_at_zero:
        return became(exact)
    around = REACH / min(tables.rate, (channel.time.size - 1) / float(channel.time[-1] - channel.time[0]))
    start = None if tables.start is None else tables.start - 1.1 * around
    end = None if tables.end is None else tables.end + 1.1 * around
    try:
        return became(_cut(channel, start, end))
    except ModelError:  # the fault lies outside the span, or is reported again here
        return became(exact)


def _cut(channel: Mapped, start: float | None, end: float | None) -> Mapped:
    """Remove from a channel of the first file all before the start and after the end."""
    if channel.table.file is not None or (start is None and end is None):
        return channel
    inside = _between(channel.time, start, end)
    if inside.stop - inside.start < 2:
        rule = f"leave nothing of the record, which goes from {channel.time[0]:.9g} s to {channel.time[-1]:.9g} s"
        raise channel.wrong("", f"start {start}, end {end}", rule, "these are times of the file")
    time = _part(channel.time, inside)
    return Mapped(channel.table, time, _part(channel.values, inside), channel.unit, channel.place)


def _between(time: Array, start: float | None, end: float | None) -> slice:
    """Return the slice of ascending times from a start to an end, both included."""
    first = 0 if start is None else int(np.searchsorted(time, start, "left"))
    last = time.size if end is None else int(np.searchsorted(time, end, "right"))
    return slice(first, max(first, last))


def _part(array: Array, inside: slice) -> Array:
    """Return a part of an array; a small one as a copy, so that the array can be freed."""
    part = array[inside]
    return part.copy() if _SMALL * part.size < array.size else part


def _shifts(channels: Sequence[Mapped], own: Mapping[str, Conditioned]) -> list[tuple[str, float, str]]:
    """Return for every second file that is aligned the shift of its times [s], and a note."""
    notes = []
    for channel in channels:
        row = channel.table
        if row.align is None or row.file is None:
            continue
        # the delay between the two clocks, by correlation or by phase
        first = own[row.align.with_]
        second = own[row.name]
        correlated = row.align.by == "correlation"
        if correlated:
            delay = _correlated(first, second, row.align.most)
        else:
            one = (first.time, first.values)
            two = (second.time, second.values)
            delay = delay_by_phase(one, two, row.align.frequency or 0.0)
        # refuse a delay at which the signals do not agree
        least = WORST_CORRELATION if correlated else LEAST_SHARE
        what = "correlation" if correlated else f"part of the power at {row.align.frequency:.6g} Hz"
        if delay.agreement < least:
            rule = f"the signals do not agree at any delay: a {what} of {least:g} is needed"
            remedy = "align with another channel, raise most, or check sign and unit"
            raise channel.wrong("align", f"{what} {delay.agreement:.3g}", rule, remedy)
        # the note: delay, agreement, and a rival delay
        note = f"{row.file}: {delay.value:.9g} s added to its times, by {row.name} and {row.align.with_}"
        note += f" ({what} {delay.agreement:.4g})"
        if delay.rival > _RIVAL * delay.agreement:
            note += f"; a delay elsewhere agrees nearly as well ({delay.rival:.4g}): the signal repeats itself"
        notes.append((row.file, delay.value, note))
    return notes


def _correlated(first: Conditioned, second: Conditioned, most: float) -> Delay:
    """Correlate two channels at the coarser of their rates."""
    pairs = [uniform(channel) for channel in (first, second)]
    step = max(pair.interval for pair in pairs)
    even = []
    for pair in pairs:
        length = (pair.values.size - 1) * pair.interval
        grid = np.asarray(np.arange(int(length / step * (1.0 + 1e-12)) + 1) * step, np.float64)
        even.append(resample(pair.values, pair.interval, 0.0, grid, 1.0 / step))
    apart = float(first.time[0] - second.time[0])
    delay = delay_by_correlation(even[0], even[1], step, (-most - apart, most - apart))
    return Delay(delay.value + apart, delay.agreement, delay.rival)


def _one_axis(measurement: Measurement, own: Mapping[str, Conditioned]) -> tuple[Array, list[Array], list[str]]:
    """Bring all channels to one time axis: that of the rate, or the one that they share."""
    parts = list(own.values())
    within = [
        _within(channel, part, measurement.tables) for channel, part in zip(measurement.channels, parts, strict=True)
    ]
    begin = max(first for first, _ in within)
    end = min(last for _, last in within)
    if not begin < end:
        rule = f"the channels have no time in common: the last begins at {begin:.9g} s, the first ends at {end:.9g} s"
        raise ModelError(Problem(measurement.place, "", rule, "align the second file, or check start and end"))
    if measurement.tables.rate is not None:
        return _at_rate(measurement, parts, (begin, end), measurement.tables.rate)
    inside = [_between(part.time, begin, end) for part in parts]
    time = _part(parts[0].time, inside[0])
    for part, within_both, channel in zip(parts, inside, measurement.channels, strict=True):
        if not np.array_equal(part.time[within_both], time):
            value = f"{measurement.channels[0].table.name} and {channel.table.name}"
            rule = "have different times; a recording has one time axis"
            raise ModelError(Problem(measurement.place, value, rule, 'resample: rate = "10 kHz" at the top'))
    return time, [_part(part.values, within_both) for part, within_both in zip(parts, inside, strict=True)], []


def _within(channel: Mapped, part: Conditioned, tables: MeasurementTables) -> tuple[float, float]:
    """Return a channel's first and last time between the start and the end."""
    time = part.time
    if channel.table.file is None:
        time = time[_between(time, tables.start, tables.end)]
    return (float(time[0]), float(time[-1])) if time.size else (np.inf, -np.inf)


def _at_rate(
    measurement: Measurement, parts: Sequence[Conditioned], bounds: tuple[float, float], rate: float
) -> tuple[Array, list[Array], list[str]]:
    """Bring all channels to a rate, as far as each of them has the values."""
    # the grid of the common times, if the memory suffices
    begin, end = bounds
    count = np.floor((end - begin) * rate * (1.0 + 1e-12)) + 1.0
    try:
        within_limit(8.0 * count * (1 + len(parts)))
    except Refused as error:
        value = f"{rate:.6g} Hz over {end - begin:.6g} s"
        raise ModelError(Problem(f"{measurement.place}: rate", value, error.rule, error.remedy)) from None
    grid = begin + np.arange(int(count)) / rate
    if grid.size < 2:
        value = f"{rate:.6g} Hz"
        rule = f"leaves one sample of {end - begin:.6g} s"
        raise ModelError(Problem(f"{measurement.place}: rate", value, rule))
    # uniform samples of every channel
    notes: list[str] = []
    try:
        even = [uniform(part) for part in parts]
    except Refused as error:
        value = "steps of very different lengths"
        raise ModelError(Problem(f"{measurement.place}: rate", value, error.rule, error.remedy)) from None
    # times at which all channels are known
    known = np.ones(grid.size, dtype=np.bool_)
    for channel, samples in zip(measurement.channels, even, strict=True):
        name = channel.table.name
        if not samples.were_even:
            stands = f"a cubic spline, {1.0 / samples.interval:.6g} Hz, stands for it"
            notes.append(f"{name}: not sampled uniformly; {stands}")
        mask, said = _known(channel, samples, grid, rate)
        known &= mask
        notes += said
    if known.sum() < 2:
        rule = (
            "no time is left at which all channels are known: each end of one is left out that ends before its kernel"
        )
        raise ModelError(Problem(f"{measurement.place}: rate", f"{rate:.6g} Hz", rule, _KEEP))
    return grid[known], [brought(samples, grid[known], rate) for samples in even], notes


def _known(channel: Mapped, samples: Even, grid: Array, rate: float) -> tuple[NDArray[np.bool_], list[str]]:
    """Return at which times of a grid a channel is known within 1e-4, and a note on the others; ModelError: at none."""
    beyond = samples.beyond(grid, rate)
    everywhere = np.ones(grid.size, dtype=np.bool_)
    if not beyond:
        return everywhere, []
    name = channel.table.name
    if channel.table.ends == "keep":
        note = f"{name}: the {beyond:.6g} s at its ends are kept; there the new rate is off by up to half the amplitude"
        return everywhere, [f"{note} of what is fast, by less than 1 part in 1000 below a fiftieth of its rate"]
    last = samples.first + samples.interval * (samples.values.size - 1)
    slack = 1e-9 * samples.interval
    mask = (grid >= samples.first + beyond - slack) & (grid <= last - beyond + slack)
    if mask.sum() < 2:
        value = f"{counted(samples.values.size, 'sample')} at {1.0 / samples.interval:.6g} Hz"
        rule = f"{rate:.6g} Hz are known within 1e-4 only {beyond:.6g} s from each end, and it lasts"
        raise channel.wrong("", value, f"{rule} {last - samples.first:.6g} s", _KEEP)
    if mask.all():
        return mask, []
    return mask, [
        f"{name}: {beyond:.6g} s at each end left out, where {rate:.6g} Hz are not known within 1e-4 ({_KEEP})"
    ]
