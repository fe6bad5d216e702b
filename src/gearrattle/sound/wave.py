"""WAV files: mono, 32-bit float or 24-bit integers.

Takes samples between -1 and 1; gives bytes, and reads such files back.
"""

from __future__ import annotations

import io
import wave
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.files import Refused
from gearrattle.readers.wav import check_length

Array = NDArray[np.float64]

BITS = (24, 32)
"""Bits a sample: integers, floating point."""
_TOP = 2**23 - 1


def wav_bytes(values: Array, rate: int, bits: int) -> bytes:
    """A WAV file.

    Args:
        values: (N,) over full scale.
        rate: samples a second [Hz].
        bits: 24 (integers) or 32 (floating point).

    Raises:
        ModelError: another number of bits; 24 bits and a value beyond full scale.
    """
    if bits not in BITS:
        raise ModelError(Problem("bits", str(bits), "must be 24 (integers) or 32 (floating point)"))
    stream = io.BytesIO()
    if bits == 32:
        from scipy.io import wavfile

        wavfile.write(stream, rate, values.astype(np.float32))
        return stream.getvalue()
    peak = float(np.abs(values).max(initial=0.0))
    if peak > 1.0:
        rule = "24-bit samples must not pass full scale"
        raise ModelError(Problem("gain", f"a peak of {peak:.4g}", rule, "give a smaller gain, or 32 bits"))
    whole = np.round(values * _TOP).astype("<i4")
    with wave.open(stream, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(3)
        file.setframerate(rate)
        file.writeframes(whole.view(np.uint8).reshape(-1, 4)[:, :3].tobytes())
    return stream.getvalue()


def read_wav(path: Path) -> tuple[Array, float]:
    """Read the first channel of a WAV file: (N,) over full scale, and its rate [Hz].

    Raises:
        ModelError: the file cannot be read.
    """
    from scipy.io import wavfile

    try:
        check_length(path)
        rate, raw = wavfile.read(path)
    except Refused as error:
        raise ModelError(Problem(str(path), "", error.rule, error.remedy)) from None
    except (ModelError, MemoryError):
        raise
    except Exception as error:  # SciPy complains of a damaged header as it likes
        raise ModelError(Problem(str(path), "", f"must be a WAV file: {error}")) from None
    values = np.asarray(raw)
    first = values if values.ndim == 1 else values[:, 0]
    if first.size == 0:
        raise ModelError(Problem(str(path), "no samples", "a WAV file must hold samples"))
    if first.dtype == np.uint8:
        return (first.astype(np.float64) - 128.0) / 128.0, float(rate)
    full = 1.0 if first.dtype.kind == "f" else float(-np.iinfo(first.dtype).min)
    return first.astype(np.float64) / full, float(rate)
