"""A model as a command's result: where it may go, writing it whole or not at all, and telling of it.

Takes a Model with its record and a path; writes the file, prints the record.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

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
    if output.parent.exists() and not output.parent.is_dir():
        raise ModelError(Problem("-o", f'"{output}"', "lies below a file; a folder is needed"))
    if any(output.exists() and path.exists() and output.samefile(path) for path in inputs):
        raise ModelError(
            Problem("-o", f'"{output}"', "is read by this command and would be lost", "choose another name")
        )


class Found(Protocol):
    """What a command found: a model and its record."""

    @property
    def model(self) -> Model:
        """The model to save."""

    @property
    def report(self) -> str:
        """The whole in words."""

    def to_dict(self) -> dict[str, Any]:
        """Return the record in JSON types."""


def tell(found: Found, output: Path | None, *, json: bool) -> None:
    """Save the model where one is asked for, and print the record, in words or as JSON."""
    from gearrattle.json_types import json_text

    if output is not None:
        _save(found.model, output)
    if json:
        print(json_text({**found.to_dict(), "output": None if output is None else str(output)}))
        return
    print(found.report)
    if output is not None:
        print(f"saved: {output}")


def _save(model: Model, output: Path) -> None:
    """Write a model, whole or not at all."""
    from gearrattle.model.file import text_of
    from gearrattle.writing import Staging

    with Staging(output.parent) as staging:
        (staging.path / output.name).write_text(text_of(model), encoding="utf-8")
        staging.commit()
