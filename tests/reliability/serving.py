"""Jobs of a server that is killed: submitted by a thread beside it, and looked at as its folder keeps them.

Takes the process of a server and its folder; gives jobs, and what tells whether their values are right.
"""

from __future__ import annotations

import json
import signal
import subprocess
import time
from contextlib import suppress
from pathlib import Path

import httpx

from gearrattle.workbench.jobs.job_record import ENDED, read_jobs
from tests.reliability.values import Look, Values, compare, values_of_file
from tests.workbench.server import MODEL

JOBS = ({"task": "run"}, {"task": "study", "options": {"axes": {"coupling.gap.stiffness": [380.0, 400.0, 420.0]}}})
"""What is asked for, one after the other."""


def submit_jobs(process: subprocess.Popen[bytes], printed: Path) -> None:
    """Wait for the address of a server, ask it for jobs, and interrupt it when they have ended."""
    with suppress(httpx.HTTPError, OSError, ValueError):
        while "token" not in (text := printed.read_text(encoding="utf-8")):
            if process.poll() is not None:
                return
            time.sleep(0.02)
        address, _, token = text.splitlines()[0].partition("/?token=")
        with httpx.Client(base_url=address, timeout=60.0) as client:
            client.get(f"/?token={token}")
            jobs = [client.post("/api/jobs", json={"text": MODEL, **job}).json()["id"] for job in JOBS]
            while not {client.get(f"/api/jobs/{job}").json()["state"] for job in jobs} <= set(ENDED):
                time.sleep(0.05)
        process.send_signal(signal.SIGINT)


def results_of(root: Path) -> dict[str, list[Path]]:
    """Return the folders of results of a workspace by task, of jobs that are done."""
    folder = root / ".gearrattle" / "jobs"
    done = [job for job in read_jobs(folder) if job.state == "done"]
    return {task: [folder / job.id / "result" for job in done if job.task == task] for task in ("run", "study")}


def look_at_jobs(root: Path) -> Look:
    """Return what tells whether later jobs are as those of an undisturbed server; 1 once each task was done."""
    references: dict[str, Values] = {}
    for task, (result,) in results_of(root).items():
        references[task] = values_of_file(result / "results.nc")

    def looked(workspace: Path) -> float:
        records = (workspace / ".gearrattle" / "jobs").glob("*/job.json")
        assert all(json.loads(path.read_bytes())["task"] in references for path in records)
        results = results_of(workspace)
        for task, folders in results.items():
            for folder in folders:
                compare(values_of_file(folder / "results.nc"), references[task])
        return sum(bool(folders) for folders in results.values()) / len(references)

    return looked
