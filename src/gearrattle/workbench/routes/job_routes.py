"""HTTP interface to jobs: start, list, name, cancel, remove, news over a socket, and answers that follow a slider."""

from __future__ import annotations

import asyncio
from typing import Any

from starlette.requests import Request
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from gearrattle.errors import ModelError, Problem
from gearrattle.workbench.jobs.job_record import Job
from gearrattle.workbench.jobs.queue import Jobs
from gearrattle.workbench.jobs.task_options import check_options
from gearrattle.workbench.routes.json_answers import answering, compact_json, json_object, object_of, text_of

_MOST_TOLD = 1000


def _jobs(request: Request) -> Jobs:
    jobs: Jobs = request.app.state.jobs
    return jobs


def _list(request: Request) -> list[dict[str, Any]]:
    return [job.to_dict() for job in _jobs(request).all()]


def _submit(request: Request, body: dict[str, Any]) -> tuple[int, dict[str, Any]]:
    parents = [job for job in _jobs(request).all() if job.id == body.get("parent")]
    file = text_of(body, "file", parents[0].file if parents else "")
    text = text_of(body, "text", "") or request.app.state.folder.read(file).decode("utf-8", "replace")
    parent = parents[0].id if parents else None
    job = Job(text_of(body, "task"), text_of(body, "name", ""), parent, object_of(body, "options"), file=file)
    return 201, _jobs(request).submit(job, text).to_dict()


def _get(request: Request) -> dict[str, Any]:
    return _jobs(request).get(request.path_params["job"]).to_dict()


def _rename(request: Request, body: dict[str, Any]) -> dict[str, Any]:
    return _jobs(request).rename(request.path_params["job"], text_of(body, "name")).to_dict()


def _cancel(request: Request) -> dict[str, Any]:
    return _jobs(request).cancel(request.path_params["job"]).to_dict()


def _delete(request: Request) -> dict[str, Any]:
    _jobs(request).delete(request.path_params["job"])
    return {}


def _live(request: Request, body: dict[str, Any]) -> dict[str, Any]:
    return {"sequence": body.get("sequence"), **_ask(request, "live", body, {"values": object_of(body, "values")})}


def _estimate(request: Request, body: dict[str, Any]) -> dict[str, Any]:
    options = object_of(body, "options")
    task = body.get("task", "study")
    if task not in ("study", "conditions"):
        raise ModelError(Problem("task", str(task)[:40], "must be study or conditions: no other is estimated"))
    check_options(task, options)
    return _ask(request, "estimate", body, {"task": task, "options": options})


def _ask(request: Request, what: str, body: dict[str, Any], question: dict[str, Any]) -> dict[str, Any]:
    """Ask the warm process about the model of a request."""
    answer: dict[str, Any] = request.app.state.newest.ask(
        what, text_of(body, "text"), text_of(body, "file", ""), question
    )
    return answer


async def _events(socket: WebSocket) -> None:
    """Tell of every change of a job, until the page leaves; a page that does not listen loses the oldest."""
    await socket.accept()
    messages: asyncio.Queue[dict[str, Any]] = asyncio.Queue(_MOST_TOLD)
    loop = asyncio.get_running_loop()

    def put(message: dict[str, Any]) -> None:
        if messages.full():
            messages.get_nowait()
        messages.put_nowait(message)

    leave = socket.app.state.jobs.listen(lambda message: loop.call_soon_threadsafe(put, message))

    async def tell() -> None:
        while True:
            await socket.send_text(compact_json(await messages.get()))

    telling = asyncio.create_task(tell())
    try:
        while (await socket.receive())["type"] != "websocket.disconnect":
            pass
    except (WebSocketDisconnect, RuntimeError):
        pass
    finally:
        leave()
        telling.cancel()


ROUTES: list[BaseRoute] = [
    Route("/api/jobs", answering(_list), methods=["GET"]),
    Route("/api/jobs", answering(_submit, json_object), methods=["POST"]),
    Route("/api/jobs/{job}", answering(_get), methods=["GET"]),
    Route("/api/jobs/{job}", answering(_rename, json_object), methods=["PATCH"]),
    Route("/api/jobs/{job}", answering(_delete), methods=["DELETE"]),
    Route("/api/jobs/{job}/cancel", answering(_cancel), methods=["POST"]),
    Route("/api/live", answering(_live, json_object), methods=["POST"]),
    Route("/api/estimate", answering(_estimate, json_object), methods=["POST"]),
    WebSocketRoute("/api/events", _events),
]
