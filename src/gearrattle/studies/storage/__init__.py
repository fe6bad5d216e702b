"""Storage of studies: folders, and addresses that fsspec knows."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TypeAlias
from urllib.parse import unquote

from gearrattle.errors import ModelError, Problem
from gearrattle.studies.storage.folder_storage import Folder
from gearrattle.studies.storage.remote import Remote, remote
from gearrattle.studies.storage.storage_location import File, Storage

Address: TypeAlias = str | os.PathLike[str] | Storage
"""A path, an address, or a storage location already found."""

_PROTOCOL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://")
_HALF = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:/(?!/)")

__all__ = ["Address", "File", "Folder", "Remote", "Storage", "storage_of"]


def storage_of(address: Address) -> Storage:
    """Return the storage location that a path or an address names; ``file://`` is a folder.

    Raises
    ------
    NotInstalled
        a library for the protocol is not here.
    ModelError
        there is no such protocol, or the address names no storage location.
    """
    if not isinstance(address, str | os.PathLike):
        return address
    text = os.fspath(address)
    if text.startswith("file://"):
        return Folder(Path(unquote(text.removeprefix("file://"))))
    if _PROTOCOL.match(text):
        return remote(text)
    if not isinstance(address, str) and _HALF.match(text):
        rule = "an address is no path: a slash is lost"
        raise ModelError(Problem("output", text, rule, "give it as text"))
    return Folder(Path(address))
