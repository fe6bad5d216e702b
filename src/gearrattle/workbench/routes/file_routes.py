"""Files of the workspace folder, and the examples that come with the package."""

from __future__ import annotations

import tomllib
from threading import Lock
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from gearrattle.errors import ModelError, Problem
from gearrattle.model.examples import example_files
from gearrattle.model.model_file import load, text_of
from gearrattle.model.schema_line import without_schema_line
from gearrattle.workbench.job_inputs import model_of
from gearrattle.workbench.routes.json_answers import JsonAnswer, answering, problems
from gearrattle.workbench.workspace_folder import Folder, NotThereError

_WRITING = Lock()
"""Held while a file is compared and written, so that of two writers one is refused."""


def _folder(request: Request) -> Folder:
    folder: Folder = request.app.state.folder
    return folder


def _list(request: Request) -> list[dict[str, Any]]:
    return _folder(request).files()


def _get(request: Request) -> Response:
    name = request.path_params["path"]
    content = _folder(request).read(name)
    kind = "application/toml; charset=utf-8" if name.endswith(".toml") else "application/octet-stream"
    return Response(content, media_type=kind, headers={"etag": _folder(request).tag(name)})


def _put(request: Request, content: bytes) -> Response:
    name = request.path_params["path"]
    folder = _folder(request)
    with _WRITING:
        refusal = _precondition(request, folder.tag(name))
        if refusal:
            return problems(412, [Problem("file", name, refusal, "open it again, or save under another name")])
        folder.write(name, content)
        return JsonAnswer({"path": name}, headers={"etag": folder.tag(name)})


def _precondition(request: Request, tag: str) -> str:
    """Why a file is not what the writer takes it for, by the tag that it has now; empty if it is."""
    expected = request.headers.get("if-match")
    if expected is not None and expected != tag:
        return "was changed by another program since it was read" if tag else "was removed since it was read"
    return "exists already" if tag and request.headers.get("if-none-match") == "*" else ""


def _examples(request: Request) -> list[dict[str, str]]:
    del request
    texts = {name: path.read_text(encoding="utf-8") for name, path in example_files().items()}
    return [{"name": name, "title": str(tomllib.loads(text).get("name", ""))} for name, text in texts.items()]


def _example(request: Request) -> dict[str, str]:
    """Send the file with its comments; one that names other files is written out, for they are not in the folder."""
    name = request.path_params["name"]
    path = example_files().get(name)
    if path is None:
        raise NotThereError(Problem("example", name[:120], "there is no such example", "look at the list of examples"))
    text = path.read_text(encoding="utf-8")
    try:
        model_of(text, _folder(request))
    except ModelError:
        text = text_of(load(path))
    return {"text": without_schema_line(text)}


ROUTES: list[BaseRoute] = [
    Route("/api/files", answering(_list), methods=["GET"]),
    Route("/api/files/{path:path}", answering(_get), methods=["GET"]),
    Route("/api/files/{path:path}", answering(_put, bytes), methods=["PUT"]),
    Route("/api/examples", answering(_examples), methods=["GET"]),
    Route("/api/examples/{name:path}", answering(_example), methods=["GET"]),
]
