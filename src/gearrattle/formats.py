"""Formats of saved files: every file states its kind and version, and a reader refuses formats that it cannot read.

The format is ``gearrattle KIND VERSION``. It is the attribute ``format`` in netCDF, HDF5 and Zarr, the key ``format``
in JSON, and the entry ``format`` in .npz and .mat. The version is raised when an earlier gearrattle would misread the
file. Files that people write (models, studies, mappings, data) have the number ``schema`` instead, which is checked
when the TOML file is read.
docs/reference/formats.md describes the content of each kind.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from importlib import metadata

from gearrattle.errors import ModelError, Problem


@dataclass(frozen=True)
class Format:
    """A kind of saved file: the version that is written, how the user can make such a file again, and the oldest
    version that can be read (0 if files of the first versions state no format).
    """

    version: int
    again: str
    oldest: int = 1


FORMATS = {
    "run": Format(2, "simulate the model again"),
    "stream": Format(4, "compute the motion again in another folder"),
    "study": Format(2, "compute the study again in another folder", oldest=2),
    "optimization": Format(1, "optimise again in another folder"),
    "charts": Format(1, "run the command that wrote the folder again"),
    "result": Format(1, "run the command or the call that saved it again"),
    "summary": Format(1, "run the command or the call that saved it again"),
    "recording": Format(1, "write the recording again", oldest=0),
    "fmu": Format(1, "export the FMU again"),
    "matrices": Format(1, "run gearrattle condense again", oldest=0),
    "state space": Format(1, "run gearrattle export again"),
}
"""Every kind of file that gearrattle writes in its own format."""


def format_name(kind: str) -> str:
    """Return the name of the format that is written: ``"gearrattle run 2"``."""
    return f"gearrattle {kind} {FORMATS[kind].version}"


@cache
def version_of(package: str) -> str:
    """Return the version of an installed distribution, or raise PackageNotFoundError.

    The result is cached, because parsing the metadata takes 5 ms.
    """
    return metadata.version(package)


def check_format(name: object, source: object, *kinds: str) -> None:
    """Refuse a file of another kind, or of a version that cannot be read (ModelError with a remedy).

    ``name`` is the format of the file, empty if the file states none.
    """
    text = str(name)
    if not text and any(FORMATS[kind].oldest == 0 for kind in kinds):
        return
    parts = re.fullmatch(r"gearrattle ([a-z -]+) (\d{1,9})", text)
    kind = parts[1] if parts else ""
    if parts is None or kind not in kinds:
        wanted = " or ".join(f'"gearrattle {kind}"' for kind in kinds)
        value = f'"{text[:60]}"' if text.isprintable() and text else "no format of gearrattle"
        rule = f"a file of the format {wanted} is needed"
        raise ModelError(Problem(f"{source}", value, rule, FORMATS[kinds[0]].again))
    version = int(parts[2])
    known = FORMATS[kind]
    if version > known.version:
        rule = f'was written by a later version of gearrattle; this one reads "{format_name(kind)}"'
        raise ModelError(Problem(f"{source}", f'"{text}"', rule, f"upgrade gearrattle, or {known.again}"))
    if version < known.oldest:
        rule = f'was written by an earlier version of gearrattle; this one reads "{format_name(kind)}"'
        raise ModelError(Problem(f"{source}", f'"{text}"', rule, known.again))
