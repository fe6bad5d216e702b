"""The shelf of places to keep a study: folders, and addresses as fsspec knows them.

Takes what the user gives as output; gives a Place.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TypeAlias
from urllib.parse import unquote

from gearrattle.errors import ModelError, Problem
from gearrattle.studies.places.base import File, Place
from gearrattle.studies.places.folder import Folder
from gearrattle.studies.places.remote import Remote, remote

Address: TypeAlias = str | os.PathLike[str] | Place
"""A path, an address, or a place already found."""

_PROTOCOL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://")
_HALF = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:/(?!/)")

__all__ = ["Address", "File", "Folder", "Place", "Remote", "place_of"]


def place_of(address: Address) -> Place:
    """Return the place that a path or an address names; ``file://`` is a folder.

    Raises:
        NotInstalled: a library for the protocol is not here.
        ModelError: there is no such protocol, or the address names no place.
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
