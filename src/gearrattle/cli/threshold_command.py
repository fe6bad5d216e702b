"""``gearrattle threshold``: the smallest change at which a driveline is quiet."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, Output, Settings, Whole, ends_in, named_as

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.design.threshold import Threshold

_SETTINGS = Settings()


def threshold(
    model: Path,
    /,
    *,
    path: str,
    range_: Annotated[str, Parameter(name="--range")],
    until: str = "quiet",
    count: Whole | None = None,
    width: float | None = None,
    workers: Whole | None = None,
    changes: Changes = (),
    output: Output = None,
    settings: Settings = _SETTINGS,
    json: Json = False,
) -> None:
    """Find the smallest change of one value at which a driveline is quiet, by exact runs.

    The range is scanned, then the nearest change of the answer is halved. A value is quiet only if the motion from
    rest, the motion before and the motion after a push all are. Ctrl-C ends it with what is known by then.

    Parameters
    ----------
    model
        Model file (TOML).
    path
        Of the value, such as mesh.m1.backlash, or with * and factors: inertia.*.drag_torque with "x1:x8".
    range_
        LOW:HIGH, such as "0.05:0.2 mm"; numbers without a unit are in SI.
    until
        What is looked for: quiet, or "largest impact energy < 0.1 mJ", "m5: largest approach speed < 5 mm/s".
    count
        Values of the scan. Default: 7.
    width
        Of the bracket, as a share of the value. Default: 0.01.
    workers
        Threads; default: as many as there are cores.
    """
    driveline = settings.on(changed_model(model, changes))
    ends = ends_in(range_)
    asked = {"count": count, "width": width}
    options: dict[str, Any] = {name: value for name, value in asked.items() if value is not None}

    def work(watch: Watch) -> Threshold:
        watch.enter("simulating")
        with named_as({"count": "--count", "width": "--width", "range": "--range", "until": "--until"}):
            return gearrattle.threshold(driveline, path, ends, until, **options, workers=workers, progress=watch)

    emit("threshold", work, output, json=json, inputs=[model], keeps_known=True)
