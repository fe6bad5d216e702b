"""Read the transfer path from a force in a gearbox to sound pressure at the ear: assumed, of modes or measured."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.model import units
from gearrattle.model.csv_columns import read_all, read_columns
from gearrattle.model.csv_layout import RecordError
from gearrattle.model.table import listed
from gearrattle.model.units import PRESSURE_PER_FORCE, Dimension
from gearrattle.report.sound.resample import resampled
from gearrattle.signals.frequency_response import FrequencyResponse, path_of
from gearrattle.signals.impact_sound import ASSUMED, CASING, SoundPath, modal_path
from gearrattle.wording import counted

Array = NDArray[np.float64]

RESPONSE = Dimension("response per impulse", "Pa/(N*s)", (0, -2, -1, 0), "1 Pa/(N*s)")
_OF_RESPONSE = {"time": units.TIME, "response": RESPONSE}
_PARTS = {"frequency": units.FREQUENCY, "real": PRESSURE_PER_FORCE, "imaginary": PRESSURE_PER_FORCE}
_POLAR = {"frequency": units.FREQUENCY, "magnitude": PRESSURE_PER_FORCE, "phase": units.ANGLE}
_ALONG = {1: "x", 2: "y"}
_SOURCES = (
    "must be rows of frequency [Hz], damping ratio and gain [Pa/(N s)], the path of a file with an impulse or a "
    "frequency response, or a mapping from forces to these"
)
OnePath = str | os.PathLike[str] | Sequence[tuple[float, float, float]]
PathSource = OnePath | Mapping[str, OnePath] | None


class ReadPath(NamedTuple):
    """A path, and notes on it."""

    path: SoundPath
    notes: tuple[str, ...] = ()


def sound_path(source: PathSource, rate: float, scale: float = 1.0) -> SoundPath:
    """Make a sound path; arguments and errors as ``read_path``, without its notes."""
    return read_path(source, rate, scale).path


def read_path(source: PathSource, rate: float, scale: float = 1.0) -> ReadPath:
    """Make a sound path.

    Parameters
    ----------
    source
        None: the assumed casing; rows of frequency [Hz], damping ratio and gain [Pa/(N s)]; a path of a WAV file; of a
        CSV file with the columns ``time [s], response [Pa/(N*s)]``, ``frequency [Hz], real [Pa/N], imaginary [Pa/N]``
        or ``frequency [Hz], magnitude [Pa/N], phase [deg]``; of a universal file (dataset 58); or a mapping from forces
        to these: "x" and "y", of all bearings, or forces of bearings such as "front.x".
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
        return ReadPath(modal_path(CASING, rate, ASSUMED))
    if isinstance(source, Mapping):
        if not source or not all(isinstance(force, str) for force in source):
            rule = "paths of several forces stand by the names of these"
            raise ModelError(Problem("path", listed(map(str, source)), rule, '{"x": ..., "y": ...}'))
        return _of_forces({force: read_path(of_force, rate, scale) for force, of_force in source.items()})
    if isinstance(source, str | os.PathLike):
        return _measured(Path(source), rate, scale)
    try:
        rows = [(float(f), float(z), float(g)) for f, z, g in source]
    except (TypeError, ValueError):
        raise ModelError(Problem("path", repr(source)[:60], _SOURCES, "such as [(1200, 0.02, 1.0)]")) from None
    return ReadPath(modal_path(rows, rate, f"{counted(len(rows), 'mode')} given"))


def _of_forces(read: Mapping[str, ReadPath]) -> ReadPath:
    """Return the path of several forces, with their impulses at one sample."""
    paths = {force: of_force.path for force, of_force in read.items()}
    if several := next((path.source for path in paths.values() if path.forces), ""):
        raise ModelError(Problem("path", several, "holds the responses to several forces: give it alone"))
    lead = max(path.lead for path in paths.values())
    samples = max(lead - path.lead + path.response.size for path in paths.values())
    response = np.zeros((len(paths), samples))
    for row, path in zip(response, paths.values(), strict=True):
        begin = lead - path.lead
        row[begin : begin + path.response.size] = path.response
    source = "; ".join(f"{force}: {path.source}" for force, path in paths.items())
    rate = next(iter(paths.values())).rate
    notes = tuple(note for of_force in read.values() for note in of_force.notes)
    return ReadPath(SoundPath(response, rate, lead, source, tuple(paths)), notes)


def _measured(path: Path, rate: float, scale: float) -> ReadPath:
    """Read a file with an impulse or a frequency response."""
    from gearrattle.measured.readers import format_of, read_raw, uff, wav

    if not path.exists():
        remedy = "a WAV, CSV or universal file with an impulse or a frequency response is needed"
        raise ModelError(Problem(str(path), "", "no such file", remedy))
    if path.suffix.lower() == ".wav":
        track = read_raw(path, format=wav.NAME).columns[0]
        assert track.time is not None
        values = resampled(scale * track.values, round(1.0 / track.time[1]), rate, str(path))
        return ReadPath(SoundPath(values, rate, 0, str(path)))
    if format_of(path) == uff.NAME:
        return _universal(path, rate)
    try:
        return _tabulated(path, rate)
    except RecordError as error:
        raise ModelError(Problem(error.place, error.value, error.rule, error.remedy)) from None


def _tabulated(path: Path, rate: float) -> ReadPath:
    """Read a CSV file with a response over time or frequency; RecordError where it is none."""
    # a response over frequency, in parts or polar
    names = {head.name for head in read_all(path, lambda _name, _unit: False)[0].heads}
    if "frequency" in names:
        wanted = _POLAR if "magnitude" in names else _PARTS
        columns = read_columns(path, wanted, False).values
        if wanted is _POLAR:
            value = columns["magnitude"] * np.exp(1j * columns["phase"])
        else:
            value = columns["real"] + 1j * columns["imaginary"]
        return ReadPath(*path_of(FrequencyResponse(columns["frequency"], value, str(path)), rate))
    # a response over time
    columns = read_columns(path, _OF_RESPONSE, False).values
    time = columns["time"]
    step = float(time[-1] - time[0]) / max(1, time.size - 1)
    if time.size < 2 or step <= 0.0 or np.abs(np.diff(time) - step).max() > 1e-3 * step:
        raise ModelError(Problem(str(path), counted(time.size, "sample"), "the times must increase by equal steps"))
    return ReadPath(SoundPath(resampled(columns["response"], 1.0 / step, rate, str(path)), rate, 0, str(path)))


def _universal(path: Path, rate: float) -> ReadPath:
    """Read the frequency response of a universal file, or the one along x and the one along y.

    ModelError where it holds none, or others.
    """
    from gearrattle.measured.readers.uff_responses import responses

    known = responses(path)
    if not known:
        rule = "holds no complex response of a pressure to a force over frequency (dataset 58)"
        raise ModelError(Problem(str(path), "", rule, "export the frequency response, with its units"))
    if len(known) == 1:
        (only,) = known
        return ReadPath(*path_of(FrequencyResponse(only.frequency, only.value, str(path)), rate))
    along = {_ALONG.get(abs(response.direction), ""): response for response in known}
    if len(known) != 2 or set(along) != {"x", "y"}:
        rule = "must hold one response, or one to a force along x and one to a force along y"
        names = listed(response.name or "without a name" for response in known)
        raise ModelError(Problem(str(path), names, rule, "export those alone, by the direction of the reference"))
    read = {}
    for axis in "xy":
        response = along[axis]
        value = response.value * (1 if response.direction > 0 else -1)
        read[axis] = ReadPath(*path_of(FrequencyResponse(response.frequency, value, f"{path} ({axis})"), rate))
    return _of_forces(read)
