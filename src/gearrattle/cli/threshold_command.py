"""``gearrattle threshold``: the smallest change at which a driveline is quiet."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, ModelFile, Output, Settings, Whole, ends_in, named_as

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.design.threshold import Threshold

_SETTINGS = Settings()


def threshold(
    model: ModelFile,
    /,
    *,
    path: str,
    range_: Annotated[str, Parameter(name="--range", allow_leading_hyphen=True)],
    until: str = "quiet",
    count: Whole = 7,
    width: float = 0.01,
    workers: Whole | None = None,
    changes: Changes = (),
    output: Output = None,
    settings: Settings = _SETTINGS,
    json: Json = False,
) -> None:
    """Find the smallest change of one value at which a driveline is quiet, by exact runs.

    Parameters
    ----------
    path
        Path of the value, such as mesh.m1.backlash; or a pattern with * whose values are multiplied:
        inertia.*.drag_torque with --range "x1:x8".
    range_
        LOW:HIGH, such as "0.05:0.2 mm"; numbers without a unit are in SI.
    until
        The goal: quiet, or a limit, such as "largest impact energy < 0.1 mJ" or "m5: largest approach speed < 5 mm/s".
    count
        Number of values in the scan.
    width
        Width at which halving stops, as a share of the value.
    workers
        Threads; default: as many as there are cores.
    """
    driveline = settings.on(changed_model(model, changes))
    ends = ends_in(range_)

    def work(watch: Watch) -> Threshold:
        watch.enter("simulating")
        with named_as({"count": "--count", "width": "--width", "range": "--range", "until": "--until"}):
            return gearrattle.threshold(
                driveline, path, ends, until, count=count, width=width, workers=workers, progress=watch
            )

    emit("threshold", work, output, json=json, inputs=[model], keeps_known=True)
