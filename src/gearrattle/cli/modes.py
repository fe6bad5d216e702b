"""``gearrattle modes``: natural frequencies, damping ratios and shapes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from gearrattle.cli.options import Json


def modes(
    model: Path,
    /,
    *,
    contact_ratio: Annotated[Sequence[str], Parameter(negative="")] = (),
    region: Annotated[Sequence[str], Parameter(negative="")] = (),
    json: Json = False,
) -> None:
    """Print the natural modes; every clearance is closed unless told otherwise.

    Parameters
    ----------
    model
        Model file (TOML).
    contact_ratio
        NAME=RATIO: the element's stiffness counts with this ratio, 0 to 1. May be repeated.
    region
        NAME=LABEL: the element is in this region: 0 the centre, 1, 2, ... drive side, -1, -2, ... coast. May be
        repeated.
    """
    import gearrattle
    from gearrattle.cli.assignments import numbers
    from gearrattle.cli.columns import columns, json_text
    from gearrattle.report.summary import modes_dict

    driveline = gearrattle.load(model)
    ratios = numbers("--contact-ratio", contact_ratio)
    labels = {name: round(label) for name, label in numbers("--region", region).items()}
    found = gearrattle.modes(driveline, contact_ratio=ratios, region=labels)
    if json:
        print(json_text(modes_dict(found)))
        return
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
