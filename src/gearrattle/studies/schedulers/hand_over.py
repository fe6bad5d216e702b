"""Hand-over of a study to workers elsewhere: one file in its folder, and the function that computes a chunk.

The file is also the test that a worker sees the folder, and the sign that the study is still wanted: once it is gone
workers stop within a second.

    .handed-<id>         one line of JSON (versions that must be the same), then the pickled Store
"""

from __future__ import annotations

import hashlib
import json
import pickle
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from uuid import uuid4

from gearrattle.errors import Cancelled, GearRattleError, ModelError, Problem
from gearrattle.formats import version_of
from gearrattle.studies.storage import Storage
from gearrattle.studies.study_store import Store

SAME = ("gearrattle", "numpy", "numba")
_SEEING = 10.0  # seconds until a file is seen on every machine of a network file system
_ASKING = 0.5  # seconds between two looks at whether the study is still wanted


class LostBefore(GearRattleError):
    """A worker had begun this very attempt, and is no more."""


@dataclass(frozen=True)
class Handed:
    """Reference to a study that is sent with every chunk; the digest is the SHA-256 of the hand-over."""

    storage: Storage
    name: str
    digest: str


@contextmanager
def handed_over(store: Store) -> Iterator[Handed]:
    """Write a study's hand-over, and remove it in the end."""
    storage = store.storage.absolute()
    head = json.dumps({name: version_of(name) for name in SAME}).encode()
    content = head + b"\n" + _pickled(Store(storage, store.plan, store.outputs, store.work))
    name = f".handed-{uuid4().hex}"
    storage.write(name, content)
    try:
        yield Handed(storage, name, hashlib.sha256(content).hexdigest())
    finally:
        storage.remove(name)


def _pickled(store: Store) -> bytes:
    """Pickle a store; a function of the user's goes along whole, so that workers need not find its file."""
    import cloudpickle

    function = store.outputs.function
    module = sys.modules.get(getattr(function, "__module__", "") or "")
    whole = module is not None and module.__name__ != "__main__" and not module.__name__.startswith("gearrattle.")
    if whole:
        cloudpickle.register_pickle_by_value(module)
    try:
        return bytes(cloudpickle.dumps(store))
    finally:
        if whole:
            cloudpickle.unregister_pickle_by_value(module)


def work(handed: Handed, chunk: int, attempt: str, alone: bool) -> None:
    """Compute a chunk in a worker and keep it.

    Parameters
    ----------
    attempt
        a name that this chunk has been sent out by, once.
    alone
        whether nothing else may be computed in this process meanwhile.

    Raises
    ------
    LostBefore
        a worker had begun this attempt.
    ModelError
        the folder cannot be seen or written from here, or versions differ.
    OSError
        the chunk cannot be kept.
    """
    store = _received(handed)
    if store.is_done(chunk):  # by a worker that was killed before it could say so
        store.clear(chunk)
        return
    if store.attempt(chunk) == attempt:
        raise LostBefore(f"chunk {chunk}")
    asked = time.monotonic()

    def touch(_: float) -> None:
        nonlocal asked
        if time.monotonic() - asked > _ASKING:
            asked = time.monotonic()
            if not handed.storage.exists(handed.name):
                raise Cancelled("the study has ended")

    with _TURNS.alone() if alone else _TURNS.beside_others():
        store.begin(chunk, attempt)
        store.keep(chunk, store.compute(chunk, touch))


@lru_cache(maxsize=2)
def _received(handed: Handed) -> Store:
    """Read a hand-over and see whether this process can do what it asks."""
    storage = handed.storage
    content = _seen(handed)
    head, _, body = content.partition(b"\n")
    wrong = {name: want for name, want in json.loads(head).items() if version_of(name) != want}
    if wrong:
        versions = ", ".join(f"{name} {version_of(name)}" for name in wrong)
        rule = f"only the same versions give the same bits: {', '.join(f'{n} {v}' for n, v in wrong.items())}"
        raise ModelError(Problem(_here(), versions, rule, "install them there"))
    touched = f".touched-{uuid4().hex}"
    try:
        storage.write(touched, b"")
        storage.remove(touched)
    except OSError as error:
        rule = f"cannot write into the study's folder {storage.address}: {error.strerror or error}"
        raise ModelError(Problem(_here(), "", rule, "let workers write there")) from None
    store: Store = pickle.loads(body)
    return store


def _seen(handed: Handed) -> bytes:
    """Read a file that has just been written, perhaps by another machine."""
    deadline = time.monotonic() + _SEEING
    while True:
        try:
            content = handed.storage.read(handed.name)
            trouble = "reads other bytes than were written"
        except OSError as error:
            content = b""
            trouble = error.strerror or str(error)
        if hashlib.sha256(content).hexdigest() == handed.digest:
            return content
        if time.monotonic() > deadline:
            rule = f"cannot see the study's folder {handed.storage.address}: {trouble}"
            remedy = "give an output folder on a file system that all workers share"
            raise ModelError(Problem(_here(), "", rule, remedy))
        time.sleep(_SEEING / 100.0)


def _here() -> str:
    from socket import gethostname

    return f"worker on {gethostname()}"


class _Turns:
    """Turns of a worker process: chunks in parallel, or one alone, which then is the cause if the worker dies."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._busy = 0
        self._one = False

    @contextmanager
    def beside_others(self) -> Iterator[None]:
        with self._changed:
            self._changed.wait_for(lambda: not self._one)
            self._busy += 1
        try:
            yield
        finally:
            with self._changed:
                self._busy -= 1
                self._changed.notify_all()

    @contextmanager
    def alone(self) -> Iterator[None]:
        with self._changed:
            self._changed.wait_for(lambda: not self._one)
            self._one = True
            self._changed.wait_for(lambda: not self._busy)
        try:
            yield
        finally:
            with self._changed:
                self._one = False
                self._changed.notify_all()


_TURNS = _Turns()
