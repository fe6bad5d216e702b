"""Storage behind an address that fsspec knows: ``s3://``, ``gs://``, ``abfs://``, ``memory://`` and others.

An object store keeps a file whole or not at all, and shows it once it has answered, as ``put`` promises.
Credentials and endpoints come from where fsspec's library for the protocol looks for them: its environment variables,
its files, or ``FSSPEC_<PROTOCOL>_<OPTION>``. The address is queried anew every time, nothing is cached.

fsspec: https://filesystem-spec.readthedocs.io.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gearrattle.errors import ModelError, NotInstalled, Problem

_OPTIONS = {"use_listings_cache": False}
_FOLDERS = {"auto_mkdir": True}


@dataclass(frozen=True)
class Remote:
    """Storage behind an address, which is kept without a slash at its end."""

    address: str

    local = None

    @property
    def shared(self) -> bool:
        """Whether other processes see it: all but the memory of a process."""
        return not self.address.startswith("memory://")

    @property
    def _system(self) -> Any:
        from fsspec import filesystem

        protocol = self.address.partition("://")[0]
        return filesystem(protocol, **self._options)

    @property
    def _options(self) -> dict[str, Any]:
        return _OPTIONS | (_FOLDERS if self.address.startswith("local://") else {})

    def _at(self, name: str = "") -> str:
        path: str = self._system._strip_protocol(f"{self.address}/{name}" if name else self.address)
        return path

    def absolute(self) -> Remote:
        """Return itself: addresses hold everywhere."""
        return self

    def make(self, folder: str = "") -> None:
        """Do nothing: stores of objects have no folders."""

    def is_empty(self) -> bool:
        """Return whether nothing is there."""
        return not self._listed("")

    def under(self, folder: str) -> Remote:
        """Return a storage location in a folder of it."""
        return Remote(f"{self.address}/{folder}")

    def exists(self, name: str) -> bool:
        """Return whether a file is there."""
        with self._own_errors():
            return bool(self._system.exists(self._at(name)))

    def read(self, name: str) -> bytes:
        """Return a file's content."""
        with self._own_errors():
            return bytes(self._system.cat_file(self._at(name)))

    def write(self, name: str, content: bytes) -> None:
        """Write a file."""
        self.put(name, content)

    def put(self, name: str, content: bytes, *, new: bool = False) -> None:
        """Write a file in one piece."""
        with self._own_errors():
            self._system.pipe_file(self._at(name), content, mode="create" if new else "overwrite")

    def remove(self, name: str) -> None:
        """Remove a file, if it is there."""
        with self._own_errors():
            try:
                self._system.rm_file(self._at(name))
            except FileNotFoundError:
                return

    def names(self, folder: str) -> list[str]:
        """Return the names of the files in a folder of it."""
        return [name.rstrip("/").rpartition("/")[2] for name in self._listed(folder)]

    def _listed(self, folder: str) -> list[str]:
        with self._own_errors():
            system = self._system
            system.invalidate_cache()
            try:
                return [str(name) for name in system.ls(self._at(folder), detail=False)]
            except FileNotFoundError:
                return []

    def take(self, folder: Path) -> None:
        """Send all files of a folder here, those deep in it first: those above them list the content."""
        for path in sorted(folder.rglob("*"), key=lambda path: (-len(path.parts), path)):
            if path.is_file():
                self.put(path.relative_to(folder).as_posix(), path.read_bytes())

    def zarr(self, name: str) -> Any:
        """Return Zarr's own store over fsspec."""
        from zarr.storage import FsspecStore

        with self._own_errors():
            return FsspecStore.from_url(f"{self.address}/{name}", storage_options=self._options)

    @contextmanager
    def _own_errors(self) -> Iterator[None]:
        """Raise whatever a store's library raises as an OSError that names the address."""
        try:
            yield
        except OSError:
            raise
        except Exception as error:  # libraries of stores raise errors of their own: credentials, connections, ...
            raise OSError(f"{self.address}: {' '.join(str(error).split()) or type(error).__name__}") from error


def remote(address: str) -> Remote:
    """Return the storage location behind an address.

    Raises
    ------
    NotInstalled
        fsspec, or its library for the protocol, is not here.
    ModelError
        there is no such protocol, or the address names no storage location.
    """
    protocol, _, rest = address.partition("://")
    try:
        from fsspec import get_filesystem_class
    except ImportError:
        rule = "an address needs fsspec, which is not installed"
        raise NotInstalled.of("studies", "output", address, rule) from None
    try:
        get_filesystem_class(protocol)
    except ImportError as error:
        rule = f"{protocol}:// needs a library that is not installed: {error}"
        remedy = f"pip install {_LIBRARIES.get(protocol, 'what it names')}"
        raise NotInstalled(Problem("output", address, rule, remedy)) from None
    except ValueError:
        rule = f"there is no protocol {protocol}://"
        remedy = "give a folder, or an address of fsspec, for example s3://bucket/study"
        raise ModelError(Problem("output", address, rule, remedy)) from None
    if not rest.strip("/"):
        rule = "names no place to write to"
        raise ModelError(Problem("output", address, rule, f"for example {protocol}://bucket/study"))
    return Remote(address.rstrip("/"))


_LIBRARIES = {"s3": "s3fs", "s3a": "s3fs", "gs": "gcsfs", "gcs": "gcsfs", "abfs": "adlfs", "az": "adlfs"}
