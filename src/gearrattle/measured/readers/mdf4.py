"""ASAM MDF, versions 3 and 4, through asammdf (extra ``measured``).

Every channel has its own times, those of its group; a name that occurs in several groups gets their number behind it.
Raw values become physical ones as the file says; channels of texts are left out. Format: ASAM MDF 4.1.

Takes a path; gives columns with times.
"""

from __future__ import annotations

import gc
import logging
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from gearrattle.errors import ModelError, NotInstalled, Problem
from gearrattle.files import Refused, opened, within_limit
from gearrattle.measured.readers.base import Column, Raw, Request
from gearrattle.measured.readers.mdf_lists import check_lists
from gearrattle.recording import Recording

NAME = "mdf4"
SUFFIXES = (".mf4", ".mdf", ".dat")
_MARK = "gearrattle: "
_MOST_BLOCKS = 1_000_000
_VIRTUAL = (3, 6)  # types of channels that have no bytes
_CAN_BE_INVALID = 2  # flag of a channel


def knows(_path: Path, head: bytes) -> bool:
    """Tell the identification block, finished or not."""
    return head[:8] in (b"MDF     ", b"UnFinMF ")


def read(path: Path, request: Request) -> Raw:
    """Return its channels of numbers."""
    mdf = _library(path)
    with opened(path) as stream:
        if stream.read(8) == b"UnFinMF ":
            rule = "the file was not finished: its writer was interrupted"
            raise ModelError(Problem(str(path), "", rule, "finalise it with the measuring system's tool"))
        check_lists(stream)
    columns: list[Column] = []
    skipped: list[str] = []
    with _opened(mdf, path) as file:
        _check_records(file)
        masters = set(file.masters_db.items())
        entries = [(name, *at) for name, places in file.channels_db.items() for at in places if at not in masters]
        entries.sort(key=lambda entry: entry[1:])
        _check_size(file, entries, request)
        count = Counter(name for name, _, _ in entries)
        for name, group, index in entries:
            full = name if count[name] == 1 else f"{name}[{group}]"
            if request.names is not None and full not in request.names:
                columns.append(Column(full, "", np.empty(0), np.empty(0)))  # named in messages, not read
                continue
            signal = file.get(group=group, index=index, ignore_invalidation_bits=True)
            values = np.asarray(signal.samples)
            if values.ndim != 1 or values.dtype.kind not in "fiu":
                skipped.append(full)
                continue
            if signal.invalidation_bits is not None:
                values = np.where(np.asarray(signal.invalidation_bits), np.nan, values)
            said = _comment_entries(signal.comment or "")
            times = np.asarray(signal.timestamps, np.float64)
            columns.append(Column(full, signal.unit or "", values.astype(np.float64), times, **said))
    if not columns:
        raise ModelError(Problem(str(path), ", ".join(skipped[:8]), "holds no channels of numbers"))
    notes = (f"no signals, left out: {', '.join(skipped)}",) if skipped else ()
    return Raw(tuple(columns), str(path), NAME, notes)


def _check_size(file: Any, entries: list[tuple[str, int, int]], request: Request) -> None:
    """Refuse groups that unpack to more than the limit, before they are read.

    Raises
    ------
    Refused
        they do.
    """
    groups = {group for name, group, _ in entries if request.names is None or name in request.names}
    samples = {group: int(file.groups[group].channel_group.cycles_nr) for group in groups}
    within_limit(sum(16 * samples[group] for _, group, _ in entries if group in groups))
    for group in groups:
        records = file.groups[group].channel_group
        record = records.samples_byte_nr + getattr(records, "invalidation_bytes_nr", 0)
        within_limit(samples[group] * record)
    unpacked = 0
    for group in groups:
        for number, block in enumerate(file.groups[group].get_data_blocks()):
            unpacked += int(block.original_size)
            within_limit(unpacked)
            if number > _MOST_BLOCKS:
                raise Refused("its list of data blocks does not end", "copy or export it again")


def _check_records(file: Any) -> None:
    """Refuse channels that lie beyond the records of their group: the library would read past them.

    Raises
    ------
    Refused
        there is one.
    """
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


def _opened(mdf: Any, path: Path) -> Any:
    """Open a file; where that fails, asammdf's half-made object is cleared away before it complains on stderr.

    Until then nothing is collected: the object is in the youngest generation, which alone is looked through.
    """
    hook, is_collecting = sys.unraisablehook, gc.isenabled()
    gc.disable()
    try:
        try:
            return mdf(path)
        except Exception as error:
            words = " ".join(str(error).split()) or type(error).__name__
            error.__traceback__ = error.__context__ = None
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
    """Return asammdf's class, quiet: what is wrong is told by exceptions."""
    try:
        from asammdf import MDF
    except ImportError:
        rule = "ASAM MDF needs asammdf, which is not installed"
        raise NotInstalled(Problem(str(path), "", rule, "pip install 'gearrattle[measured]'")) from None
    logging.getLogger("asammdf").setLevel(logging.CRITICAL)
    return MDF
