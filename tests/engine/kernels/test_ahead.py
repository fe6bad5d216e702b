"""Kernels compiled side by side: each once, the same code as ever, and nothing depends on the other processes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import pytest

from gearrattle import processes
from gearrattle.engine.kernels import _ahead
from gearrattle.engine.kernels._ahead import PLAN, Ahead, Task
from tests.architecture.places import EXAMPLES

FIRST, SECOND = ((name, (False,)) for name in PLAN[:2])
NOT_PLANNED = "statics.is_loose"
PLANNED = "gearrattle.engine.kernels.compiled_ahead"

BEGIN = """
import hashlib, json, os, signal, sys, time
import gearrattle as gr
from gearrattle.engine.kernels import _ahead
from gearrattle.engine.kernels._jit import AHEAD
_ahead._cores = lambda: 2
"""
RUN = f"""
from gearrattle.engine.kernels.compiled_ahead import planned
import gearrattle.engine.kernels as kernels, importlib
lent = []
lend = _ahead.Ahead._lend
def recorded(self, connection, task):
    is_free = lend(self, connection, task)
    if is_free:
        lent.append(task[0])
    return is_free
_ahead.Ahead._lend = recorded
begin = _ahead.Ahead._start
def killed(self):
    begin(self)
    self.processes[-1].kill()
if sys.argv[1] == "killed":
    _ahead.Ahead._start = killed
run = gr.run(gr.load({str(EXAMPLES / "paper" / "case2.toml")!r}), cycles=40, samples_per_cycle=4)
run.metrics
here = []
for name in _ahead.PLAN:
    module, function = name.split(".")
    entry = getattr(importlib.import_module("gearrattle.engine.kernels." + module), function)
    if sum(entry.stats.cache_misses.values()):
        here.append(name)
t = run.motion.trajectory
bits = t.events.time.tobytes() + t.events.velocity.tobytes() + t.acceleration.tobytes()
answer = dict(here=here, lent=lent, processes=len(AHEAD.processes), bits=hashlib.sha256(bits).hexdigest())
print(json.dumps(answer))
"""
LEFT = f"""
model = gr.load({str(EXAMPLES / "paper" / "case2.toml")!r})
signal.signal(signal.SIGINT, signal.default_int_handler)
import threading
threading.Thread(target=gr.run, args=(model,), daemon=True).start()
for _ in range(6000):
    if AHEAD.processes:
        break
    time.sleep(0.01)
print(AHEAD.processes[0].pid, flush=True)
time.sleep(60.0)
"""
"""The process ends while a kernel is compiled for it."""


def program(code: str, *arguments: str, cache: Path | None = None) -> Any:
    """What a program prints, as JSON."""
    environment = {**os.environ} if cache is None else {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    command = [sys.executable, "-c", BEGIN + code, *arguments]
    return json.loads(subprocess.run(command, capture_output=True, env=environment, check=True).stdout)


@contextmanager
def answered() -> Iterator[tuple[Ahead, Connection]]:
    """What answers another process, and the other end of its pipe."""
    ahead, (here, there) = Ahead(PLANNED), Pipe()
    thread = threading.Thread(target=ahead._answer, args=(here,))
    thread.start()
    try:
        yield ahead, there
    finally:
        there.close()
        thread.join()


def asked(connection: Connection, task: Task) -> bool:
    """Whether another process may compile a kernel."""
    connection.send(task)
    return bool(connection.recv())


def taken(ahead: Ahead, task: Task) -> threading.Thread:
    """A thread that takes a kernel on, and ends once it has it."""
    thread = threading.Thread(target=ahead.take, args=(task,), daemon=True)
    thread.start()
    return thread


def test_what_was_taken_is_refused_and_what_was_lent_is_lent_once() -> None:
    with answered() as (ahead, other):
        ahead.take(FIRST)
        assert not asked(other, FIRST)
        assert asked(other, SECOND)
        assert not asked(other, SECOND)


def test_what_another_process_compiles_is_waited_for() -> None:
    with answered() as (ahead, other):
        assert asked(other, FIRST)
        waiting = taken(ahead, FIRST)
        waiting.join(0.3)
        assert waiting.is_alive()
        taken(ahead, SECOND).join()
        asked(other, ("another", ()))
        waiting.join()


def test_a_process_that_ends_is_not_waited_for() -> None:
    with answered() as (ahead, other):
        assert asked(other, FIRST)
        waiting = taken(ahead, FIRST)
        other.close()
        waiting.join()


def test_a_process_that_is_stopped_is_not_waited_for_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_ahead, "_PATIENCE", 0.2)
    with answered() as (ahead, other):
        assert asked(other, FIRST)
        taken(ahead, FIRST).join()


@pytest.mark.parametrize(
    ("cores", "name", "count"), [(1, PLAN[0], 0), (2, PLAN[0], 1), (2, NOT_PLANNED, 0), (64, PLAN[0], 3)]
)
def test_so_many_processes_begin(monkeypatch: pytest.MonkeyPatch, cores: int, name: str, count: int) -> None:
    begun: list[Ahead] = []
    monkeypatch.setattr(_ahead, "_cores", lambda: cores)
    monkeypatch.setattr(Ahead, "_start", lambda self: begun.extend([self]))
    ahead = Ahead(PLANNED)
    ahead.begin(name)
    ahead.begin(name)
    assert begun == count * [ahead]


def test_none_begins_in_a_process_that_others_started(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[Ahead] = []
    monkeypatch.setattr(_ahead, "_cores", lambda: 2)
    monkeypatch.setattr(processes, "may_start_others", lambda: False)
    monkeypatch.setattr(Ahead, "_start", lambda self: begun.extend([self]))
    Ahead(PLANNED).begin(PLAN[0])
    assert not begun


def test_a_process_that_cannot_start_is_done_without(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: Ahead) -> None:
        raise OSError("no memory")

    monkeypatch.setattr(_ahead, "_cores", lambda: 2)
    monkeypatch.setattr(Ahead, "_start", fail)
    Ahead(PLANNED).begin(PLAN[0])


@pytest.mark.compiled
def test_every_kernel_of_the_plan_has_its_arguments() -> None:
    from gearrattle.engine.kernels.compiled_ahead import planned

    assert sorted(planned()) == sorted(PLAN)
    assert len(set(PLAN)) == len(PLAN)


@pytest.mark.compiled
@pytest.mark.slow
def test_nothing_is_started_where_all_is_kept() -> None:
    runs = [program(RUN, "as it is") for _ in range(2)]
    assert runs[1]["here"] == []
    assert runs[1]["lent"] == []
    assert runs[1]["processes"] == 0


@pytest.mark.compiled
@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
@pytest.mark.parametrize("name", ["SIGKILL", "SIGINT", "SIGTERM"])
def test_no_process_is_left(tmp_path: Path, name: str) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", BEGIN + LEFT]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment) as process:
        assert process.stdout is not None
        other = int(process.stdout.readline())
        process.send_signal(getattr(signal, name))
        process.wait()
    for _ in range(300):
        try:
            os.kill(other, 0)
        except ProcessLookupError:
            return
        time.sleep(0.1)
    pytest.fail(f"{other} is still there")


@pytest.mark.compiled
@pytest.mark.long
def test_each_kernel_is_compiled_once_and_the_same_with_and_without_other_processes(tmp_path: Path) -> None:
    side_by_side = program(RUN, "as it is", cache=tmp_path / "side by side")
    alone = program(RUN, "killed", cache=tmp_path / "alone")
    assert sorted(side_by_side["here"] + side_by_side["lent"]) == sorted(PLAN)
    assert side_by_side["lent"][0] == PLAN[0]
    assert len(side_by_side["lent"]) > 1
    assert sorted(alone["here"]) == sorted(PLAN)
    assert alone["processes"] == 1
    assert alone["bits"] == side_by_side["bits"]
