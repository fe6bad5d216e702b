"""Give a target one damaged input after the other, and note what is neither a value nor an error of ours.

An input must end within two seconds of processor time, leave the process below 1 GB, print nothing, and leave no file
behind. A find is known by its kind and by the last line of our source that it went through; the shortest input that
shows it is kept.

Takes targets; gives counts and finds.
"""

from __future__ import annotations

import io
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest.mock import patch

from gearrattle.errors import GearRattleError
from tests.fuzz.mutations import mutated
from tests.fuzz.target import LawError, NotSimulatedError, Target

SECONDS, MOST_MEMORY = 2.0, 700_000_000
"""What one input may take: processor time, and memory beyond that of the process before (some 300 MB)."""
_NEW, _KEPT = 0.05, 200  # how often an input that passed becomes a seed, and how many there are


class SlowError(BaseException):
    """An input took too long; no handler of ours may catch it."""


@dataclass
class Result:
    """What became of the inputs of one target.

    Attributes
    ----------
    tried
        inputs.
    refused
        by an error of ours.
    finds
        input by what is wrong with its answer.
    """

    tried: int = 0
    refused: int = 0
    finds: dict[str, bytes] = field(default_factory=dict)


class Attack:
    """A target in a folder of its own.

    Parameters
    ----------
    target
        what is attacked.
    folder
        an empty one: the damaged file and what stands beside it are in its folder ``attacked``.
    """

    def __init__(self, target: Target, folder: Path) -> None:
        self.target = target
        self.home = folder / "attacked"
        self.path = self.home / target.file
        self.temporary = folder / "temporary"
        sound = folder / "seeds"
        for path in (self.home, self.temporary, sound):
            path.mkdir(exist_ok=True)
        self.seeds = target.seeds(sound)
        target.around(self.home)
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self.result = Result()
        self.names: set[str] = set()
        self.resident_before = largest_resident(afresh=True)

    def tells(self, data: bytes) -> str:
        """Return what is wrong with the answer to one input; empty if nothing is, "refused" if it is refused."""
        self.path.write_bytes(data)
        begun = time.process_time()
        printed = io.StringIO()
        try:
            with _bounded(2.5 * SECONDS), redirect_stdout(printed):
                self.target.run(self.path)
            reported = ""
        except NotSimulatedError:
            reported = ""
        except GearRattleError:
            reported = "refused"
        except LawError as error:
            reported = f"law, {error!s:.100}"
        except SlowError as error:
            reported = f"slow, {_where(error)}"
        except Exception as error:
            reported = f"{type(error).__name__}, {_where(error)}"
        left = self.clear_away()
        if reported not in ("", "refused"):
            return reported
        if left:
            return f"left behind, {Path(left[0]).suffix or 'a folder'}"
        if printed.getvalue():
            return "prints"
        if time.process_time() - begun > SECONDS:
            return "slow"
        if largest_resident() > MOST_MEMORY + self.resident_before:
            largest_resident(afresh=True)  # the next input is not to blame
            return "memory"
        return reported

    def clear_away(self) -> list[str]:
        """Remove files and folders that were not there when the sound files had been read; return their names."""
        names = names_below(self.home) | names_below(self.temporary)
        more = sorted(names - self.names) if self.names else []
        for name in more:
            path = Path(name)
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink(missing_ok=True)
        return more

    def run(self, count: int, seed: int, before: Callable[[int, bytes], object] = lambda *_: None) -> Result:
        """Try damaged inputs.

        Parameters
        ----------
        count
            how many.
        seed
            of their damage; the same seed gives the same inputs.
        before
            called with the number and content of every input before it is tried.
        """
        with self.opened():
            self.read_sound_files()
            pool = list(self.seeds)
            for number in range(count):
                draw = random.Random(f"{seed} {self.target.name} {number}")
                data = mutated(draw.choice(pool), draw, kind=self.target.kind)
                before(number, data)
                reported = self.tells(data)
                self.note(reported, data)
                if not reported and draw.random() < _NEW:
                    pool[len(self.seeds) + _KEPT :] = []
                    pool.insert(len(self.seeds), data)
        return self.result

    @contextmanager
    def opened(self) -> Iterator[None]:
        """Have the target open, quiet, and its temporary files in a folder of ours."""
        with quiet(), patch.object(tempfile, "tempdir", str(self.temporary)), self.target.while_open():
            yield

    def read_sound_files(self) -> None:
        """Read the files that the damage begins with: what cannot be read sound teaches nothing damaged."""
        for data in self.seeds:
            self.path.write_bytes(data)
            try:
                self.target.run(self.path)
            except NotSimulatedError:
                continue
        self.names = names_below(self.home) | names_below(self.temporary)

    def note(self, message: str, data: bytes) -> None:
        """Count an input, and keep it if it is the shortest that shows something new."""
        self.result.tried += 1
        self.result.refused += message == "refused"
        if message not in ("", "refused"):
            earlier = self.result.finds.get(message)
            if earlier is None or len(data) < len(earlier):
                self.result.finds[message] = data

    def shortest(self, message: str, data: bytes, tries: int = 400) -> bytes:
        """Return a shorter input with the same answer, by leaving out parts of it."""
        size = len(data) // 2
        with self.opened():
            while size and tries:
                at = 0
                while at < len(data) and tries:
                    shorter = data[:at] + data[at + size :]
                    tries -= 1
                    if self.tells(shorter) == message:
                        data = shorter
                    else:
                        at += size
                size //= 2
        return data


def names_below(folder: Path) -> set[str]:
    """Return the paths of all files and folders below a folder."""
    return {os.path.join(where, name) for where, folders, files in os.walk(folder) for name in (*folders, *files)}


def largest_resident(*, afresh: bool = False) -> int:
    """Return the largest resident size of this process [bytes]: so far, or on Linux ``afresh`` from now on.

    A process of many tests has long been larger than any input makes it.
    """
    status = Path("/proc/self/status")
    if not status.exists():
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    if afresh:
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    (line,) = (line for line in status.read_text(encoding="ascii").splitlines() if line.startswith("VmHWM"))
    return 1024 * int(line.split()[1])


@contextmanager
def quiet() -> Iterator[None]:
    """Say nothing of overflow: a warning is no failure."""
    import numpy as np

    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        yield


@contextmanager
def _bounded(seconds: float) -> Iterator[None]:
    """Raise SlowError after so much processor time, as soon as Python is back from compiled code."""

    def stop(*_: Any) -> None:
        raise SlowError

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)


def _where(error: BaseException) -> str:
    """Return the last line of our source that an error went through."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if "/gearrattle/" in frame.filename]
    return f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "elsewhere"
