"""The application: the page, the static files, and the HTTP interface with the processes that compute.

Importing the modules of the interface takes seconds. The page does not need them: they are imported in a thread after
the page has been sent or a second has passed, and requests of the page wait for them.

``state`` of the application holds:

    folder      the workspace
    asked       event: the page has sent a request to the interface
    ending      event: the server ends
    begun       task that imports the first modules and starts the processes that compute
    jobs        queue of jobs            }
    newest      answers to a slider      } exist after this task, unless the server ended before
    reserve     a warm process           }
    importing   thread that imports the other modules

An application without ``begun`` (its lifespan was not entered) serves existing files and results, but computes nothing.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections.abc import AsyncIterator
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from threading import Event, Thread

import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import State
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Mount, Route, Router
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp

from gearrattle.errors import Problem
from gearrattle.workbench.access import Receive, Scope, Send
from gearrattle.workbench.jobs.latest_answers import Newest
from gearrattle.workbench.jobs.worker import Reserve
from gearrattle.workbench.routes import widget_routes
from gearrattle.workbench.routes.json_answers import problems
from gearrattle.workbench.workspace_folder import Folder

STATIC = Path(__file__).parent / "static"
_STAGES = ("model_routes", "file_routes"), ("job_routes",), ("result_routes",)
"""Modules of ``routes`` in the order of their import: for the editor, for jobs, for results."""
_UNOPENED = 1.0  # s, after which the import begins even if the page has not been opened


@dataclass(frozen=True)
class Limits:
    """Number of jobs that run at the same time, and memory limit of a job [bytes]."""

    processes: int
    memory: float


def application(folder: Folder, limits: Limits) -> Starlette:
    """Return the application of a workspace folder, with limits for its jobs; ``Access`` stands before it."""

    @contextlib.asynccontextmanager
    async def living(app: Starlette) -> AsyncIterator[None]:
        app.state.asked = asyncio.Event()
        app.state.ending = Event()
        app.state.begun = asyncio.create_task(_after_the_page(app.state, limits))
        try:
            yield
        finally:
            await _end_answers(app.state)
            if hasattr(app.state, "jobs"):
                await asyncio.to_thread(_end, app.state)

    static = Mount("/static", StaticFiles(directory=STATIC))
    routes = [Route("/", _page), static, *widget_routes.ROUTES, Mount("/", _interface)]
    app = Starlette(routes=routes, lifespan=living, exception_handlers={HTTPException: _refusal, Exception: _refusal})
    app.state.folder = folder
    return app


class Server(uvicorn.Server):
    """A server that ends unfinished answers before it waits for them at its end.

    An answer that it cancels is no error, and is not logged as one.
    """

    def __init__(self, config: uvicorn.Config, state: State) -> None:
        super().__init__(config)
        self._state = state
        logging.getLogger("uvicorn.error").addFilter(_is_fault)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End it."""
        await _end_answers(self._state)
        await super().shutdown(sockets)


def _is_fault(record: logging.LogRecord) -> bool:
    """Whether a record of uvicorn's log says more than that the end of the server cancelled an answer."""
    error = record.exc_info and record.exc_info[1]
    return not isinstance(error, asyncio.CancelledError) and not str(record.msg).startswith("Cancel %s running task")


def all_routes() -> list[BaseRoute]:
    """Return the HTTP interface; its modules are imported now."""
    return [*widget_routes.ROUTES, *(route for stage in range(len(_STAGES)) for route in _router(stage).routes)]


@cache
def _router(stage: int) -> Router:
    """Return a router that passes requests to the modules of a stage, and other requests to later stages."""
    modules = [import_module(f"gearrattle.workbench.routes.{name}") for name in _STAGES[stage]]
    is_last = stage + 1 == len(_STAGES)
    return Router(
        [route for module in modules for route in module.ROUTES], default=None if is_last else _later(stage + 1)
    )


def _later(stage: int) -> ASGIApp:
    """Return what passes a request on to a stage as soon as that is imported, and computes."""

    async def pass_on(scope: Scope, receive: Receive, send: Send) -> None:
        state = scope["app"].state
        if hasattr(state, "begun"):  # not where nothing is computed
            await asyncio.shield(state.begun)
        await (await run_in_threadpool(_router, stage))(scope, receive, send)

    return pass_on


async def _after_the_page(state: State, limits: Limits) -> None:
    """Begin once the page, which is there then, asks for something, or has not been opened within a second."""
    with contextlib.suppress(TimeoutError):
        await asyncio.wait_for(state.asked.wait(), _UNOPENED)
    if not state.ending.is_set():
        await asyncio.to_thread(_begin, state, limits)


def _begin(state: State, limits: Limits) -> None:
    """Import the interface and begin to compute."""
    _router(0)
    if state.ending.is_set():
        return
    state.reserve = Reserve()
    queue = import_module("gearrattle.workbench.jobs.queue")
    state.jobs = queue.Jobs(state.folder, limits.processes, limits.memory, state.reserve)
    state.newest = Newest(state.folder, limits.memory, state.reserve)
    state.importing = Thread(target=_import_rest, args=(state.ending,), daemon=True)
    state.importing.start()


def _import_rest(ending: Event) -> None:
    """Import the rest of the interface, and what it imports itself when the first result is read."""
    for stage in range(len(_STAGES)):
        if not ending.is_set():
            _router(stage)
    if not ending.is_set():
        import_module("h5netcdf")


async def _end_answers(state: State) -> None:
    """End the computations for which answers wait; computations that have not begun do not begin."""
    state.ending.set()
    state.asked.set()
    await state.begun
    if hasattr(state, "newest"):
        await asyncio.to_thread(state.newest.close)


def _end(state: State) -> None:
    """End the processes that compute, and wait for the current import, because Python cannot end during an import."""
    state.jobs.close()
    state.reserve.close()
    state.importing.join()


async def _interface(scope: Scope, receive: Receive, send: Send) -> None:
    """Pass a request on to the interface: what the editor asks for does not wait until jobs can be computed."""
    state = scope["app"].state
    if hasattr(state, "asked"):  # not where nothing is computed
        state.asked.set()
    await (await run_in_threadpool(_router, 0))(scope, receive, send)


async def _refusal(request: Request, error: Exception) -> Response:
    """Answer what no endpoint answered: no such path, no such method, a body without end."""
    status = error.status_code if isinstance(error, HTTPException) else 500
    rule = error.detail if isinstance(error, HTTPException) else "internal error"
    answer = problems(status, [Problem("request", f"{request.method} {request.url.path}"[:200], rule)])
    answer.headers.update((isinstance(error, HTTPException) and error.headers) or {})
    return answer


async def _page(request: Request) -> FileResponse:
    del request
    return FileResponse(STATIC / "page.html")
