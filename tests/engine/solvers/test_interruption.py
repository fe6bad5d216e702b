"""Ctrl-C from Python: heard while a motion is prepared, compiled, marched, audited and sampled."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from tests.interruption import ANSWER, longest_deafness

pytestmark = [
    pytest.mark.compiled,
    pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX"),
]
EXAMPLES = Path(__file__).parents[3] / "examples"
PROGRAM = """
import signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)
import gearrattle as gr
model = gr.load(sys.argv[1])
print("begun", flush=True)
try:
    gr.simulate(model, **{settings})
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    print("done", flush=True)
except KeyboardInterrupt:
    print(time.monotonic(), flush=True)
"""
"""A shell's background jobs ignore SIGINT and hand that on to what they start."""


@pytest.mark.parametrize(
    ("example", "settings"),
    [
        ("paper/case3.toml", {"cycles": 1, "samples_per_cycle": 500_000}),
        ("clutch_friction.toml", {"cycles": 400, "samples_per_cycle": 1000, "audit": False}),
        ("run_up.toml", {}),
        ("paper/case3.toml", {"cycles": 4, "samples_per_cycle": 50_000, "algorithm": "rk4"}),
    ],
)
def test_a_simulation_looks_at_signals_many_times_a_second(example: str, settings: dict[str, object]) -> None:
    model = gr.load(EXAMPLES / example)
    gr.simulate(model, **{**settings, "cycles": 1, "samples_per_cycle": 8})  # type: ignore[arg-type]  # compiled
    longest, where = longest_deafness(lambda: gr.simulate(model, **settings))  # type: ignore[arg-type]
    assert longest < 0.5 * ANSWER, where


def interrupted(settings: dict[str, object], delay: float) -> float:
    """Press Ctrl-C after a while; return the seconds until it is heard, or NaN if all was done before."""
    words = [sys.executable, "-c", PROGRAM.replace("{settings}", f"{settings!r}"), str(EXAMPLES / "paper/case3.toml")]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"begun\n"
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(delay)
        pressed = time.monotonic()  # of the same clock in all processes
        process.send_signal(signal.SIGINT)
        answer, (_, errors) = process.stdout.readline(), process.communicate(timeout=60)
    assert (process.returncode, errors) == (0, b"")
    return float("nan") if answer == b"done\n" else float(answer) - pressed


@pytest.mark.long
def test_ctrl_c_is_heard_while_kernels_compile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    took = [interrupted({"cycles": 2}, delay) for delay in (1.0, 2.0, 3.0)]
    assert np.nanmedian(took) <= ANSWER  # a busy machine may be late once, the program must not be


@pytest.mark.long
def test_ctrl_c_is_heard_at_every_instant_of_a_long_run() -> None:
    settings: dict[str, object] = {"cycles": 3000}
    took = [interrupted(settings, delay) for delay in np.arange(0.1, 4.0, 0.1)]
    assert np.nanquantile(took, 0.9) <= ANSWER


@pytest.mark.long
def test_ctrl_c_is_heard_at_every_instant_of_a_compilation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    took = []
    for delay in np.arange(0.5, 30.0, 1.5):
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / f"{delay}"))
        took.append(interrupted({"cycles": 2}, delay))
    assert np.nanquantile(took, 0.9) <= ANSWER
