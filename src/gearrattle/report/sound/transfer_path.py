"""The transfer path from an impulse in a gear mesh to sound pressure at the ear: an impulse response [Pa/(N s)].

Without a measured response, damped modes represent the casing and its radiation,

    h(t) = sum of g exp(-zeta omega t) sin(omega_d t),      omega_d = omega sqrt(1 - zeta^2),

computed from its spectrum g omega_d / (omega^2 - w^2 + 2 i zeta omega w), so that there is no aliasing. ``CASING`` is
ASSUMED, not measured: six modes at frequencies where the casing of a car gearbox may have its modes, with gains that
give 66 dB for the rattle of ``examples/manual_transmission.toml``. Use it to compare designs, not to predict a level.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.model import units
from gearrattle.model.csv_columns import read_columns
from gearrattle.model.csv_layout import RecordError
from gearrattle.model.units import Dimension
from gearrattle.wording import counted

Array = NDArray[np.float64]

CASING = (
    (640.0, 0.020, 0.8),
    (1150.0, 0.018, 1.0),
    (1900.0, 0.015, 1.0),
    (2800.0, 0.015, 0.8),
    (4200.0, 0.012, 0.5),
    (6100.0, 0.012, 0.3),
)
"""Frequency [Hz], damping ratio and gain [Pa/(N s)] of the modes that represent a gearbox; assumed."""
RESPONSE = Dimension("response per impulse", "Pa/(N*s)", (0, -2, -1, 0), "1 Pa/(N*s)")

LEAD = 64
"""Samples of a response before the impulse: a band-limited response starts a little before it."""
_QUIET = 1e-6  # largest amplitude of a mode at the end, relative to the start
_LONGEST = 30.0  # seconds


@dataclass(frozen=True, eq=False)
class SoundPath:
    """An impulse response.

    Attributes
    ----------
    response
        (N,) [Pa/(N s)]; the impulse is at sample ``lead``.
    rate
        sampling rate [Hz].
    lead
        samples before the impulse.
    """

    response: Array
    rate: float
    lead: int
    source: str


def sound_path(
    source: str | os.PathLike[str] | Sequence[tuple[float, float, float]] | None, rate: float, scale: float = 1.0
) -> SoundPath:
    """Make a sound path.

    Parameters
    ----------
    source
        None: the assumed casing; rows of frequency [Hz], damping ratio and gain [Pa/(N s)]; a path of a WAV
        file; or of a CSV file with the columns ``time [s], response [Pa/(N*s)]``.
    rate
        sampling rate of the result [Hz].
    scale
        response that the value 1 in a WAV file means [Pa/(N s)].

    Raises
    ------
    ModelError
        a mode out of range, a file that cannot be read.
    """
    if source is None:
        return modal_path(CASING, rate, "assumed casing of six modes")
    if isinstance(source, str | os.PathLike):
        return _measured(Path(source), rate, scale)
    try:
        rows = [(float(f), float(z), float(g)) for f, z, g in source]
    except (TypeError, ValueError):
        rule = "must be rows of frequency [Hz], damping ratio and gain [Pa/(N s)], or the path of a WAV or CSV file"
        raise ModelError(Problem("path", repr(source)[:60], rule, "such as [(1200, 0.02, 1.0)]")) from None
    return modal_path(rows, rate, f"{counted(len(rows), 'mode')} given")


def modal_path(modes: Sequence[tuple[float, float, float]], rate: float, source: str) -> SoundPath:
    """The band-limited impulse response of damped modes: frequency [Hz], damping ratio, gain [Pa/(N s)]."""
    # refuse modes out of range
    for i, (frequency, damping, gain) in enumerate(modes):
        is_valid = 0.0 < frequency < 0.5 * rate and 0.0 < damping < 1.0 and math.isfinite(gain)
        if not is_valid:
            value = f"{frequency:g} Hz, damping {damping:g}, gain {gain:g}"
            rule = f"a mode must lie between 0 and {0.5 * rate:g} Hz, its damping ratio between 0 and 1"
            raise ModelError(Problem(f"path.{i}", value, rule))
    if not modes:
        raise ModelError(Problem("path", "no modes", "must have at least one mode"))
    # length: until the slowest mode has decayed
    slowest = min(2.0 * math.pi * f * z for f, z, _ in modes)
    seconds = -math.log(_QUIET) / slowest
    if seconds > _LONGEST:
        rule = f"a mode must decay within {_LONGEST:g} s"
        raise ModelError(Problem("path", f"{seconds:.3g} s", rule, "increase its damping"))
    number = 2 * math.ceil(0.5 * seconds * rate) + 2 * LEAD
    # the spectrum of the damped modes, sampled
    w = 2.0 * math.pi * np.fft.rfftfreq(number, 1.0 / rate)
    spectrum = np.zeros(w.size, dtype=complex)
    for frequency, damping, gain in modes:
        omega = 2.0 * math.pi * frequency
        spectrum += gain * omega * math.sqrt(1.0 - damping**2) / (omega**2 - w**2 + 2j * damping * omega * w)
    # the impulse response, with its impulse at sample LEAD
    response = np.fft.irfft(spectrum * rate, number)
    return SoundPath(np.roll(response, LEAD), rate, LEAD, source)


def _measured(path: Path, rate: float, scale: float) -> SoundPath:
    from gearrattle.measured.readers import read_raw, wav
    from gearrattle.report.sound.resample import resampled

    if not path.exists():
        raise ModelError(Problem(str(path), "", "no such file", "a WAV or CSV file with an impulse response is needed"))
    if path.suffix.lower() == ".wav":
        track = read_raw(path, format=wav.NAME).columns[0]
        assert track.time is not None
        values = resampled(scale * track.values, round(1.0 / track.time[1]), rate, str(path))
        return SoundPath(values, rate, 0, str(path))
    try:
        columns = read_columns(path, {"time": units.TIME, "response": RESPONSE}, False)
    except RecordError as error:
        raise ModelError(Problem(error.place, error.value, error.rule, error.remedy)) from None
    time = columns.values["time"]
    values = columns.values["response"]
    step = float(time[-1] - time[0]) / max(1, time.size - 1)
    if time.size < 2 or step <= 0.0 or np.abs(np.diff(time) - step).max() > 1e-3 * step:
        raise ModelError(Problem(str(path), counted(time.size, "sample"), "the times must increase by equal steps"))
    return SoundPath(resampled(values, 1.0 / step, rate, str(path)), rate, 0, str(path))
