"""``gearrattle simulate``: the motion alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import gearrattle
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, Output, Settings

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.report.motion_page import SimulationReport

_DEFAULTS = Settings()


def simulate(
    model: Path,
    /,
    *,
    output: Output = None,
    settings: Settings = _DEFAULTS,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Simulate a model and save the motion.

    With -o, writes the motion into a file that ends in .nc (everything) or .csv (the samples), or a whole report into a
    folder, all or nothing.

    Parameters
    ----------
    model
        Model file (TOML).
    """
    driveline = changed_model(model, changes)

    def work(watch: Watch) -> SimulationReport:
        run = gearrattle.simulate(driveline, **settings.arguments(), progress=watch)
        from gearrattle.report.motion_page import SimulationReport

        return SimulationReport(run)

    emit("motion", work, output, json=json, inputs=[model])
