"""``gearrattle listen``: forces on the casing, impacts and measured signals as WAV files, side by side at one gain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.command_inputs import is_model, motion_or_recording
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Json, OutputPath, Whole, Words
from gearrattle.errors import ModelError, Problem

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.model import Model
    from gearrattle.recording import Recording
    from gearrattle.report.sound.sound_page import SoundPage
    from gearrattle.results import Run


@Parameter(name="*")
@dataclass(frozen=True)
class Hearing:
    """Options for the sound of motions."""

    path: Annotated[
        Path | None,
        Parameter(help="File with an impulse response (.wav, .csv) or frequency response (.csv, .uff); else assumed."),
    ] = None
    path_y: Annotated[Path | None, Parameter(help="The same of a force along y; --path is then along x.")] = None
    scale: Annotated[float, Parameter(help="What 1 in a WAV impulse response is worth [Pa/(N s)].")] = 1.0
    source: Annotated[str | None, Parameter(help="casing or impacts; default: the casing if it has bearings.")] = None
    element: Annotated[Words, Parameter(help="Whose impacts are heard; default: all meshes. May be repeated.")] = ()
    gain: Annotated[float | None, Parameter(help="Full scale per pascal; default: the loudest peaks at half.")] = None

    def arguments(self) -> dict[str, Any]:
        """Return the settings as keyword arguments of ``listen``."""
        settings = {"source": self.source, "elements": self.element or None, "gain": self.gain}
        return {"path": self.paths, "scale": self.scale, **settings}

    @property
    def paths(self) -> Path | dict[str, Path] | None:
        """The path of any force, or those of a force along x and along y."""
        if self.path_y is None:
            return self.path
        if self.path is None:
            rule = "is the path along y, and none is given along x"
            raise ModelError(Problem("--path-y", str(self.path_y), rule, "--path FILE is that along x"))
        return {"x": self.path, "y": self.path_y}


_DEFAULTS = Hearing()
_RATE = 48_000.0  # Hz, of ``gearrattle.listen``


def listen(
    *motions: Path,
    output: OutputPath = None,
    hearing: Hearing = _DEFAULTS,
    bits: Whole = 32,
    quality: bool = False,
    json: Json = False,
) -> None:
    """Turn forces on the casing, or impacts, into sound, all designs at one gain, and tell their levels.

    Parameters
    ----------
    motions
        Saved motions (.nc), measured files or mappings of them with a sound pressure or a force; or model files
        (.toml), which are simulated.
    output
        Folder for the WAV files, each named after its motion, and for report.html, summary.json and results.nc; or a
        file for the numbers, ending in .nc or .csv. Default: the levels on the terminal only.
    bits
        32: floating point; 24: integers.
    quality
        Also loudness, sharpness, roughness and impulsiveness (extra "sound").
    """
    from gearrattle.report.sound.sound_page import SoundPage

    if not motions:
        raise ModelError(
            Problem("motions", "", "needs a saved motion, a measured file or a model file", "gearrattle listen run.nc")
        )

    def work(watch: Watch) -> SoundPage:
        runs = {
            name: _simulated(motion, watch) if isinstance(motion, gearrattle.Model) else motion
            for name, motion in _opened(motions, hearing).items()
        }
        sound = gearrattle.listen(runs, **hearing.arguments())
        return SoundPage(replace(sound, bits=bits), with_quality=quality)

    emit("sound", work, output, json=json, inputs=motions)


def _opened(motions: Sequence[Path], hearing: Hearing) -> dict[str, Model | Run | Recording]:
    """Open every motion or model, by the name of its file, after checking that all of them can make sound."""
    from gearrattle.report.sound.listen import heard_of
    from gearrattle.report.sound.transfer_path import read_path

    read_path(hearing.paths, _RATE, hearing.scale)
    opened: dict[str, Model | Run | Recording] = {}
    for path in motions:
        if path.stem in opened:
            raise ModelError(Problem(str(path), path.stem, "two motions have this name", "rename one of the files"))
        motion = gearrattle.load(path) if is_model(path) else motion_or_recording(path)
        opened[path.stem] = motion
        if isinstance(motion, gearrattle.Model):
            heard_of(path.stem, motion, hearing.source, hearing.element or None)
    return opened


def _simulated(model: Model, watch: Watch) -> Run:
    from gearrattle.simulation.simulate import simulate

    return simulate(model, progress=watch)
