"""``gearrattle examples``: the models, studies and scripts that come with the package."""

from __future__ import annotations

from pathlib import Path

import gearrattle
from gearrattle.cli.shared_options import Json, OutputPath
from gearrattle.errors import ModelError, Problem
from gearrattle.json_types import json_text
from gearrattle.model.examples import example_files, examples_folder
from gearrattle.wording import columns
from gearrattle.writing import Staging


def examples(*, output: OutputPath = None, json: Json = False) -> None:
    """List the models that come with the package, or copy all examples into a folder.

    Parameters
    ----------
    output
        New or empty folder for models, studies, measured files and scripts.
    """
    if output is not None:
        _copy(output)
    rows = [(name, gearrattle.load(path).name) for name, path in example_files().items()]
    if json:
        models = [{"name": name, "title": title} for name, title in rows]
        print(json_text({"models": models, "output": None if output is None else str(output)}))
        return
    print(columns(("model", "what it is"), rows, words=(0, 1)))
    if output is not None:
        print(f"examples: {output}")


def _copy(output: Path) -> None:
    """Copy every example, complete or not at all; ModelError if the folder is not empty."""
    import shutil

    if output.is_dir() and any(output.iterdir()):
        raise ModelError(Problem("-o", f'"{output}"', "is not empty", "give a new or an empty folder"))
    with Staging(output) as staging:
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(examples_folder(), staging.path, ignore=ignored, dirs_exist_ok=True)
        staging.commit()
