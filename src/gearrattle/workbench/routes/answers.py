"""What all endpoints share: answers in JSON, and errors as problems in JSON."""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable, Iterable
from functools import wraps
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from gearrattle.errors import GearRattleError, ModelError, Problem
from gearrattle.workbench.folder import NotThereError
from gearrattle.workbench.jobs.newest import SupersededError
from gearrattle.workbench.jobs.worker import FailedError
from gearrattle.workbench.problems import written

Endpoint = Callable[[Request], Awaitable[Response]]


def problems(status: int, those: Iterable[Problem]) -> JSONResponse:
    """Return problems as an answer."""
    return JSONResponse({"problems": written(those)}, status_code=status)


def answering(work: Callable[..., Any], *, has_body: bool = False) -> Endpoint:
    """Return the endpoint of a function of the request and, with ``has_body``, of the object in its body.

    The function runs in a thread, for it may read files; what it returns is sent as JSON, unless it is an answer. A
    tuple is status and content.
    """

    @wraps(work)
    async def answer(request: Request) -> Response:
        try:
            arguments = (request, await _body(request)) if has_body else (request,)
            content = await run_in_threadpool(work, *arguments)
        except (GearRattleError, KeyError, FileNotFoundError) as error:
            return _refusal(error)
        if isinstance(content, Response):
            return content
        status, content = content if isinstance(content, tuple) else (200, content)
        return JSONResponse(content, status_code=status)

    return answer


def _refusal(error: Exception) -> JSONResponse:
    """Return an error as an answer."""
    if isinstance(error, NotThereError):
        return problems(404, error.problems)
    if isinstance(error, ModelError | FailedError):
        return problems(400, error.problems)
    if isinstance(error, SupersededError):
        return problems(409, [Problem("request", "", str(error))])
    if isinstance(error, GearRattleError):
        return problems(500, [Problem("computation", "", str(error), "try again")])
    return problems(404, [Problem("request", str(error.args[0])[:120], "there is nothing of this name")])


async def _body(request: Request) -> dict[str, Any]:
    """Return the JSON object in a body.

    Raises
    ------
    ModelError
        it is none.
    """
    try:
        content = json.loads(await request.body())
    except (ValueError, RecursionError):
        raise ModelError(Problem("body", "", "must be JSON")) from None
    if not isinstance(content, dict):
        raise ModelError(Problem("body", type(content).__name__, "must be a JSON object"))
    return content


def text_of(body: dict[str, Any], name: str, default: str | None = None) -> str:
    """Return a text of a body.

    Raises
    ------
    ModelError
        it is missing, or no text.
    """
    value = body.get(name, default)
    if not isinstance(value, str):
        raise ModelError(Problem(name, type(value).__name__, "must be a text"))
    return value


def object_of(body: dict[str, Any], name: str) -> dict[str, Any]:
    """Return an object of a body; empty where it is missing.

    Raises
    ------
    ModelError
        it is none.
    """
    value = body.get(name) or {}
    if not isinstance(value, dict):
        raise ModelError(Problem(name, type(value).__name__, "must be an object"))
    return value
