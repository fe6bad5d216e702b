"""Widgets and their parts, each a module, and their style sheet."""

from __future__ import annotations

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from gearrattle.errors import Problem
from gearrattle.report.browser import widgets
from gearrattle.workbench.routes.json_answers import answering
from gearrattle.workbench.workspace_folder import NotThereError


def _widget(request: Request) -> Response:
    name = str(request.path_params["name"])
    if name not in widgets.names():
        raise NotThereError(Problem("widget", name[:60], "there is no such widget", ""))
    return Response(widgets.module(name), media_type="text/javascript; charset=utf-8")


def _style(request: Request) -> Response:
    del request
    return Response(widgets.style(), media_type="text/css; charset=utf-8")


ROUTES: list[BaseRoute] = [
    Route("/widgets/widgets.css", answering(_style), methods=["GET"]),
    Route("/widgets/{name}.js", answering(_widget), methods=["GET"]),
]
