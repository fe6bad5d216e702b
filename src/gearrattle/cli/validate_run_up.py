"""What ``gearrattle validate`` does with a run-up: orders over speed instead of cycles.

Takes files and options; gives a RunUp, on the terminal or as a page.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.validation import RunUp

_Words = Annotated[Sequence[str], Parameter(negative="")]


@Parameter(name="*")
@dataclass(frozen=True)
class OverSpeed:
    """How run-ups are compared."""

    order: Annotated[Sequence[float], Parameter(negative="", help="Of a run-up: compare it. May be repeated.")] = ()
    turns: Annotated[float | None, Parameter(help="Of a run-up: turns in a block of the fit; default 8.")] = None
    shaft: Annotated[str | None, Parameter(help="Of a run-up: measured channel of the shaft's speed or angle.")] = None
    repeat: Annotated[_Words, Parameter(help="Of a run-up: a file that repeats it. May be repeated.")] = ()

    def given(self) -> list[str]:
        """Return the options that were given."""
        values = {"--order": self.order, "--turns": self.turns, "--shaft": self.shaft, "--repeat": self.repeat}
        return [name for name, value in values.items() if value not in ((), [], None)]


def is_run_up(model: Path) -> bool:
    """Return whether a model file has a sweep, or a saved run ran along one."""
    import gearrattle
    from gearrattle.cli.sources import is_model

    if model.suffix.lower() == ".toml":
        return is_model(model) and gearrattle.load(model).excitation.sweep is not None
    return gearrattle.open_run(model).speed is not None


def validate_run_up(
    files: tuple[Path, Path], how: OverSpeed, match: dict[str, str], settings: dict[str, Any], output: Path | None,
    *, json: bool,
) -> None:  # fmt: skip
    """Compare a run-up, and print or write what was found."""
    from gearrattle.cli.background import watched
    from gearrattle.cli.page_folder import page_folder
    from gearrattle.json_types import json_text
    from gearrattle.report.run_up_validation import run_up_content

    asked = how, match, settings
    if output is None:
        found = watched(lambda watch: _work(watch, files, asked, None))
    else:
        with page_folder(output) as staging:
            found = watched(lambda watch: _work(watch, files, asked, staging.path))
            staging.commit()
    for note in found.notes:
        print(f"note: {note}", file=sys.stderr)
    if json:
        print(json_text(run_up_content(found)))
    else:
        print(_table(found))
        print(found.verdict)
    if output is not None:
        print(f"page: {output / 'report.html'}", file=sys.stderr if json else sys.stdout)


def _work(
    watch: Watch, files: tuple[Path, Path], asked: tuple[OverSpeed, dict[str, str], dict[str, Any]], folder: Path | None
) -> RunUp:
    """Compare; with a folder to write into, make the page as well."""
    import gearrattle
    from gearrattle.report.run_up_validation import fill_run_up

    how, match, settings = asked
    records = [gearrattle.read(path) for path in (files[1], *map(Path, how.repeat))]
    more = {} if how.turns is None else {"turns": how.turns}
    found = gearrattle.validate_run_up(
        files[0], records, how.order or None, match=match, speed=how.shaft, settings=settings, progress=watch, **more
    )
    if folder is not None:
        watch.enter("writing the page")
        fill_run_up(found, folder)
    return found


def _table(found: RunUp) -> str:
    from gearrattle.cli.columns import columns
    from gearrattle.report.run_up_validation import tracks_table

    table = tracks_table(found)
    return columns(table.head, table.rows)
