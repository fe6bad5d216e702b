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
from gearrattle.files import Refused
from gearrattle.workbench.folder import NotThereError
from gearrattle.workbench.jobs.newest import SupersededError

Endpoint = Callable[[Request], Awaitable[Response]]


def problems(status: int, those: Iterable[Problem]) -> JSONResponse:
    """Return problems as an answer."""
    return JSONResponse({"problems": [problem.to_dict() for problem in those]}, status_code=status)


def answering(work: Callable[..., Any], body: Callable[[bytes], Any] | None = None) -> Endpoint:
    """Return the endpoint of a function of the request and, with ``body``, of what that makes of its body.

    The function runs in a thread, for it may read files; what it returns is sent as JSON, unless it is an answer. A
    tuple is status and content.
    """

    @wraps(work)
    async def answer(request: Request) -> Response:
        try:
            arguments = (request,) if body is None else (request, body(await request.body()))
            content = await run_in_threadpool(work, *arguments)
        except (GearRattleError, Refused) as error:
            return _refusal(error)
        if isinstance(content, Response):
            return content
        status, content = content if isinstance(content, tuple) else (200, content)
        return JSONResponse(content, status_code=status)

    return answer


def _refusal(error: GearRattleError | Refused) -> JSONResponse:
    """Return an error as an answer."""
    if isinstance(error, ModelError):
        return problems(404 if isinstance(error, NotThereError) else 400, error.problems)
    if isinstance(error, Refused):
        return problems(400, [Problem("file", "", error.rule, error.remedy)])
    if isinstance(error, SupersededError):
        return problems(409, [Problem("request", "", str(error))])
    return problems(500, [Problem("computation", "", str(error), getattr(error, "remedy", "") or "try again")])


def json_object(content: bytes) -> dict[str, Any]:
    """Return the JSON object in a body.

    Raises
    ------
    ModelError
        it is none.
    """
    try:
        value = json.loads(content)
    except (ValueError, RecursionError):
        raise ModelError(Problem("body", "", "must be JSON")) from None
    if not isinstance(value, dict):
        raise ModelError(Problem("body", type(value).__name__, "must be a JSON object"))
    return value


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
