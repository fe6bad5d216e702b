"""``gearrattle modes``: natural frequencies, shapes, what works in each mode and what shakes it; a Campbell diagram."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from gearrattle.cli.options import Json

if TYPE_CHECKING:
    from gearrattle.calls.campbell import Campbell
    from gearrattle.calls.statics import Modes
    from gearrattle.model import Model


def modes(
    model: Path,
    /,
    *,
    contact_ratio: Annotated[Sequence[str], Parameter(negative="")] = (),
    region: Annotated[Sequence[str], Parameter(negative="")] = (),
    speeds: str | None = None,
    over: Annotated[Sequence[str], Parameter(negative="")] = (),
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    json: Json = False,
) -> None:
    """Print the natural modes; every clearance is closed unless told otherwise.

    With -o, writes modes.html, modes.json and figures/ into a folder, all or nothing.

    Parameters
    ----------
    model
        Model file (TOML).
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
    output
        Folder for the page; default: the table on the terminal only.
    """
    import gearrattle
    from gearrattle.cli.assignments import labels, lists, numbers
    from gearrattle.cli.page_folder import page_folder
    from gearrattle.json_types import json_text

    driveline = gearrattle.load(model)
    ratios = numbers("--contact-ratio", contact_ratio)
    regions = labels("--region", region)
    found = gearrattle.modes(driveline, contact_ratio=ratios, region=regions)
    grid: dict[str, float | Sequence[float]] = {**ratios, **lists("--over", over)}
    diagram = gearrattle.campbell(driveline, speeds, contact_ratio=grid, region=regions)
    if output is not None:
        from gearrattle.report.modes import fill_modes

        with page_folder(output) as staging:
            setting = " ".join([_setting(ratios, regions), *found.notes])
            fill_modes(driveline, found, diagram, setting, staging.path)
            staging.commit()
    if json:
        from gearrattle.report.modes import modes_content

        print(json_text(modes_content(driveline, found, diagram)))
    else:
        _tell(driveline, found, diagram, crossings=speeds is not None)
    if output is not None:
        print(f"page: {output / 'modes.html'}", file=sys.stderr if json else sys.stdout)


def _setting(ratios: dict[str, float], regions: dict[str, int]) -> str:
    """Say which slope every element has."""
    told = [f"{name} counts with {ratio:g} of its stiffness" for name, ratio in ratios.items()]
    told += [f"{name} is in region {label}" for name, label in regions.items()]
    if not told:
        return "Every element has the slope of its last drive stage: every clearance is closed."
    return f"{'; '.join(told)}. Every other element has the slope of its last drive stage."


def _tell(driveline: Model, found: Modes, diagram: Campbell, *, crossings: bool) -> None:
    """Print the modes, what they are about and, if asked for, where orders meet them."""
    from gearrattle.cli.columns import columns
    from gearrattle.report.modes_tables import crossings_table, listed, turning

    hertz = driveline.units == "SI"
    head = ("mode", "frequency [Hz]" if hertz else "frequency", "damping [%]", *found.inertia_names)
    rows = [
        (
            str(number + 1),
            f"{frequency / math.tau if hertz else frequency:.6g}",
            "-" if math.isnan(damping) else f"{100.0 * damping:.4g}",
            *(f"{value:.4f}" for value in found.shapes[:, number].tolist()),
        )
        for number, (frequency, damping) in enumerate(
            zip(found.frequencies.tolist(), found.damping_ratios.tolist(), strict=True)
        )
    ]
    print(columns(head, rows))
    print()
    for mode, frequency in enumerate(found.frequencies.tolist()):
        works = "rigid motion" if frequency == 0.0 else f"works in {listed(found.works_in(mode))}"
        print(f"mode {mode + 1}: {works}; excited by {listed(found.excited_by(mode)).replace('–', 'nothing')}")
    for group in found.repeated():
        numbers = " and ".join(str(mode + 1) for mode in group)
        print(f"note: modes {numbers} have one frequency; only sums of their shares mean something", file=sys.stderr)
    for note in found.notes:
        print(f"note: {note}", file=sys.stderr)
    if crossings:
        table = crossings_table(diagram, si=hertz)
        low, high = (turning(speed, si=hertz) for speed in diagram.speeds)
        radians = f" ({diagram.speeds[0]:.4g} to {diagram.speeds[1]:.4g} rad/s)" if hertz else ""
        print(f"\nspeeds from {low} to {high}{radians}:")
        print(columns(table.head, table.rows) if table.rows else "no order meets a mode in this range")
