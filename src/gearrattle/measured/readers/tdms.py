"""TDMS of National Instruments, through npTDMS (extra ``measured``).

Every channel of real numbers is a signal, named by the channel, by group and channel where several groups have that
name. Its times follow from the waveform properties ``wf_increment`` and ``wf_start_offset``; without them, from the
rule of ``with_times``. Its unit is the property ``unit_string``. The library scales stored numbers as the file says.
Format: NI, TDMS File Format Internal Structure.
"""

from __future__ import annotations

import logging
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from gearrattle.errors import ModelError, NotInstalled, Problem
from gearrattle.files import opened
from gearrattle.formats import check_format, format_name
from gearrattle.measured.readers.reader import Column, Raw, Request, ask_for, is_time, unfit, with_times
from gearrattle.recording import Array, Recording

NAME = "tdms"
SUFFIXES = (".tdms",)
_INCREMENT = "wf_increment"  # s between samples
_OFFSET = "wf_start_offset"  # s, of the first sample
_UNIT = "unit_string"
_GROUP = "recording"
_FORMAT = "gearrattle_format"
_COPIES = 2  # arrays of a channel's length that the library holds while it scales one


def knows(_path: Path, head: bytes) -> bool:
    """Return whether a file begins with the tag of a segment."""
    return head[:4] == b"TDSm"


def read(path: Path, request: Request) -> Raw:
    """Return its channels of numbers; those that are not asked for have a name only."""
    library = _library(path)
    with opened(path) as stream, library.TdmsFile.open(stream) as file:
        check_format(str(file.properties.get(_FORMAT, "")), path, "recording")
        # the channels of numbers, by distinct names
        channels = [channel for group in file.groups() for channel in group.channels()]
        signals = [channel for channel in channels if np.dtype(channel.dtype).kind in "fiu"]
        count = Counter(channel.name for channel in signals)
        names = [c.name if count[c.name] == 1 else f"{c.group_name}/{c.name}" for c in signals]
        # read those wanted, if the memory suffices
        wanted = [_is_wanted(name, _unit(c), request) for name, c in zip(names, signals, strict=True)]
        lengths = [len(channel) for channel, is_read in zip(signals, wanted, strict=True) if is_read]
        ask_for(lengths * 2, request, _COPIES * 8 * max(lengths, default=0))
        columns = [_column(*row) for row in zip(names, signals, wanted, strict=True)]
        notes = _unfinished(file, path)
    # notes on what is left out
    if not columns:
        raise ModelError(Problem(str(path), "", "holds no channels of numbers", "is this the whole record?"))
    others = [channel.name for channel in channels if channel not in signals]
    notes += [f"left out, because they are no signals: {', '.join(others)}"] if others else []
    return Raw(with_times(columns, path, request), str(path), NAME, tuple(notes))


def _unfinished(file: Any, path: Path) -> list[str]:
    """Return a note on a file whose last segment is incomplete; a ModelError refuses one that cuts channels apart."""
    if not file.file_status.incomplete_final_segment:
        return []
    for group in file.groups():
        if len({len(channel) for channel in group.channels()}) > 1:
            rule = "ends inside a segment: the file is truncated, or its writer was interrupted"
            raise ModelError(Problem(f"{path}: {group.name}", "", rule, "copy or export it again"))
    return ["its last segment is incomplete, its writer was interrupted: read as far as all channels go"]


def _column(name: str, channel: Any, is_read: bool) -> Column:
    """Return a channel as a column, with the times of its waveform properties if it has them."""
    values = np.array(channel[:], np.float64) if is_read else np.empty(0)
    time = _times(channel, values.size)
    said = [str(channel.properties.get(key, "")) for key in ("quantity", "subject")]
    return Column(name, _unit(channel), values, time, *said)


def _times(channel: Any, samples: int) -> Array | None:
    """Return the times of a waveform [s]; None where the channel has no interval between samples."""
    interval = float(channel.properties.get(_INCREMENT, 0.0))
    if not interval > 0.0:
        return None
    time = np.arange(samples, dtype=np.float64)
    time *= interval
    time += float(channel.properties.get(_OFFSET, 0.0))
    return time


def _unit(channel: Any) -> str:
    """Return the unit of a channel; empty where it has none."""
    return str(channel.properties.get(_UNIT, "")).strip()


def _is_wanted(name: str, unit: str, request: Request) -> bool:
    """Return whether a channel is read: it is asked for, or it may hold times."""
    return request.wants(name) or name == request.time or (not request.time and is_time(name, unit))


def write(recording: Recording, path: Path) -> None:
    """Write one group, a channel each with its properties; samples that are not uniform have a channel of times [s]."""
    library = _library(path)
    interval = recording.interval
    waveform: dict[str, float] = {}
    objects = [library.RootObject({"name": recording.source, _FORMAT: format_name("recording")})]
    if interval is None:
        objects.append(library.ChannelObject(_GROUP, "time", recording.time, {_UNIT: "s"}))
    else:
        waveform = {_INCREMENT: interval, _OFFSET: float(recording.time[0]), "wf_samples": recording.time.size}
    for channel in recording.channels:
        if channel.name == "time":
            raise unfit(path, channel.name, "this name is that of the times", "rename the channel")
        properties = {_UNIT: channel.unit, "quantity": channel.quantity, "subject": channel.subject, **waveform}
        objects.append(library.ChannelObject(_GROUP, channel.name, channel.values, properties))
    with library.TdmsWriter(path) as writer:
        writer.write_segment(objects)


def _library(path: Path) -> Any:
    """Return npTDMS, quiet: what is wrong raises exceptions."""
    try:
        import nptdms
        from nptdms.log import log_manager
    except ImportError:
        rule = "TDMS needs npTDMS, which is not installed"
        raise NotInstalled.of("measured", str(path), "", rule) from None
    log_manager.set_level(logging.CRITICAL)
    return nptdms
