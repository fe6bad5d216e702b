"""Queue of jobs: waiting and running ones, and notice of every change."""

from __future__ import annotations

import os
import shutil
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from gearrattle.errors import ModelError, Problem, shown_problems
from gearrattle.model import Model
from gearrattle.workbench.job_files import problem_of, stored_text
from gearrattle.workbench.job_inputs import INPUTS, NAME, copy_inputs, files_of, model_of
from gearrattle.workbench.jobs.job_record import ENDED, Job, State, now, read_job, read_jobs
from gearrattle.workbench.jobs.task_options import check_options
from gearrattle.workbench.jobs.tasks import TASKS
from gearrattle.workbench.jobs.worker import EndedError, FailedError, Reserve, WarmProcess
from gearrattle.workbench.value_groups import change_words
from gearrattle.workbench.workspace_folder import Folder, NotThereError
from gearrattle.writing import put

Listener = Callable[[dict[str, Any]], None]
MOST_WAITING = 200
STOPPING = "stopping; what is known is kept"
_LONGEST_NAME = 120


class Jobs:
    """All jobs of a workspace folder and their processes: so many at a time, each with a limit of memory [bytes]."""

    def __init__(self, folder: Folder, processes: int, memory: float, reserve: Reserve) -> None:
        folder.sweep()
        self._folder = folder
        self._reserve = reserve
        self._jobs = {job.id: job for job in read_jobs(folder.jobs)}
        self._changed = threading.Condition()
        self._listeners: list[Listener] = []
        self._running: dict[str, WarmProcess] = {}
        self._cancelled: set[str] = set()
        self._unwritten: dict[str, Job] = {}
        self._is_open = True
        for job in self._jobs.values():
            if job.state not in ENDED:
                self._end(job, "broken", [Problem("job", job.id, "the server ended before it", "start it again")])
        self._threads = [threading.Thread(target=self._serve, args=(memory,), daemon=True) for _ in range(processes)]
        for thread in self._threads:
            thread.start()

    def all(self) -> list[Job]:
        """Return all jobs, the earliest first."""
        with self._changed:
            return list(self._jobs.values())

    def get(self, job: str) -> Job:
        """Return a job; NotThereError if there is none of this id."""
        with self._changed:
            if job not in self._jobs:
                raise NotThereError(Problem("job", job[:64], "there is no such job", "look at the list of runs"))
            return self._jobs[job]

    def submit(self, job: Job, text: str) -> Job:
        """Check and copy model, options and data files of a new job and put it into the queue; without a name it has
        that of the model, or says what its model has that its parent's has not. ModelError for the model, the task
        or its options, OSError if the disk is full.
        """
        check_options(job.task, job.options)
        model = model_of(text, self._folder, job.file)
        job.name = (job.name.strip() or self._change(job, model) or model.name or job.task)[:_LONGEST_NAME]
        with self._changed:
            if sum(other.state == "waiting" for other in self._jobs.values()) >= MOST_WAITING:
                raise ModelError(Problem("job", "", f"{MOST_WAITING} jobs wait already", "cancel some, or wait"))
        target = self.path(job.id)
        try:
            others = files_of(job.options, TASKS[job.task].files)
            job.data_files = copy_inputs(target / INPUTS, self._folder, text, job.file, others)
            put(target / NAME, text.encode())
            job.write(self._folder.jobs)
        except BaseException:
            shutil.rmtree(target, ignore_errors=True)
            raise
        with self._changed:
            self._jobs[job.id] = job
            self._tell(job)
            self._changed.notify()
            return job

    def _change(self, job: Job, model: Model) -> str:
        """Return in words how a model differs from that of the job's parent; nothing where it has a name of its own."""
        with self._changed:
            parent = self._jobs.get(job.parent or "")
        if parent is None:
            return ""
        try:
            before = model_of(stored_text(self.path(parent.id) / NAME), self._folder, parent.file)
        except (ModelError, OSError):
            return ""
        return change_words(before, model) if before.name == model.name else ""

    def path(self, job: str) -> Path:
        """Return the folder of a job."""
        return self._folder.jobs / job

    def rename(self, job: str, name: str) -> Job:
        """Give a job another name; ModelError if its record cannot be read, OSError if the disk is full."""
        with self._changed:
            known = self.get(job)
            read_job(self.path(job))
            renamed = replace(known, name=name.strip()[:_LONGEST_NAME] or known.task)
            renamed.write(self._folder.jobs)
            known.name = renamed.name
            self._tell(known)
            return known

    def cancel(self, job: str) -> Job:
        """Take a job from the queue, or stop it; one that has ended stays as it is.

        A task that keeps what is known is asked to end with that; a second call ends its process, as the first one does
        of other tasks.
        """
        with self._changed:
            cancelled = self.get(job)
            if cancelled.state == "waiting":
                self._end(cancelled, "cancelled", [])
            elif cancelled.state == "running":
                if TASKS[cancelled.task].keeps_known and job not in self._cancelled:
                    self._running[job].stop()
                    cancelled.progress = {**cancelled.progress, "text": STOPPING}
                    self._tell(cancelled)
                else:
                    self._running[job].end()
                self._cancelled.add(job)
            return cancelled

    def delete(self, job: str) -> None:
        """Remove a job with all its files; ModelError if it has not ended, or some files cannot be removed."""
        with self._changed:
            removed = self.get(job)
            if removed.state not in ENDED:
                raise ModelError(Problem("job", job, "has not ended", "cancel it first"))
            del self._jobs[job]
            self._unwritten.pop(job, None)
        _remove(self.path(job))  # a folder of very many files takes seconds, which others do not wait for
        with self._changed:
            if os.path.lexists(self.path(job)):
                self._jobs[job] = removed
                raise ModelError(Problem("job", job, "cannot be removed wholly", f"remove {self.path(job)}"))
            self._say({"deleted": job})

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Have a function called after every change, in threads of the queue; returns what ends that."""
        with self._changed:
            self._listeners.append(listener)

        def leave() -> None:
            with self._changed:
                self._listeners.remove(listener)

        return leave

    def close(self) -> None:
        """End all processes; jobs under way are broken then."""
        with self._changed:
            self._is_open = False
            for process in self._running.values():
                process.end()
            self._changed.notify_all()
        for thread in self._threads:
            thread.join(10.0)

    def _serve(self, memory: float) -> None:
        """Compute one job after the other."""
        process = WarmProcess(memory, self._reserve)
        process.start()
        while (job := self._next(process)) is not None:
            state, problems = self._computed(job, process)
            self._finish(job, state, problems)
        process.end()

    def _computed(self, job: Job, process: WarmProcess) -> tuple[State, Sequence[Problem]]:
        """Compute a job; return its state then, and why it failed: whatever goes wrong concerns this job alone."""
        content = {"folder": self.path(job.id), "task": job.task, "options": job.options, "file": job.file}
        try:
            job.sentence = process.ask("job", content, partial(self._progress, job))
        except FailedError as failure:
            return "failed", failure.problems
        except EndedError as ended:
            return "failed", [Problem("job", job.id, str(ended), "ask for fewer cycles or samples")]
        except Exception as error:  # the queue goes on
            return "failed", [Problem("internal error", type(error).__name__, str(error), "please report it")]
        return "done", []

    def _next(self, process: WarmProcess) -> Job | None:
        """Wait for a job and begin it; None: the queue is closed."""
        with self._changed:
            while self._is_open:
                job = next((job for job in self._jobs.values() if job.state == "waiting"), None)
                if job is None:
                    self._changed.wait()
                    continue
                job.state = "running"
                job.started = now()
                refused = self._write(job)
                if refused is not None:
                    self._end(job, "failed", [refused])
                    continue
                process.start()
                self._running[job.id] = process
                self._tell(job)
                return job
        return None

    def _progress(self, job: Job, fraction: float) -> None:
        with self._changed:
            text = STOPPING if job.id in self._cancelled else "computing"
            job.progress = {"fraction": min(1.0, max(0.0, fraction)), "text": text}
            self._tell(job)

    def _finish(self, job: Job, state: State, problems: Sequence[Problem]) -> None:
        if state != "done":  # its process may have been ended while it wrote the result
            self._folder.sweep_job(job.id)
        with self._changed:
            del self._running[job.id]
            if job.id in self._cancelled:
                self._cancelled.discard(job.id)
                state, problems = ("cancelled", []) if state == "failed" else (state, problems)
            elif not self._is_open and state == "failed":
                state = "broken"
                problems = [Problem("job", job.id, "the server ended before it", "start it again")]
            if state == "done":
                job.progress = {"fraction": 1.0, "text": ""}
            self._end(job, state, problems)

    def _end(self, job: Job, state: State, problems: Sequence[Problem]) -> None:
        job.ended = now()
        job.state = state
        job.problems = [problem.to_dict() for problem in shown_problems(problems)]
        refused = self._write(job)
        if refused is not None and state == "done":
            job.state = "failed"
            job.problems = [refused.to_dict()]
        self._tell(job)

    def _write(self, job: Job) -> Problem | None:
        """Write the record of a job, and those that were refused before; return why that of this job is refused."""
        refused = None
        self._unwritten[job.id] = job
        for unwritten in list(self._unwritten.values()):
            try:
                unwritten.write(self._folder.jobs)
                del self._unwritten[unwritten.id]
            except OSError as error:
                refused = problem_of(error) if unwritten is job else refused
        return refused

    def _tell(self, job: Job) -> None:
        self._say({"job": job.to_dict()})

    def _say(self, message: dict[str, Any]) -> None:
        for listener in list(self._listeners):
            listener(message)


def _remove(path: Path) -> None:
    """Remove a folder, or the link in its place, as far as the machine lets it be removed."""
    if path.is_symlink():
        path.unlink()
        return
    with suppress(RecursionError):  # shutil calls itself for each level
        shutil.rmtree(path, ignore_errors=True)
