"""A model as a command's result: where it may go, and writing it whole or not at all.

Takes a Model and a path; writes the file.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from gearrattle.errors import ModelError, Problem

if TYPE_CHECKING:
    from gearrattle.model import Model


def check_output(output: Path | None, *inputs: Path) -> None:
    """Refuse a place that cannot hold the model, before anything is computed.

    Raises:
        ModelError: another ending than .toml, a folder, or one of the files the command reads.
    """
    if output is None:
        return
    if output.suffix != ".toml":
        raise ModelError(Problem("-o", f'"{output}"', "must end in .toml"))
    if output.is_dir():
        raise ModelError(Problem("-o", f'"{output}"', "is a folder; a file is needed"))
    if any(output.exists() and path.exists() and output.samefile(path) for path in inputs):
        raise ModelError(
            Problem("-o", f'"{output}"', "is read by this command and would be lost", "choose another name")
        )


def save_model(model: Model, output: Path) -> None:
    """Write a model, whole or not at all."""
    from gearrattle.report.staging import Staging

    with Staging(output.parent) as staging:
        (staging.path / output.name).write_text(model.to_toml(), encoding="utf-8")
        staging.commit()
