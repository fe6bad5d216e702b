"""``listen``: runs or recordings as sound, all with one transfer path and one gain, so that their levels compare.

    p(t) = sum of p_i h(t - t_i),      p_i = m_eff (v_i - v_i')

over the impacts of the chosen elements. p_i is the momentum that impact i exchanges: the integral of its force above
the quasi-static load (``gearrattle.signals.impacts``), because a constant load makes no sound. Times and rates come
from the log of crossings, not from samples. The duration of contacts is neglected, so the sound is too loud at
frequencies above the reciprocal of this duration. Of a driveline with bearings to the housing the force on the casing
is heard instead (``gearrattle.signals.casing_sound``): it has passed shafts and bearings, and nothing is neglected. The
sound pressure of a recording is used unchanged; a recorded force is convolved with the response of the path.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble
from gearrattle.errors import ModelError, Problem
from gearrattle.measured.readers.wav import wav_bytes
from gearrattle.model import GROUND, Model
from gearrattle.model.table import did_you_mean, listed, shown
from gearrattle.recording import Recording
from gearrattle.report.sound.psychoacoustics import Quality, quality
from gearrattle.report.sound.resample import resampled
from gearrattle.report.sound.transfer_path import PathSource, read_path
from gearrattle.result import Result
from gearrattle.results import Run
from gearrattle.signals.casing_sound import FROM_CASING, FROM_IMPACTS, SOURCES, casing_pressure, source_of
from gearrattle.signals.impact_sound import LONGEST, RATE, SoundPath, impact_pressure, pressure_level, through
from gearrattle.signals.rings import by_parts, parts_of
from gearrattle.signals.windows import steady
from gearrattle.trajectory import AXES

Array = NDArray[np.float64]

_HEADROOM = 0.5  # of full scale: the highest peak, unless a gain is given


@dataclass(frozen=True, eq=False)
class Sound(Result):
    """One or more designs to listen to.

    Attributes
    ----------
    names
        of the designs.
    pressure
        by design, (N,) sound pressure [Pa].
    rate
        samples per second [Hz].
    gain
        full scale per pascal, the same for all designs [1/Pa].
    path
        transfer path from a force to sound pressure.
    notes
        what the user must know.
    bits
        bits per sample of saved WAV files: 24 (integers), 32 or 64 (floating point).

    Examples
    --------
    >>> gr.listen(gr.simulate(gr.example("case3"), cycles=20, discard=5)).rate
    48000
    """

    kind: ClassVar[str] = "sound"
    names: tuple[str, ...]
    pressure: tuple[Array, ...]
    rate: int
    gain: float
    path: SoundPath
    notes: tuple[str, ...]
    bits: int = 32

    @property
    def levels(self) -> dict[str, float]:
        """Sound pressure level of each design over its whole length [dB re 20 uPa]; -inf for silence."""
        return {name: pressure_level(signal) for name, signal in zip(self.names, self.pressure, strict=True)}

    def quality(self) -> dict[str, Quality]:
        """Loudness, sharpness, roughness and impulsiveness of each design; needs the extra ``sound``."""
        return {name: quality(signal, self.rate) for name, signal in zip(self.names, self.pressure, strict=True)}

    def wav(self, name: str, bits: int = 32) -> bytes:
        """The WAV file of a design at the common gain; 24 bits (integers), 32 or 64 (floating point)."""
        return wav_bytes(self.gain * self.pressure[self.names.index(name)], self.rate, bits)

    def save(self, path: str | os.PathLike[str], bits: int = 32) -> Path:
        """Save the sound; if that fails, nothing changes on the disk.

        Parameters
        ----------
        path
            a folder, which gets ``NAME.wav`` of every design, report.html, summary.json and results.nc; or a file that
            ends in .nc or .csv.
        bits
            bits per sample of the WAV files: 24 (integers), 32 or 64 (floating point).

        Returns
        -------
        Path
            The page in the folder, or the file.

        Raises
        ------
        ModelError
            another ending, other bits, or a folder with files that are not a page of gearrattle.
        OSError
            the path cannot be written.
        """
        return Result.save(replace(self, bits=bits), path)


def listen(
    runs: Run | Recording | Mapping[str, Run | Recording] | Sequence[Run | Recording],
    path: PathSource = None,
    *,
    source: str | None = None,
    elements: Sequence[str] | None = None,
    gain: float | None = None,
    rate: int = RATE,
    scale: float = 1.0,
) -> Sound:
    """Turn impacts or measured signals into sound.

    Parameters
    ----------
    runs
        a run or a recording, several, or several by name.
    path
        transfer path from a force [N] or an impulse [N s] to sound pressure. None: an assumed casing; rows of frequency
        [Hz], damping ratio and gain [Pa/(N s)]; the path of a WAV or CSV file with an impulse response, or of a CSV or
        universal file with a frequency response [Pa/N]; or a mapping from forces on the casing to these, whose
        pressures then add: "x" and "y", of all bearings together, or forces of bearings such as "front.x". With one
        path the energies of x and y add.
    source
        what is heard of runs: "casing", the forces of bearings on the casing; "impacts", in gear meshes. None: the
        casing where the model has bearings to it, unless ``elements`` are named; else impacts.
    elements
        elements whose impacts make sound; None: all gear meshes with backlash. An angular momentum of a coupling
        [N m s] counts as a momentum at a lever of 1 m.
    gain
        full scale per pascal [1/Pa]; None: the highest peak of all designs becomes half of full scale.
    rate
        samples per second [Hz].
    scale
        response for the value 1 in a WAV file with an impulse response [Pa/(N s)].

    Returns
    -------
    Sound
        Sound pressures, all with one path and one gain. The sound of a run is that of its steady part, in which the
        path still rings from the discarded cycles.

    Raises
    ------
    ModelError
        unknown element, element without a free body, path that cannot be read, "casing" of a driveline without
        bearings to it, or recording without sound pressure or force.

    Examples
    --------
    >>> run = gr.simulate(gr.example("case3"), cycles=20, discard=5)
    >>> sound = gr.listen(run)
    >>> sound.rate, sound.names
    (48000, ('A',))
    """
    if not (isinstance(rate, int) and 8_000 <= rate <= 384_000):
        raise ModelError(Problem("rate", repr(rate), "must be a whole number of Hz from 8000 to 384000"))
    if gain is not None and not (np.isfinite(gain) and gain > 0.0):
        raise ModelError(Problem("gain", repr(gain), "must be a positive number"))
    if source not in (None, *SOURCES):
        raise ModelError(Problem("source", shown(source), f"must be {listed(SOURCES)}", did_you_mean(source, SOURCES)))
    named = _named(runs)
    way, of_path = read_path(path, float(rate), scale)
    notes = [f"path: {way.source}", *of_path]
    if path is None:
        notes.append("the path is assumed: compare designs by it, take no level from it")
    pressure = []
    for name, heard in named.items():
        if isinstance(heard, Recording):
            pressure.append(_recorded(heard, way))
        elif heard_of(name, heard.model, source, elements) == FROM_CASING:
            made, said = _casing(name, heard, way)
            pressure.append(made)
            notes += said
        else:
            pressure.append(_impacts(name, heard, way, elements))
    peak = max(float(np.abs(signal).max(initial=0.0)) for signal in pressure)
    common = gain if gain is not None else (_HEADROOM / peak if peak > 0.0 else 1.0)
    return Sound(tuple(named), tuple(pressure), rate, float(common), way, tuple(notes))


def _named(runs: Any) -> dict[str, Run | Recording]:
    if isinstance(runs, Run | Recording):
        runs = [runs]
    if not isinstance(runs, Mapping):
        runs = {chr(ord("A") + i) if i < 26 else f"design-{i}": run for i, run in enumerate(runs)}
    if not runs or not all(isinstance(run, Run | Recording) for run in runs.values()):
        raise ModelError(Problem("runs", type(runs).__name__, "must be runs or recordings, at least one"))
    wrong = [str(name) for name in runs if not str(name).replace("_", "").replace("-", "").replace(".", "").isalnum()]
    if wrong:
        rule = "a design's name becomes a file's: letters, digits, _, - and . only"
        raise ModelError(Problem("runs", repr(wrong[0]), rule))
    return {str(name): run for name, run in runs.items()}


def heard_of(name: str, model: Model, source: str | None, elements: Sequence[str] | None) -> str:
    """Return what is heard of a driveline, "casing" or "impacts".

    ModelError for what it has not, and for a dimensionless model.
    """
    if model.units == "dimensionless":
        raise ModelError(
            Problem(name, "a dimensionless model", "has no seconds to be heard in", "give the model units")
        )
    of_model = source_of(assemble(model).layout)
    if source == FROM_CASING and of_model != FROM_CASING:
        remedy = "give bodies a mass and bearings, or hear its impacts"
        raise ModelError(Problem(f"{name}: source", source, "the model has no bearings to the housing", remedy))
    if source == FROM_CASING and elements is not None:
        rule = "names elements with impacts, and the casing is heard"
        raise ModelError(Problem(f"{name}: elements", listed(elements), rule, f'source="{FROM_IMPACTS}", or leave out'))
    chosen = source or (of_model if elements is None else FROM_IMPACTS)
    if chosen == FROM_IMPACTS:
        audible(name, model, elements)
    return chosen


def audible(name: str, model: Model, elements: Sequence[str] | None) -> list[str]:
    """Return the clearances of a driveline whose impacts make sound.

    ModelError for a name that is not a clearance, and a model without clearances.
    """
    known = parts_of(assemble(model).layout).clearance_names
    meshes = {element.name for element in model.elements if element.along_line and element.arms}
    chosen = [name for name in known if name in meshes] if elements is None else list(elements)
    for clearance in chosen:
        if clearance not in known:
            rule = f"there is no clearance of this name; there are {listed(known)}"
            raise ModelError(Problem(f"{name}: elements", clearance, rule, did_you_mean(clearance, known)))
    if not chosen:
        rule = "no gear mesh has backlash: nothing of this run can be heard"
        remedy = f"name elements among {listed(known)}" if known else "give an element backlash or a clearance"
        raise ModelError(Problem(f"{name}: elements", "", rule, remedy))
    return chosen


def _check_length(name: str, run: Run) -> None:
    """Refuse a run that is too long to be heard."""
    seconds = steady(run.trajectory).duration
    if seconds > LONGEST:
        raise ModelError(Problem(name, f"{seconds:.4g} s", f"a run to be heard may last {LONGEST:g} s", "cut it"))


def _one_path(name: str, way: SoundPath) -> None:
    """Refuse a path by direction for what has none."""
    if way.forces:
        rule = "paths of several forces are for those on the casing"
        raise ModelError(Problem(f"{name}: path", way.source, rule, "give one path"))


def _casing(name: str, run: Run, way: SoundPath) -> tuple[Array, list[str]]:
    """Sound pressure of a run's force on the casing, and notes."""
    _check_length(name, run)
    in_housing = [bearing.name for bearing in run.model.bearings if bearing.around == GROUND]
    known = (*AXES, *(f"{bearing}.{axis}" for bearing in in_housing for axis in AXES))
    if unknown := [force for force in way.forces if force not in known]:
        rule = f"no force on the casing; there are {listed(known)}"
        raise ModelError(Problem(f"{name}: path", unknown[0], rule, did_you_mean(unknown[0], known)))
    pressure, is_exact = casing_pressure(run.trajectory, way)
    if is_exact:
        return pressure, []
    rate = run.trajectory.samples_per_cycle / run.trajectory.layout.period
    note = f"{name}: of its samples, {rate:.6g} a second: what lies above {0.5 * rate:.6g} Hz has folded back"
    return pressure, [note]


def _impacts(name: str, run: Run, way: SoundPath, elements: Sequence[str] | None) -> Array:
    """Sound pressure of a run's impacts."""
    _one_path(name, way)
    _check_length(name, run)
    motion = by_parts(run.trajectory)
    chosen = audible(name, run.model, elements)
    known = motion.layout.clearance_names
    pressure = impact_pressure(motion, [known.index(clearance) for clearance in chosen], way)
    if not np.isfinite(pressure).all():
        rule = "no body at one of these is free to move, so its impacts exchange no momentum"
        raise ModelError(Problem(f"{name}: elements", listed(chosen), rule, "name other elements"))
    return pressure


def _recorded(recording: Recording, way: SoundPath) -> Array:
    """Sound pressure of a recording: its own, or that of its force."""
    channel = recording.find("sound pressure") or recording.find("force")
    if channel is None:
        rule = "holds neither sound pressure nor a force"
        raise ModelError(Problem(recording.source, ", ".join(recording.names), rule))
    step = recording.interval
    if step is None:
        raise ModelError(Problem(recording.source, "uneven times", "must be sampled uniformly to be heard"))
    values = resampled(channel.values, 1.0 / step, way.rate, channel.name)
    if channel.quantity == "sound pressure":
        return values
    _one_path(recording.source, way)
    return through(values, way)
