"""Answers of all endpoints in JSON, errors as problems."""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable, Iterable
from functools import wraps
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response

from gearrattle.errors import GearRattleError, ModelError, Problem, shown_problems
from gearrattle.files import Refused
from gearrattle.json_types import json_value, parsed_json
from gearrattle.workbench.job_files import problem_of
from gearrattle.workbench.jobs.latest_answers import SupersededError
from gearrattle.workbench.workspace_folder import NotThereError
from gearrattle.writing import disk_is_full

Endpoint = Callable[[Request], Awaitable[Response]]
_LARGEST_JSON = 4_000_000  # bytes: a model file and options have at most 1 MB each, and JSON escapes some of it


def compact_json(content: Any) -> str:
    """Return JSON in ASCII, whatever is said: what is not finite becomes null, half of a surrogate pair is escaped."""
    try:
        return json.dumps(content, allow_nan=False, separators=(",", ":"))
    except ValueError:
        return json.dumps(json_value(content), separators=(",", ":"))


class JsonAnswer(JSONResponse):
    """An answer in JSON."""

    def render(self, content: Any) -> bytes:
        """Return its body."""
        return compact_json(content).encode()


def problems(status: int, those: Iterable[Problem]) -> JsonAnswer:
    """Return problems as an answer."""
    return JsonAnswer({"problems": [problem.to_dict() for problem in shown_problems(those)]}, status_code=status)


def answering(work: Callable[..., Any], body: Callable[[bytes], Any] | None = None) -> Endpoint:
    """Return the endpoint of a function of the request and, with ``body``, of what that makes of its body.

    Both run in a thread, for they may read files, or a large body; what the function returns is sent as JSON, unless it
    is an answer. A tuple is status and content.
    """

    @wraps(work)
    async def answer(request: Request) -> Response:
        try:
            if body is None:
                content = await run_in_threadpool(work, request)
            else:
                sent = await request.body()
                content = await run_in_threadpool(lambda: work(request, body(sent)))
        except ClientDisconnect:  # the client has closed the connection
            return Response(status_code=400)
        except (GearRattleError, OSError) as error:
            return _refusal(error)
        if isinstance(content, Response):
            return content
        status, content = content if isinstance(content, tuple) else (200, content)
        return JsonAnswer(content, status_code=status)

    return answer


def _refusal(error: GearRattleError | OSError) -> JsonAnswer:
    """Return an error as an answer."""
    if isinstance(error, ModelError):
        return problems(404 if isinstance(error, NotThereError) else 400, error.problems)
    if isinstance(error, Refused):
        return problems(400, [Problem("file", "", error.rule, error.remedy)])
    if isinstance(error, OSError):
        status = 507 if disk_is_full(error) else 404 if isinstance(error, FileNotFoundError) else 500
        return problems(status, [problem_of(error)])
    if isinstance(error, SupersededError):
        return problems(409, [Problem("request", "", str(error))])
    return problems(500, [Problem("computation", "", str(error), getattr(error, "remedy", "") or "try again")])


def json_object(content: bytes) -> dict[str, Any]:
    """Return the JSON object in a body; ModelError if it is no JSON object, or too large."""
    if len(content) > _LARGEST_JSON:
        raise ModelError(Problem("body", f"{len(content) / 1e6:.0f} MB", f"has at most {_LARGEST_JSON / 1e6:.0f} MB"))
    try:
        value = parsed_json(content)
    except ValueError as error:
        raise ModelError(Problem("body", "", f"must be JSON: {error}"[:200])) from None
    if not isinstance(value, dict):
        raise ModelError(Problem("body", type(value).__name__, "must be a JSON object"))
    return value


def text_of(body: dict[str, Any], name: str, default: str | None = None) -> str:
    """Return a text of a body; ModelError if it is missing, or no text."""
    value = body.get(name, default)
    if not isinstance(value, str):
        raise ModelError(Problem(name, type(value).__name__, "must be a text"))
    return value


def object_of(body: dict[str, Any], name: str) -> dict[str, Any]:
    """Return an object of a body, empty where it is missing; ModelError if it is no object."""
    value = body.get(name) or {}
    if not isinstance(value, dict):
        raise ModelError(Problem(name, type(value).__name__, "must be an object"))
    return value
