"""The store of a long motion: a folder with one netCDF file for every chunk, and the state at its end.

    chunk-000001.nc, chunk-000002.nc, ...    every finished chunk, as a run
    state.npz                                state of the solver after the last chunk, sums of the criteria, owner

Every file is written completely and then renamed, first the chunk, then the state. So, even if the program is killed,
the state names the last valid chunk; a chunk beyond it is computed again. A store belongs to one model, one set of
settings and one set of versions, because only these reproduce the same bits; any other is refused.
"""

from __future__ import annotations

import io
import json
import os
import platform
import re
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import Cancelled, ModelError, Problem
from gearrattle.files import Refused, check_archive
from gearrattle.formats import check_format, format_name, version_of
from gearrattle.model import Model
from gearrattle.model.table import listed
from gearrattle.results import Run, open_run
from gearrattle.wording import counted
from gearrattle.writing import PREFIX, Lock, put, sweep

STATE = "state.npz"
_CHUNK = "chunk-{:06d}.nc"
Arrays = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class State:
    """State of a stored motion: finished chunks and periods.

    Attributes
    ----------
    owner
        format, model, settings and versions, as lines of text.
    chunks, done
        number of finished chunks, and of finished periods.
    march
        snapshot of the solver (``solvers.Extensible``).
    sums
        packed sums of the criteria (``quantities.quantity.Sums``); empty before the first.
    """

    owner: str
    chunks: int
    done: int
    march: Arrays
    sums: Arrays


class Store:
    """A folder that keeps the chunks of one long motion; ``state`` is that after the last chunk; None before."""

    def __init__(self, folder: Path, owner: str, state: State | None) -> None:
        self.folder = folder
        self.state = state
        self._owner = owner
        self._lock: Lock | None = None
        self._writing = threading.Lock()
        self._closed = False

    @classmethod
    def open(cls, folder: str | os.PathLike[str], model: Model, settings: Mapping[str, Any], *, resume: bool) -> Store:
        """Open a folder, made when the first chunk is kept.

        A ModelError refuses a folder with other files, one that holds a run already where ``resume`` is not set, and
        one that is not of this model, these settings and these versions.
        """
        path = Path(folder)
        owner = _owner(model, settings)
        if path.exists() and not path.is_dir():
            raise NotADirectoryError(20, "a file stands where a folder is needed", str(path))
        state = read_state(path)
        if state is None and (others := _others(path)):
            rule = f"is not empty and holds no stored motion: {listed(others)}"
            raise ModelError(Problem(str(path), "", rule, "give a new or an empty folder"))
        if state is not None and not resume:
            rule = f"holds {counted(state.done, 'cycle')} of a run already"
            raise ModelError(Problem(str(path), "", rule, "resume to go on with it, or choose another folder"))
        if state is not None and (begun := state.owner.partition("\n")[0]) != format_name("stream"):
            rule = "was begun by an earlier version of gearrattle, whose sums of criteria this one cannot go on with"
            remedy = "gearrattle.open_stream reads what is there; to go on, compute the motion again in another folder"
            raise ModelError(Problem(str(path), f'"{begun}"', rule, remedy))
        if state is not None and state.owner != owner:
            raise ModelError(_difference(path, state.owner, owner))
        store = cls(path, owner, state)
        if path.exists():
            store._hold()
            store.state = read_state(path)  # the last state that was written
            sweep(path)
        return store

    def release(self) -> None:
        """Let others write into the folder."""
        if self._lock is not None:
            self._lock.release()
            self._lock = None

    def close(self) -> int:
        """Count no further chunk, whatever another thread still computes; return the periods that count."""
        with self._writing:
            self._closed = True
            return 0 if self.state is None else self.state.done

    def _hold(self) -> None:
        """Lock the folder; ModelError where another program writes into it."""
        if self._lock is None:
            try:
                self._lock = Lock(self.folder)
            except Refused as error:
                raise ModelError(Problem(str(self.folder), "", error.rule, error.remedy)) from None

    def check_there(self) -> None:
        """Refuse to go on with a folder that has lost its state or its last chunk (ModelError): a chunk after a gap can
        never be read.
        """
        if self.state is None:
            return
        for name in ("", STATE, _CHUNK.format(self.state.chunks)):
            path = self.folder / name
            if not path.exists():
                rule = (
                    f"has been removed, after {counted(self.state.done, 'cycle')} of the motion were kept in the folder"
                )
                raise ModelError(Problem(str(path), "", rule, "bring it back, or begin the motion again"))

    def keep(self, run: Run, march: Arrays, sums: Arrays, done: int) -> None:
        """Write a chunk, then the state after it.

        Raises
        ------
        ModelError
            another program writes into the folder, or has; what was kept in it has been removed.
        OSError
            the machine refused; what was kept before still counts.
        Cancelled
            the store has been closed.
        """
        # the folder holds what it held, and no other stream writes into it
        self.check_there()
        self.folder.mkdir(parents=True, exist_ok=True)
        if self._lock is not None and not self._lock.held:
            rule = "is written by another stream of this program, which was begun later"
            raise ModelError(Problem(str(self.folder), "", rule, "go on with that one"))
        if self._lock is None:
            self._hold()
            if (state := read_state(self.folder)) is not None:
                rule = f"holds {counted(state.done, 'cycle')} of a run by now, written by another program"
                raise ModelError(Problem(str(self.folder), "", rule, "choose another folder"))
        # the chunk
        chunks = 1 if self.state is None else self.state.chunks + 1
        run.save(self.folder / _CHUNK.format(chunks))
        # the state after it, unless the store was closed meanwhile
        arrays: dict[str, Any] = {"owner": np.array(self._owner), "counts": np.array([chunks, done])}
        arrays |= {f"march/{name}": array for name, array in march.items()}
        arrays |= {f"gathered/{name}": array for name, array in sums.items()}
        content = io.BytesIO()
        np.savez(content, **arrays)
        with self._writing:
            if self._closed:
                raise Cancelled("the store of this motion is closed")
            put(self.folder / STATE, content.getvalue())
            self.state = State(self._owner, chunks, done, march, sums)


def read_state(folder: Path) -> State | None:
    """The state in a folder, or None; ModelError if the file is no state of a stored motion."""
    path = folder / STATE
    rule = "must be the state of a stored motion"
    try:
        check_archive(path)
        with np.load(path, allow_pickle=False) as file:
            owner = str(file["owner"])
            check_format(owner.partition("\n")[0], path, "stream")
            chunks, done = file["counts"].tolist()
            parts: dict[str, dict[str, NDArray[Any]]] = {"march": {}, "gathered": {}}
            for name in set(file.files) - {"owner", "counts"}:
                part, _, key = name.partition("/")
                parts[part][key] = file[name]
    except FileNotFoundError:
        return None
    except Refused as error:
        raise ModelError(Problem(str(path), "", error.rule, error.remedy)) from None
    except (MemoryError, PermissionError, ModelError):
        raise
    except Exception as error:  # reading a damaged archive may raise anything
        words = " ".join(str(error).split())[:120] or type(error).__name__
        raise ModelError(Problem(str(path), words, rule, "remove the folder, or choose another")) from None
    return State(owner, chunks, done, parts["march"], parts["gathered"])


def open_stream(folder: str | os.PathLike[str]) -> Iterator[Run]:
    """Read the chunks of a stored motion, one after the other.

    Parameters
    ----------
    folder
        the store of a ``stream``, finished or not.

    Returns
    -------
    Iterator[Run]
        The runs of its chunks, in order; each is read when it is asked for.

    Raises
    ------
    ModelError
        there is no stored motion, or one of its files is missing or damaged.

    Examples
    --------
    >>> for chunk in gr.stream(gr.example("case3"), cycles=20, chunk=10, store="long"):
    ...     pass
    ...
    >>> [round(run.trajectory.cycles) for run in gr.open_stream("long")]
    [10, 10]
    """
    path = Path(folder)
    state = read_state(path)
    if state is None:
        raise ModelError(Problem(str(path), "", f"there is no stored motion ({STATE})"))
    return _chunks(path, state)


def _chunks(folder: Path, state: State) -> Iterator[Run]:
    """Yield the chunks; ModelError for one of another motion, or one that does not begin where the one before ended."""
    done = 0
    model = None
    for index in range(state.chunks):
        path = folder / _CHUNK.format(index + 1)
        if not path.exists():
            gone = path if folder.exists() else folder
            rule = f"has been removed: of {counted(state.chunks, 'chunk')}, {index} can be read"
            raise ModelError(Problem(str(gone), "", rule, "bring it back, or compute the motion again"))
        run = open_run(path)
        if model is not None and run.model != model:
            raise ModelError(Problem(str(path), "", "is a chunk of another model", "compute the motion again"))
        if run.trajectory.first_cycle != done:
            value = f"a chunk from cycle {run.trajectory.first_cycle}"
            rule = f"must begin at cycle {done}"
            raise ModelError(Problem(str(path), value, rule, "compute the motion again"))
        done = done + run.trajectory.cycles
        model = run.model
        yield run


def _owner(model: Model, settings: Mapping[str, Any]) -> str:
    """Lines of text on everything that decides the bits of a motion."""
    versions = {name: version_of(name) for name in ("gearrattle", "numpy", "scipy", "numba")}
    content = {**settings, **versions, "python": platform.python_version(), "machine": platform.machine()}
    return "\n".join(
        [
            format_name("stream"),
            *(f"{key} = {json.dumps(value)}" for key, value in content.items()),
            model.to_stored()[0],
        ]
    )


def _others(folder: Path) -> list[str]:
    """Names in a folder that no stream has written, ascending; a first chunk may lack its state."""
    if not folder.exists():
        return []
    own = re.compile(rf"chunk-\d{{6}}\.nc|{re.escape(PREFIX)}.*|\.lock")
    return sorted(entry.name for entry in folder.iterdir() if not own.fullmatch(entry.name))


def _difference(path: Path, stored: str, asked: str) -> Problem:
    """Say where a stored motion differs from the one asked for."""
    there = stored.splitlines()
    here = asked.splitlines()
    pairs = zip([*there, ""], [*here, ""], strict=False)
    old, new = next(((a, b) for a, b in pairs if a != b), (counted(len(there), "line"), counted(len(here), "line")))
    rule = (
        f"holds another motion, with {old or 'nothing there'}; only the same model, settings and versions go on with it"
    )
    return Problem(str(path), new or "nothing", rule, "repeat the call that began it, or choose another folder")
