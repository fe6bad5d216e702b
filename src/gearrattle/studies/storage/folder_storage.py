"""Storage in a folder of this machine, or of a file system that it shares with others.

A file is renamed to its name after its content has reached the disk.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from gearrattle.files import read_bytes
from gearrattle.writing import is_left, put


@dataclass(frozen=True)
class Folder:
    """Storage in a folder."""

    path: Path

    shared = True

    @property
    def address(self) -> str:
        """Its path."""
        return str(self.path)

    @property
    def local(self) -> Path:
        """Its path."""
        return self.path

    def absolute(self) -> Folder:
        """Return the folder by its absolute path."""
        return Folder(self.path.absolute())

    def make(self, folder: str = "") -> None:
        """Make it and a folder of it, with all folders above."""
        (self.path / folder).mkdir(parents=True, exist_ok=True)

    def is_empty(self) -> bool:
        """Return whether it does not exist or holds nothing besides what killed programs have left."""
        return not (self.path.exists() and any(not is_left(path.name) for path in self.path.iterdir()))

    def under(self, folder: str) -> Folder:
        """Return a folder in it."""
        return Folder(self.path / folder)

    def exists(self, name: str) -> bool:
        """Return whether a file is there."""
        return (self.path / name).exists()

    def read(self, name: str) -> bytes:
        """Return a file's content."""
        return read_bytes(self.path / name)

    def write(self, name: str, content: bytes) -> None:
        """Write a file in place."""
        (self.path / name).write_bytes(content)

    def put(self, name: str, content: bytes, *, new: bool = False) -> None:
        """Write a file of another name, flush it to the disk, rename it."""
        put(self.path / name, content, new=new)

    def remove(self, name: str) -> None:
        """Remove a file, if it is there."""
        (self.path / name).unlink(missing_ok=True)

    def names(self, folder: str) -> list[str]:
        """Return the names of the files in a folder of it."""
        try:
            return [path.name for path in (self.path / folder).iterdir()]
        except FileNotFoundError:
            return []

    def take(self, folder: Path) -> None:
        """Copy all files of a folder here."""
        shutil.copytree(folder, self.path, dirs_exist_ok=True)

    def zarr(self, name: str) -> str:
        """Return the path of a group."""
        return str(self.path / name)
