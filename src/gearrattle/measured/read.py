"""``read``: a measured file, or a mapping of one, in; a ``Recording`` out.

Takes readers and signals; gives recordings to metrics, plots and ``drive``.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.files import Refused, allowed_root, within_limit
from gearrattle.measured.conditioned import Conditioned, became, brought, finished, uniform
from gearrattle.measured.readers import READERS, Column, read_raw
from gearrattle.measured.readers.mapping import Mapped, Measurement, read_mapping
from gearrattle.measured.readers.quantities import DIMENSIONS, factor, guess
from gearrattle.model.table import listed, shown
from gearrattle.model.units import UnitError
from gearrattle.recording import QUANTITIES, Array, Channel, Recording
from gearrattle.signals.conditioning import resample
from gearrattle.signals.synchrony import Delay, delay_by_correlation, delay_by_phase
from gearrattle.wording import with_article

WORST_CORRELATION = 0.5
LEAST_SHARE = 0.05
"""An alignment that agrees less is refused: correlation, or the part of the power at the frequency."""
_RIVAL = 0.95


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
        a file (CSV, MAT, HDF5, ASAM MDF, UFF, WAV, a saved run): all its channels, quantities as far as the
        file or its units tell; or a mapping, ``measurement.toml`` or its tables, which names channels and says
        what is done to them.
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
    channels, notes = [], list(raw.notes)
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
    finite = np.isfinite(column.values)
    if not finite.all():
        at = int(np.argmin(finite))
        rule, remedy = "samples must be finite numbers", 'a mapping can leave the channel out, or gaps = "bridge"'
        raise ModelError(Problem(f"{source}: {column.name}", f"{column.values[at]} at sample {at}", rule, remedy))
    said = column.quantity if column.quantity in QUANTITIES else ""
    if said and not column.unit and len(DIMENSIONS[said]) > 1:
        either = " or ".join(dimension.si for dimension in DIMENSIONS[said])
        note = f"{column.name}: in SI, taken to be {either}; the file does not say its unit"
        return Channel(column.name, said, column.subject, either, column.values), [note]
    quantity = said or guess(column.unit)
    if not quantity:
        return Channel(column.name, "", column.subject, column.unit or "1", column.values), []
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
    """Have done what a mapping says."""
    tables, notes = measurement.tables, list(measurement.notes)
    own: dict[str, Conditioned] = {}
    for channel in measurement.channels:
        own[channel.table.name] = became(_cut(channel, tables.start, tables.end))
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


def _cut(channel: Mapped, start: float | None, end: float | None) -> Mapped:
    """Leave out of a channel of the first file what lies before the start and after the end."""
    if channel.table.file is not None or (start is None and end is None):
        return channel
    inside = np.ones(channel.time.size, dtype=np.bool_)
    inside &= channel.time >= (-np.inf if start is None else start)
    inside &= channel.time <= (np.inf if end is None else end)
    if inside.sum() < 2:
        rule = f"leave nothing of the record, which goes from {channel.time[0]:.9g} s to {channel.time[-1]:.9g} s"
        raise channel.wrong("", f"start {start}, end {end}", rule, "these are times of the file")
    return Mapped(channel.table, channel.time[inside], channel.values[inside], channel.unit, channel.place)


def _shifts(channels: Sequence[Mapped], own: Mapping[str, Conditioned]) -> list[tuple[str, float, str]]:
    """Return for every second file that is aligned what is added to its times [s], and a note."""
    notes = []
    for channel in channels:
        row = channel.table
        if row.align is None or row.file is None:
            continue
        first, second = own[row.align.with_], own[row.name]
        correlated = row.align.by == "correlation"
        if correlated:
            delay = _correlated(first, second, row.align.most)
        else:
            one, two = (first.time, first.values), (second.time, second.values)
            delay = delay_by_phase(one, two, row.align.frequency or 0.0)
        least = WORST_CORRELATION if correlated else LEAST_SHARE
        what = "correlation" if correlated else f"part of the power at {row.align.frequency:.6g} Hz"
        if delay.agreement < least:
            rule = f"the signals do not agree at any delay: a {what} of {least:g} is needed"
            remedy = "align with another channel, raise most, or check sign and unit"
            raise channel.wrong("align", f"{what} {delay.agreement:.3g}", rule, remedy)
        note = f"{row.file}: {delay.value:.9g} s added to its times, by {row.name} and {row.align.with_}"
        note += f" ({what} {delay.agreement:.4g})"
        if delay.rival > _RIVAL * delay.agreement:
            note += f"; a delay elsewhere agrees nearly as well ({delay.rival:.4g}): the signal repeats itself"
        notes.append((row.file, delay.value, note))
    return notes


def _correlated(first: Conditioned, second: Conditioned, most: float) -> Delay:
    """Correlate two channels at the coarser of their rates."""
    pairs = [uniform(channel) for channel in (first, second)]
    step = max(interval for interval, _, _ in pairs)
    even = []
    for interval, values, _ in pairs:
        grid = np.asarray(np.arange(int((values.size - 1) * interval / step * (1.0 + 1e-12)) + 1) * step, np.float64)
        even.append(resample(values, interval, 0.0, grid, 1.0 / step))
    apart = float(first.time[0] - second.time[0])
    delay = delay_by_correlation(even[0], even[1], step, (-most - apart, most - apart))
    return Delay(delay.value + apart, delay.agreement, delay.rival)


def _one_axis(measurement: Measurement, own: Mapping[str, Conditioned]) -> tuple[Array, list[Array], list[str]]:
    """Bring all channels to one time axis: the rate's, or the one that they share."""
    parts = list(own.values())
    begin, end = max(float(p.time[0]) for p in parts), min(float(p.time[-1]) for p in parts)
    if not begin < end:
        rule = f"the channels have no time in common: the last begins at {begin:.9g} s, the first ends at {end:.9g} s"
        raise ModelError(Problem(measurement.place, "", rule, "align the second file, or check start and end"))
    notes: list[str] = []
    rate = measurement.tables.rate
    if rate is not None:
        count = np.floor((end - begin) * rate * (1.0 + 1e-12)) + 1.0
        try:
            within_limit(8.0 * count * (1 + len(parts)))
        except Refused as error:
            value = f"{rate:.6g} Hz over {end - begin:.6g} s"
            raise ModelError(Problem(f"{measurement.place}: rate", value, error.rule, error.remedy)) from None
        grid = begin + np.arange(int(count)) / rate
        if grid.size < 2:
            value, rule = f"{rate:.6g} Hz", f"leaves one sample of {end - begin:.6g} s"
            raise ModelError(Problem(f"{measurement.place}: rate", value, rule))
        done = []
        for channel, part in zip(measurement.channels, parts, strict=True):
            values, said = brought(channel, part, grid, rate)
            done.append(values)
            notes += said
        return grid, done, notes
    inside = [(p.time >= begin) & (p.time <= end) for p in parts]
    time = parts[0].time[inside[0]]
    for part, mask, channel in zip(parts, inside, measurement.channels, strict=True):
        if not np.array_equal(part.time[mask], time):
            value = f"{measurement.channels[0].table.name} and {channel.table.name}"
            rule = "have different times; a recording has one time axis"
            raise ModelError(Problem(measurement.place, value, rule, 'resample: rate = "10 kHz" at the top'))
    return time, [part.values[mask] for part, mask in zip(parts, inside, strict=True)], notes
