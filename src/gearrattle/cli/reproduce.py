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
    from gearrattle.cli.page_folder import page_folder
    from gearrattle.json_types import json_text
    from gearrattle.reproduction import reproduce as run
    from gearrattle.reproduction.page import fill

    folder = output or Path(f"{what}-reproduction")
    with page_folder(folder) as staging:

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
    print(f"page: {folder / 'reproduction.html'}", file=sys.stderr if json else sys.stdout)


def _tell(found: Reproduction) -> None:
    """Print how many rows have each status, then those that differ, each with its reason."""
    import shutil
    import textwrap

    from gearrattle.cli.columns import columns
    from gearrattle.reproduction.record import DIFFERS
    from gearrattle.wording import noun_of

    rows = [(f"{number}", status) for status, number in found.counts().items()]
    print(columns(("rows", "status"), [*rows, (f"{len(found.rows)}", "in all")], {1}))
    differing = [row for row in found.rows if row.status == DIFFERS]
    if not differing:
        return
    width = max(60, min(120, shutil.get_terminal_size().columns))
    print(f"\n{len(differing)} {noun_of(len(differing), 'row differs', 'rows differ')}:")
    for row in differing:
        print(textwrap.fill(row.item, width, subsequent_indent="  "))
        print(textwrap.fill(f"because {row.why}", width, initial_indent="    ", subsequent_indent="    "))
    print("\nThe page has all rows.")
