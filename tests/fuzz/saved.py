"""Saved motions with other values in them, judged and measured.

The law: a motion with any numbers in it is judged and measured, or refused by an error of ours.

Takes nothing; gives targets.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np

import gearrattle as gr
from tests.fuzz.target import SMALL, Target, small_run

_CHUNK = "chunk-000001.nc"


def _save(folder: Path) -> None:
    small_run().save(folder / "sound.nc")


def save_stream(folder: Path) -> None:
    """Store a short motion in two chunks."""
    list(gr.stream(gr.loads(SMALL), store=folder / "kept", cycles=4, chunk=2, discard=1))


def _save_chunks(folder: Path) -> None:
    save_stream(folder)
    (folder / "sound.nc").write_bytes((folder / "kept" / _CHUNK).read_bytes())


def _is_number(item: Any) -> bool:
    return isinstance(item, h5py.Dataset) and item.dtype.kind in "iufb" and item.size > 0


@cache
def _datasets(path: Path) -> tuple[str, ...]:
    """Return the names of the arrays of numbers in a file."""
    with h5py.File(path) as file:
        return tuple(sorted(name for name in file if _is_number(file[name])))


def changed(changes: Any, source: Path, target: Path) -> None:
    """Copy a file with other numbers in it.

    Parameters
    ----------
    changes
        number of an array, index in it, and value: a list of such lists; what is none is left out.
    source, target
        the files.
    """
    target.write_bytes(source.read_bytes())
    names = _datasets(source)
    with h5py.File(target, "r+") as file:
        for change in changes if isinstance(changes, list) else ():
            if not isinstance(change, list) or len(change) != 3 or any(type(part) is not int for part in change[:2]):
                continue
            values = file[names[change[0] % len(names)]]
            is_plain = isinstance(change[2], int | float) and abs(change[2]) < 2**63
            value = float(change[2]) if is_plain or change[2] in (math.inf, -math.inf) else math.nan
            content = values[()]
            with np.errstate(invalid="ignore"):
                np.ravel(content)[change[1] % content.size] = np.asarray(value).astype(values.dtype)
            values[()] = content


def _changes(folder: Path) -> list[bytes]:
    """Return changes that change nothing: each array has its own first value."""
    _save(folder)
    names = _datasets(folder / "sound.nc")
    with h5py.File(folder / "sound.nc") as file:
        first = [[number, 0, float(np.ravel(file[name][()])[0])] for number, name in enumerate(names)]
    return [json.dumps([row]).encode() for row in first] + [json.dumps(first).encode()]


def _json_of(path: Path) -> Any:
    try:
        return json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        return []


def _judge(path: Path) -> None:
    """Judge and measure a motion."""
    run = gr.open_run(path)
    gr.criteria(run)
    gr.metrics(run)


def _judge_changed(path: Path) -> None:
    target = path.with_name("r.nc")
    changed(_json_of(path), path.with_name("sound.nc"), target)
    _judge(target)


def _judge_changed_chunk(path: Path) -> None:
    folder = path.with_name("kept")
    changed(_json_of(path), path.with_name("sound.nc"), folder / _CHUNK)
    gr.criteria(gr.open_stream(folder))
    gr.metrics(gr.open_stream(folder))


def _saved(folder: Path) -> list[bytes]:
    _save(folder)
    return [(folder / "sound.nc").read_bytes()]


def targets() -> Iterator[Target]:
    """Yield the targets of this module."""
    yield Target("saved run, judged", "r.nc", _saved, _judge)
    yield Target("saved run of other values, judged", "c.json", _changes, _judge_changed, kind="JSON", around=_save)
    yield Target("stream of other values, judged", "c.json", _changes, _judge_changed_chunk, "JSON", _save_chunks)
