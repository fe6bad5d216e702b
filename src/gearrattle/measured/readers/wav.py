"""WAV: samples at a whole rate, without names and without units; the mapping must tell them.

Whole numbers are read as parts of full scale, -1 to 1, real numbers as they are. A recording is written as 64-bit real
numbers in SI, not scaled: a player takes what exceeds 1 as too loud. A header without the length of the samples, of a
recorder that was stopped or a program that wrote into a pipe, is read to the end of the file. Formats: IBM, Microsoft,
Multimedia Programming Interface and Data Specifications 1.0 (1991); real numbers are format tag 3; ITU-R BS.2088 (RF64,
BW64).

Takes a path; gives columns "1", "2", ... Takes samples; gives the bytes of a file.
"""

from __future__ import annotations

import io
import os
import struct
import warnings
import wave
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.files import opened, within_limit
from gearrattle.measured.readers.base import Column, Raw, Request, unfit
from gearrattle.recording import Recording
from gearrattle.wording import counted

NAME = "wav"
SUFFIXES = (".wav",)
BITS = (24, 32, 64)
"""Bits a sample: integers, floating point, floating point."""
_TOP = 2**23 - 1
_BELOW_WHOLE = 1e-6
_KINDS = (b"RIFF", b"RIFX", b"RF64", b"BW64")
_UNKNOWN = 0xFFFFFFFF
_LEAST_UNKNOWN = 0x7FFF0000  # a length of samples from here on that passes the end of the file is none


def knows(_path: Path, head: bytes) -> bool:
    """Tell a RIFF file of waves."""
    return head[:4] in _KINDS and head[8:12] == b"WAVE"


def read(path: Path, _request: Request) -> Raw:
    """Return one column a track."""
    from scipy.io import wavfile

    with warnings.catch_warnings():
        warnings.simplefilter("error", wavfile.WavFileWarning)
        content, notes = _samples(path)
        rate, data = wavfile.read(content)
    table = data.reshape(data.shape[0], -1)
    if np.issubdtype(table.dtype, np.integer):
        middle = 128.0 if table.dtype == np.uint8 else 0.0
        full = 128.0 if table.dtype == np.uint8 else float(np.iinfo(table.dtype).max) + 1.0
        table = (table - middle) / full
    time = np.arange(table.shape[0]) / float(rate)
    with np.errstate(all="ignore"):  # damaged numbers may lie beyond a double
        tracks = np.asarray(table, np.float64)
    columns = [Column(str(k + 1), "", tracks[:, k], time) for k in range(tracks.shape[1])]
    return Raw(tuple(columns), str(path), NAME, notes)


def _samples(path: Path) -> tuple[io.BytesIO, tuple[str, ...]]:
    """Return a file with the form of the samples and the samples only, whose lengths are those that are there.

    Raises
    ------
    ModelError
        the file is shorter than its header says, or has no samples.
    Refused
        it is larger than the limit when it is unpacked.
    """
    with opened(path) as stream:
        size = os.fstat(stream.fileno()).st_size
        kind = stream.read(12)[:4]
        if kind not in _KINDS:
            raise ValueError(f"begins with {kind!r}, not with RIFF")
        order = ">" if kind == b"RIFX" else "<"
        form = b""
        long = 0
        while len(chunk := stream.read(8)) == 8:
            name, length = struct.unpack(f"{order}4sI", chunk)
            start = stream.tell()
            rest = size - start
            if name == b"data":
                length = long if long and length == _UNKNOWN else length
                if length == 0 and _are_chunks(stream, rest, order):
                    continue
                block = _block(form, order, path)
                taken, notes = _taken(length, rest, block, path)
                within_limit(taken + 8 * (taken // _bytes_a_sample(form, order)))
                return _rebuilt(kind, order, form, stream.read(taken)), notes
            if length > rest:
                raise _shorter(path, rest, "a header", length)
            if name == b"ds64":  # lengths of RF64, which holds more than 4 GB
                long = int(struct.unpack("<QQ", stream.read(16))[1])
            if name == b"fmt ":
                form = stream.read(length)
            stream.seek(start + length + length % 2)
    raise ModelError(Problem(str(path), "", "has no samples", "is this the whole record?"))


def _taken(length: int, rest: int, block: int, path: Path) -> tuple[int, tuple[str, ...]]:
    """Return how many bytes of samples are read, all that the header tells; where it tells none, to the end.

    Raises
    ------
    ModelError
        the header tells more than there are.
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
    """Return the refusal of a file that is shorter than its header says."""
    rule = f"its header says {length}: the file is truncated"
    return ModelError(Problem(str(path), f"{rest} bytes of {what}", rule, "copy or export it again"))


def _are_chunks(stream: BinaryIO, rest: int, order: str) -> bool:
    """Tell whether what follows are chunks that end with the file, and no samples; stays where it is in the file."""
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
    """Return the bytes of one sample of all tracks.

    Raises
    ------
    ModelError
        the file does not say it before the samples.
    """
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
    """Return a file of these samples."""
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
    """A WAV file.

    Parameters
    ----------
    values
        (N,) or (N, tracks) samples.
    rate
        samples a second [Hz].
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
