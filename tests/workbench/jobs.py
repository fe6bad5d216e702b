"""Jobs in a folder as the queue leaves them, and a client for the routes over them.

Takes results; gives folders and a client.
"""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import gearrattle as gr
from gearrattle.workbench.kept import keep


def make_job(root: Path, key: str, result: Any, model: gr.Model, **record: Any) -> Path:
    folder = root / ".gearrattle" / "jobs" / key
    folder.mkdir(parents=True)
    (folder / "model.toml").write_text(model.to_toml(), encoding="utf-8")
    (folder / "job.json").write_text(json.dumps({"id": key, "task": "run", "name": key, "options": {}, **record}))
    keep(result, folder)
    return folder


def client(root: Path) -> Any:
    pytest.importorskip("starlette")
    from starlette.applications import Starlette
    from starlette.testclient import TestClient

    from gearrattle.workbench.routes.results import ROUTES

    application = Starlette(routes=ROUTES)
    application.state.folder = SimpleNamespace(root=root)
    return TestClient(application)
