"""``listen``: runs or recordings as sound, all with one transfer path and one gain, so that their levels compare.

    p(t) = sum of p_i h(t - t_i),      p_i = m_eff (v_i - v_i')

over the impacts of the chosen elements. p_i is the momentum that impact i exchanges: the integral of its force above
the quasi-static load (``gearrattle.signals.impacts``), because a constant load makes no sound. Times and rates come
from the log of crossings, not from samples. The duration of contacts is neglected, so the sound is too loud at
frequencies above the reciprocal of this duration. The sound pressure of a recording is used unchanged; a recorded force
is convolved with the response of the path.
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
from gearrattle.model import Model
from gearrattle.model.table import did_you_mean, listed
from gearrattle.recording import Recording
from gearrattle.report.sound.psychoacoustics import Quality, quality
from gearrattle.report.sound.resample import resampled
from gearrattle.report.sound.transfer_path import sound_path
from gearrattle.result import Result
from gearrattle.results import Run
from gearrattle.signals.impact_sound import LONGEST, RATE, SoundPath, impact_pressure, pressure_level, through
from gearrattle.signals.rings import by_parts, parts_of
from gearrattle.signals.windows import steady

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
        transfer path from impulse to sound pressure.
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
    path: str | os.PathLike[str] | Sequence[tuple[float, float, float]] | None = None,
    *,
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
        transfer path from an impulse [N s] to sound pressure. None: an assumed casing; rows of frequency [Hz], damping
        ratio and gain [Pa/(N s)]; or the path of a WAV or CSV file with an impulse response.
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
        Sound pressures, all with one path and one gain. The sound of a run begins after its discarded cycles.

    Raises
    ------
    ModelError
        unknown element, element without a free body, path that cannot be read, or recording without sound pressure or
        force.

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
    named = _named(runs)
    way = sound_path(path, float(rate), scale)
    notes = [f"path: {way.source}"]
    if path is None:
        notes.append("the path is assumed: compare designs by it, take no level from it")
    pressure = []
    for name, source in named.items():
        made = _heard(source, way) if isinstance(source, Recording) else _impacts(name, source, way, elements)
        pressure.append(made)
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


def audible(name: str, model: Model, elements: Sequence[str] | None) -> list[str]:
    """Return the clearances of a driveline whose impacts make sound.

    ModelError for a dimensionless model, a name that is not a clearance, and a model without clearances.
    """
    if model.units == "dimensionless":
        raise ModelError(
            Problem(name, "a dimensionless model", "has no seconds to be heard in", "give the model units")
        )
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


def _impacts(name: str, run: Run, way: SoundPath, elements: Sequence[str] | None) -> Array:
    """Sound pressure of a run's impacts."""
    motion = by_parts(run.trajectory)
    chosen = audible(name, run.model, elements)
    seconds = steady(motion).duration
    if seconds > LONGEST:
        raise ModelError(Problem(name, f"{seconds:.4g} s", f"a run to be heard may last {LONGEST:g} s", "cut it"))
    known = motion.layout.clearance_names
    pressure = impact_pressure(motion, [known.index(clearance) for clearance in chosen], way)
    if not np.isfinite(pressure).all():
        rule = "no body at one of these is free to move, so its impacts exchange no momentum"
        raise ModelError(Problem(f"{name}: elements", listed(chosen), rule, "name other elements"))
    return pressure


def _heard(recording: Recording, way: SoundPath) -> Array:
    """Sound pressure of a recording: its own, or that of its force."""
    channel = recording.find("sound pressure") or recording.find("force")
    if channel is None:
        rule = "holds neither sound pressure nor a force"
        raise ModelError(Problem(recording.source, ", ".join(recording.names), rule))
    step = recording.interval
    if step is None:
        raise ModelError(Problem(recording.source, "uneven times", "must be sampled uniformly to be heard"))
    values = resampled(channel.values, 1.0 / step, way.rate, channel.name)
    return values if channel.quantity == "sound pressure" else through(values, way)
