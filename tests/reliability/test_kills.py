"""Commands that are killed lose nothing that was whole, show nothing partial, and leave no process behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.reliability.kills import LEFT, Attack, attacks, finish, kill_once, processes, started
from tests.studies.drivelines import TOML

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="processes are found in /proc")
STUDY = 'model = "A.toml"\n[axis]\n"torque.0.mean" = { from = 0.2, to = 1.2, count = 200 }\n'


def started_study(folder: Path) -> tuple[subprocess.Popen[bytes], str]:
    """Start a study, and wait until its workers have been started."""
    (folder / "A.toml").write_text(TOML, encoding="utf-8")
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    words = ("study", "study.toml", "-o", "out", "--scheduler", "local", "--workers", "2")
    process, mark = started(Attack("processes", (words,), folder / "out", lambda _: 0.0))
    deadline = time.monotonic() + 120.0
    while len(processes(mark)) < 3 and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    assert process.poll() is None
    return process, mark


@pytest.mark.parametrize("delay", [0.0, 0.3, 1.0])
def test_workers_end_with_a_study_that_is_killed_while_they_import(delay: float, tmp_path: Path) -> None:
    process, mark = started_study(tmp_path)
    time.sleep(delay)
    process.send_signal(signal.SIGKILL)
    process.wait()
    deadline = time.monotonic() + LEFT
    while (left := processes(mark)) and time.monotonic() < deadline:
        time.sleep(0.05)
    for one in left:
        os.kill(one, signal.SIGKILL)
    assert left == []


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
