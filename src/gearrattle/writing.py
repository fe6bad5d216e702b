"""Folders that are written over time: by one program at a time.

Takes the path of a folder; gives the right to write there.
"""

from __future__ import annotations

import errno
import os
import platform
import sys
import time
import weakref
from pathlib import Path
from typing import Any

from gearrattle.files import Refused


class Lock:
    """The right to write into a folder, of one program at a time; within it the latest writer takes it over.

    The operating system holds it (flock) and takes it back when the process ends, however it ends. The file ``.lock``
    says who has it: process, and when it began to write. It stays behind, and means nothing without the lock.
    """

    NAME = ".lock"

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        """Take the lock.

        Raises:
            Refused: somebody else has it.
            OSError: the machine refused.
        """
        resolved = str(Path(folder).resolve())
        if (earlier := _LOCKS.get(resolved)) is not None:
            earlier.release()
        handle = os.open(Path(folder) / self.NAME, os.O_RDWR | os.O_CREAT, 0o666)
        self.release: weakref.finalize[Any, Any] = weakref.finalize(self, os.close, handle)
        if not _locked(handle):
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


def _locked(handle: int) -> bool:
    """Lock an open file if nobody has locked it."""
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
            return True  # a file system without locks
        raise
    return True
