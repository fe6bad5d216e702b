"""``gearrattle reproduce``: the 1995 paper's numbers beside ours."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Json, OutputPath

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.reproduction import Reproduction


def reproduce(
    what: Literal["paper"],
    /,
    *,
    output: OutputPath = None,
    quick: bool = False,
    json: Json = False,
) -> None:
    """Run what the paper ran, and write a page: paper, ours, why they differ.

    Parameters
    ----------
    what
        "paper": C. Padmanabhan et al., ASME J. Mech. Design 117 (1995) 185-192.
    output
        Folder for the results, or a file for the numbers, ending in .nc or .csv; default: paper-reproduction.
    quick
        Shorten the runs to about a tenth: samples, not results.
    """
    from gearrattle.reproduction import reproduce as run

    def work(watch: Watch) -> Reproduction:
        return run(quick, watch)

    emit("reproduction", work, output or Path(f"{what}-reproduction"), json=json)
