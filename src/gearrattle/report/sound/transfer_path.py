"""Read the transfer path from an impulse in a gear mesh to sound pressure at the ear, assumed, of modes or measured."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.model import units
from gearrattle.model.csv_columns import read_columns
from gearrattle.model.csv_layout import RecordError
from gearrattle.model.units import Dimension
from gearrattle.signals.impact_sound import ASSUMED, CASING, SoundPath, modal_path
from gearrattle.wording import counted

Array = NDArray[np.float64]

RESPONSE = Dimension("response per impulse", "Pa/(N*s)", (0, -2, -1, 0), "1 Pa/(N*s)")


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
        return modal_path(CASING, rate, ASSUMED)
    if isinstance(source, str | os.PathLike):
        return _measured(Path(source), rate, scale)
    try:
        rows = [(float(f), float(z), float(g)) for f, z, g in source]
    except (TypeError, ValueError):
        rule = "must be rows of frequency [Hz], damping ratio and gain [Pa/(N s)], or the path of a WAV or CSV file"
        raise ModelError(Problem("path", repr(source)[:60], rule, "such as [(1200, 0.02, 1.0)]")) from None
    return modal_path(rows, rate, f"{counted(len(rows), 'mode')} given")


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
