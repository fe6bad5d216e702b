"""Power cuts: what is written is traced, and played back up to some operation with what the disk had not taken dropped.

    python -m tests.reliability.power --number 200

writes benchmarks/reliability/cuts.json: by what was written, how many cuts there were and after how many something was
shown as whole that is neither the old nor the new.

The disk that is modelled keeps the order of names (renaming, making, removing), as file systems with a journal do, but
takes them late: of the changes of names since a folder was flushed last, any number may be lost. The content of a file
that was not flushed since it was written may be there, be lost, be cut short, or be zeros.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.studies.stored_studies import OUTCOME
from gearrattle.writing import PREFIX, Staging
from tests.studies.drivelines import model

RESULTS = Path(__file__).parents[2] / "benchmarks" / "reliability" / "cuts.json"
State = dict[str, tuple[int, bytes | None]]
"""By name: number of the file, and its content; None for a folder."""


@dataclass
class Trace:
    """What a folder held before every operation on names, and what of it the disk had taken.

    Attributes
    ----------
    states
        the folder's content before operation 0, 1, ..., and in the end.
    flushed
        before each of them, by number of a file, its content when it was flushed last.
    barriers
        before each of them, the last state whose names the disk has taken.
    """

    root: Path
    states: list[State] = field(default_factory=list)
    flushed: list[dict[int, bytes]] = field(default_factory=list)
    barriers: list[int] = field(default_factory=list)

    def note(self) -> None:
        """Keep the present state."""
        now: State = {}
        for path in sorted(self.root.rglob("*")):
            try:
                content = None if path.is_dir() else path.read_bytes()
                now[path.relative_to(self.root).as_posix()] = (path.stat().st_ino, content)
            except FileNotFoundError:
                continue
        if not self.states:
            self.flushed.append({number: content for number, content in now.values() if content is not None})
            self.barriers.append(0)
        else:
            self.flushed.append(dict(self.flushed[-1]))
            self.barriers.append(self.barriers[-1])
        self.states.append(now)

    def cut(self, rng: np.random.Generator, to: Path) -> None:
        """Write what the disk holds after a cut at a random operation."""
        k = int(rng.integers(len(self.states)))
        j = int(rng.integers(self.barriers[k], k + 1))
        for name, (number, content) in self.states[j].items():
            if content is None:
                (to / name).mkdir(parents=True, exist_ok=True)
                continue
            kept = [content, b"", content[: len(content) // 2], bytes(len(content))]
            taken = self.flushed[k].get(number) == content
            (to / name).parent.mkdir(parents=True, exist_ok=True)
            (to / name).write_bytes(kept[0 if taken else int(rng.integers(4))])


def traced(root: Path, write: Callable[[Path], object]) -> Trace:
    """Write into a folder, and return the trace of it."""
    trace = Trace(root)
    lock = threading.RLock()
    names = dict[int, str]()

    def noting(operation: Any) -> Any:
        def noted(*arguments: Any, **options: Any) -> Any:
            with lock:
                trace.note()
                return operation(*arguments, **options)

        return noted

    def open_file(path: Any, *arguments: Any, **options: Any) -> int:
        handle = plain_open(path, *arguments, **options)
        names[handle] = os.fspath(path)
        return handle

    def flush(handle: int) -> None:
        with lock:
            plain_flush(handle)
            trace.note()
            about = os.fstat(handle)
            path = Path(os.readlink(f"/proc/self/fd/{handle}"))
            if path.is_dir():
                trace.barriers[-1] = len(trace.states) - 1
            elif path.is_relative_to(root.resolve()):
                trace.flushed[-1][about.st_ino] = path.read_bytes()

    plain_open, plain_flush = os.open, os.fsync
    with pytest.MonkeyPatch.context() as patch:
        trace.note()
        for name in ("rename", "replace", "link", "unlink", "mkdir", "rmdir"):
            patch.setattr(os, name, noting(getattr(os, name)))
        patch.setattr(os, "fsync", flush)
        write(root)
    trace.note()
    return trace


def tree(folder: Path) -> dict[str, bytes]:
    """Return the files of a folder."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@dataclass(frozen=True)
class Scene:
    """Something that is written.

    Attributes
    ----------
    name
        what.
    before
        fills the folder with what was there, flushed long ago.
    write
        what is traced.
    check
        looks at what is left, and raises AssertionError where it is corrupt and shown as whole.
    """

    name: str
    before: Callable[[Path], object]
    write: Callable[[Path], object]
    check: Callable[[Path], object]


OLD = {"report.html": b"old", "figures/a.svg": b"old", "figures/stale.svg": b"old", "mine.txt": b"mine"}
FRESH = {"report.html": b"new" * 100, "figures/a.svg": b"new" * 100, "figures/b.svg": b"new", "summary.json": b"new"}


def _fill(folder: Path, content: dict[str, bytes]) -> None:
    for name, data in content.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)


def _replaced(folder: Path) -> None:
    with Staging(folder / "out") as staging:
        _fill(staging.path, FRESH)
        staging.commit()


def _whole(old: dict[str, bytes], new: dict[str, bytes]) -> Callable[[Path], object]:
    def check(folder: Path) -> None:
        with Staging(folder / "out"):  # the next start
            pass
        actual = tree(folder / "out") if (folder / "out").exists() else {}
        assert actual in (old, new)
        assert not list(folder.rglob(f"{PREFIX}*"))

    return check


STREAM: dict[str, Any] = {"cycles": 12, "discard": 2, "samples_per_cycle": 8, "chunk": 4}
AXES = {"torque.0.mean": [0.2, 0.4, 0.6, 0.8, 1.0, 1.2]}
RANGES = {"coupling.joint.stiffness": (500.0, 1000.0)}


def _stream(folder: Path, *, resume: bool = False) -> list[bytes]:
    return [
        run.trajectory.events.time.tobytes()
        for run in gr.stream(model(), **STREAM, store=folder / "s", resume=resume, audit=False)
    ]


def _study(folder: Path, *, resume: bool = False) -> Any:
    return gr.study(model(), AXES, ["TR rms", "verdict"], output=folder / "s", resume=resume, workers=1)


def _optimum(folder: Path, generations: int) -> Any:
    limits: dict[str, Any] = {"population": 4, "generations": generations, "workers": 1, "resume": True}
    return gr.optimize(model(), RANGES, {"wheel: TR rms": "min"}, output=folder / "s", **limits)


def scenes() -> list[Scene]:
    """Return what is written under power cuts, with what should come of it."""
    fresh_and_mine = {**FRESH, "mine.txt": OLD["mine.txt"]}
    runs = [gr.simulate(model(), cycles=cycles, samples_per_cycle=8, audit=False) for cycles in (6, 7)]
    with tempfile.TemporaryDirectory() as home:
        chunks = _stream(Path(home))
    cases = gr.study(model(), AXES, ["TR rms", "verdict"], workers=1)
    with tempfile.TemporaryDirectory() as home:
        optima = [_optimum(Path(home), generations) for generations in (1, 2)]

    def saved(folder: Path) -> None:
        actual = gr.open_run(folder / "x.nc")
        times = [run.trajectory.events.time.tobytes() for run in runs]
        assert actual.trajectory.events.time.tobytes() in times
        assert actual.trajectory.cycles in (6, 7)

    def streamed(folder: Path) -> None:
        if (folder / "s" / "state.npz").exists():
            actual = [run.trajectory.events.time.tobytes() for run in gr.open_stream(folder / "s")]
            assert actual == chunks[: len(actual)]
        _stream(folder, resume=True)
        assert [run.trajectory.events.time.tobytes() for run in gr.open_stream(folder / "s")] == chunks

    def studied(folder: Path) -> None:
        try:
            actual = gr.open_study(folder / "s")
        except ModelError:
            actual = None
        if actual is not None:
            done = actual[OUTCOME].values == 1
            for name in cases.data_vars:
                np.testing.assert_array_equal(actual[name].values[done], cases[name].values[done])
        assert _study(folder, resume=True).equals(cases)

    def optimised(folder: Path) -> None:
        actual = gr.open_study(folder / "s")
        assert any(actual.equals(whole) for whole in optima)
        assert _optimum(folder, 2).equals(optima[1])

    return [
        Scene("a report over an old one", lambda f: _fill(f / "out", OLD), _replaced, _whole(OLD, fresh_and_mine)),
        Scene("a report in a new folder", lambda _: None, _replaced, _whole({}, FRESH)),
        Scene("a saved run", lambda f: runs[0].save(f / "x.nc"), lambda f: runs[1].save(f / "x.nc"), saved),
        Scene("a stream", lambda _: None, _stream, streamed),
        Scene("a study", lambda _: None, _study, studied),
        Scene("an optimisation that goes on", lambda f: _optimum(f, 1), lambda f: _optimum(f, 2), optimised),
    ]


def cuts(scene: Scene, number: int, seed: int) -> list[str]:
    """Cut the power while a scene is written, and return what went wrong."""
    rng, problems = np.random.default_rng(seed), []
    with tempfile.TemporaryDirectory() as home:
        root = Path(home) / "traced"
        root.mkdir()
        scene.before(root)
        trace = traced(root, scene.write)
        assert len(trace.states) > 5
        for i in range(number):
            left = Path(home) / f"cut-{i}"
            left.mkdir()
            trace.cut(rng, left)
            try:
                scene.check(left)
            except Exception as error:
                problems.append(f"cut {i}: {type(error).__name__}: {error!s:.300}")
    return problems


def main() -> int:
    """Cut, and write what came out."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--number", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=Path, default=RESULTS)
    asked = parser.parse_args()
    written, rows = scenes(), []
    for i, scene in enumerate(written):
        number = asked.number // len(written) + (i < asked.number % len(written))
        problems = cuts(scene, number, asked.seed + i)
        rows.append(
            {"attack": f"power cuts: {scene.name}", "tried": number, "failures": len(problems), "notes": problems}
        )
        print(f"{scene.name}: {number} cuts, {len(problems)} failures", *problems, sep="\n  ", file=sys.stderr)
    content = {"date": time.strftime("%Y-%m-%d"), "seed": asked.seed, "rows": rows}
    asked.output.parent.mkdir(parents=True, exist_ok=True)
    asked.output.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    return int(any(row["failures"] for row in rows))


if __name__ == "__main__":
    raise SystemExit(main())
