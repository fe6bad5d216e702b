"""A server in a process of its own, as a user starts it, and a client that has its token.

Takes a folder; gives the server.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx

from gearrattle.workbench.jobs.job_record import ENDED

MODEL = """schema = 1
name = "gap"
inertia = [{ name = "a", J = 0.01, drag = 0.05 }, { name = "b", J = 0.002, drag = 0.01 }]
coupling = [{ name = "gap", between = ["a", "b"], stiffness = 400.0, damping = 0.05, clearance = 0.01 }]
excitation = { speed = 80.0 }
torque = [{ on = "a", harmonics = [{ order = 1, amplitude = 2.0 }] }]
simulation = { cycles = 20, discard = 5, samples_per_cycle = 64 }
"""


@dataclass
class Server:
    """A running server."""

    process: subprocess.Popen[str]
    address: str
    token: str
    client: httpx.Client

    @property
    def port(self) -> int:
        return int(self.address.rpartition(":")[2])

    def job(self, **request: Any) -> dict[str, Any]:
        """Start a job."""
        answer = self.client.post("/api/jobs", json={"task": "run", "text": MODEL, **request})
        assert answer.status_code == 201, answer.text
        job: dict[str, Any] = answer.json()
        return job

    def state(self, job: str) -> dict[str, Any]:
        record: dict[str, Any] = self.client.get(f"/api/jobs/{job}").json()
        return record

    def model_text(self, job: str) -> str:
        """Return the model file of a job."""
        return self.client.get(f"/api/jobs/{job}/model.toml").text

    def ended(self, job: str) -> dict[str, Any]:
        """Wait until a job has ended."""
        return self.until(job, *ENDED)

    def until(self, job: str, *states: str) -> dict[str, Any]:
        end = time.monotonic() + 600.0
        while (record := self.state(job))["state"] not in states:
            assert time.monotonic() < end, record
            time.sleep(0.02)
        return record


@contextmanager
def serving(folder: Path, *words: str, within: Path | None = None, **environment: str) -> Iterator[Server]:
    """Serve a folder, started in the folder ``within`` (default: this one)."""
    command = [sys.executable, "-m", "gearrattle", "serve", str(folder), "--workers", "1", *words]
    variables = {**os.environ, "OMP_NUM_THREADS": "1", **environment}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=variables, cwd=within) as process:
        try:
            assert process.stdout is not None
            address, _, token = process.stdout.readline().strip().partition("/?token=")
            with httpx.Client(base_url=address, timeout=600.0) as client:
                _wait(client)
                assert client.get(f"/?token={token}").status_code == 303
                yield Server(process, address, token, client)
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(20)


def _wait(client: httpx.Client) -> None:
    end = time.monotonic() + 20.0
    while True:
        try:
            client.get("/")
            return
        except httpx.ConnectError:
            assert time.monotonic() < end
            time.sleep(0.02)
