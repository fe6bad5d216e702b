"""``gearrattle schema``: the format of model files and study files, for editors."""

from __future__ import annotations

from gearrattle.json_types import json_text
from gearrattle.model import json_schema
from gearrattle.model.schema import schema_of


def schema(*, study: str | None = None) -> None:
    """Print the JSON Schema of model files, or of study files of a kind; editors use it to complete and check them.

    Parameters
    ----------
    study
        Kind of study file, such as "grid" or "bifurcation"; without it, model files.
    """
    if study is None:
        print(json_text(json_schema()))
        return
    from gearrattle.studies.kinds import kind_named

    print(json_text(schema_of(kind_named(study, "--study"), f"gearrattle study file: {study}")))
