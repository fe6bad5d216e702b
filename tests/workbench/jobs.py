"""Jobs in a folder as the queue leaves them, and a client for the routes over them.

Takes results; gives folders and a client; ``make_finished`` makes what most tests look at.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.workbench.jobs.job_record import Job
from gearrattle.workbench.kept_results import PARTIAL, Growing, keep
from gearrattle.workbench.workspace_folder import Folder
from tests.orbits.test_branch import over_frequency
from tests.report import examples

KINDS = {
    "run": "run",
    "simulate": "motion",
    "advise": "advice",
    "modes": "modes",
    "equilibrium": "equilibrium",
    "stiffness": "stiffness",
    "reduce": "reduction",
    "compare": "comparison",
    "study": "study",
    "conditions": "study",
    "bifurcation": "bifurcation",
    "basins": "basins, grid",
    "screen": "screening",
    "periodic": "periodic motion",
    "continuation": "branches",
    "validate": "validation",
    "fit": "fit",
    "threshold": "threshold",
    "remedies": "remedies",
}
"""Task -> an example of what it answers."""
AXES = {"mesh.gear.backlash": ["0.05 mm", "0.1 mm"], "coupling.clutch.stiffness": [1400.0, 1500.0]}


@cache
def model() -> gr.Model:
    return gr.example("case3").with_({"simulation.cycles": 20, "simulation.discard": 5})


def make_finished(root: Path) -> None:
    """Write a job of every task, two runs, a study with a hole, and periodic motions, all and half of them."""
    for task, case in KINDS.items():
        make_job(root, task, examples.result(case), examples.model(), task=task)
    make_job(root, "first", gr.run(model()), model(), name="wide")
    narrow = model().with_({"mesh.gear.backlash": "0.05 mm"})
    make_job(root, "second", gr.run(narrow), narrow, name="narrow", parent="first")
    holes = _without_last(gr.study(model(), AXES, workers=1))
    make_job(root, "holes", holes, model(), task="study", options={"axes": AXES})
    rows = "\n".join(f"{k * 1e-3:.12g},{np.sin(k):g}" for k in range(2000))
    Folder(root).write("rig.csv", f"time [s],speed [rad/s]\n{rows}\n".encode())
    branch = over_frequency()
    make_job(root, "branches", branch, branch.model, task="continuation")
    half = gr.continuation(branch.model, "excitation.frequency", (0.4, 0.5))
    progress = {"fraction": 0.5, "text": "computing"}
    Job("continuation", "half done", id="half", state="running", progress=progress).write(Folder(root).jobs)
    Growing(Folder(root).job("half") / PARTIAL)(half)


def _without_last(data: xr.Dataset) -> xr.Dataset:
    """Return a study whose last case has no values."""
    holes = data.copy(deep=True)
    last = dict.fromkeys(AXES, 1)
    for name, values in data.items():
        if set(AXES) <= set(map(str, values.dims)) and values.dtype.kind in "fi":
            holes[name][last] = np.nan if values.dtype.kind == "f" else -1
    return holes


def make_job(root: Path, key: str, result: Any, model: gr.Model, **record: Any) -> Path:
    """Write a job that is done; ``record`` holds what is other than usual."""
    times = {"started": "2026-01-01T10:00:00+00:00", "ended": "2026-01-01T10:00:02+00:00"}
    job = Job(**{"task": "run", "name": key, "id": key, "state": "done", **times, **record})
    job.write(Folder(root).jobs)
    folder = Folder(root).job(key)
    (folder / "model.toml").write_text(model.to_toml(), encoding="utf-8")
    keep(result, folder)
    return folder


def client(root: Path) -> Any:
    """Return a client that has the token; nothing is computed."""
    pytest.importorskip("starlette")
    pytest.importorskip("uvicorn")
    from starlette.testclient import TestClient

    from gearrattle.workbench.access import Access
    from gearrattle.workbench.application import Limits, application

    token, port = "the token of the start address", 8765
    app = Access(application(Folder(root), Limits(1, 8e9)), "127.0.0.1", token)
    return TestClient(app, base_url=f"http://127.0.0.1:{port}", headers={"authorization": f"Bearer {token}"})
