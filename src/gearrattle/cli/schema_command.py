"""``gearrattle schema``: the formats of the files that gearrattle reads, for editors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gearrattle.cli.shared_options import OutputPath
from gearrattle.errors import ModelError, Problem
from gearrattle.json_types import json_text
from gearrattle.model import json_schema
from gearrattle.model.schema import schema_of
from gearrattle.model.schema_line import MODEL, schema_file
from gearrattle.model.table import Table, did_you_mean
from gearrattle.wording import listed
from gearrattle.writing import Staging

REMEDIES = "remedies"
FILES = (MODEL, "mapping", "data", "recording", REMEDIES)
"""Kinds of files besides studies."""


def schema(*, study: str | None = None, file: str = MODEL, output: OutputPath = None) -> None:
    """Print the JSON Schema of model files, or of other files; editors use it to complete and check them.

    Parameters
    ----------
    study
        Kind of study file, such as "grid" or "bifurcation".
    file
        Kind of other files: "model", "mapping" (of a measured file), "data" (modes and responses to fit), "recording"
        (a motion to fit), "remedies".
    output
        Folder for the schemas of all kinds of files; a model file in it may then begin with the line
        "#:schema ./gearrattle.schema.json". Other files in the folder remain.
    """
    # check the options
    if file not in FILES:
        rule = f"must be {listed(FILES, 'or')}"
        raise ModelError(Problem("--file", f'"{file}"', rule, did_you_mean(file, FILES)))
    if study is not None:
        from gearrattle.studies.kinds import kind_named

        kind_named(study, "--study")
    if output is not None and (output.suffix == ".json" or output.is_file()):
        rule = "must be a folder: the schemas of all kinds of files go there"
        raise ModelError(Problem("-o", f'"{output}"', rule, f"for one of them: gearrattle schema > {schema_file()}"))
    # print one, or write all
    if output is None:
        print(json_text(schema_for(study or file)))
        return
    write_schemas(output)
    print(f"schemas: {output}")


def schema_for(kind: str) -> dict[str, Any]:
    """Return the JSON Schema of a kind of file: one of ``FILES``, or a kind of study."""
    if kind == MODEL:
        return json_schema()
    if kind == REMEDIES:
        from gearrattle.design.remedy_file import remedy_schema

        return remedy_schema()
    table, title = _tables()[kind]
    return schema_of(table, title)


def write_schemas(folder: Path) -> None:
    """Write the schemas of all kinds of files into a folder, all or none; other files in it remain."""
    with Staging(folder) as staging:
        for kind in (MODEL, REMEDIES, *_tables()):
            (staging.path / schema_file(kind)).write_text(json_text(schema_for(kind)) + "\n", encoding="utf-8")
        staging.commit()


def _tables() -> dict[str, tuple[type[Table], str]]:
    """Return the class that reads a kind of file, and the title of its schema."""
    from gearrattle.measured.fitting.recording_table import RecordingTables
    from gearrattle.measured.identification.data_tables import DataTables
    from gearrattle.measured.readers.mapping_tables import MeasurementTables
    from gearrattle.studies.kinds import KINDS

    return {
        "mapping": (MeasurementTables, "gearrattle mapping file"),
        "data": (DataTables, "gearrattle data file of modes and responses"),
        "recording": (RecordingTables, "gearrattle data file of a recorded motion"),
        **{name: (kind, f"gearrattle study file: {name}") for name, kind in KINDS.items()},
    }
