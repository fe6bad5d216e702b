"""ASAM MDF, versions 3 and 4, through asammdf (extra ``measured``).

Every channel has its own times, those of its group; a name that occurs in several groups gets their number behind it.
The times are the group's master channel that is one of time, in its unit; the library takes any master for a time in s,
and numbers the samples where there is none. A file whose recorder was stopped is finished by the library, in a copy:
counts of samples and lengths of data follow from what there is. Raw values become physical ones as the file says, those
marked invalid gaps; channels of texts are left out. Formats: ASAM MDF 3.3 (CNBLOCK) and 4.1 (cn_type, cn_sync_type,
cn_flags).
"""

from __future__ import annotations

import gc
import io
import itertools
import logging
import sys
from collections import Counter
from contextlib import redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO

import numpy as np

from gearrattle.errors import ModelError, NotInstalled, Problem
from gearrattle.files import Refused, opened, within_limit
from gearrattle.measured.readers.mdf_lists import check_lists, has_long_list_of_data
from gearrattle.measured.readers.reader import Column, Raw, Request, ask_for, seconds
from gearrattle.model.table import shown
from gearrattle.model.units import UnitError
from gearrattle.recording import Array, Recording

NAME = "mdf4"
SUFFIXES = (".mf4", ".mdf", ".dat")
_MARK = "gearrattle: "
_UNFINISHED = b"UnFinMF "
_FINISHED_BY_LIBRARY = 0x01 | 0x04 | 0x10  # flags: counts of samples, length of the last data block, last data list
_IDENTIFICATION = 64  # bytes of the block
_LEFT_TO_DO = 60  # offset of the flags of unfinished work
_MOST_BLOCKS = 1_000_000
_VIRTUAL = (3, 6)  # types of channels that have no bytes
_ALL_INVALID = 1  # flag of a channel
_CAN_BE_INVALID = 2  # flag of a channel
_MASTERS = {True: (2, 3), False: (1,)}  # types of channels by whether the version is 4
_OF_TIME = (1, 0)  # synchronisation types of a master: time, not said
_NOT_OF_TIME = {2: "an angle", 3: "a distance"}
_EXPORT_OVER_TIME = 'export it over time, or name a channel of its times: time = "..."'
_TIMES_TOLD = 'name a channel of its times: time = "..."; or tell the rate: sampled = "10 kHz"'
_LONG_RECORD = 1_000_000  # bytes; a record of a hundred channels has about a thousand
_MOST_PACKED = 1032  # bytes that one byte unpacks to at most (zlib)
_PIECE = 4_000_000  # bytes of a group that the library reads at once
_ARRAYS = 5  # arrays of a channel's length that the library holds while it reads one
_COPIES = 6  # copies of one record that the library makes where the record is longer than a piece


def knows(_path: Path, head: bytes) -> bool:
    """Return whether a file has the identification block, finished or not."""
    return head[:8] in (b"MDF     ", _UNFINISHED)


def _unfinished_work(stream: BinaryIO, path: Path) -> tuple[str, ...]:
    """Return a note on a file that was not finished; a ModelError refuses one that the library does not finish safely.

    It does so from version 4.10 on, where samples must be counted or the last data block has no length; it never ends
    on a list of data blocks that goes on in a second one (asammdf 8.8).
    """
    head = stream.read(_IDENTIFICATION)
    work = int.from_bytes(head[_LEFT_TO_DO : _LEFT_TO_DO + 2], "little") if head[8:16] >= b"4.10" else 0
    if not work and head[:8] != _UNFINISHED:
        return ()
    if not work or work & ~_FINISHED_BY_LIBRARY or any(head[_LEFT_TO_DO + 2 :]) or has_long_list_of_data(stream):
        rule = "the file was not finished: its writer was interrupted"
        raise ModelError(Problem(str(path), "", rule, "finalise it with the measuring system's tool"))
    return ("the file was not finished, its writer was interrupted: its samples were counted anew, in a copy",)


def read(path: Path, request: Request) -> Raw:
    """Return its channels of numbers."""
    # refuse files that are damaged, or that the library does not finish
    mdf = _library(path)
    with opened(path) as stream:
        check_lists(stream)
        stream.seek(0)
        unfinished = _unfinished_work(stream, path)
    # the library prints what it cannot decode, and leaves a copy where it fails
    with TemporaryDirectory() as folder, redirect_stdout(io.StringIO()), _opened(mdf, path, folder) as file:
        _check_long_records(file)
        _check_records(file)
        # channels other than the masters, in the order of the file; names made distinct
        places = {_master(file, group) for group in range(len(file.groups))}
        channels = [(name, *at) for name, spots in file.channels_db.items() for at in spots if at not in places]
        count = Counter(name for name, _, _ in channels)
        entries = [(name if count[name] == 1 else f"{name}[{group}]", group, index) for name, group, index in channels]
        entries.sort(key=lambda entry: entry[1:])
        # read the columns, if the memory suffices
        _check_size(file, entries, request)
        columns, skipped, without_times = _columns(file, entries, request, path)
    if not columns and without_times:
        raise without_times[0]
    if not columns:
        raise ModelError(Problem(str(path), ", ".join(skipped[:8]), "holds no channels of numbers"))
    # notes on channels and groups left out
    notes = [*unfinished]
    notes += [f"left out, because they are no signals: {', '.join(skipped)}"] if skipped else []
    for error in without_times:
        problem = error.problems[0]
        notes.append(f"{problem.place.removeprefix(f'{path}: ')} left out: {problem.rule}; {problem.remedy}")
    return Raw(tuple(columns), str(path), NAME, tuple(notes))


def _columns(
    file: Any, entries: list[tuple[str, int, int]], request: Request, path: Path
) -> tuple[list[Column], list[str], list[ModelError]]:
    """Return columns, names of channels that are no signals, and errors of groups without times.

    A ModelError refuses a channel that is asked for by its name and has no times.
    """
    # the times of every group, read once
    columns: list[Column] = []
    skipped: list[str] = []
    times: dict[int, Array | ModelError] = {}
    chosen = file.channels_db.get(request.time, ())
    for name, group, index in entries:
        if not request.wants(name):
            columns.append(Column(name, "", np.empty(0), np.empty(0)))  # named in messages, not read
            continue
        if group not in times:
            times[group] = _times(file, group, request, path)
        own = times[group]
        if isinstance(own, ModelError):
            if request.names is not None:
                raise own
            continue
        if request.names is None and (group, index) in chosen:
            continue
        # numbers of the channel; texts and arrays are no signals
        signal = file.get(group=group, index=index, ignore_invalidation_bits=True)
        values = np.asarray(signal.samples)
        if values.ndim != 1 or values.dtype.kind not in "fiu":
            skipped.append(name)
            continue
        # invalid numbers become gaps
        values = _valid(file, group, index, signal)
        said = _comment_entries(signal.comment or "")
        columns.append(Column(name, signal.unit or "", values, own, **said))
    return columns, skipped, [reason for reason in times.values() if isinstance(reason, ModelError)]


def _valid(file: Any, group: int, index: int, signal: Any) -> Array:
    """Return the samples of a channel; NaN where the file marks them invalid, one by one or all at once."""
    values = np.asarray(signal.samples, np.float64)
    if getattr(file.groups[group].channels[index], "flags", 0) & _ALL_INVALID:
        return np.full(values.size, np.nan)
    if signal.invalidation_bits is not None:
        return np.where(np.asarray(signal.invalidation_bits), np.nan, values)
    return values


def _master(file: Any, group: int) -> tuple[int, int] | None:
    """Return group and index of the master channel of a group, which may be that of another one; of several, of time.

    A master of another kind beside it is a channel.
    """
    elsewhere = getattr(file.groups[group].channel_group, "cg_master_index", None)
    group = group if elsewhere is None else elsewhere
    channels = file.groups[group].channels
    masters = [index for index, channel in enumerate(channels) if channel.channel_type in _MASTERS[file.version >= "4"]]
    masters.sort(key=lambda index: _kind(channels[index]) not in _OF_TIME)
    return (group, masters[0]) if masters else None


def _kind(channel: Any) -> int:
    """Return the synchronisation type of a master; in version 3 all are of time."""
    return int(getattr(channel, "sync_type", _OF_TIME[0]))


def _times(file: Any, group: int, request: Request, path: Path) -> Array | ModelError:
    """Return the times of a group [s]: the channel that is asked for, its master of time, or so many at a rate.

    Where there are none, the error that says so is returned.
    """
    location = f"{path}: group {group}"
    samples = int(file.groups[group].channel_group.cycles_nr)
    if request.time:
        at = next((at for at in file.channels_db.get(request.time, ()) if at[0] == group), None)
        rule = f'has no channel "{request.time}" for its times'
        if at is None:
            return ModelError(Problem(location, "", rule))
        return _seconds(file, at[0], at[1], request.time_unit, location)
    master = _master(file, group)
    channel = None if master is None else file.groups[master[0]].channels[master[1]]
    if master is not None and _kind(channel) in _OF_TIME:
        return _seconds(file, *master, request.time_unit, location)
    if channel is not None and _kind(channel) in _NOT_OF_TIME:
        rule = f"is sampled over {_NOT_OF_TIME[_kind(channel)]}, not over time"
        return ModelError(Problem(location, f"master channel {channel.name} [{channel.unit}]", rule, _EXPORT_OVER_TIME))
    if request.interval is not None:
        return np.asarray(np.arange(samples) * request.interval, np.float64)
    return ModelError(Problem(location, "", "has no master channel, so its samples have no times", _TIMES_TOLD))


def _seconds(file: Any, group: int, index: int, unit: str, location: str) -> Array | ModelError:
    """Return the values of a channel as times [s]; where its unit is no unit of time, the error that says so."""
    channel = file.groups[group].channels[index]
    if hasattr(channel, "sampling_rate") and not channel.bit_count and not channel.sampling_rate:
        return ModelError(Problem(location, "", "has no times and no interval between samples", _TIMES_TOLD))
    signal = file.get(group=group, index=index, ignore_invalidation_bits=True)
    try:
        factor = seconds(unit or signal.unit or "")
    except UnitError as error:
        rule = f"has times whose unit is none of time: {error.rule}"
        return ModelError(Problem(f"{location}: {channel.name}", shown(unit or signal.unit), rule, 'time_unit = "ms"'))
    return factor * _valid(file, group, index, signal)


def _check_size(file: Any, entries: list[tuple[str, int, int]], request: Request) -> None:
    """Ask for the memory of the channels that are wanted and of their times, before they are read (Refused).

    The library maps the file, reads the data of a group a piece at a time, but whole blocks of it, and makes some
    arrays of the length of a channel while it does so.
    """
    file.configure(read_fragment_size=_PIECE)
    wanted = [group for name, group, _ in entries if request.wants(name)]
    groups = sorted(set(wanted))
    samples = {group: int(file.groups[group].channel_group.cycles_nr) for group in groups}
    largest = 0
    mapped = 0
    for group in groups:
        block = 0
        for number, information in enumerate(file.groups[group].get_data_blocks()):
            block = max(block, int(information.original_size))
            mapped += int(information.compressed_size)
            if number > _MOST_BLOCKS:
                raise Refused("its list of data blocks does not end", "copy or export it again")
        largest = max(largest, _ARRAYS * 8 * samples[group] + block)
    ask_for(
        [*(samples[group] for group in wanted), *samples.values()], request._replace(interval=None), largest + mapped
    )


def _check_long_records(file: Any) -> None:
    """Refuse records longer than the data of their group, or of which the copies take more than the limit (Refused).

    The library makes room for a whole record first.
    """
    for group in file.groups:
        record = group.channel_group.samples_byte_nr + getattr(group.channel_group, "invalidation_bytes_nr", 0)
        if record <= _LONG_RECORD:
            continue
        blocks = itertools.islice(group.get_data_blocks(), _MOST_BLOCKS)
        unpacked = sum(min(block.original_size, _MOST_PACKED * block.compressed_size) for block in blocks)
        if record > unpacked:
            value = f"a record of {record} bytes, where the data of its group are {unpacked}"
            raise Refused(f"is damaged: {value}", "copy or export it again")
        within_limit(_COPIES * record)


def _check_records(file: Any) -> None:
    """Refuse channels that lie beyond the records of their group (Refused): the library would read past them."""
    for group in file.groups:
        sizes = (getattr(group.channel_group, f"{part}_nr", 0) for part in ("samples_byte", "invalidation_bytes"))
        bits, invalid = (8 * size for size in sizes)
        for channel in group.channels:
            if hasattr(channel, "start_offset"):  # version 3
                first = channel.start_offset + 8 * getattr(channel, "additional_byte_offset", 0)
                beyond = first + channel.bit_count > bits
            else:
                first = 8 * channel.byte_offset + channel.bit_offset
                beyond = channel.channel_type not in _VIRTUAL and first + channel.bit_count > bits
                beyond |= bool(channel.flags & _CAN_BE_INVALID) and channel.pos_invalidation_bit >= invalid
            if beyond:
                raise Refused("is damaged: a channel lies beyond the records of its group", "copy or export it again")


def write(recording: Recording, path: Path) -> None:
    """Write one group, MDF 4.10, not compressed."""
    mdf = _library(path)
    from asammdf import Signal

    signals = [
        Signal(
            channel.values,
            recording.time,
            name=channel.name,
            unit=channel.unit,
            comment=f"{_MARK}{channel.quantity}, {channel.subject}",
        )
        for channel in recording.channels
    ]
    with mdf(version="4.10") as file:
        file.append(signals, comment=recording.source)
        saved = Path(file.save(path, overwrite=True))
    saved.replace(path)  # the library gives a file its own ending


def _opened(mdf: Any, path: Path, folder: str) -> Any:
    """Open a file, or a finished copy of it in a folder.

    Where that fails, asammdf's half-made object is cleared away before it complains on stderr. Until then nothing is
    collected: the object is in the youngest generation, which alone is looked through.
    """
    hook = sys.unraisablehook
    is_collecting = gc.isenabled()
    gc.disable()
    try:
        try:
            return mdf(path, temporary_folder=folder)
        except Exception as error:
            words = " ".join(str(error).split()) or type(error).__name__
            error.__traceback__ = None
            error.__context__ = None
        sys.unraisablehook = lambda _unraisable: None
        gc.collect(0)
    finally:
        sys.unraisablehook = hook
        if is_collecting:
            gc.enable()
    raise ValueError(words)


def _comment_entries(comment: str) -> dict[str, str]:
    """Return quantity and subject from a comment that ``write`` put there."""
    if not comment.startswith(_MARK):
        return {}
    quantity, _, subject = comment.removeprefix(_MARK).partition(",")
    return {"quantity": quantity, "subject": subject.strip()}


def _library(path: Path) -> Any:
    """Return asammdf's class, quiet: what is wrong raises exceptions."""
    try:
        from asammdf import MDF
    except ImportError:
        rule = "ASAM MDF needs asammdf, which is not installed"
        raise NotInstalled.of("measured", str(path), "", rule) from None
    logging.getLogger("asammdf").setLevel(logging.CRITICAL)
    return MDF
