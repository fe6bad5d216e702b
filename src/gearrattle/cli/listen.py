"""``gearrattle listen``: impacts of motions and measured signals as WAV files, side by side at one gain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from gearrattle.cli.options import Json, Whole

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.model import Model
    from gearrattle.recording import Recording
    from gearrattle.results import Run
    from gearrattle.sound.listen import Sound

_Words = Annotated[Sequence[str], Parameter(negative="")]


@Parameter(name="*")
@dataclass(frozen=True)
class Hearing:
    """How motions become sound."""

    path: Annotated[Path | None, Parameter(help="WAV or CSV file with an impulse response; default: assumed.")] = None
    scale: Annotated[float, Parameter(help="What 1 in a WAV impulse response is worth [Pa/(N s)].")] = 1.0
    element: Annotated[_Words, Parameter(help="Whose impacts are heard; default: all meshes. May be repeated.")] = ()
    gain: Annotated[float | None, Parameter(help="Full scale per pascal; default: the loudest peaks at half.")] = None

    def arguments(self) -> dict[str, Any]:
        """Return the settings as keyword arguments of ``listen``."""
        return {"path": self.path, "scale": self.scale, "elements": self.element or None, "gain": self.gain}


_DEFAULTS = Hearing()
_RATE = 48_000.0  # Hz, of ``gearrattle.listen``


def listen(
    *motions: Path,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    hearing: Hearing = _DEFAULTS,
    bits: Whole = 32,
    quality: Annotated[bool, Parameter(negative="")] = False,
    json: Json = False,
) -> None:
    """Turn impacts into sound, all designs through one path and at one gain, and tell their levels.

    Parameters
    ----------
    motions
        Saved motions (.nc), measured files or mappings of them with a sound pressure or a force; or model files
        (.toml), which are simulated.
    output
        Folder for the WAV files, each named after its motion; default: the levels alone.
    bits
        32: floating point; 24: integers.
    quality
        Also loudness, sharpness and roughness (extra "sound").
    """
    import gearrattle
    from gearrattle.errors import ModelError, Problem
    from gearrattle.json_types import json_text, json_value

    if not motions:
        raise ModelError(
            Problem("motions", "", "needs a saved motion, a measured file or a model file", "gearrattle listen run.nc")
        )
    if output is not None and output.exists() and not output.is_dir():
        raise ModelError(Problem("-o", f'"{output}"', "is a file; a folder is needed"))
    sound = gearrattle.listen(_runs(motions, hearing), **hearing.arguments())
    record = _record(sound, with_quality=quality)
    if output is not None:
        _save(sound, output, bits)
    if json:
        print(json_text(json_value({**record, "output": None if output is None else str(output)})))
        return
    _tell(sound, record)
    if output is not None:
        print(f"saved: {', '.join(str(output / f'{name}.wav') for name in sound.names)}")


def _runs(motions: Sequence[Path], hearing: Hearing) -> dict[str, Run | Recording]:
    """Open or simulate every motion, by the name of its file, once all of them can be heard."""
    import gearrattle
    from gearrattle.cli.background import watched
    from gearrattle.cli.sources import heard, is_model
    from gearrattle.errors import ModelError, Problem
    from gearrattle.sound.listen import audible
    from gearrattle.sound.path import sound_path

    sound_path(hearing.path, _RATE, hearing.scale)
    opened: dict[str, Model | Run | Recording] = {}
    for path in motions:
        if path.stem in opened:
            raise ModelError(Problem(str(path), path.stem, "two motions have this name", "rename one of the files"))
        motion = opened[path.stem] = gearrattle.load(path) if is_model(path) else heard(path)
        if isinstance(motion, gearrattle.Model):
            audible(path.stem, motion, hearing.element or None)
    return {
        name: watched(partial(_simulated, motion)) if isinstance(motion, gearrattle.Model) else motion
        for name, motion in opened.items()
    }


def _simulated(model: Model, watch: Watch) -> Run:
    from gearrattle.calls.simulate import simulate

    return simulate(model, progress=watch)


def _record(sound: Sound, *, with_quality: bool) -> dict[str, Any]:
    heard = sound.quality() if with_quality else {}
    designs = {
        name: {"level": level, **(heard[name]._asdict() if name in heard else {})}
        for name, level in sound.levels.items()
    }
    return {"designs": designs, "gain": sound.gain, "rate": sound.rate, "path": sound.path.source, "notes": sound.notes}


def _save(sound: Sound, output: Path, bits: int) -> None:
    from gearrattle.writing import Staging

    content = {name: sound.wav(name, bits) for name in sound.names}
    with Staging(output) as staging:
        for name, data in content.items():
            (staging.path / f"{name}.wav").write_bytes(data)
        staging.commit()


def _tell(sound: Sound, record: dict[str, Any]) -> None:
    import sys

    from gearrattle.cli.columns import columns

    units = {"level": "dB", "loudness": "sone", "loudness_5": "sone", "sharpness": "acum", "roughness": "asper"}
    first = next(iter(record["designs"].values()))
    head = ("design", *(f"{key} [{units[key]}]" for key in first))
    rows = [(name, *(f"{value:.4g}" for value in each.values())) for name, each in record["designs"].items()]
    print(columns(head, rows))
    print(f"gain {sound.gain:.6g} of full scale per Pa, the same for all; {sound.rate} Hz")
    for note in sound.notes:
        print(f"note: {note}", file=sys.stderr)
