"""What every command does with its result: compute it in the background, save it whole or not at all, print it.

A terminal gets the sentence and the short tables of the result's presentation, notes on stderr; ``--json`` gives what
summary.json holds.

Takes a function that computes; gives files and text.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from functools import partial
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
    kind: str,
    work: Callable[[Watch], Any],
    output: Path | None = None,
    *,
    json: bool,
    inputs: Sequence[Path] = (),
    keeps_known: bool = False,
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
    keeps_known
        whether the work returns what it knows when it is stopped: it is printed and saved then, too.

    Raises
    ------
    ModelError
        ``output`` cannot hold such a result; then nothing has been computed.
    """
    from gearrattle.report.kinds import presentation_class, presentation_of
    from gearrattle.report.saved import check_target, destination, put_into

    if output is None:
        print_now = partial(print_result, json=json)
        print_now(watched(lambda watch: presentation_of(work(watch)), known=print_now if keeps_known else None))
        return
    endings = presentation_class(kind).endings
    check_target(output, endings, "-o", inputs)

    def work_and_save(watch: Watch) -> tuple[Presentation[Any], Path]:
        presentation = presentation_of(work(watch))
        watch.phase = "writing the result"
        return presentation, put_into(presentation, output, staging)

    def commit(saved: tuple[Presentation[Any], Path]) -> None:
        staging.commit()
        print_result(*saved, json=json)

    with destination(output, endings) as staging:
        commit(watched(work_and_save, known=commit if keeps_known else None))


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
