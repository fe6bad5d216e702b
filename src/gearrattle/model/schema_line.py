"""The first line of a file for editors: ``#:schema ./gearrattle.schema.json`` names the JSON Schema of the file.

taplo (Even Better TOML) and tombi read it, relative to the file. Where the schema is missing taplo fails, so the line
is written only into a folder that has the schema, or whose parent has it: ``gearrattle schema -o FOLDER`` and
``gearrattle examples -o FOLDER`` put it there.
"""

from __future__ import annotations

from pathlib import Path

MARK = "#:schema "
MODEL = "model"


def schema_file(kind: str = MODEL) -> str:
    """Return the name of the file with the schema of a kind of file: "model", "mapping", a kind of study, ..."""
    return "gearrattle.schema.json" if kind == MODEL else f"gearrattle.{kind}.schema.json"


def with_schema_line(text: str, folder: Path, kind: str = MODEL) -> str:
    """Return the text of a file as it is written into a folder: the line in front, if the schema is there."""
    name = schema_file(kind)
    home = folder.resolve()
    there = [prefix for prefix, owner in (("./", home), ("../", home.parent)) if (owner / name).is_file()]
    return f"{MARK}{there[0]}{name}\n{text}" if there else text


def without_schema_line(text: str) -> str:
    """Return the text of a file that goes elsewhere: the line would lead to no file."""
    return text.partition("\n")[2] if text.startswith(MARK) else text
