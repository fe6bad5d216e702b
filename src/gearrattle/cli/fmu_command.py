"""``gearrattle fmu``: a driveline as an FMU for co-simulation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.background import watched
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.shared_options import Changes, Json, ModelFile, Words, number_or_text
from gearrattle.json_types import json_text
from gearrattle.wording import counted, listed, measured

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.exchange.fmu import Fmu


def fmu(
    model: ModelFile,
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    version: Literal["3.0", "2.0"] = "3.0",
    torque: Words = (),
    speed: Words = (),
    parameter: Words = (),
    step: str | None = None,
    audit: Annotated[bool, Parameter(show_default=False)] = False,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Write a driveline as an FMU for co-simulation, with the exact motion inside; its host needs gearrattle.

    Parameters
    ----------
    output
        The file, ending in .fmu.
    version
        Of the Functional Mock-up Interface.
    torque
        Inertia that takes a torque from outside, beside those of the model. May be repeated. Default: all that are
        free; of more than eight those with a torque in the model, and the last one.
    speed
        Inertia whose speed comes from outside. May be repeated.
    parameter
        Path of a value that the host may change, with * for any text. May be repeated. Default: mean torques, drag
        torques, backlash and clearances.
    step
        Communication step that the FMU proposes: seconds, or e.g. "0.1 ms". Default: a hundredth of the period.
    audit
        Let the FMU audit its energy: one more output, the residual of the balance.
    """
    driveline = changed_model(model, changes)

    def work(watch: Watch) -> Fmu:
        watch.phase = "writing the FMU"
        return gearrattle.export_fmu(
            driveline,
            output,
            version,
            torques=torque or None,
            speeds=speed,
            parameters=parameter or None,
            step=number_or_text(step),
            audit=audit,
        )

    written = watched(work)
    if json:
        print(json_text(written.to_dict()))
        return
    size = measured(written.step, "s" if driveline.units == "SI" else "", 4)
    numbers = listed(
        [
            counted(len(written.names("input")), "input"),
            counted(len(written.names("parameter")), "parameter"),
            counted(len(written.names("output")), "output"),
        ]
    )
    print(f"{written.path}: FMI {written.version}, {numbers}; it proposes steps of {size}.")
    print(f"inputs: {listed(list(written.names('input'))) or 'none'}")
