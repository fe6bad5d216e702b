"""The HTTP interface to models: check a text, edit it, and what forms and palettes are made of.

Takes requests; gives JSON.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from gearrattle.errors import GearRattleError, ModelError, Problem
from gearrattle.model import json_schema
from gearrattle.model.file import LARGEST
from gearrattle.workbench.checking import NAME, checked, plain, problems_of
from gearrattle.workbench.editing import edited
from gearrattle.workbench.folder import Folder
from gearrattle.workbench.shelf import shelf

Answer = Callable[[Mapping[str, Any], Folder], dict[str, Any]]


def _check(asked: Mapping[str, Any], folder: Folder) -> dict[str, Any]:
    """Check a text."""
    return _checked(_text(asked), asked, folder)


def _edit(asked: Mapping[str, Any], folder: Folder) -> dict[str, Any]:
    """Edit a text, and check it."""
    made = edited(_text(asked), asked.get("edits", ()))
    answer = _checked(made.text, asked, folder)
    return {"text": made.text, **answer, "notes": [*made.notes, *answer["notes"]]}


def _checked(text: str, asked: Mapping[str, Any], folder: Folder) -> dict[str, Any]:
    name = asked.get("name", NAME)
    answer = checked(text, folder, name if isinstance(name, str) and name else NAME)
    return {**answer, "tables": plain(answer["tables"])}


def _text(asked: Mapping[str, Any]) -> str:
    text = asked.get("text")
    if not isinstance(text, str):
        raise ModelError(Problem("text", "", "must be the content of a model file"))
    return text


def _answering(answer: Answer) -> Callable[[Request], Any]:
    """Make the endpoint of a function: JSON in, JSON out, problems with the status 400."""

    async def endpoint(request: Request) -> Response:
        try:
            asked = await _body(request)
            return JSONResponse(await run_in_threadpool(answer, asked, request.app.state.folder))
        except GearRattleError as error:
            return JSONResponse({"problems": problems_of(error)}, status_code=400)

    return endpoint


async def _body(request: Request) -> Mapping[str, Any]:
    """Read a JSON object; a model file has at most 1 MB, and edits are of its size."""
    content = bytearray()
    async for chunk in request.stream():
        content += chunk
        if len(content) > 4 * LARGEST:
            raise ModelError(Problem("request", "more than 4 MB", "a model file has at most 1 MB"))
    try:
        asked = json.loads(content)
    except ValueError:
        asked = None
    if not isinstance(asked, dict):
        raise ModelError(Problem("request", "", "must be a JSON object"))
    return asked


async def _schema(_request: Request) -> Response:
    """Return the JSON Schema of a model file."""
    return JSONResponse(json_schema())


async def _components(_request: Request) -> Response:
    """Return what can be added to a driveline."""
    return JSONResponse(shelf())


ROUTES: list[Route] = [
    Route("/api/check", _answering(_check), methods=["POST"]),
    Route("/api/edit", _answering(_edit), methods=["POST"]),
    Route("/api/schema", _schema),
    Route("/api/components", _components),
]
