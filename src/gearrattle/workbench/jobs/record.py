"""A job as the page sees it and as its folder keeps it.

Takes what is asked for; gives ``job.json``, whole or not at all.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal
from uuid import uuid4

from gearrattle.writing import put

State = Literal["waiting", "running", "done", "failed", "cancelled", "broken"]
NAME = "job.json"
ENDED: tuple[State, ...] = ("done", "failed", "cancelled", "broken")


def now() -> str:
    """Return the time in UTC."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


@dataclass
class Job:
    """One computation.

    Attributes
    ----------
    id
        name of its folder.
    task
        what is computed, a row of ``tasks.TASKS``.
    name
        for people.
    parent
        the job it came from; None: none.
    state
        how far it is. A job is "broken" if the server ended before it.
    options
        arguments of the task.
    progress
        finished share 0 ... 1, and the phase in a word or two.
    created, started, ended
        ISO 8601 in UTC; None: not yet.
    problems
        why it failed: place, value, rule, remedy of each.
    sentence
        what came out.
    file
        name of the model's file in the workspace folder, to which names of data files are relative; empty: none, a file
        in the folder itself.
    data_files
        names of data files among its inputs.
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
        put(jobs / self.id / NAME, json.dumps(self.to_dict(), ensure_ascii=False).encode())


def read_jobs(jobs: Path) -> list[Job]:
    """Return all jobs of a folder, the earliest first; what is no job is left alone."""
    records = [record for path in jobs.glob(f"*/{NAME}") if (record := _read(path)) is not None]
    return sorted(records, key=lambda job: (job.created, job.id))


def _read(path: Path) -> Job | None:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not isinstance(content, Mapping) or not isinstance(content.get("task"), str):
        return None
    known = {name: value for name, value in content.items() if name in Job.__dataclass_fields__}
    return Job(**{**known, "id": path.parent.name})
