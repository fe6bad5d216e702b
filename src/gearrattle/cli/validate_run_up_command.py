"""``gearrattle validate`` for a run-up: it compares orders over speed instead of cycles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.command_inputs import is_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Words

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.measured.validation import RunUp


@Parameter(name="*")
@dataclass(frozen=True)
class OverSpeed:
    """Options for comparing run-ups."""

    order: Annotated[Sequence[float], Parameter(help="Of a run-up: compare it. May be repeated.")] = ()
    turns: Annotated[float | None, Parameter(help="Of a run-up: turns in a block of the fit; default 8.")] = None
    shaft: Annotated[str | None, Parameter(help="Of a run-up: measured channel of the shaft's speed or angle.")] = None
    repeat: Annotated[Words, Parameter(help="Of a run-up: a file that repeats it. May be repeated.")] = ()


def is_run_up(model: Path) -> bool:
    """Return whether a model file, or the model of a saved run, has a sweep."""
    if model.suffix.lower() == ".toml":
        return is_model(model) and gearrattle.load(model).excitation.sweep is not None
    return gearrattle.open_run(model).speed is not None


def validate_run_up(
    files: tuple[Path, Path],
    how: OverSpeed,
    match: dict[str, str],
    settings: dict[str, Any],
    output: Path | None,
    *,
    json: bool,
) -> None:
    """Compare a simulated run-up with measured ones, and print or save the result."""
    repeats = [Path(path) for path in how.repeat]
    more = {} if how.turns is None else {"turns": how.turns}

    def work(watch: Watch) -> RunUp:
        records = [gearrattle.read(path) for path in (files[1], *repeats)]
        return gearrattle.validate_run_up(
            files[0],
            records,
            how.order or None,
            match=match,
            speed=how.shaft,
            settings=settings,
            progress=watch,
            **more,
        )

    emit("validation of a run-up", work, output, json=json, inputs=[*files, *repeats])
