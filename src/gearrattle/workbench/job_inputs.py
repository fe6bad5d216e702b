"""Input files of a job: its model, and the data files that the model and the options name, in one folder.

    inputs/model.toml    the model; data files in its folder or below keep their names
    inputs/data/         data files from other folders; the model and other files refer to them here
    inputs/measured/     files that options name, with their names in the workspace folder, and the files named in them

They are copied when the job is submitted. So later changes of files do not affect the job, and the folder can be run on
any machine.
"""

from __future__ import annotations

import os
import shutil
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

import tomlkit

from gearrattle.errors import ModelError, Problem
from gearrattle.files import Refused, allowed_root, opened, reachable
from gearrattle.model import Model, loads
from gearrattle.workbench.editing import edited
from gearrattle.workbench.workspace_folder import Folder

INPUTS = "inputs"
NAME = "model.toml"
"""Names in the folder of a job: the folder of inputs, and the model in it."""
DATA = "data"
MEASURED = "measured"
_KEY = "file"
Location = tuple[int | str, ...]


def model_of(text: str, folder: Folder, file: str = "") -> Model:
    """Return the model of a text as if it stood in a file of the workspace folder, to which names of data files are
    relative; ModelError if the text is no model, or the name leads out of the folder.
    """
    with allowed_root(folder.root):
        return loads(text, str(folder.path(file or NAME)))


def moved(options: Mapping[str, Any], of_files: Sequence[str], inputs: Path = Path()) -> dict[str, Any]:
    """Return options of a task with the paths of files, and of tables that name files, in the folder of inputs."""
    home = inputs / MEASURED
    return {name: _moved(value, home) if name in of_files else value for name, value in options.items()}


def files_of(options: Mapping[str, Any], of_files: Sequence[str]) -> list[str]:
    """Return the names of the files that options of a task name; see ``moved``."""
    return [name for key in of_files if key in options for name in _names_in(options[key])]


def copy_inputs(target: Path, folder: Folder, text: str, file: str, others: Sequence[str] = ()) -> list[str]:
    """Copy a model, its data files and those that options name into a new folder of inputs, and return the names of the
    data files; ModelError if one is missing or may not be read.
    """
    with allowed_root(folder.root):
        reserved = {"..", *([MEASURED] if others else [])}
        text, sources = _of_model(text, folder.path(file or NAME).parent, reserved)
        texts = {NAME: text}
        for name in others:
            _add_option(name, folder, sources, texts)
    target.mkdir(parents=True, exist_ok=True)
    for name, content in texts.items():
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        (target / name).write_text(content, encoding="utf-8")
    for name, source in sources.items():
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        with opened(source) as original, (target / name).open("wb") as copy:
            shutil.copyfileobj(original, copy)
    return sorted({*texts, *sources} - {NAME})


def _moved(value: Any, home: Path, is_file: bool = True) -> Any:
    if isinstance(value, str):
        return (home / value).as_posix() if is_file else value
    if isinstance(value, Mapping):
        return {key: _moved(entry, home, key == _KEY) for key, entry in value.items()}
    return [_moved(entry, home, is_file=False) for entry in value] if isinstance(value, list) else value


def _names_in(option: Any) -> list[str]:
    """Return the names of files in an option: it is one, or holds tables that name some."""
    return [option] if isinstance(option, str) else [name for _, name in _named(option)]


def _named(tables: Any, path: Location = ()) -> Iterator[tuple[Location, str]]:
    """Yield paths and names of the files that tables name."""
    if isinstance(tables, Mapping):
        for key, value in tables.items():
            if key == _KEY and isinstance(value, str):
                yield (*path, key), value
            yield from _named(value, (*path, key))
    elif isinstance(tables, list):
        for index, value in enumerate(tables):
            yield from _named(value, (*path, index))


def _of_model(text: str, home: Path, reserved: set[str]) -> tuple[str, dict[str, Path]]:
    """Return a model with the names of its data files among the inputs, and where those come from by name."""
    named = [(path, os.path.normpath(raw), _source(raw, home)) for path, raw in _named(tomllib.loads(text))]
    kept = {source: raw for _, raw, source in named if not os.path.isabs(raw) and raw.split("/")[0] not in reserved}
    sources = {name: source for source, name in kept.items()}
    for _, _, source in named:
        if source not in kept:
            kept[source] = _free(f"{DATA}/{source.name}", sources)
            sources[kept[source]] = source
    edits = [{"op": "set", "path": path, "value": kept[source]} for path, raw, source in named if raw != kept[source]]
    return (edited(text, edits).text if edits else text), sources


def _free(name: str, taken: Mapping[str, Path]) -> str:
    path = PurePosixPath(name)
    count = 1
    while name in taken:
        count += 1
        name = f"{path.parent}/{path.stem}_{count}{path.suffix}"
    return name


def _add_option(name: str, folder: Folder, sources: dict[str, Path], texts: dict[str, str]) -> None:
    """Add a file that an option names, and where it is a TOML file what that names."""
    path = folder.file(name)
    moved_name = f"{MEASURED}/{name}"
    if path.suffix.lower() != ".toml":
        sources[moved_name] = path
        return
    document = tomlkit.parse(folder.read(name).decode("utf-8-sig"))
    for location, raw in list(_named(document.unwrap())):
        source = _source(raw, path.parent)
        if source.is_relative_to(folder.root):
            wanted = f"{MEASURED}/{source.relative_to(folder.root).as_posix()}"
        else:
            wanted = _free(f"{DATA}/{source.name}", sources)
        sources[wanted] = source
        relative = os.path.relpath(wanted, PurePosixPath(moved_name).parent)
        if os.path.normpath(raw) != relative:
            table: Any = document
            for key in location[:-1]:
                table = table[key]
            table[location[-1]] = relative
    texts[moved_name] = tomlkit.dumps(document)


def _source(name: str, home: Path) -> Path:
    """Return the path of a file that a file in a folder names; it may be read."""
    try:
        path = reachable(name, home)
    except Refused as refused:
        raise ModelError(Problem(str(home / name), "", refused.rule, refused.remedy)) from None
    except ValueError:
        raise ModelError(Problem(_KEY, name[:80], "names no file")) from None
    if not path.is_file():
        raise ModelError(Problem(str(home / name), "", "no such file"))
    return path
