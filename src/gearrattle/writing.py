"""Files that are written: whole or not at all, by one program at a time, and on the disk once that is reported.

Results are written into a hidden folder beside their destination, on the same file system, and moved into place by
renaming when they are complete. A failure, a full disk, Ctrl-C or SIGTERM removes the hidden folder and leaves the
destination as it was. What a killed program leaves is dealt with by ``sweep``, at the next start into the same folder:

    .gearrattle-<id>/lock       locked (flock) while the program that made the folder lives
    .gearrattle-<id>/content/   what is being written; removed
    .gearrattle-<id>/new/       complete, and being moved into the folder around the hidden one: the move is completed
    .gearrattle-<id>/old/       what it replaces
    .gearrattle-<id>.part       a small file that is being written, locked by who writes it; removed

``content`` becomes ``new`` by one renaming, after all its files have been flushed to the disk. So at any time either
all of the old files count or all of the new ones.
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
"""How the names of hidden files and folders begin that are removed once what they hold is in place."""
_OWNER = "lock"
_CONTENT = "content"
_NEW = "new"
_OLD = "old"
_PART = ".part"
_ATTEMPTS = 5
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_NO_ROOM_WORDS = "no space left on device"  # of libraries that keep the words of an error alone
_FLUSHING = 8  # threads: the disk takes several requests at once


@contextmanager
def staged(destination: Path | None, send: Callable[[Path], None]) -> Iterator[Path]:
    """Give a folder to fill, whose content moves to its destination, or is sent elsewhere, if nothing goes wrong
    meanwhile.
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
    """Give an empty folder that is removed in the end, and first remove those left by killed programs."""
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
    """Whether a path lies in what ``temporary_folder`` gave."""
    return any(part.startswith(PREFIX) for part in path.parts)


@contextmanager
def whole(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give the path of a new file, which takes the place of ``path`` if nothing goes wrong meanwhile; FileNotFoundError
    without its folder, IsADirectoryError where it is a folder, OSError if it cannot be written.
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
        """Make the hidden folder, and clean up after killed programs; NotADirectoryError if a file has the name of the
        folder, OSError if it cannot be written.
        """
        anchor = _existing(self.destination)
        if not anchor.is_dir():
            raise NotADirectoryError(20, "a file stands where a folder is needed", str(anchor))
        sweep(anchor)
        with suppress(OSError):
            sweep(anchor.parent)  # a program killed there may have begun before the folder was made
        try:
            self._hidden, self._owner = _hidden_folder(anchor)
        except OSError as error:
            if error.errno not in (errno.ENOENT, errno.EACCES, errno.EPERM, errno.EROFS):
                raise
            # a file system that takes no files says that there is no such file
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
        """Move everything to the destination, replacing what has the same name and leaving everything else there.

        When this returns, everything is on the disk. OSError where the destination cannot be written; it is as it was.
        """
        assert self._hidden is not None
        flush(self.path)
        anchor = _existing(self.destination)
        with _turn(anchor):
            if anchor == self.destination:
                self._replace(self._hidden)
            else:  # one renaming makes the folder, and those above it
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
        """Remove the hidden folder, also if another program still writes there."""
        hidden = self._hidden
        self._hidden = None
        self._path = None
        if hidden is not None:
            _discard(hidden, self._owner)


def disk_is_full(error: BaseException) -> bool:
    """Whether an error says that the disk takes no more."""
    return getattr(error, "errno", None) in _NO_ROOM or _NO_ROOM_WORDS in str(error).lower()


def is_left(name: str) -> bool:
    """Whether a file or folder of this name may stand in a folder that counts as empty."""
    return name.startswith(PREFIX) or name == Lock.NAME


def sweep(folder: Path) -> None:
    """Complete or remove what killed programs have left in a folder, nothing if it cannot be read; OSError if results
    cannot be moved into the folder, which is then as it was.
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
    """Whether an entry is a hidden file or folder of this user: what others left is not trusted."""
    if not entry.name.startswith(PREFIX) or entry.is_symlink():
        return False
    if not entry.is_dir() and not (entry.is_file() and entry.name.endswith(_PART)):
        return False
    return not hasattr(os, "geteuid") or entry.stat().st_uid == os.geteuid()


def _is_folder(path: Path) -> bool:
    return path.is_dir() and not path.is_symlink()


def _existing(path: Path) -> Path:
    """Return a path, or the nearest above it that exists."""
    while not path.exists() and path != path.parent:
        path = path.parent
    return path


def _hidden_folder(anchor: Path) -> tuple[Path, int]:
    """Make a hidden folder, and return it with the open file whose lock says that it is in use."""
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
    """Remove a hidden folder, its lock last, unless results wait in it for being moved into place."""
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
    """Move what is in ``new`` into the folder around a hidden one; who begins it may be killed, and another go on."""
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
    os.rename(new, hidden / "undone")  # so that no other program moves it in


@contextmanager
def _turn(folder: Path) -> Iterator[None]:
    """Lock a folder, where the file system can, so that one program at a time moves results into it."""
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
    """Write a small file, whole or not at all; when this returns it is on the disk. FileExistsError if it must be new
    and is there, OSError if it cannot be written.
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
                stream.close()  # an open file keeps its name there
            if new and _linked(temporary, path):
                os.unlink(temporary)
            else:
                os.replace(temporary, path)
        _flush_folder(path.parent)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _linked(temporary: Path, path: Path) -> bool:
    """Give a file its name unless the name is taken; False on file systems without links."""
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
    """Have the disk take all files of a folder, and the folder, before anything that is written later; OSError if it
    refuses.
    """
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
    """Flush the names in a folder; nothing where folders cannot be flushed."""
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
    """The right to write into a folder, of one program at a time; within it the latest writer takes it over.

    The operating system holds it (flock) and takes it back when the process ends, however it ends. The file ``.lock``
    says who has it: process, and when it began to write. It stays behind, and means nothing without the lock.
    """

    NAME = ".lock"

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        """Take the lock; Refused if another program has it, OSError if the machine refuses."""
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
        """Whether it has neither been released nor taken over."""
        return self.release.alive


_LOCKS: weakref.WeakValueDictionary[str, Lock] = weakref.WeakValueDictionary()


def _opened_lock(path: Path, *, make: bool = True) -> int:
    """Open a file to be locked, made if need be, never through a symbolic link, for it is written; Refused if it is no
    regular file, OSError if it cannot be written.
    """
    flags = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    handle = os.open(path, os.O_RDWR | (os.O_CREAT if make else 0) | flags, 0o666)
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise Refused("is no regular file", f"remove {path}")
    return handle


def _locked(handle: int) -> bool | None:
    """Lock an open file if it is not locked; None on a file system without locks."""
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
