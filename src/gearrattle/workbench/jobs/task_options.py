"""Check of a task's options before anything runs: their names and types.

A task is a public function. The allowed options follow from the annotations of its arguments, applied to JSON values.
"""

from __future__ import annotations

import builtins
import inspect
import json
import os
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from functools import cache
from typing import Any, Literal, NamedTuple

from gearrattle.errors import ModelError, Problem
from gearrattle.wording import listed
from gearrattle.workbench.jobs.tasks import TASKS

_LONGEST = 1_000_000  # characters of JSON: the record of a job keeps them, and every list of jobs sends them


def check_options(task: str, options: Mapping[str, Any]) -> None:
    """Check a task and its options.

    Raises
    ------
    ModelError
        no such task, an unknown option, one that is missing, or one of a kind that it cannot be; or they are too long.

    Examples
    --------
    >>> from gearrattle.workbench.jobs.task_options import check_options
    >>> check_options("study", {"axes": {"mesh.gear.backlash": [1e-4, "0.2 mm"]}})
    >>> check_options("study", {"axes": "mesh.gear.backlash"})
    Traceback (most recent call last):
        ...
    gearrattle.errors.ModelError: options.axes: found mesh.gear.backlash; must be an object or null
    """
    # known task, options of bounded length
    if task not in TASKS:
        raise ModelError(Problem("task", task[:40], f"must be one of {', '.join(TASKS)}"))
    if len(json.dumps(options)) > _LONGEST:
        rule = f"are longer than {_LONGEST / 1e6:.0f} MB together"
        raise ModelError(Problem("options", "", rule, "name long tables as files, or ask for fewer values"))
    # names and types of options
    kinds = _kinds(task)
    problems = [
        Problem(f"options.{name}"[:80], "", "is no option of this task", _meant(name, list(kinds)))
        for name in options
        if name not in kinds
    ]
    problems += [
        Problem(f"options.{name}", str(options[name])[:80], f"must be {listed(_words(kind), 'or')}")
        for name, kind in kinds.items()
        if name in options and not _holds(kind, options[name])
    ]
    # options that are missing
    signature = inspect.signature(TASKS[task].callable())
    problems += [
        Problem(f"options.{name}", "", f"is missing; it must be {listed(_words(kind), 'or')}")
        for name, kind in kinds.items()
        if name not in options and signature.parameters[name].default is inspect.Parameter.empty
    ]
    if problems:
        raise ModelError(problems)


class _Names(dict[str, Any]):
    """The names of a module; what it imports for type checkers alone may be anything."""

    def __missing__(self, name: str) -> Any:
        return typing.Any


@cache
def _kinds(task: str) -> Mapping[str, Any]:
    """Return the annotation of each option of a task.

    ``typing.get_type_hints`` would fail on names that are imported for type checkers alone.
    """
    function: Callable[..., Any] = TASKS[task].callable()
    names = _Names({**vars(builtins), **function.__globals__})
    parameters = inspect.signature(function).parameters
    return {name: eval(str(parameters[name].annotation), {}, names) for name in TASKS[task].options()}


def _choices(kind: Any) -> Sequence[Any]:
    """Return the members of a union; of any other annotation it alone."""
    is_union = typing.get_origin(kind) in (typing.Union, types.UnionType)
    return typing.get_args(kind) if is_union else (kind,)


def _outer(kind: Any) -> Any:
    """Return an annotation without what stands in its brackets: of ``Sequence[float]`` the ``Sequence``."""
    return type(None) if kind is None else typing.get_origin(kind) or kind


def _holds(kind: Any, value: Any) -> bool:
    """Whether a value of JSON is of a kind."""
    for choice in _choices(kind):
        known = _KINDS.get(_outer(choice))
        if known is not None and known.holds(value, typing.get_args(choice)):
            return True
    return False


def _words(kind: Any) -> list[str]:
    """Return what a kind is called in a message; a choice that JSON cannot say is left out."""
    known = [_KINDS[_outer(choice)].words for choice in _choices(kind) if _outer(choice) in _KINDS]
    return list(dict.fromkeys(known))


def _is_number(value: Any, _inner: Sequence[Any]) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_text(value: Any, _inner: Sequence[Any]) -> bool:
    return isinstance(value, str)


def _is_object(value: Any, inner: Sequence[Any]) -> bool:
    return isinstance(value, dict) and all(_holds(inner[1], item) for item in value.values())


def _is_list(value: Any, inner: Sequence[Any]) -> bool:
    return isinstance(value, list) and all(_holds(inner[0], item) for item in value)


def _is_group(value: Any, inner: Sequence[Any]) -> bool:
    if not isinstance(value, list) or len(value) != len(inner):
        return False
    return all(_holds(part, item) for part, item in zip(inner, value, strict=True))


class _Kind(NamedTuple):
    """Words of a kind of value, and the test whether a value of JSON is of it."""

    words: str
    holds: Callable[[Any, Sequence[Any]], bool]


_KINDS = {
    typing.Any: _Kind("anything", lambda _value, _inner: True),
    object: _Kind("anything", lambda _value, _inner: True),
    type(None): _Kind("null", lambda value, _inner: value is None),
    bool: _Kind("true or false", lambda value, _inner: isinstance(value, bool)),
    float: _Kind("a number", _is_number),
    int: _Kind("a number", _is_number),
    str: _Kind("a text", _is_text),
    os.PathLike: _Kind("a text", _is_text),
    Literal: _Kind("one of its names", lambda value, inner: value in inner),
    Mapping: _Kind("an object", _is_object),
    Sequence: _Kind("a list", _is_list),
    tuple: _Kind("a list of as many as are needed", _is_group),
}
"""Outermost part of an annotation -> what JSON says in its place."""


def _meant(name: str, known: list[str]) -> str:
    close = get_close_matches(name, known, 1)
    return f'did you mean "{close[0]}"?' if close else f"known: {', '.join(known)}"
