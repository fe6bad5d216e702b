"""What workers do for ``benchmarks.scaling``: a chunk of a study as always, and a note of when and how long.

In a module of its own, for workers import it by its name.
"""

from __future__ import annotations

import json
import os
import threading
import time
from pathlib import Path

from gearrattle.studies.case_runs import Computed, compute
from gearrattle.studies.study_store import ProgressCallback, Store


def noted(store: Store, chunk: int, report: ProgressCallback | None) -> Computed:
    """Compute a chunk; beside the study, note the worker, begin and end [s], and processor time spent [s]."""
    begin, spent = time.time(), time.thread_time()
    computed = compute(store.plan, store.outputs, chunk, report)
    worker = f"{os.getpid()} {threading.get_ident()}"
    note = worker, begin, time.time(), time.thread_time() - spent
    (folder_of(store) / f"{chunk}.json").write_text(json.dumps(note), encoding="utf-8")
    return computed


def folder_of(store: Store) -> Path:
    """Where the notes of a study are."""
    return Path(store.storage.address).with_suffix(".notes")
