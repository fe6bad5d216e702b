"""Inputs of commands: a model with values changed, a saved run, or anything that ``gearrattle.read`` takes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import gearrattle
from gearrattle.cli.assignments import changes
from gearrattle.errors import ModelError, Problem

if TYPE_CHECKING:
    from gearrattle.model import Model
    from gearrattle.recording import Recording
    from gearrattle.results import Run


def changed_model(source: Path, entries: Sequence[str]) -> Model:
    """Read a model file, and change the values that ``--set`` names; ModelError as ``gearrattle.load`` and
    ``Model.with_``.
    """
    model = gearrattle.load(source)
    return model.with_(changes("--set", entries)) if entries else model


def motion_or_recording(source: Path) -> Run | Recording:
    """Open a saved run as a run, anything else as a recording; ModelError for a folder, and as ``gearrattle.read``."""
    from gearrattle.measured.readers import format_of

    if source.is_dir():
        rule = "a saved motion (.nc) or a measured file is needed; of a stream samples are kept in chunks"
        raise ModelError(Problem(str(source), "a folder", rule, f"gearrattle criteria {source} judges a stream"))
    if source.suffix.lower() != ".toml" and format_of(source) == "run":
        return gearrattle.open_run(source)
    return gearrattle.read(source)


def channels_of(signal: Run | Recording, channel: str | None, option: str) -> tuple[str, ...]:
    """Return the channels for a command: the named one, else all signals of a recording.

    ModelError, with the option's name, for a run without a named channel.
    """
    from gearrattle.recording import Recording

    if channel is not None:
        return (channel,)
    if not isinstance(signal, Recording):
        raise no_channel(option)
    turning = ("shaft angle", "pulses")
    return tuple(one.name for one in signal.channels if one.quantity not in turning) or signal.names


def no_channel(option: str) -> ModelError:
    """Return the error for a run without the name of a channel."""
    rule = "must name a channel: a run has many, and only of a recording all are taken"
    return ModelError(Problem(option, "", rule, 'such as "acceleration.hub"'))


def is_model(source: Path) -> bool:
    """Return whether a file is a model: TOML with inertias, or TOML that cannot be read (``load`` says why)."""
    import tomllib

    from gearrattle.model.model_file import read_text

    if source.suffix.lower() != ".toml":
        return False
    try:
        return "inertia" in tomllib.loads(read_text(source))
    except (ModelError, ValueError):
        return True
