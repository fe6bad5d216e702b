"""HTTP interface to models: check, edit, and the contents of forms and palettes."""

from __future__ import annotations

from typing import Any

from starlette.requests import Request
from starlette.routing import BaseRoute, Route

from gearrattle.workbench.checking import checked, plain
from gearrattle.workbench.editing import edited
from gearrattle.workbench.first_values import SCHEMA
from gearrattle.workbench.routes.json_answers import answering, json_object, text_of
from gearrattle.workbench.table_templates import shelf


def _check(request: Request, body: dict[str, Any]) -> dict[str, Any]:
    """Check a text."""
    return _checked(request, text_of(body, "text"), body)


def _edit(request: Request, body: dict[str, Any]) -> dict[str, Any]:
    """Edit a text, and check it; ``gone`` says what an edit took away besides what it names."""
    made = edited(text_of(body, "text"), body.get("edits", ()))
    answer = _checked(request, made.text, body)
    return {"text": made.text, **answer, "gone": list(made.notes)}


def _checked(request: Request, text: str, body: dict[str, Any]) -> dict[str, Any]:
    answer = checked(text, request.app.state.folder, text_of(body, "file", ""))
    return {**answer, "tables": plain(answer["tables"])}


def _schema(_request: Request) -> dict[str, Any]:
    """Return the JSON Schema of a model file."""
    return SCHEMA


def _components(_request: Request) -> list[dict[str, Any]]:
    """Return what can be added to a driveline."""
    return shelf()


ROUTES: list[BaseRoute] = [
    Route("/api/check", answering(_check, json_object), methods=["POST"]),
    Route("/api/edit", answering(_edit, json_object), methods=["POST"]),
    Route("/api/schema", answering(_schema), methods=["GET"]),
    Route("/api/components", answering(_components), methods=["GET"]),
]
