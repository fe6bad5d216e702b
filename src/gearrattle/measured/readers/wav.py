"""WAV: samples at a whole rate, without names and without units; the mapping must state them.

Integers are read as fractions of full scale, -1 to 1, floating-point numbers as they are. A recording is written as
64-bit floating-point numbers in SI, not scaled: a player clips numbers above 1. A header without the length of the
samples, of a recorder that was stopped or a program that wrote into a pipe, is read to the end of the file. Formats:
IBM, Microsoft, Multimedia Programming Interface and Data Specifications 1.0 (1991); real numbers are format tag 3;
ITU-R BS.2088 (RF64, BW64).

The columns of a file are called "1", "2", ...
"""

from __future__ import annotations

import io
import os
import struct
import warnings
import wave
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.files import opened
from gearrattle.measured.readers.reader import Column, Raw, Request, ask_for, unfit
from gearrattle.recording import Array, Recording
from gearrattle.wording import counted

NAME = "wav"
SUFFIXES = (".wav",)
BITS = (24, 32, 64)
"""Bits a sample: integers, floating point, floating point."""
_TOP = 2**23 - 1
_BELOW_WHOLE = 1e-6
_KINDS = (b"RIFF", b"RIFX", b"RF64", b"BW64")
_UNKNOWN = 0xFFFFFFFF
_LEAST_UNKNOWN = 0x7FFF0000  # a length of samples from here on that exceeds the file counts as unknown

_PIECE = 1_000_000  # bytes of samples that are unpacked at once
_LONGEST_FORM = 10_000  # bytes of a header that are read


def knows(_path: Path, head: bytes) -> bool:
    """Return whether a file is RIFF with WAVE."""
    return head[:4] in _KINDS and head[8:12] == b"WAVE"


class _Samples(NamedTuple):
    """Form, position and byte count of the samples of an open file."""

    kind: bytes
    order: str
    form: bytes
    size: int
    notes: tuple[str, ...]

    @property
    def block(self) -> int:
        """Bytes of one sample of all tracks."""
        return int(struct.unpack(f"{self.order}H", self.form[12:14])[0])

    @property
    def tracks(self) -> int:
        """How many there are."""
        return int(struct.unpack(f"{self.order}H", self.form[2:4])[0])


def read(path: Path, request: Request) -> Raw:
    """Return one column a track; tracks that are not asked for have a name only."""
    with opened(path) as stream:
        samples = _samples(stream, path)
        names = [str(k + 1) for k in range(samples.tracks)]
        wanted = [k for k, name in enumerate(names) if request.wants(name)]
        length = samples.size // samples.block
        ask_for([length] * (len(wanted) + 1), request)
        table, rate = _read(stream, samples, wanted)
    time = np.arange(length, dtype=np.float64)
    time /= rate
    columns = [Column(name, "", np.empty(0), time) for name in names]
    for k, values in zip(wanted, table, strict=True):
        columns[k] = Column(names[k], "", values, time)
    return Raw(tuple(columns), str(path), NAME, samples.notes)


def _read(stream: BinaryIO, samples: _Samples, wanted: list[int]) -> tuple[Array, float]:
    """Return the wanted tracks (tracks, N) and their rate [Hz], unpacked a piece at a time.

    ValueError for a form of samples that is not known.
    """
    from scipy.io import wavfile

    table = np.empty((len(wanted), samples.size // samples.block))
    step = max(1, _PIECE // samples.block)
    rate = 0
    with warnings.catch_warnings():
        warnings.simplefilter("error", wavfile.WavFileWarning)
        for begin in range(0, max(1, table.shape[1]), step):
            count = min(step, table.shape[1] - begin)
            bytes_read = stream.read(count * samples.block)
            rate, piece = wavfile.read(_rebuilt(samples.kind, samples.order, samples.form, bytes_read))
            rows = piece.reshape(piece.shape[0], -1)
            if np.issubdtype(rows.dtype, np.integer):
                middle = 128.0 if rows.dtype == np.uint8 else 0.0
                full = 128.0 if rows.dtype == np.uint8 else float(np.iinfo(rows.dtype).max) + 1.0
                rows = (rows - middle) / full
            with np.errstate(all="ignore"):  # damaged numbers may lie beyond a double
                table[:, begin : begin + count] = rows[:, wanted].T
    return table, float(rate)


def _samples(stream: BinaryIO, path: Path) -> _Samples:
    """Return the form of a file's samples, with the file positioned at them.

    A ModelError refuses a file that is shorter than its header says, or has no samples.
    """
    # kind of file and order of bytes
    size = os.fstat(stream.fileno()).st_size
    kind = stream.read(12)[:4]
    if kind not in _KINDS:
        raise ValueError(f"begins with {kind!r}, not with RIFF")
    order = ">" if kind == b"RIFX" else "<"
    form = b""
    long = 0
    # go from block to block until the samples
    while len(chunk := stream.read(8)) == 8:
        name, length = struct.unpack(f"{order}4sI", chunk)
        start = stream.tell()
        rest = size - start
        if name == b"data":
            length = long if long and length == _UNKNOWN else length
            if length == 0 and _are_chunks(stream, rest, order):
                continue
            taken, notes = _taken(length, rest, _block(form, order, path), path)
            return _Samples(kind, order, form, taken, notes)
        if length > rest:
            raise _shorter(path, rest, "a header", length)
        # lengths and form of the samples
        if name == b"ds64":  # lengths of RF64, which holds more than 4 GB
            long = int(struct.unpack("<QQ", stream.read(16))[1])
        if name == b"fmt ":
            form = stream.read(min(length, _LONGEST_FORM))
        stream.seek(start + length + length % 2)
    raise ModelError(Problem(str(path), "", "has no samples", "is this the whole record?"))


def _taken(length: int, rest: int, block: int, path: Path) -> tuple[int, tuple[str, ...]]:
    """Return how many bytes of samples are read: the count of the header, or without one all to the end.

    A ModelError refuses a header that states more than there are.
    """
    if length > 0 and length <= rest:
        return length, ()
    if 0 < length < _LEAST_UNKNOWN:
        raise _shorter(path, rest, "samples", length)
    taken = rest - rest % block
    why = "a recorder that was stopped" if length == 0 else "a program that writes into a pipe"
    says = f"its header says {length} bytes of samples, as {why} leaves it"
    return taken, (f"{says}: read to the end of the file, {counted(taken // block, 'sample')} a track",)


def _shorter(path: Path, rest: int, what: str, length: int) -> ModelError:
    """Return the error for a file that is shorter than its header states."""
    rule = f"its header says {length}: the file is truncated"
    return ModelError(Problem(str(path), f"{rest} bytes of {what}", rule, "copy or export it again"))


def _are_chunks(stream: BinaryIO, rest: int, order: str) -> bool:
    """Return whether chunks up to the end of the file follow, no samples; the position in the file is kept."""
    start = stream.tell()
    end = start + rest
    at = start
    while at + 8 <= end:
        stream.seek(at)
        name, length = struct.unpack(f"{order}4sI", stream.read(8))
        if not (name.isascii() and name.decode("ascii").isprintable()):
            break
        at += 8 + length + length % 2
    stream.seek(start)
    return at in (end, end + 1)


def _block(form: bytes, order: str, path: Path) -> int:
    """Return the bytes of one sample of all tracks; ModelError where the file does not state its form."""
    block = int(struct.unpack(f"{order}H", form[12:14])[0]) if len(form) >= 16 else 0
    if block == 0 or _bytes_a_sample(form, order) == 0:
        rule = "does not tell the form of its samples: damaged"
        raise ModelError(Problem(str(path), "", rule, "copy or export it again"))
    return block


def _bytes_a_sample(form: bytes, order: str) -> int:
    """Return the bytes of one sample of one track."""
    tracks, block = struct.unpack(f"{order}2xH8xH2x", form[:16])
    return int(block // tracks) if tracks else 0


def _rebuilt(kind: bytes, order: str, form: bytes, samples: bytes) -> io.BytesIO:
    """Return the bytes of a file with these samples."""
    length = 20 + len(form) + len(samples)
    head = struct.pack(f"{order}4sI4s", b"RIFX" if kind == b"RIFX" else b"RIFF", min(length, _UNKNOWN), b"WAVE")
    if length > _UNKNOWN:
        head = struct.pack("<4sI4s4sIQQQI", b"RF64", _UNKNOWN, b"WAVE", b"ds64", 28, length + 36, len(samples), 0, 0)
    parts = (
        head,
        struct.pack(f"{order}4sI", b"fmt ", len(form)),
        form,
        struct.pack(f"{order}4sI", b"data", min(len(samples), _UNKNOWN)),
        samples,
    )
    return io.BytesIO(b"".join(parts))


def write(recording: Recording, path: Path) -> None:
    """Write every channel as a track; names, units and the time of the first sample are lost."""
    interval = recording.interval
    rate = 0.0 if interval is None else 1.0 / interval
    if interval is None or abs(rate - round(rate)) > _BELOW_WHOLE * rate:
        value = "samples that are not uniform" if interval is None else f"{rate:.9g} Hz"
        raise unfit(path, value, "WAV holds samples at a whole number of Hz", 'resample: rate = "10 kHz" in a mapping')
    table = np.stack([channel.values for channel in recording.channels], axis=1)
    path.write_bytes(wav_bytes(table, round(rate), 64))


def wav_bytes(values: NDArray[np.float64], rate: int, bits: int) -> bytes:
    """Return the bytes of a WAV file.

    Parameters
    ----------
    values
        (N,) or (N, tracks) samples.
    rate
        samples per second [Hz].
    bits
        24 (integers; 1 is full scale), 32 or 64 (floating point, as they are).

    Raises
    ------
    ModelError
        another number of bits; 24 bits and a value beyond full scale.
    """
    if bits not in BITS:
        raise ModelError(Problem("bits", str(bits), "must be 24 (integers), 32 or 64 (floating point)"))
    stream = io.BytesIO()
    if bits > 24:
        from scipy.io import wavfile

        wavfile.write(stream, rate, values.astype(f"f{bits // 8}"))
        return stream.getvalue()
    peak = float(np.abs(values).max(initial=0.0))
    if peak > 1.0:
        rule = "24-bit samples must not pass full scale"
        raise ModelError(Problem("gain", f"a peak of {peak:.4g}", rule, "give a smaller gain, or 32 bits"))
    integers = np.round(values * _TOP).astype("<i4")
    with wave.open(stream, "wb") as file:
        file.setnchannels(1 if values.ndim == 1 else values.shape[1])
        file.setsampwidth(3)
        file.setframerate(rate)
        file.writeframes(integers.view(np.uint8).reshape(-1, 4)[:, :3].tobytes())
    return stream.getvalue()
