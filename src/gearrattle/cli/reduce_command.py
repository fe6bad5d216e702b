"""``gearrattle reduce``: a smaller model that is as good inside a band."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import gearrattle
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, ModelFile, OutputPath, Words, number_or_text

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.reductions.reduction import Reduction


def reduce(
    model: ModelFile,
    /,
    *,
    up_to: str,
    output: OutputPath = None,
    keep: Words = (),
    merge: Words = (),
    limit: float = 0.05,
    margin: float = 2.0,
    check: Literal["simulate"] | None = None,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Merge bodies that do not move against each other inside a band, and say what it costs.

    Parameters
    ----------
    up_to
        End of the band, e.g. "75 Hz".
    output
        File for the reduced model, ending in .toml; or a folder for report.html, summary.json, results.nc and figures/;
        or a file, ending in .nc, .csv, .pdf, .pptx or .xlsx. Default: the answer on the terminal only.
    keep
        Name of an element that must stay. May be repeated. Without it every element with a clearance stays; with it
        only those named are sure to.
    merge
        Name of an element to be merged whatever it costs, up to the limit. May be repeated.
    limit
        Largest relative error of a natural frequency in the band.
    margin
        Modes up to margin times the band's end decide what is merged.
    check
        "simulate": also run both models and compare what the criteria say.
    """
    driveline = changed_model(model, changes)
    band = number_or_text(up_to)

    def work(_watch: Watch) -> Reduction:
        return gearrattle.reduce(
            driveline,
            up_to if band is None else band,
            keep=keep or None,
            merge=merge,
            limit=limit,
            margin=margin,
            check=check,
        )

    emit("reduction", work, output, json=json, inputs=[model])
