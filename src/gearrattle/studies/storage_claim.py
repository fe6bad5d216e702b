"""Claim of a storage location by a study: whether it may be kept there, and the lock that one program at a time holds.

The location is checked before anything is computed, and again when the study begins there. A folder is locked while a
study is under way; an address cannot be. There ``study.json`` is written by one program alone, and two programs that
resume the same study compute the same.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.files import Refused
from gearrattle.formats import check_format
from gearrattle.studies.storage import Storage
from gearrattle.writing import Lock, sweep

ABOUT = "study.json"
"""File of every study that says what it is of."""


def check_storage(storage: Storage, *, resume: bool) -> None:
    """Refuse a storage location that holds anything but the study to be resumed; it need not exist.

    ModelError where it holds a study and ``resume`` is not set, or something else; NotADirectoryError where it is a
    file, or lies below one.
    """
    if storage.local is not None:
        anchor = storage.local.absolute()
        while not anchor.exists() and anchor != anchor.parent:
            anchor = anchor.parent
        if not anchor.is_dir():
            raise NotADirectoryError(20, "a file stands where a folder is needed", str(anchor))
    if storage.exists(ABOUT):
        if not resume:
            raise holds_one(storage)
    elif not storage.is_empty():
        raise ModelError(Problem(storage.address, "", "is not empty, and no study", "give another folder"))


def holds_one(storage: Storage) -> ModelError:
    """Return the error for a storage location that holds a study already."""
    return ModelError(Problem(storage.address, "", "holds a study already", "resume it, or give another folder"))


class Claim:
    """The right to write a study into a storage location."""

    def __init__(self, storage: Storage, *, resume: bool) -> None:
        """Take the claim, and remove what killed programs have left there.

        ModelError where another program has it, and as ``check_storage``; OSError where nothing can be written there.
        """
        check_storage(storage, resume=resume)
        self._storage = storage
        self._lock: Lock | None = None
        if storage.local is None:
            return
        storage.make()
        try:
            self._lock = Lock(storage.local)
        except Refused as error:
            raise ModelError(Problem(storage.address, "", error.rule, error.remedy)) from None
        try:
            check_storage(storage, resume=resume)  # another program may have begun meanwhile
            self._clear(storage.local)
        except BaseException:
            self.release()
            raise

    def check(self) -> None:
        """Raise ModelError where a later study of this program writes into the storage location."""
        if self._lock is not None and not self._lock.held:
            rule = "is written by another study of this program, which was begun later"
            raise ModelError(Problem(self._storage.address, "", rule, "go on with that one"))

    def release(self) -> None:
        """Release the claim, and remove what killed workers have left there."""
        if self._lock is not None and self._lock.held and self._storage.local is not None:
            with suppress(OSError):  # of what is left; the results are there
                self._clear(self._storage.local)
            self._lock.release()

    def _clear(self, folder: Path) -> None:
        """Remove what killed programs have left; nothing that a program is still writing."""
        for part in ("", "done"):
            sweep(folder / part)
        for name in self._storage.names(""):
            if name.startswith((".handed-", ".touched-")):
                self._storage.remove(name)


def about_in(storage: Storage) -> dict[str, Any]:
    """Return what ``study.json`` says; ModelError where it is damaged."""
    try:
        about = json.loads(storage.read(ABOUT))
        if isinstance(about, dict) and isinstance(about["owner"], dict):
            return about
    except FileNotFoundError:
        raise
    except Refused as error:
        raise ModelError(Problem(f"{storage.address}: {ABOUT}", "", error.rule, error.remedy)) from None
    except (ValueError, KeyError, RecursionError):
        pass
    rule = "does not say what study the folder holds: it is damaged"
    raise ModelError(Problem(f"{storage.address}: {ABOUT}", "", rule, "give another folder"))


def check_owner(storage: Storage, owner: Mapping[str, str], kind: str) -> dict[str, Any]:
    """Return what ``study.json`` says, if it is of this study.

    ModelError: it is of another, damaged, or of a format (``formats``) that is not that of this kind.
    """
    about = about_in(storage)
    check_format(about["owner"].get("format", ""), f"{storage.address}/{ABOUT}", kind)
    changed = [key for key in {**owner, **about["owner"]} if about["owner"].get(key) != owner.get(key)]
    if changed:
        rule = f"holds another study: {', '.join(changed)} differ; only the same gives the same bits"
        raise ModelError(Problem(storage.address, "", rule, "give another folder"))
    return about
