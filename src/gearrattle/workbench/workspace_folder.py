"""The workspace folder: its files by name, and no file outside it.

A name is a relative path with ``/``. Names with ``..``, hidden parts, backslashes, drive letters or control characters
are refused; a symbolic link is refused if its target is outside the folder.
"""

from __future__ import annotations

import hashlib
import os
import re
import stat
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.files import Refused, read_bytes
from gearrattle.writing import PREFIX, disk_is_full, put, sweep

_LONGEST = 240
JOB_NAME = re.compile(r"[A-Za-z0-9_-]{1,64}")
"""Pattern of the name of a job's folder."""
_MOST_FILES = 2000
_DEEPEST = 120  # folders: no name of a file leads deeper
_KINDS = {
    ".toml": "model",
    ".csv": "measured",
    ".txt": "measured",
    ".mf4": "measured",
    ".mat": "measured",
    ".wav": "measured",
    ".unv": "measured",
    ".uff": "measured",
    ".h5": "measured",
    ".hdf5": "measured",
    ".npz": "measured",
    ".nc": "motion",
}


class NotThereError(ModelError):
    """A file or job with the requested name does not exist."""


@dataclass(frozen=True)
class Folder:
    """A folder, without symbolic links, of which files are read and written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from gearrattle.workbench.workspace_folder import Folder
    >>> folder = Folder(Path(tempfile.mkdtemp()).resolve())
    >>> folder.write("models/idle.toml", b"schema = 1")
    >>> [entry["path"] for entry in folder.files()]
    ['models/idle.toml']
    >>> folder.path("../secret")
    Traceback (most recent call last):
        ...
    gearrattle.errors.ModelError: file: found ../secret; must name a file within the folder (letters, digits and / ...
    """

    root: Path

    @property
    def jobs(self) -> Path:
        """Where jobs are kept."""
        return self.root / ".gearrattle" / "jobs"

    def sweep(self) -> None:
        """Remove what a server that was killed was writing: hidden files and folders in its own and those of jobs."""
        _sweep_all(islice(_folders_within(self.root, "."), _MOST_FILES))
        _sweep_all(_folders_within(self.jobs.parent, PREFIX))

    def sweep_job(self, job: str) -> None:
        """Remove what the process of a job was writing when it was ended."""
        _sweep_all(_folders_within(self.jobs / job, PREFIX))

    def path(self, name: str) -> Path:
        """Return the path of a file by its name; ModelError if it is no name, or leads outside."""
        parts = name.split("/")
        fine = 0 < len(name) <= _LONGEST and name.isprintable() and not any(sign in name for sign in '\\:*?"<>|')
        if not fine or any(part.startswith(".") or part != part.strip() or not part for part in parts):
            raise _outside(name)
        try:
            path = (self.root / name).resolve()
        except (OSError, RuntimeError):
            raise _outside(name) from None
        if not path.is_relative_to(self.root) or any(
            part.startswith(".") for part in path.relative_to(self.root).parts
        ):
            raise _outside(name)
        return path

    def file(self, name: str) -> Path:
        """Return the path of a file; NotThereError if there is none, ModelError if it is no name or leads outside."""
        path = self.path(name)
        if not path.is_file():
            raise NotThereError(Problem("file", name, "there is no such file in the folder", "upload it first"))
        return path

    def job(self, job: str) -> Path:
        """Return the folder of a job; NotThereError if it does not exist, ModelError if it holds a link, a pipe or a
        device.
        """
        if not JOB_NAME.fullmatch(job) or not (self.jobs / job).is_dir():
            raise NotThereError(Problem("job", job[:64], "there is no such job", "look at the list of runs"))
        check_job_folder(self.jobs / job)
        return self.jobs / job

    def make_jobs(self) -> None:
        """Make the folder of jobs; ModelError if it, or the hidden folder around it, is a link or a file, OSError if
        the machine refuses.
        """
        for path in (self.jobs.parent, self.jobs):
            if not os.path.lexists(path):
                path.mkdir(exist_ok=True)
            if path.is_symlink() or not path.is_dir():
                kind = "a link" if path.is_symlink() else "no folder"
                raise ModelError(Problem("FOLDER", str(path), f"is {kind}; runs are kept there", "remove or rename it"))

    def read(self, name: str) -> bytes:
        """Return what a file holds; raises as ``file``."""
        try:
            return read_bytes(self.file(name))
        except Refused as refused:
            raise ModelError(Problem("file", name, refused.rule, refused.remedy)) from None

    def write(self, name: str, content: bytes) -> None:
        """Write a file, whole or not at all, and make its folders; ModelError if it is no name, leads outside, is a
        folder or a kind that is not kept here, or the machine refuses; OSError if the disk is full.
        """
        path = self.path(name)
        if path.suffix.lower() not in _KINDS:
            kinds = f"must end in one of {', '.join(_KINDS)}"
            raise ModelError(Problem("file", name, kinds, "models and measured files are kept here"))
        if path.is_dir():
            raise ModelError(Problem("file", name, "is a folder", "choose another name"))
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            put(path, content)
        except OSError as error:
            if disk_is_full(error):
                raise
            raise ModelError(Problem("file", name, (error.strerror or "cannot be written").lower())) from None

    def tag(self, name: str) -> str:
        """Return what differs between two contents of a file (an ETag); empty: there is no file."""
        path = self.path(name)
        return f'"{hashlib.sha256(read_bytes(path)).hexdigest()[:32]}"' if path.is_file() else ""

    def files(self) -> list[dict[str, Any]]:
        """Return path, bytes, time of change and kind of every file of a kind that is known, by path."""
        entries: list[dict[str, Any]] = []
        for folder in _folders_within(self.root, "."):
            for path in sorted(folder / name for name in _names_in(folder)):
                kind = _KINDS.get(path.suffix.lower())
                if kind is None or path.name.startswith("."):
                    continue
                try:
                    state = path.lstat()
                except OSError:  # removed meanwhile
                    continue
                if stat.S_ISLNK(state.st_mode) or stat.S_ISDIR(state.st_mode):
                    continue
                relative = path.relative_to(self.root).as_posix()
                entries.append({"path": relative, "bytes": state.st_size, "modified": state.st_mtime, "kind": kind})
                if len(entries) >= _MOST_FILES:
                    return entries
        return entries


def _sweep_all(folders: Iterable[Path]) -> None:
    """Sweep folders; what cannot be moved into place, or removed, stays, and keeps no server from its start."""
    for folder in folders:
        with suppress(OSError):
            sweep(folder)


def _names_in(folder: Path) -> list[str]:
    """Return the names in a folder; none where it cannot be read."""
    try:
        return os.listdir(folder)
    except OSError:
        return []


def _folders_within(root: Path, hidden: str) -> Iterator[Path]:
    """Yield a folder and those within it, by name; neither links, nor what begins as hidden names do, nor the deepest.

    Python's own walks call themselves for each level, and end with an error in a folder of a thousand levels.
    """
    pending = [root]
    while pending:
        folder = pending.pop()
        yield folder
        if len(folder.parts) - len(root.parts) >= _DEEPEST:
            continue
        with suppress(OSError), os.scandir(folder) as entries:
            names = [
                entry.name
                for entry in entries
                if not entry.name.startswith(hidden) and entry.is_dir(follow_symlinks=False)
            ]
            pending += [folder / name for name in sorted(names, reverse=True)]


def check_job_folder(folder: Path) -> None:
    """Refuse the folder of a job with anything but regular files and folders in it (ModelError): somebody else may have
    made it, and a link may lead to any file of this machine. So is one whose folders cannot be read, or are nested
    too deeply.
    """
    if folder.is_symlink():
        raise _no_regular_file(folder.name, "")
    pending = [(str(folder), 0)]
    while pending:
        path, depth = pending.pop()
        if depth > _DEEPEST:
            raise _unreadable(folder.name, f"holds folders more than {_DEEPEST} deep")
        try:
            with os.scandir(path) as opened:
                entries = list(opened)
        except FileNotFoundError:  # removed meanwhile
            continue
        except OSError as error:
            raise _unreadable(folder.name, (error.strerror or "cannot be read").lower()) from None
        for entry in entries:
            if entry.is_dir(follow_symlinks=False):
                pending.append((entry.path, depth + 1))
            elif not entry.is_file(follow_symlinks=False):
                raise _no_regular_file(folder.name, Path(entry.path).relative_to(folder).as_posix())


def _no_regular_file(job: str, name: str) -> ModelError:
    rule = "is a link, a pipe or a device; files of a run are regular files"
    return ModelError(Problem(f"{job}/{name}".rstrip("/"), "", rule, "delete the run"))


def _unreadable(job: str, rule: str) -> ModelError:
    return ModelError(Problem("job", job, rule, "delete the run"))


def _outside(name: str) -> ModelError:
    rule = "must name a file within the folder (letters, digits and / between folders)"
    return ModelError(
        Problem("file", name[:_LONGEST].encode("unicode_escape").decode(), rule, "leave out .. and hidden names")
    )
