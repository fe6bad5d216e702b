"""Commands that are killed lose nothing that was whole, show nothing partial, and leave no process behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from uuid import uuid4

import numpy as np
import pytest

from tests.reliability.kills import LEFT, MARK, Attack, attacks, finish, kill_once, processes, started
from tests.studies.drivelines import TOML

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="processes are found in /proc")
ROOT = Path(__file__).parents[2]
SLOW_TO_IMPORT = """
import os, time
import gearrattle as gr
from tests.studies.drivelines import model
if "GEARRATTLE_STUDY_WORKER" in os.environ:
    time.sleep(60.0)
def own(run):
    return {"largest speed": float(abs(run.trajectory.velocity).max())}
if __name__ == "__main__":
    torques = [0.1 * k for k in range(1, 17)]
    gr.study(model(), {"torque.0.mean": torques}, [], function=own, scheduler="local", workers=2)
"""
STUDY = 'model = "A.toml"\n[axis]\n"torque.0.mean" = { from = 0.2, to = 1.2, count = 200 }\n'


def wait_for_workers(process: subprocess.Popen[bytes], mark: str) -> None:
    """Wait until two workers have been started."""
    deadline = time.monotonic() + 120.0
    while len(processes(mark)) < 3 and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    assert process.poll() is None


def left_after_kill(process: subprocess.Popen[bytes], mark: str) -> list[int]:
    """Kill a process; return which of those it started live five seconds later, and end them."""
    process.send_signal(signal.SIGKILL)
    process.wait()
    deadline = time.monotonic() + LEFT
    while (left := processes(mark)) and time.monotonic() < deadline:
        time.sleep(0.05)
    for one in left:
        os.kill(one, signal.SIGKILL)
    return left


@pytest.mark.long
@pytest.mark.parametrize("delay", [0.3, 0.0, 1.0])
def test_workers_end_with_a_study_that_is_killed_while_they_import(delay: float, tmp_path: Path) -> None:
    (tmp_path / "A.toml").write_text(TOML, encoding="utf-8")
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    words = ("study", "study.toml", "-o", "out", "--scheduler", "local", "--workers", "2")
    process, mark = started(Attack("processes", (words,), tmp_path / "out", lambda _: 0.0))
    wait_for_workers(process, mark)
    time.sleep(delay)
    assert left_after_kill(process, mark) == []


@pytest.mark.long
def test_workers_end_with_a_study_that_is_killed_while_they_import_its_main_module(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(SLOW_TO_IMPORT, encoding="utf-8")
    mark = uuid4().hex
    environment = {**os.environ, MARK: mark, "PYTHONPATH": f"{ROOT / 'src'}:{ROOT}"}
    process = subprocess.Popen([sys.executable, str(script)], env=environment)
    wait_for_workers(process, mark)
    time.sleep(2.0)  # by now they import it
    assert left_after_kill(process, mark) == []


@pytest.mark.long
def test_twenty_kills_lose_nothing_and_leave_nothing(tmp_path: Path) -> None:
    rng = np.random.default_rng(20)
    with attacks(tmp_path, ("run", "figures", "stream", "threads", "processes")) as made:
        for attack in made * 4:
            kill_once(attack, rng)
        for attack in made:
            finish(attack)
        assert {attack.name: (attack.tried, attack.notes) for attack in made} == {
            attack.name: (4, []) for attack in made
        }
