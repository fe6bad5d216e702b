"""Reading a model file: bytes to text to tables to a ``Model``, every failure a ``ModelError`` with its place.

Nothing in a file is evaluated: TOML is data, units go through ``units``. A file is refused by size before it is
parsed, so that a wrong path (a result file, a disk image) is answered at once.
"""

from __future__ import annotations

import difflib
import json
import os
import re
import tomllib
from pathlib import Path
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.files import Refused, allowed_root, opened, reachable
from gearrattle.model.model import Model
from gearrattle.model.pydantic_problems import Positions, place
from gearrattle.model.signal import Points
from gearrattle.model.table import shown
from gearrattle.model.toml_line_numbers import NestingError, key_lines
from gearrattle.model.value_kinds import NEWER_SCHEMA, is_newer_schema

LARGEST = 1_000_000
_HDF5 = b"\x89HDF\r\n\x1a\n"
"""What HDF5 files begin with, netCDF-4 files among them."""
_FEWEST_CHARACTERS = 10
"""Of a point of a record: two numbers of three characters, each with a comma and a blank."""


def load(path: str | os.PathLike[str], *, root: str | os.PathLike[str] | None = None) -> Model:
    """Read and validate a model file.

    Parameters
    ----------
    path
        a TOML file, UTF-8, at most 1 MB.
    root
        folder of further files that the model may name. Always allowed are files under the model's own folder,
        and under the working directory if that holds the model.

    Returns
    -------
    Model
        The validated model, in SI.

    Raises
    ------
    ModelError
        the file is missing, unreadable or no model; carries all problems found, with line numbers.

    Examples
    --------
    >>> _ = open("two.toml", "w").write(gr.example("case3").to_toml())
    >>> gr.load("two.toml").name == gr.example("case3").name
    True
    """
    with allowed_root(root):
        return loads(read_text(path), os.fspath(path))


def loads(text: str, name: str = "<text>", stored: Points | None = None) -> Model:
    """Read and validate a model given as TOML text.

    Parameters
    ----------
    text
        the content of a model file.
    name
        what messages call it; paths in it are relative to the folder of this name.
    stored
        points of signals that the text only names (``Model.to_stored``).

    Returns
    -------
    Model
        The validated model, in SI.

    Raises
    ------
    ModelError
        the text is no model; carries all problems found, with line numbers.

    Examples
    --------
    >>> text = gr.example("case3").to_toml()
    >>> [inertia.name for inertia in gr.loads(text).inertias]
    ['flywheel', 'hub', 'input_gear', 'output_gear']
    """
    return Model.from_tables(*read_tables(text, name), stored)


def readable_text(model: Model) -> str:
    """Return a model as a text that ``loads`` reads; one of records too long for that only names their points.

    Such a text goes together with the points themselves (``Model.to_stored``), as in the file of a saved run.
    """
    text, points = model.to_stored()
    if _FEWEST_CHARACTERS * sum(time.size for time, _ in points.values()) > LARGEST:
        return text
    whole = model.to_toml()
    return whole if len(whole) <= LARGEST else text


def text_of(model: Model) -> str:
    """Return a model as a text that can be read again; ModelError if its records are too long for a model file."""
    text = model.to_toml()
    if len(text) > LARGEST:
        rule = f"{_size_rule('model file')}; this one would have {len(text) / 1e6:.1f}, for the points of its records"
        raise ModelError(Problem("signal", "too many points", rule, "cut or thin the record"))
    return text


def read_text(path: str | os.PathLike[str], kind: str = "model file") -> str:
    """Read a TOML file as text, UTF-8 of at most 1 MB; ModelError if it is missing, unreadable, too large or no text.
    Messages call the file a ``kind``.
    """
    name = os.fspath(path)
    try:
        if os.path.isdir(name):
            raise ModelError(Problem(name, "a folder", "must be a TOML file", _models_in(name)))
        with opened(name) as stream:
            content = stream.read(LARGEST + 1)
    except FileNotFoundError:
        raise ModelError(Problem(name, "", "no such file", _neighbour(name))) from None
    except (OSError, ValueError) as error:
        raise ModelError(unreadable(shown_name(name), error)) from None
    if content.startswith(_HDF5):
        remedy = f"gr.open_run({name!r}).model, if it is a saved run"
        raise ModelError(Problem(name, "a netCDF or HDF5 file", f"a {kind} is a text (TOML)", remedy))
    if len(content) > LARGEST:
        raise ModelError(Problem(name, "more than 1 MB", _size_rule(kind), f"is this really a {kind}?"))
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        rule = "must be a text in UTF-8"
        raise ModelError(Problem(f"{name}:{line}", f"byte 0x{content[error.start]:02x}", rule)) from None


def read_tables(text: str, name: str, kind: str = "model file") -> tuple[dict[str, Any], Positions]:
    """Parse TOML text into tables and the positions of their keys; ModelError if it is too long, nested too deeply, or
    no valid TOML. Messages call the text a ``kind`` and by its name.
    """
    if len(text) > LARGEST:
        raise ModelError(Problem(name, f"{len(text)} characters", _size_rule(kind)))
    try:
        lines = key_lines(text)
    except NestingError as error:
        raise ModelError(Problem(f"{name}:{error.line}", "", "arrays, tables or keys are nested too deeply")) from None
    tables = _parse(text, name)
    if not tables:
        value = "an empty file" if not text.strip() else "a file without a key"
        raise ModelError(Problem(name, value, f"a {kind} has tables and keys", _BEGIN.get(kind, "")))
    _check_kind(tables, name, kind)
    positions = Positions(name, lines)
    if is_newer_schema(tables.get("schema")):
        raise ModelError(Problem(place(("schema",), {}, positions), shown(tables["schema"]), *NEWER_SCHEMA))
    return tables, positions


_ALIKE = 0.75
"""Least likeness of names, 0 to 1 (``difflib``), with which a file is suggested."""
_BEGIN = {"model file": "it needs schema, inertia and excitation; gearrattle examples lists models"}
_MARKS = {"inertia": "model file", "model": "study file", "channel": "mapping file", "response": "data file"}
"""A key that a kind of file always has, or has alone."""
_COMMANDS = {
    "model file": "gearrattle run takes it",
    "study file": "gearrattle study takes it",
    "mapping file": "gearrattle metrics takes it",
    "data file": "gearrattle fit takes it",
}


def kind_of(path: str | os.PathLike[str]) -> str:
    """Return the kind of a TOML file, by a key that its kind always has, empty for none or no TOML; ModelError if the
    file is missing, unreadable, too large or no text.
    """
    try:
        tables = tomllib.loads(read_text(path, "TOML file"))
    except (ValueError, RecursionError):
        return ""
    return next((kind for mark, kind in _MARKS.items() if mark in tables), "")


def _check_kind(tables: dict[str, Any], name: str, kind: str) -> None:
    """Refuse a file that is of another kind, by one error in place of one a key."""
    own = next((mark for mark, of_kind in _MARKS.items() if of_kind == kind), "")
    other = next((of_kind for mark, of_kind in _MARKS.items() if mark in tables), kind)
    if own not in tables and other != kind:
        raise ModelError(Problem(name, f"a {other}", f"a {kind} is needed", _COMMANDS[other]))


def _size_rule(kind: str) -> str:
    return f"a {kind} has at most 1 MB"


def check_reachable(path: str | os.PathLike[str], folder: str | os.PathLike[str]) -> None:
    """Refuse a file that an input file in this folder names and may not read (ModelError), see ``reachable``."""
    try:
        reachable(path, folder)
    except (OSError, ValueError) as error:
        raise ModelError(unreadable(shown_name(os.fspath(Path(folder) / path)), error)) from None


def unreadable(name: str, error: OSError | ValueError) -> Problem:
    """Return the problem of a file that the machine, or ``gearrattle.files``, does not open."""
    if isinstance(error, Refused):
        return Problem(name, "", error.rule, error.remedy)
    reason = error.strerror if isinstance(error, OSError) else None
    return Problem(name, "", f"cannot be read: {(reason or str(error)).lower()}")


def shown_name(name: str) -> str:
    """Return a file name that can be printed."""
    return "".join(c if c.isprintable() else "?" for c in name)


def _parse(text: str, name: str) -> dict[str, Any]:
    """Parse TOML; a syntax error becomes a problem with its line."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        if _is_json(text):
            rule = "must be TOML: KEY = VALUE lines under [table] headings"
            raise ModelError(Problem(name, "a JSON file", rule, "write its keys as TOML")) from None
        line, words = _syntax(str(error), text)
        raise ModelError(Problem(f"{name}:{line}", "", f"not valid TOML: {words}")) from None
    except ValueError:  # a whole number longer than Python converts
        digits = re.search(r"\d[\d_]{999,}", text)
        line = text.count("\n", 0, digits.start() if digits else 0) + 1
        raise ModelError(Problem(f"{name}:{line}", "", "a whole number has too many digits")) from None


def _is_json(text: str) -> bool:
    """Whether a text is an object or a list of JSON."""
    if not text.lstrip().startswith(("{", "[")):
        return False
    try:
        json.loads(text)
    except (ValueError, RecursionError):
        return False
    return True


def _syntax(message: str, text: str) -> tuple[int, str]:
    """Split tomllib's message into the line and the words."""
    where = re.search(r"\(at line (\d+), column (\d+)\)$", message)
    words = message[: where.start()].strip() if where else message
    words = words[:1].lower() + words[1:]
    if where is None:
        return text.count("\n") + 1, words
    return int(where.group(1)), f"{words} (column {where.group(2)})"


def _neighbour(name: str) -> str:
    """Suggest a TOML file of the same folder whose name is similar."""
    path = Path(name)
    try:
        names = [entry.name for entry in path.parent.iterdir() if entry.suffix.lower() == ".toml"]
    except (OSError, ValueError):
        return f"the folder {path.parent} does not exist or cannot be read"
    by_stem = {Path(name).stem.lower(): name for name in sorted(names)}
    close = difflib.get_close_matches(path.stem.lower(), by_stem, n=1, cutoff=_ALIKE)
    return f'did you mean "{path.parent / by_stem[close[0]]}"?' if close else ""


def _models_in(folder: str) -> str:
    """Name a TOML file inside a folder."""
    try:
        names = sorted(entry.name for entry in Path(folder).iterdir() if entry.suffix == ".toml")
    except OSError:
        return ""
    return f'such as "{Path(folder) / names[0]}"' if names else ""
