"""Record of a job, in its folder and for the page.

The folder may come from another user or another version. A job whose record cannot be read is shown as broken, with the
reason, and does not affect other jobs.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal, get_args
from uuid import uuid4

from gearrattle.errors import ModelError, Problem
from gearrattle.workbench.job_files import stored_object
from gearrattle.workbench.jobs.tasks import TASKS
from gearrattle.workbench.workspace_folder import JOB_NAME, NotThereError, check_job_folder
from gearrattle.writing import put

State = Literal["waiting", "running", "done", "failed", "cancelled", "broken"]
NAME = "job.json"
_LARGEST = 2_000_000  # bytes: options have half of it, and every list of jobs sends all of it
ENDED: tuple[State, ...] = ("done", "failed", "cancelled", "broken")


def now() -> str:
    """Return the time in UTC."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


@dataclass
class Job:
    """One computation: a row of ``tasks.TASKS``, its options and its progress.

    Attributes
    ----------
    state
        progress of the job. A job is "broken" if the server ended before the job.
    created, started, ended
        ISO 8601 in UTC; None: not yet.
    problems
        reasons why it failed: place, value, rule and remedy.
    file
        name of the model's file in the workspace folder, to which names of data files are relative; empty: none, a file
        in the folder itself.
    """

    task: str
    name: str = ""
    parent: str | None = None
    options: dict[str, Any] = field(default_factory=dict)
    id: str = field(default_factory=lambda: uuid4().hex[:12])
    state: State = "waiting"
    progress: dict[str, Any] = field(default_factory=lambda: {"fraction": 0.0, "text": ""})
    created: str = field(default_factory=now)
    started: str | None = None
    ended: str | None = None
    problems: list[dict[str, str]] = field(default_factory=list)
    sentence: str = ""
    file: str = ""
    data_files: list[str] = field(default_factory=list)

    def to_dict(self) -> dict[str, Any]:
        """Return it as JSON types."""
        return asdict(self)

    def write(self, jobs: Path) -> None:
        """Write it into its folder, which is made."""
        (jobs / self.id).mkdir(parents=True, exist_ok=True)
        put(jobs / self.id / NAME, json.dumps(self.to_dict(), allow_nan=False).encode())


def read_jobs(jobs: Path) -> list[Job]:
    """Return all jobs of a folder, the earliest first; a folder without a record is left alone."""
    folders = [path for path in jobs.iterdir() if JOB_NAME.fullmatch(path.name)] if jobs.is_dir() else []
    records = [_readable(path) for path in folders if path.is_symlink() or os.path.lexists(path / NAME)]
    return sorted(records, key=lambda job: (job.created, job.id))


def read_job(folder: Path) -> Job:
    """Return the job of a folder; ModelError if its record is missing, damaged or says what no job has."""
    check_job_folder(folder)
    try:
        content = stored_object(folder / NAME, _LARGEST)
    except FileNotFoundError:
        raise NotThereError(Problem(NAME, folder.name, "is not there", "delete the run")) from None
    known = {name: value for name, value in content.items() if name in Job.__dataclass_fields__}
    if "task" not in known:
        raise _wrong("task", "", "is missing")
    for name, value in known.items():
        rule = _RULES[name]
        if not rule.holds(value):
            raise _wrong(name, str(value), rule.words)
    return Job(**{**known, "id": folder.name})


def _readable(folder: Path) -> Job:
    """Return the job of a folder; one that is broken, with the reason, if its record cannot be read."""
    try:
        return read_job(folder)
    except ModelError as error:
        problems = [problem.to_dict() for problem in error.problems]
        created = datetime.fromtimestamp(os.lstat(folder).st_mtime, UTC).isoformat(timespec="milliseconds")
        return Job("unknown", folder.name, id=folder.name, state="broken", created=created, problems=problems)


def _wrong(name: str, value: str, rule: str) -> ModelError:
    return ModelError(Problem(f"{NAME}: {name}", value[:80], rule, "delete the run, and start it again"))


@dataclass(frozen=True)
class _Rule:
    """The allowed values of a field of a record, as a test and in words."""

    holds: Callable[[Any], bool]
    words: str


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _is_time(value: Any) -> bool:
    try:
        return datetime.fromisoformat(value).tzinfo is not None
    except (TypeError, ValueError):
        return False


def _is_progress(value: Any) -> bool:
    if not isinstance(value, Mapping) or set(value) != {"fraction", "text"}:
        return False
    fraction = value["fraction"]
    return isinstance(fraction, int | float) and 0.0 <= fraction <= 1.0 and _is_text(value["text"])


def _is_list_of_texts(value: Any) -> bool:
    return isinstance(value, list) and all(map(_is_text, value))


def _is_list_of_problems(value: Any) -> bool:
    names = set(Problem("", "", "").to_dict())
    return isinstance(value, list) and all(
        isinstance(problem, Mapping) and set(problem) == names and all(map(_is_text, problem.values()))
        for problem in value
    )


_TEXT = _Rule(_is_text, "must be a text")
_TIME_OR_NONE = _Rule(lambda value: value is None or _is_time(value), "must be a time, ISO 8601 in UTC, or null")
_RULES = {
    "task": _Rule(lambda value: _is_text(value) and value in TASKS, f"must be one of {', '.join(TASKS)}"),
    "name": _TEXT,
    "parent": _Rule(lambda value: value is None or _is_text(value), "must be a text or null"),
    "options": _Rule(lambda value: isinstance(value, Mapping), "must be an object"),
    "id": _TEXT,
    "state": _Rule(lambda value: value in get_args(State), f"must be one of {', '.join(get_args(State))}"),
    "progress": _Rule(_is_progress, "must hold fraction, 0 ... 1, and text"),
    "created": _Rule(_is_time, "must be a time, ISO 8601 in UTC"),
    "started": _TIME_OR_NONE,
    "ended": _TIME_OR_NONE,
    "problems": _Rule(_is_list_of_problems, "must be a list of place, value, rule and remedy"),
    "sentence": _TEXT,
    "file": _TEXT,
    "data_files": _Rule(_is_list_of_texts, "must be a list of texts"),
}
"""Field of a record -> what it may hold."""
