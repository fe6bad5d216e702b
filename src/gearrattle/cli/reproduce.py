"""``gearrattle reproduce``: the 1995 paper's numbers beside ours."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from gearrattle.cli.options import Json

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.reproduction import Reproduction


def reproduce(
    what: Literal["paper"],
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    quick: Annotated[bool, Parameter(negative="")] = False,
    json: Json = False,
) -> None:
    """Run what the paper ran, and write a page: paper, ours, why they differ.

    Writes reproduction.html, reproduction.json and figures/ into a folder, all or nothing.

    Parameters
    ----------
    what
        "paper": C. Padmanabhan et al., ASME J. Mech. Design 117 (1995) 185-192.
    output
        Folder for the page; default: paper-reproduction.
    quick
        Shorten the runs to about a tenth: samples, not results.
    """
    from gearrattle.cli.background import watched
    from gearrattle.cli.columns import json_text
    from gearrattle.reproduction import reproduce as run
    from gearrattle.reproduction.page import fill
    from gearrattle.writing import Staging

    folder = output or Path(f"{what}-reproduction")
    with Staging(folder) as staging:

        def work(watch: Watch) -> Reproduction:
            found = run(quick, watch)
            watch.enter("writing the page")
            fill(found, staging.path)
            return found

        found = watched(work)
        staging.commit()
    if json:
        print(json_text(found.to_dict()))
    else:
        _tell(found)
        print("; ".join(f"{number} {status}" for status, number in found.counts().items()))
    print(f"page: {folder / 'reproduction.html'}", file=sys.stderr if json else sys.stdout)


def _tell(found: Reproduction) -> None:
    """Print every row with its status and, below it, the reason."""
    import shutil
    import textwrap

    width = max(60, min(120, shutil.get_terminal_size().columns))
    longest = max(len(row.item) for row in found.rows)
    for row in found.rows:
        print(f"{row.item:<{longest}}  {row.verdict}")
        if row.why:
            print(textwrap.fill(row.why, width, initial_indent="    ", subsequent_indent="    "))
