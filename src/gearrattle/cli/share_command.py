"""``gearrattle share``: a saved result as one file to hand over."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.background import watched
from gearrattle.cli.shared_options import Json
from gearrattle.json_types import json_text

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch


def share(
    source: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    json: Json = False,
) -> None:
    """Write a saved result as one file to hand over; only the verdict on a motion is computed again.

    Parameters
    ----------
    source
        Folder that a command wrote (run, study, compare, ...), or a file that one saved (.nc).
    output
        File that ends in .zip (page, figures, numbers, model, tables, script), .pdf (the page), .pptx (slides) or
        .xlsx (tables). Default: the source's name with ".zip", here.
    """
    target = output or Path(f"{source.absolute().name.removesuffix('.nc')}.zip")

    def work(watch: Watch) -> Path:
        watch.enter("writing the file")
        return gearrattle.share(source, target)

    written = watched(work)
    size = written.stat().st_size
    if json:
        print(json_text({"output": str(written), "bytes": size}))
        return
    print(f"saved: {written} ({size / 1e6:.1f} MB)")
