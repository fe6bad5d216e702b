"""Record what a tree of this project answers: ``python record.py FOLDER PART ...``, with the tree first on the path.

A record is a folder with texts.json and arrays.npz, by the same keys: what was asked, then the way to a value in its
answer. This file imports nothing that lies beside it, so that it can record a tree that does not have it.
"""

from __future__ import annotations

import io
import json
import os
import re
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import chdir, redirect_stderr, redirect_stdout
from html.parser import HTMLParser
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

import gearrattle as gr
from gearrattle.cli import main
from tests.compositions.calls import CALLS, Kit
from tests.compositions.commands import COMMAND_LINES
from tests.compositions.kinds import BASE, KINDS

TREE = Path(sys.modules["tests.compositions"].__path__[0]).parents[1]
EXAMPLES = TREE / "examples"
ALGORITHMS = (
    "exact",
    "rk2",
    "rk4",
    "rkf",
    "rkv",
    "adams",
    "gear",
    "bulirsch-stoer",
    "rkv-events",
    "gear-events",
    "dop853",
    "radau",
)
CYCLES, SAMPLES = 3, 32
DEEPEST = 6
BAD_VALUES = ("-1", "0", "1e300", "nan", '"a"', '"1 kg"', "[]", "[1]", "{}", "true", "", "99999999999999999999")
WITHOUT_JSON = frozenset({"look", "schema", "listen", "figures"})


class Record:
    """Values by key: texts, and arrays of numbers."""

    def __init__(self) -> None:
        self.texts: dict[str, str] = {}
        self.arrays: dict[str, np.ndarray] = {}

    def add(self, key: str, value: Any, depth: int = 0) -> None:
        """Add a value and all that it holds."""
        if isinstance(value, np.ndarray | np.generic) and value.dtype.kind in "biufcmM":
            self.arrays[key] = np.asarray(value).astype("i8") if value.dtype.kind in "mM" else np.asarray(value)
        elif isinstance(value, np.ndarray):
            self.add(key, value.tolist(), depth)
        elif isinstance(value, float):
            self.arrays[key] = np.array(value)
        elif value is None or isinstance(value, bool | int | str | bytes | Path):
            self.texts[key] = value.name if isinstance(value, Path) else str(value)
        elif depth > DEEPEST:
            self.texts[key] = type(value).__name__
        else:
            self._add_parts(key, value, depth + 1)

    def _add_parts(self, key: str, value: Any, depth: int) -> None:
        for name, part in parts_of(value):
            self.add(f"{key} {name}", part, depth)

    def save(self, folder: Path) -> None:
        """Write both files."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "texts.json").write_text(json.dumps(self.texts, indent=0, ensure_ascii=False), encoding="utf-8")
        np.savez(folder / "arrays.npz", *self.arrays.values())
        (folder / "keys.json").write_text(json.dumps(list(self.arrays), ensure_ascii=False), encoding="utf-8")


def parts_of(value: Any) -> Iterator[tuple[str, Any]]:
    """Yield what a value holds, with names."""
    if isinstance(value, xr.Dataset):
        yield "names", sorted(map(str, value.variables))
        yield "attrs", dict(value.attrs)
        yield from ((str(name), variable) for name, variable in sorted(value.variables.items(), key=str))
    elif isinstance(value, xr.DataArray | xr.Variable):
        yield "dims", list(value.dims)
        yield "attrs", dict(value.attrs)
        yield "values", value.values
        if isinstance(value, xr.DataArray):
            yield from ((f"coord {name}", coord.variable) for name, coord in value.coords.items())
    elif isinstance(value, pd.DataFrame | pd.Series):
        yield "index", value.index.to_list()
        yield "attrs", dict(value.attrs)
        columns = {"": value} if isinstance(value, pd.Series) else {str(name): value[name] for name in value}
        yield "columns", list(columns)
        yield from ((f"column {name}", column.to_numpy()) for name, column in columns.items())
    elif isinstance(value, Mapping):
        yield "keys", [str(name) for name in value]
        yield from ((f"[{name}]", part) for name, part in value.items())
    elif isinstance(value, list | tuple | set | frozenset):
        yield from _items(sorted(value, key=str) if isinstance(value, set | frozenset) else value)
    elif isinstance(value, gr.Model):
        yield "TOML", value.to_toml()
    elif callable(value):
        yield "called", value.__name__ if hasattr(value, "__name__") else type(value).__name__
    else:
        yield "type", type(value).__name__
        yield from public_values(value)


def _items(value: Any) -> Iterator[tuple[str, Any]]:
    yield "length", len(value)
    if value and all(type(item) is float for item in value):
        yield "numbers", np.array(value)
    else:
        yield from ((f"{i}", item) for i, item in enumerate(value))


def public_values(value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the public fields and properties of an object; what one raises, where it does."""
    names = {name for name in dir(type(value)) if not name.startswith("_")} | set(getattr(value, "__dict__", {}))
    for name in sorted(name for name in names if not name.startswith("_")):
        if callable(getattr(type(value), name, None)):
            continue
        try:
            yield f".{name}", getattr(value, name)
        except Exception as error:
            yield f".{name}", f"{type(error).__name__}: {error}"


def motions(record: Record) -> None:
    """Record the motion of every example by every algorithm."""
    for path in sorted([*EXAMPLES.glob("*.toml"), *EXAMPLES.glob("paper/*.toml")]):
        model = gr.load(path)
        for algorithm in ALGORITHMS:
            key = f"motion {path.stem} {algorithm}"
            record_answer(
                record,
                key,
                lambda model=model, algorithm=algorithm: gr.simulate(  # type: ignore[misc]
                    model, algorithm, cycles=CYCLES, discard=1, samples_per_cycle=SAMPLES
                ),
            )


def calls(record: Record, kinds: list[str]) -> None:
    """Record what every public call answers."""
    for kind in kinds:
        with TemporaryDirectory() as name:
            kit = Kit(KINDS[kind].make(), Path(name))
            for row, call in CALLS.items():
                record_answer(record, f"call {row} ({kind})", lambda call=call, kit=kit: call(kit))  # type: ignore[misc]


def record_answer(record: Record, key: str, call: Callable[[], Any]) -> None:
    """Record an answer, or the error in its place."""
    with warnings.catch_warnings(record=True) as raised, redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        warnings.simplefilter("always")
        try:
            record.add(key, call())
        except Exception as error:
            record.add(key, f"{type(error).__name__}: {error}")
    record.add(f"{key} warnings", sorted({str(warning.message) for warning in raised}))


def commands(record: Record, kinds: list[str]) -> None:
    """Record what every command prints, with which code it ends, and the tree of files that it leaves."""
    for kind in kinds:
        with TemporaryDirectory() as name:
            kit = Kit(KINDS[kind].make(), Path(name))
            for number, (row, words) in enumerate(COMMAND_LINES.items()):
                out = kit.folder / f"out-{number}"
                line = words(kit, out)
                with chdir(kit.folder):
                    record_command(record, f"command {row} ({kind})", line, kit.folder)
                    if "--json" not in line and line[0] not in WITHOUT_JSON and "-o" not in line:
                        record_command(record, f"command {row} --json ({kind})", [*line, "--json"], kit.folder)
                for path in sorted(out.rglob("*")) if out.is_dir() else ():
                    record_file(record, f"file {row} ({kind}) {path.relative_to(out)}", path)


def record_command(record: Record, key: str, words: list[str], folder: Path) -> None:
    """Record one command: its exit code, its lines on stdout (JSON as values) and on stderr."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = main(list(words))
    record.add(f"{key} exit", code)
    for stream, text in (("stdout", out.getvalue()), ("stderr", err.getvalue())):
        plain = text.replace(str(folder), "FOLDER")
        if stream == "stderr":  # progress shows as the machine is quick or slow
            plain = "\n".join(line for line in plain.splitlines() if line.startswith(("error", "note", "warning")))
        try:
            record.add(f"{key} {stream}", json.loads(plain))
        except ValueError:
            record.add(f"{key} {stream}", plain)


def record_file(record: Record, key: str, path: Path) -> None:
    """Record a file: numbers of datasets, values of JSON, text of pages' tables; of others that they are there."""
    record.add(key, "folder" if path.is_dir() else "file")
    if path.suffix == ".json":
        record.add(key, json.loads(path.read_text(encoding="utf-8")))
    elif path.suffix == ".nc":
        tree = xr.open_datatree(path, engine="h5netcdf")
        for group in tree.subtree:
            record.add(f"{key} {group.path}", group.to_dataset().load())
        tree.close()
    elif path.suffix == ".html":
        reader = Tables()
        reader.feed(path.read_text(encoding="utf-8"))
        record.add(f"{key} tables", "\n".join(reader.lines()))
    elif path.suffix in (".csv", ".toml", ".txt"):
        record.add(f"{key} text", path.read_text(encoding="utf-8"))


class Tables(HTMLParser):
    """Headings and cells of a page, in order."""

    def __init__(self) -> None:
        super().__init__()
        self.pieces: list[str] = []
        self.wanted = 0

    def handle_starttag(self, tag: str, attrs: Any) -> None:  # noqa: ARG002
        """Begin a heading, a row or a cell."""
        if tag in ("h1", "h2", "h3", "tr"):
            self.pieces.append("\n")
        self.wanted += tag in ("h1", "h2", "h3", "th", "td")

    def handle_endtag(self, tag: str) -> None:
        """End it."""
        if tag in ("h1", "h2", "h3", "th", "td"):
            self.wanted -= 1
            self.pieces.append(" | ")

    def handle_data(self, data: str) -> None:
        """Keep what stands in one."""
        if self.wanted:
            self.pieces.append(data)

    def lines(self) -> list[str]:
        """Return the text, a row a line."""
        return [" ".join(line.split()) for line in "".join(self.pieces).split("\n") if line.strip(" |")]


def refusals(record: Record) -> None:
    """Record the messages for a model file in which one value is wrong or one key is unknown."""
    for entry in re.finditer(r"(\w+) = ([^,{}\[\]\n]+)", BASE):
        texts = [f"{entry[1]} = {value}" for value in BAD_VALUES] + [f"{entry[1]}x = {entry[2]}"]
        for number, text in enumerate(texts):
            whole = BASE[: entry.start()] + text + BASE[entry.end() :]
            key = f"refusal {entry.start()}.{number} {text}"
            record_answer(record, key, lambda whole=whole: gr.loads(whole))  # type: ignore[misc]


def record_part(part: str, kinds: list[str]) -> Record:
    """Record one part."""
    record = Record()
    if part == "motions":
        motions(record)
    elif part == "refusals":
        refusals(record)
    elif part == "calls":
        calls(record, kinds)
    else:
        commands(record, kinds)
    return record


if __name__ == "__main__":
    folder, part, *kinds = sys.argv[1:]
    os.environ.setdefault("COLUMNS", "100")
    record_part(part, kinds or list(KINDS)).save(Path(folder) / re.sub(r"\W+", "-", " ".join([part, *kinds])))
