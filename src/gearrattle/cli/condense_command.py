"""``gearrattle condense``: small matrices of a driveline, valid in a band, with clearances that open and close."""

from __future__ import annotations

from typing import TYPE_CHECKING

import gearrattle
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, ModelFile, OutputPath, Words, number_or_text

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.reductions.condense import Condensed


def condense(
    model: ModelFile,
    /,
    *,
    up_to: str,
    method: str = "craig-bampton",
    output: OutputPath = None,
    keep: Words = (),
    limit: float = 0.05,
    margin: float = 3.0,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Write a driveline in few coordinates: mass, damping and stiffness matrices, and their error in the band.

    Parameters
    ----------
    up_to
        End of the band, e.g. "75 Hz".
    method
        "craig-bampton", "guyan", "modal" or "lumping".
    output
        File for the matrices, ending in .npz (NumPy), .mat (MATLAB), .nc or .csv; or a folder for report.html,
        summary.json, results.nc and figures/. Default: the answer on the terminal only.
    keep
        Name of an element whose ends stay free. May be repeated. Default: every element with a clearance.
    limit
        Largest relative error of a natural frequency in the band.
    margin
        Modes up to margin times the band's end are represented.
    """
    driveline = changed_model(model, changes)
    band = number_or_text(up_to)

    def work(_watch: Watch) -> Condensed:
        return gearrattle.condense(
            driveline,
            up_to if band is None else band,
            method=method,
            keep=keep or None,
            limit=limit,
            margin=margin,
        )

    emit("condensation", work, output, json=json, inputs=[model])
