"""``gearrattle modes``: natural frequencies, shapes, what works in each mode and what shakes it; a Campbell diagram."""

from __future__ import annotations

from collections.abc import Sequence

import gearrattle
from gearrattle.cli.assignments import labels, lists, numbers
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, ModelFile, Output, Words


def modes(
    model: ModelFile,
    /,
    *,
    contact_ratio: Words = (),
    region: Words = (),
    speeds: str | None = None,
    over: Words = (),
    output: Output = None,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Print the natural modes; every clearance is closed unless specified otherwise.

    Parameters
    ----------
    contact_ratio
        NAME=RATIO: the element's stiffness counts with this ratio, 0 to 1. May be repeated.
    region
        NAME=LABEL: the element is in this region: 0 the centre, 1, 2, ... drive side, -1, -2, ... coast. May be
        repeated.
    speeds
        Range of the Campbell diagram, e.g. "800:3000 rpm"; numbers without a unit are in rad/s. Default: from 0 to
        twice the model's speed. Given, the crossings are printed.
    over
        NAME=RATIO,RATIO,...: the Campbell diagram has lines for each of these contact ratios. May be repeated.
    """
    from gearrattle.report.modes_page import ModesPage

    driveline = changed_model(model, changes)
    ratios = numbers("--contact-ratio", contact_ratio)
    regions = labels("--region", region)
    grid: dict[str, float | Sequence[float]] = {**ratios, **lists("--over", over)}

    def work(_: object) -> ModesPage:
        modes = gearrattle.modes(driveline, contact_ratio=ratios, region=regions)
        diagram = gearrattle.campbell(driveline, speeds, contact_ratio=grid, region=regions)
        return ModesPage(modes, diagram, _setting(ratios, regions), lists_crossings=speeds is not None)

    emit("modes", work, output, json=json, inputs=[model])


def _setting(ratios: dict[str, float], regions: dict[str, int]) -> str:
    """Name the slope of every element."""
    exceptions = [f"{name} counts with {ratio:g} of its stiffness" for name, ratio in ratios.items()]
    exceptions += [f"{name} is in region {label}" for name, label in regions.items()]
    if not exceptions:
        return "Every element has the slope of its last drive stage: every clearance is closed."
    return f"{'; '.join(exceptions)}. Every other element has the slope of its last drive stage."
