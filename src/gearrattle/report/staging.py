"""Nothing half-written: results appear whole or not at all.

Everything is first written into a hidden folder beside its destination, on the same file system, and moved into place
by renaming when it is complete. A failure, a full disk or Ctrl-C removes the hidden folder and leaves the destination
as it was. Opening the staging area also proves, before any long computation, that the destination can be written.

Takes a destination; gives a folder to write into.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Self

_ATTEMPTS = 5


@contextmanager
def staged(destination: Path | None, send: Callable[[Path], None]) -> Iterator[Path]:
    """Give a folder to fill, whose content moves to its destination if nothing goes wrong meanwhile.

    Args:
        destination: a folder of this machine; None for one elsewhere.
        send: takes the filled folder to one elsewhere.
    """
    if destination is None:
        with tempfile.TemporaryDirectory(prefix="gearrattle-") as name:
            yield Path(name)
            send(Path(name))
        return
    with Staging(destination) as staging:
        yield staging.path
        staging.commit()


class Staging:
    """A folder to write into, whose content moves to ``destination`` on ``commit``.

    Use it as a context manager; leaving it without ``commit`` discards everything.

    Attributes:
        destination: the folder the results are for; it need not exist.
        path: the folder to write into; exists while the context is open.
    """

    def __init__(self, destination: str | os.PathLike[str]) -> None:
        self.destination = Path(destination).absolute()
        self._hidden: Path | None = None

    def __enter__(self) -> Self:
        """Make the hidden folder.

        Raises:
            NotADirectoryError: a file stands where the folder should be.
            OSError: the place cannot be written.
        """
        anchor = self.destination
        while not anchor.exists() and anchor != anchor.parent:
            anchor = anchor.parent
        if not anchor.is_dir():
            raise NotADirectoryError(20, "a file stands where a folder is needed", str(anchor))
        self._hidden = Path(tempfile.mkdtemp(prefix=".gearrattle-", dir=anchor))
        self.path.mkdir()
        return self

    @property
    def path(self) -> Path:
        """The folder to write into."""
        if self._hidden is None:
            raise RuntimeError("the staging area is not open")
        return self._hidden / "content"

    def commit(self) -> None:
        """Move everything to the destination, replacing what has the same name and leaving everything else there.

        Raises:
            OSError: the destination cannot be written.
        """
        if not self.destination.exists():
            self.destination.parent.mkdir(parents=True, exist_ok=True)
            self.path.rename(self.destination)
            return
        for item in sorted(self.path.iterdir()):
            target = self.destination / item.name
            if target.is_dir() and not target.is_symlink():
                target.rename(self.path.parent / f"replaced-{item.name}")
            item.replace(target)

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove the hidden folder, also if somebody is still writing there."""
        hidden, self._hidden = self._hidden, None
        for _ in range(_ATTEMPTS):
            if hidden is None or not hidden.exists():
                return
            shutil.rmtree(hidden, ignore_errors=True)
