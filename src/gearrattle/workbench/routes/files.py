"""Files of the workspace folder, and the examples that come with the package.

Takes requests for ``/api/files`` and ``/api/examples``; gives listings and contents.
"""

from __future__ import annotations

from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import BaseRoute, Route

from gearrattle.errors import ModelError, Problem
from gearrattle.model.examples import example_files
from gearrattle.model.file import load, loads, text_of
from gearrattle.workbench.folder import Folder
from gearrattle.workbench.routes.answers import answering, problems


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


async def _put(request: Request) -> Response:
    name, expected = request.path_params["path"], request.headers.get("if-match")
    folder = _folder(request)
    try:
        folder.path(name)
        content = await request.body()
        if expected is not None and expected != await run_in_threadpool(folder.tag, name):
            rule = "was changed by another program since it was read"
            return problems(412, [Problem("file", name, rule, "open it again, or save it under another name")])
        await run_in_threadpool(folder.write, name, content)
        return JSONResponse({"path": name, "tag": await run_in_threadpool(folder.tag, name)})
    except ModelError as error:
        return problems(400, error.problems)
    except OSError as error:
        return problems(400, [Problem("file", name, (error.strerror or "cannot be written").lower())])


def _examples(request: Request) -> list[dict[str, str]]:
    del request
    return [{"name": name, "title": load(path).name} for name, path in example_files().items()]


def _example(request: Request) -> dict[str, str]:
    """Send the file with its comments; one that names other files is written out, for they are not in the folder."""
    path = example_files()[request.path_params["name"]]
    text = path.read_text(encoding="utf-8")
    try:
        loads(text, str(_folder(request).root / "model.toml"))
    except ModelError:
        text = text_of(load(path))
    return {"text": text}


ROUTES: list[BaseRoute] = [
    Route("/api/files", answering(_list), methods=["GET"]),
    Route("/api/files/{path:path}", answering(_get), methods=["GET"]),
    Route("/api/files/{path:path}", _put, methods=["PUT"]),
    Route("/api/examples", answering(_examples), methods=["GET"]),
    Route("/api/examples/{name:path}", answering(_example), methods=["GET"]),
]
