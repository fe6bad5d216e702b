"""The application: the table of routes, what they share, and the static files.

Takes the workspace folder and the secrets; gives an ASGI application behind its checks.
"""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Mount, Route
from starlette.staticfiles import StaticFiles

from gearrattle.errors import Problem
from gearrattle.workbench.access import Access
from gearrattle.workbench.folder import Folder
from gearrattle.workbench.jobs.newest import Newest
from gearrattle.workbench.jobs.queue import Jobs
from gearrattle.workbench.routes import files, jobs, model, results
from gearrattle.workbench.routes.answers import problems

STATIC = Path(__file__).parent / "static"
ROUTES: list[BaseRoute] = [*files.ROUTES, *jobs.ROUTES, *model.ROUTES, *results.ROUTES]
"""The HTTP interface."""


@dataclass(frozen=True)
class Limits:
    """What jobs may take.

    Attributes
    ----------
    processes
        jobs that run at a time.
    memory
        bytes that one may hold.
    """

    processes: int
    memory: float


def application(folder: Folder, limits: Limits, *, host: str, token: str, password: str = "") -> Access:
    """Return the application of a workspace folder.

    Parameters
    ----------
    folder
        the workspace folder.
    limits
        of jobs.
    host
        that the server listens on.
    token, password
        what opens it; an empty password opens nothing.
    """

    @contextlib.asynccontextmanager
    async def living(app: Starlette) -> AsyncIterator[None]:
        app.state.jobs = Jobs(folder, limits.processes, limits.memory)
        app.state.newest = Newest(folder.root, limits.memory)
        try:
            yield
        finally:
            app.state.newest.close()
            app.state.jobs.close()

    routes = [Route("/", _page), *ROUTES, Mount("/static", StaticFiles(directory=STATIC))]
    app = Starlette(routes=routes, lifespan=living, exception_handlers={HTTPException: _refusal})
    app.state.folder = folder
    return Access(app, host, token, password)


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
