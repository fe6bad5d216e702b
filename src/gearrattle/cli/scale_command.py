"""``gearrattle scale``: the model without dimensions, and what scaling does to its conditioning."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import gearrattle
from gearrattle.cli.assignments import numbers
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, OutputPath, Words

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.report.scaling_page import ScalingPage


def scale(
    model: Path,
    /,
    *,
    contact_ratio: Words = (),
    output: OutputPath = None,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Print the dimensionless coefficients and the condition numbers; save the dimensionless model.

    Parameters
    ----------
    model
        Model file (TOML), in SI.
    contact_ratio
        NAME=RATIO: for the condition numbers, the element's stiffness counts with this ratio, 0 to 1. May be repeated.
    output
        File for the dimensionless model, ending in .toml; or a folder for report.html, summary.json, results.nc and
        figures/; or a file, ending in .nc, .csv, .pdf, .pptx or .xlsx. Default: the answer on the terminal only.
    """
    from gearrattle.report.scaling_page import ScalingPage

    driveline = changed_model(model, changes)
    ratios = numbers("--contact-ratio", contact_ratio)

    def work(_watch: Watch) -> ScalingPage:
        scaled = gearrattle.nondimensionalize(driveline)
        return ScalingPage(scaled, gearrattle.stiffness(driveline, contact_ratio=ratios))

    emit("scaling", work, output, json=json, inputs=[model])
