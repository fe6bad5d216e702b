"""Storage location: a folder or an address that keeps a study and may be written by several processes.

It holds files by name, "/" between folders. ``put`` promises that a file appears whole or not at all, and that it
appears after everything that was written before it: a study's markers rely on that. ``write`` promises nothing.

To add a kind: its file with a class, and a line in ``storage_of``. The tests of the store run over all of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol


@dataclass(frozen=True)
class File:
    """File in storage, which need not exist; methods as of ``pathlib.Path``, but writing is all or nothing."""

    storage: Storage
    name: str

    def __str__(self) -> str:
        return f"{self.storage.address.rstrip('/')}/{self.name}"

    def exists(self) -> bool:
        """Return whether it is there."""
        return self.storage.exists(self.name)

    def read_bytes(self) -> bytes:
        """Return its content; FileNotFoundError if it is not there."""
        return self.storage.read(self.name)

    def write_bytes(self, data: bytes) -> None:
        """Write it, whole or not at all."""
        self.storage.put(self.name, data)

    def unlink(self, missing_ok: bool = False) -> None:
        """Remove it."""
        if not missing_ok and not self.exists():
            raise FileNotFoundError(2, "No such file", str(self))
        self.storage.remove(self.name)


class Storage(Protocol):
    """Location that keeps a study.

    Methods raise OSError for whatever goes wrong there.
    """

    @property
    def address(self) -> str:
        """Name in messages, which ``storage_of`` accepts."""

    @property
    def shared(self) -> bool:
        """Whether other processes see it."""

    @property
    def local(self) -> Path | None:
        """The folder, if it is one of this machine."""

    def absolute(self) -> Storage:
        """Return the same storage location, by a name that holds for processes that work elsewhere."""

    def make(self, folder: str = "") -> None:
        """Make it and a folder of it, if they are not there."""

    def is_empty(self) -> bool:
        """Return whether nothing is there."""

    def under(self, folder: str) -> Storage:
        """Return a storage location of its own in a folder of it."""

    def exists(self, name: str) -> bool:
        """Return whether a file is there."""

    def read(self, name: str) -> bytes:
        """Return a file's content; FileNotFoundError if it is not there."""

    def write(self, name: str, content: bytes) -> None:
        """Write a file; what reads it meanwhile may find a part of it."""

    def put(self, name: str, content: bytes, *, new: bool = False) -> None:
        """Write a file whole or not at all; if it must be ``new``, FileExistsError where it is not."""

    def remove(self, name: str) -> None:
        """Remove a file, if it is there."""

    def names(self, folder: str) -> list[str]:
        """Return the names of the files in a folder of it; none if there is no such folder."""

    def take(self, folder: Path) -> None:
        """Copy all files of a folder of this machine here, replacing those of the same name."""

    def zarr(self, name: str) -> Any:
        """Return what Zarr and xarray open a group by."""
