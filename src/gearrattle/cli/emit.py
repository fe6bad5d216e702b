"""What every command does with its result: compute it in the background, save it whole or not at all, print it.

A terminal gets the sentence and the short tables of the result's presentation, notes on stderr; ``--json`` gives what
summary.json holds.

Takes a function that computes; gives files and text.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from shutil import get_terminal_size
from typing import TYPE_CHECKING, Any

from gearrattle.cli.background import watched
from gearrattle.json_types import json_text

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.report.presentation import Presentation
    from gearrattle.studies.storage import File


def emit(
    kind: str, work: Callable[[Watch], Any], output: Path | None = None, *, json: bool, inputs: Sequence[Path] = ()
) -> None:
    """Compute a result, save it where that is asked for, and print it.

    Parameters
    ----------
    kind
        of the result.
    work
        computes it, or a presentation of it.
    output
        a file or a folder; None: it is printed only.
    json
        whether it is printed as JSON.
    inputs
        files that are read, which ``output`` must not replace.

    Raises
    ------
    ModelError
        ``output`` cannot hold such a result; then nothing has been computed.
    """
    from gearrattle.report.kinds import presentation_class, presentation_of
    from gearrattle.report.saved import check_target, destination, put_into

    if output is None:
        print_result(watched(lambda watch: presentation_of(work(watch))), json=json)
        return
    endings = presentation_class(kind).endings
    check_target(output, endings, "-o", inputs)

    def work_and_save(watch: Watch) -> tuple[Presentation[Any], Path]:
        presentation = presentation_of(work(watch))
        watch.enter("writing the result")
        return presentation, put_into(presentation, output, staging)

    with destination(output, endings) as staging:
        presentation, written = watched(work_and_save)
        staging.commit()
    print_result(presentation, written, json=json)


def print_result(presentation: Presentation[Any], written: Path | File | None = None, *, json: bool) -> None:
    """Print a result, and where it stands: the answer on stdout, notes on stderr.

    Parameters
    ----------
    presentation
        of the result.
    written
        the file or page; None if it was not saved.
    json
        whether it is printed as JSON.
    """
    from gearrattle.report.saved import summary
    from gearrattle.report.text import plain_text

    for note in presentation.notes:
        print(f"note: {note}", file=sys.stderr)
    if json:
        print(json_text({**summary(presentation), "output": None if written is None else str(written)}))
        return
    print(plain_text(presentation, get_terminal_size().columns if sys.stdout.isatty() else None))
    if written is not None:
        print(f"{'page' if written.name == 'report.html' else 'saved'}: {written}")
