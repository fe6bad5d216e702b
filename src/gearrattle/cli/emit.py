"""Computing (in the background), saving (complete or not at all) and printing the result of a command.

The sentence and the short tables of the result's presentation are printed on stdout, notes on stderr; ``--json`` prints
the content of summary.json.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from shutil import get_terminal_size
from typing import TYPE_CHECKING, Any

from gearrattle.cli.background import watched
from gearrattle.errors import ModelError, Problem
from gearrattle.json_types import json_text
from gearrattle.wording import counted, listed

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
    """Compute a result, save it to ``output`` if there is one, and print it.

    Parameters
    ----------
    output
        a file or a folder; None: the result is printed only.
    inputs
        input files, which ``output`` must not replace.
    keeps_known
        whether the work returns a partial result when it is stopped, which is then printed and saved, too.

    Raises
    ------
    ModelError
        such a result cannot be saved to ``output``; nothing has been computed then.
    """
    show = partial(print_result, json=json)
    _emit_to(kind, work, output, inputs, show, keeps_known=keeps_known)


def _emit_to(
    kind: str,
    work: Callable[[Watch], Any],
    output: Path | None,
    inputs: Sequence[Path],
    show: Callable[[Presentation[Any], Path | None], None],
    *,
    keeps_known: bool = False,
) -> None:
    """Compute a result, save it to ``output`` if there is one, and pass it to ``show``; arguments as of ``emit``."""
    from gearrattle.report.result_kinds import presentation_class, presentation_of
    from gearrattle.report.saved import check_target, destination, put_into

    if output is None:

        def show_it(presentation: Presentation[Any]) -> None:
            show(presentation, None)

        show_it(watched(lambda watch: presentation_of(work(watch)), known=show_it if keeps_known else None))
        return
    endings = presentation_class(kind).endings
    check_target(output, endings, "-o", inputs)

    def work_and_save(watch: Watch) -> tuple[Presentation[Any], Path]:
        presentation = presentation_of(work(watch))
        watch.phase = "writing the result"
        watch.expect(math.nan)
        return presentation, put_into(presentation, output, staging)

    def commit(saved: tuple[Presentation[Any], Path]) -> None:
        staging.commit()
        show(*saved)

    with destination(output, endings) as staging:
        commit(watched(work_and_save, known=commit if keeps_known else None))


def emit_each(
    kind: str,
    works: Mapping[str, Callable[[Watch], Any]],
    output: Path | None = None,
    *,
    json: bool,
    inputs: Sequence[Path] = (),
) -> None:
    """Compute, save and print several results one after the other, as ``emit`` does.

    Parameters
    ----------
    output
        for one result, a file or a folder; for several, a folder with one folder per result, named after it.
    json
        whether results are printed as JSON: several as one document with ``results`` by name.

    Raises
    ------
    ModelError
        ``output`` is a file, but there are several results.
    """
    from gearrattle.report.result_kinds import presentation_class
    from gearrattle.report.saved import summary

    if len(works) == 1:
        (work,) = works.values()
        emit(kind, work, output, json=json, inputs=inputs)
        return
    endings = presentation_class(kind).endings
    if output is not None and output.suffix.lower() in endings:
        rule = f"is one file, and there are {counted(len(works), 'channel')}: {listed(list(works))}"
        raise ModelError(Problem("-o", f'"{output}"', rule, "name a channel, or give a folder"))
    summaries: dict[str, Any] = {}

    def show(name: str, presentation: Presentation[Any], written: Path | None) -> None:
        if json:
            summaries[name] = {**summary(presentation), "output": None if written is None else str(written)}
            return
        print(f"{name}\n{'-' * len(name)}")
        print_result(presentation, written, json=False)
        print()

    for name, work in works.items():
        _emit_to(kind, work, None if output is None else output / _folder_name(name), inputs, partial(show, name))
    if json:
        print(json_text({"results": summaries}))


def _folder_name(name: str) -> str:
    """Return the name of a channel as the name of a folder."""
    return re.sub(r"[^\w.-]+", "_", name).strip("._") or "channel"


def print_result(presentation: Presentation[Any], written: Path | File | None = None, *, json: bool) -> None:
    """Print a result as JSON or as text: the answer on stdout; notes, and the written file or page, on stderr."""
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
