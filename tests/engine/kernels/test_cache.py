"""Code compiled just now and code from the cache give the same bits: a stored motion may go on in another process."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.architecture.places import EXAMPLES

CODE = f"""
import hashlib, gearrattle as gr
run = gr.simulate(gr.load({str(EXAMPLES / "paper" / "case2.toml")!r}), cycles=40, samples_per_cycle=1, audit=False)
t = run.trajectory
print(hashlib.sha256(t.events.time.tobytes() + t.events.velocity.tobytes() + t.acceleration.tobytes()).hexdigest())
"""


@pytest.mark.long
def test_fresh_and_cached_code_give_the_same_bits(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", CODE]
    runs = [subprocess.run(command, capture_output=True, env=environment, check=True) for _ in range(2)]
    assert list(tmp_path.rglob("*.nbc"))
    assert runs[0].stdout == runs[1].stdout
    assert len(runs[0].stdout.split()) == 1
