"""Safe writing of files: complete or not at all, by one program at a time, and on the disk when the call returns.

Results are written into a hidden folder next to their destination, on the same file system, and moved to the
destination by renaming when they are complete. A failure, a full disk, Ctrl-C or SIGTERM removes the hidden folder and
leaves the destination unchanged. If a program is killed, these files remain; at the next start into the same folder
``sweep`` completes or removes them:

    .gearrattle-<id>/lock       locked (flock) while the program that made the folder runs
    .gearrattle-<id>/content/   incomplete files; removed
    .gearrattle-<id>/new/       complete files that are being moved to the destination; the move is completed
    .gearrattle-<id>/old/       the files at the destination that they replace
    .gearrattle-<id>.part       a small incomplete file, locked by the program that writes it; removed

``content`` is renamed to ``new`` after all its files have been flushed to the disk. So at any time either all old files
are valid or all new ones.
"""

from __future__ import annotations

import errno
import os
import platform
import shutil
import stat
import sys
import tempfile
import time
import weakref
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self
from uuid import uuid4

from gearrattle.files import Refused

PREFIX = ".gearrattle-"
"""Prefix of hidden files and folders, which are removed when their content is at the destination."""
_OWNER = "lock"
_CONTENT = "content"
_NEW = "new"
_OLD = "old"
_PART = ".part"
_ATTEMPTS = 5
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_NO_ROOM_WORDS = "no space left on device"  # text of the error, for libraries that do not keep its number
_FLUSHING = 8  # threads: the disk takes several requests at once


@contextmanager
def staged(destination: Path | None, send: Callable[[Path], None]) -> Iterator[Path]:
    """Context with a folder to write into. At its end, if there is no error, the content is moved to ``destination``;
    without a destination, ``send`` is called with the folder.
    """
    if destination is None:
        with temporary_folder() as path:
            yield path
            send(path)
        return
    with Staging(destination) as staging:
        yield staging.path
        staging.commit()


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Context with an empty folder that is removed at the end; folders left by killed programs are removed first."""
    home = Path(tempfile.gettempdir())
    with suppress(OSError):
        sweep(home)
    hidden, owner = _hidden_folder(home)
    try:
        path = hidden / _CONTENT
        path.mkdir()
        yield path
    finally:
        _discard(hidden, owner)


def in_temporary_folder(path: Path) -> bool:
    """Whether a path is inside a folder of ``temporary_folder``."""
    return any(part.startswith(PREFIX) for part in path.parts)


@contextmanager
def whole(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Context with the path of a new file, which replaces ``path`` at the end if there is no error.

    FileNotFoundError if the folder of ``path`` does not exist, IsADirectoryError if ``path`` is a folder, OSError if it
    cannot be written.
    """
    target = Path(path)
    if not target.parent.is_dir():
        raise FileNotFoundError(2, "No such folder", str(target.parent))
    if target.is_dir():
        raise IsADirectoryError(21, "Is a directory", str(target))
    with Staging(target.parent) as staging:
        yield staging.path / target.name
        staging.commit()


class Staging:
    """A folder to write into, whose content moves to ``destination`` on ``commit``.

    Use it as a context manager; leaving it without ``commit`` discards everything.
    """

    def __init__(self, destination: str | os.PathLike[str]) -> None:
        self.destination = Path(os.path.realpath(destination))
        self._hidden: Path | None = None
        self._path: Path | None = None
        self._owner = -1

    def __enter__(self) -> Self:
        """Make the hidden folder, after ``sweep``.

        NotADirectoryError if a file has the name of the folder, OSError if the folder cannot be written.
        """
        anchor = _existing(self.destination)
        if not anchor.is_dir():
            raise NotADirectoryError(20, "a file stands where a folder is needed", str(anchor))
        sweep(anchor)
        with suppress(OSError):
            sweep(anchor.parent)  # a killed program may have started before the folder existed
        try:
            self._hidden, self._owner = _hidden_folder(anchor)
        except OSError as error:
            if error.errno not in (errno.ENOENT, errno.EACCES, errno.EPERM, errno.EROFS):
                raise
            # a file system without write access reports that the file does not exist
            reason = "permission denied" if error.errno != errno.EROFS else "read-only file system"
            reason = "its file system takes no files" if error.errno == errno.ENOENT else reason
            raise PermissionError(errno.EACCES, f"this folder cannot be written: {reason}", str(anchor)) from None
        self._path = self._hidden / _CONTENT / self.destination.relative_to(anchor)
        try:
            self._path.mkdir(parents=True)
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    @property
    def path(self) -> Path:
        """The folder to write into."""
        if self._path is None:
            raise RuntimeError("the staging area is not open")
        return self._path

    def commit(self) -> None:
        """Move everything to the destination; files of the same name are replaced, all others remain.

        When this returns, everything is on the disk. OSError if the destination cannot be written; it is then
        unchanged.
        """
        assert self._hidden is not None
        flush(self.path)
        anchor = _existing(self.destination)
        with _turn(anchor):
            if anchor == self.destination:
                self._replace(self._hidden)
            else:  # one renaming makes the folder and the missing folders above it
                missing = self.destination.relative_to(anchor).parts
                os.rename([self.path, *self.path.parents][len(missing) - 1], anchor / missing[0])
                _flush_folder(anchor)

    def _replace(self, hidden: Path) -> None:
        """Move everything into the destination, which exists."""
        names = sorted(os.listdir(self.path))
        single = len(names) == 1 and not any((folder / names[0]).is_dir() for folder in (self.path, self.destination))
        if single:
            os.replace(self.path / names[0], self.destination / names[0])
            _flush_folder(self.destination)
            return
        if hidden.parent != self.destination:  # the destination was made meanwhile
            self._hidden = self.destination / hidden.name
            self._path = self._hidden / self.path.relative_to(hidden)
            os.rename(hidden, self._hidden)
            hidden = self._hidden
        os.rename(self.path, hidden / _NEW)
        try:
            _move_in(hidden)
        except BaseException:
            _move_back(hidden, names)
            raise

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove the hidden folder, even if another program still writes into it."""
        hidden = self._hidden
        self._hidden = None
        self._path = None
        if hidden is not None:
            _discard(hidden, self._owner)


def disk_is_full(error: BaseException) -> bool:
    """Whether an error means that the disk is full."""
    return getattr(error, "errno", None) in _NO_ROOM or _NO_ROOM_WORDS in str(error).lower()


def is_left(name: str) -> bool:
    """Whether a folder counts as empty although it contains a file or folder of this name."""
    return name.startswith(PREFIX) or name == Lock.NAME


def sweep(folder: Path) -> None:
    """Complete or remove the files that killed programs have left in a folder; do nothing if it cannot be read.

    OSError if results cannot be moved into the folder, which is then unchanged.
    """
    # hidden folders and files of gearrattle
    try:
        with os.scandir(folder) as entries:
            left = [Path(entry.path) for entry in entries if _is_own(entry)]
    except OSError:
        return
    # leave those that a living program has locked
    for path in left:
        try:
            handle = _opened_lock(path / _OWNER if path.is_dir() else path, make=path.is_dir())
        except OSError:  # removed meanwhile
            continue
        if _locked(handle) is not True:
            os.close(handle)
            continue
        # remove a small file, complete a move that had begun
        if path.is_file():
            path.unlink(missing_ok=True)
            os.close(handle)
            continue
        if _is_folder(path / _NEW):
            try:
                with _turn(folder):
                    _move_in(path)
            except BaseException:
                os.close(handle)
                raise
        _discard(path, handle)


def _is_own(entry: os.DirEntry[str]) -> bool:
    """Whether an entry is a hidden file or folder of this user; those of other users are not trusted."""
    if not entry.name.startswith(PREFIX) or entry.is_symlink():
        return False
    if not entry.is_dir() and not (entry.is_file() and entry.name.endswith(_PART)):
        return False
    return not hasattr(os, "geteuid") or entry.stat().st_uid == os.geteuid()


def _is_folder(path: Path) -> bool:
    return path.is_dir() and not path.is_symlink()


def _existing(path: Path) -> Path:
    """Return a path, or if it does not exist, the nearest folder above it that exists."""
    while not path.exists() and path != path.parent:
        path = path.parent
    return path


def _hidden_folder(anchor: Path) -> tuple[Path, int]:
    """Make a hidden folder; return it and its open lock file, whose lock means that the folder is in use."""
    while True:
        hidden = Path(tempfile.mkdtemp(prefix=PREFIX, dir=anchor))
        with suppress(FileNotFoundError):  # another program has taken it for one that was left
            try:
                handle = _opened_lock(hidden / _OWNER)
            except BaseException:
                shutil.rmtree(hidden, ignore_errors=True)
                raise
            if _locked(handle) is not False and (hidden / _OWNER).exists():
                return hidden, handle
            os.close(handle)


def _discard(hidden: Path, handle: int) -> None:
    """Remove a hidden folder, its lock file last, unless it holds results that still have to be moved."""
    waiting = _is_folder(hidden / _NEW) and any((hidden / _NEW).iterdir())
    for _ in range(0 if waiting else _ATTEMPTS):
        with suppress(FileNotFoundError):
            for entry in hidden.iterdir():
                if entry.name != _OWNER:
                    shutil.rmtree(entry, ignore_errors=True)
    os.close(handle)
    if not waiting:
        shutil.rmtree(hidden, ignore_errors=True)


def _move_in(hidden: Path) -> None:
    """Move the content of ``new`` to the destination, the parent of the hidden folder.

    If the program is killed, another program can continue the move.
    """
    new = hidden / _NEW
    old = hidden / _OLD
    destination = hidden.parent
    _flush_folder(hidden)
    old.mkdir(exist_ok=True)
    for name in sorted(os.listdir(new)):
        if os.path.lexists(destination / name):
            os.rename(destination / name, old / name)
        os.rename(new / name, destination / name)
    for folder in (destination, new, old):
        _flush_folder(folder)


def _move_back(hidden: Path, names: list[str]) -> None:
    """Undo ``_move_in`` of files and folders of these names."""
    new = hidden / _NEW
    old = hidden / _OLD
    destination = hidden.parent
    for name in reversed(names):
        if not os.path.lexists(new / name):
            os.rename(destination / name, new / name)
        if os.path.lexists(old / name):
            os.rename(old / name, destination / name)
    _flush_folder(destination)
    os.rename(new, hidden / "undone")  # so that no other program continues the move


@contextmanager
def _turn(folder: Path) -> Iterator[None]:
    """Lock a folder, if the file system supports it, so that only one program at a time moves results into it."""
    handle = -1
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
    try:
        if handle >= 0 and sys.platform != "win32":
            import fcntl

            with suppress(OSError):
                fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        if handle >= 0:
            os.close(handle)


def put(path: Path, content: bytes, *, new: bool = False) -> None:
    """Write a small file, complete or not at all; when this returns, the file is on the disk.

    FileExistsError if ``new`` and the file exists, OSError if it cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    while True:
        temporary = path.with_name(f"{PREFIX}{uuid4().hex}{_PART}")
        handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
        if _locked(handle) is not False and temporary.exists():
            break
        os.close(handle)  # another program has taken it for one that was left
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
            if sys.platform == "win32":
                stream.close()  # Windows cannot rename an open file
            if new and _linked(temporary, path):
                os.unlink(temporary)
            else:
                os.replace(temporary, path)
        _flush_folder(path.parent)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _linked(temporary: Path, path: Path) -> bool:
    """Give a temporary file its final name unless a file of this name exists; False on file systems without links."""
    try:
        os.link(temporary, path)
    except FileExistsError:
        raise
    except OSError:
        if path.exists():
            raise FileExistsError(17, "File exists", str(path)) from None
        return False
    return True


def flush(folder: Path) -> None:
    """Flush all files of a folder, and the folder itself, to the disk; OSError if this fails."""
    folders = []
    files = []
    for root, _, names in os.walk(folder):
        folders.append(Path(root))
        files += [Path(root) / name for name in names]
    regular = [path for path in files if path.is_file() and not path.is_symlink()]
    with ThreadPoolExecutor(_FLUSHING) as pool:
        list(pool.map(_flush_file, regular))
        list(pool.map(_flush_folder, folders))


def _flush_file(path: Path) -> None:
    handle = os.open(path, os.O_RDWR if sys.platform == "win32" else os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _flush_folder(folder: Path) -> None:
    """Flush the names in a folder, on systems that can flush a folder."""
    if sys.platform == "win32":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(handle)


class Lock:
    """A lock (flock) that lets only one program at a time write into a folder.

    Within one program, the latest writer takes the lock over from an earlier one. The operating system releases the
    lock when the process ends for any reason. The file ``.lock`` states the process and when it began to write; the
    file remains afterwards, and has no meaning without the lock.
    """

    NAME = ".lock"

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        """Acquire the lock; Refused if another program has it, OSError if the system cannot lock."""
        resolved = str(Path(folder).resolve())
        if (earlier := _LOCKS.get(resolved)) is not None:
            earlier.release()
        handle = _opened_lock(Path(folder) / self.NAME)
        self.release: weakref.finalize[Any, Any] = weakref.finalize(self, os.close, handle)
        if _locked(handle) is False:
            owner = os.read(handle, 200).decode("utf-8", "replace").strip()
            self.release()
            rule = f"another program writes into it ({owner or 'it has just begun'})"
            raise Refused(rule, "wait for it to end, or choose another folder")
        began = time.strftime("%Y-%m-%d %H:%M:%S")
        os.ftruncate(handle, 0)
        os.write(handle, f"process {os.getpid()} on {platform.node()} since {began}\n".encode())
        _LOCKS[resolved] = self

    @property
    def held(self) -> bool:
        """Whether the lock has neither been released nor taken over by a later writer."""
        return self.release.alive


_LOCKS: weakref.WeakValueDictionary[str, Lock] = weakref.WeakValueDictionary()


def _opened_lock(path: Path, *, make: bool = True) -> int:
    """Open the lock file for writing; with ``make`` it is made if it does not exist. Symbolic links are not followed.

    Refused if it is not a regular file, OSError if it cannot be written.
    """
    flags = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    handle = os.open(path, os.O_RDWR | (os.O_CREAT if make else 0) | flags, 0o666)
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise Refused("is no regular file", f"remove {path}")
    return handle


def _locked(handle: int) -> bool | None:
    """Lock an open file; False if it is locked already, None on a file system without locks."""
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError as error:
        if error.errno in (errno.EACCES, errno.EDEADLK):
            return False
        if error.errno in (errno.ENOTSUP, errno.ENOSYS, errno.ENOLCK):
            return None
        raise
    return True
