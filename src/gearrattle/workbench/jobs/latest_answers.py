"""Quick answers, for example to a moving slider: one at a time, and of the waiting requests only the newest."""

from __future__ import annotations

import threading
from typing import Any

from gearrattle.errors import GearRattleError
from gearrattle.files import allowed_roots
from gearrattle.workbench.jobs.worker import EndedError, Reserve, WarmProcess
from gearrattle.workbench.workspace_folder import Folder


class SupersededError(GearRattleError):
    """A newer request took the place of this one before it began."""


class Newest:
    """A warm process from the reserve, with a limit of memory [bytes], and the newest request that waits for it."""

    def __init__(self, folder: Folder, memory: float, reserve: Reserve) -> None:
        self._folder = folder
        self._process = WarmProcess(memory, reserve)
        self._changed = threading.Condition()
        self._latest = 0
        self._is_busy = False
        self._is_open = True
        self._process.start()

    def ask(self, what: str, text: str, file: str, question: dict[str, Any]) -> dict[str, Any]:
        """Return the answer to a question about a model: "live", its motion with some values changed; or "estimate",
        the cost of a study.

        Raises
        ------
        ModelError
            the name leads out of the folder.
        SupersededError
            a newer request came before this one began.
        FailedError
            the model or a value is wrong.
        EndedError
            the process ended, or the server does.
        """
        self._folder.path(file or "model.toml")
        with self._changed:
            self._latest += 1
            number = self._latest
            self._changed.notify_all()
            while self._is_busy and number == self._latest:
                self._changed.wait()
            if not self._is_open:
                raise EndedError("the server ends")
            if number != self._latest:
                raise SupersededError("a newer request took its place")
            self._is_busy = True
            self._process.start()
        try:
            content = {"text": text, "folder": self._folder, "file": file, "roots": allowed_roots(), **question}
            answer: dict[str, Any] = self._process.ask(what, content)
            return answer
        finally:
            with self._changed:
                self._is_busy = False
                self._changed.notify_all()

    def close(self) -> None:
        """End the process; what waits is refused."""
        with self._changed:
            self._is_open = False
        self._process.end()
