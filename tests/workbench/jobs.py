"""Jobs in a folder as the queue leaves them, and a client for the routes over them.

Takes results; gives folders and a client.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import gearrattle as gr
from gearrattle.workbench.folder import Folder
from gearrattle.workbench.jobs.record import Job
from gearrattle.workbench.kept import keep


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
