"""Folder that keeps computed motions, one file for each, so that a stopped search can be continued.

The name of a file is a digest of everything that decides the motion: model, start, outputs, version of the package.
"""

from __future__ import annotations

import io
import json
import os
import zipfile
from hashlib import sha256
from pathlib import Path

import numpy as np

from gearrattle.design.motions import Asked, Counter, Motion, moved_on
from gearrattle.formats import version_of
from gearrattle.writing import put


class Keep:
    """Folder of computed motions."""

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self._folder = Path(folder)
        self._folder.mkdir(parents=True, exist_ok=True)

    def motion(self, asked: Asked, counter: Counter | None = None) -> Motion:
        """Return a motion from the folder; if it is not there, simulate it and write it to the folder."""
        file = self._folder / f"{_name(asked)}.npz"
        known = _read(file, asked)
        if known is not None:
            if counter is not None:
                counter.add(1.0)
            return known
        motion = moved_on(asked, counter)
        _write(file, motion)
        return motion


def kept_or_moved(asked: Asked, keep: Keep | None, counter: Counter | None = None) -> Motion:
    """Return a motion from the folder if there is one, else simulate it."""
    return moved_on(asked, counter) if keep is None else keep.motion(asked, counter)


def _name(asked: Asked) -> str:
    """A digest of everything that decides a motion."""
    outputs = [[output.name, list(map(str, output.subjects))] for output in asked.outputs]
    said = [version_of("gearrattle"), asked.start, asked.initial, outputs, asked.samples]
    digest = sha256(asked.model.to_stored()[0].encode())
    digest.update(json.dumps(said, sort_keys=True).encode())
    return digest.hexdigest()[:32]


def _read(file: Path, asked: Asked) -> Motion | None:
    """Return the motion in a file; None if there is no file, or a damaged one."""
    try:
        with np.load(file, allow_pickle=False) as archive:
            values = {output.name: archive[f"value {output.name}"] for output in asked.outputs}
            end = {name: archive[f"end {name}"].tolist() for name in ("angle", "velocity")}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    return Motion(asked.start, values, end)


def _write(file: Path, motion: Motion) -> None:
    """Write a motion to a file, completely or not at all."""
    arrays = {f"value {name}": np.asarray(values) for name, values in motion.values.items()}
    arrays |= {f"end {name}": np.array(values) for name, values in motion.end.items()}
    stream = io.BytesIO()
    np.savez(stream, **arrays)  # type: ignore[arg-type]
    put(file, stream.getvalue())
