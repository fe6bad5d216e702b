"""``gearrattle metrics``: rattle metrics of a saved motion, or of a measured file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gearrattle
from gearrattle.cli.command_inputs import motion_or_recording
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Json, Output


def metrics(
    source: Path,
    /,
    *,
    model: Path | None = None,
    name: tuple[str, ...] = (),
    order: tuple[float, ...] = (),
    base_level: float | None = None,
    kappa: float | None = None,
    kind: str | None = None,
    output: Output = None,
    json: Json = False,
) -> None:
    """Measure a saved motion, or signals of a rig, by every rattle metric.

    Parameters
    ----------
    source
        Motion saved by "simulate" or "run" (.nc), or the folder of a "stream"; or a measured file, or a mapping of one
        (.toml).
    model
        Model file of the driveline of a measured file: inertias, radii, drag torques, orders, speed.
    name
        A metric; may be given several times. Default: all.
    order
        An order of the engine's torque; may be given several times. Default: those of the model.
    base_level
        Level of the gearbox without rattle [dB], for the rattle level.
    kappa
        Factor from the intensity of impacts to sound [1/N], for the rattle level; follows from one measured level.
    kind
        "steady", or "transient": of an event. Default: transient where a torque has ramps or is a record.
    """
    from gearrattle.quantities.metrics import metrics as measured

    driveline = None if model is None else gearrattle.load(model)
    motion = gearrattle.open_stream(source) if source.is_dir() else motion_or_recording(source)
    how: dict[str, Any] = {"orders": order or None, "base_level": base_level, "kappa": kappa, "kind": kind}
    emit("metrics", lambda _: measured(motion, driveline, name or None, **how), output, json=json, inputs=[source])
