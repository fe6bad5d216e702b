"""WAV: samples at a whole rate, without names and without units; the mapping must tell them.

Whole numbers are read as parts of full scale, -1 to 1, real numbers as they are. A recording is written as 64-bit real
numbers in SI, not scaled: a player takes what exceeds 1 as too loud. Format: IBM, Microsoft, Multimedia Programming
Interface and Data Specifications 1.0 (1991); real numbers are format tag 3.

Takes a path; gives columns "1", "2", ... Takes samples; gives the bytes of a file.
"""

from __future__ import annotations

import io
import os
import struct
import warnings
import wave
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.files import opened, within_limit
from gearrattle.measured.readers.base import Column, Raw, Request, unfit
from gearrattle.recording import Recording

NAME = "wav"
SUFFIXES = (".wav",)
BITS = (24, 32, 64)
"""Bits a sample: integers, floating point, floating point."""
_TOP = 2**23 - 1
_BELOW_WHOLE = 1e-6


def knows(_path: Path, head: bytes) -> bool:
    """Tell a RIFF file of waves."""
    return head[:4] in (b"RIFF", b"RIFX", b"RF64") and head[8:12] == b"WAVE"


def read(path: Path, _request: Request) -> Raw:
    """Return one column a track."""
    from scipy.io import wavfile

    _check_length(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error", wavfile.WavFileWarning)  # among them: the data end before the header says
        warnings.filterwarnings("ignore", message="Chunk .* not understood", category=wavfile.WavFileWarning)
        rate, data = wavfile.read(path)
    table = data.reshape(data.shape[0], -1)
    if np.issubdtype(table.dtype, np.integer):
        middle = 128.0 if table.dtype == np.uint8 else 0.0
        full = 128.0 if table.dtype == np.uint8 else float(np.iinfo(table.dtype).max) + 1.0
        table = (table - middle) / full
    time = np.arange(table.shape[0]) / float(rate)
    with np.errstate(all="ignore"):  # damaged numbers may lie beyond a double
        tracks = np.asarray(table, np.float64)
    columns = [Column(str(k + 1), "", tracks[:, k], time) for k in range(tracks.shape[1])]
    return Raw(tuple(columns), str(path), NAME)


def _check_length(path: Path) -> None:
    """Refuse a file that is shorter than its header says, or larger than the limit when it is unpacked.

    Raises
    ------
    ModelError
        it is shorter.
    Refused
        it is larger.
    """
    with opened(path) as stream:
        size = os.fstat(stream.fileno()).st_size
        within_limit(8 * size)  # of one-byte samples
        head = stream.read(12)
        if head[:4] not in (b"RIFF", b"RIFX", b"RF64"):
            return
        order = ">" if head[:4] == b"RIFX" else "<"
        long = 0
        while len(chunk := stream.read(8)) == 8:
            name, length = struct.unpack(f"{order}4sI", chunk)
            if name == b"ds64":  # lengths of RF64, which holds more than 4 GB
                long = int(struct.unpack("<QQ", stream.read(16))[1])
                length -= 16
            if name == b"data":
                length = long or length
            if stream.tell() + length > size:
                value = f"{size - stream.tell()} bytes of {'samples' if name == b'data' else 'a header'}"
                rule = f"its header says {length}: the file is truncated"
                raise ModelError(Problem(str(path), value, rule, "copy or export it again"))
            if name == b"data":
                return
            stream.seek(length + length % 2, os.SEEK_CUR)


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
