"""``gearrattle simulate``: the motion alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import gearrattle
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, ModelFile, Output, Settings

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.report.motion_page import SimulationReport

_DEFAULTS = Settings()


def simulate(
    model: ModelFile,
    /,
    *,
    output: Output = None,
    settings: Settings = _DEFAULTS,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Simulate a model and save the motion."""
    driveline = changed_model(model, changes)

    def work(watch: Watch) -> SimulationReport:
        run = gearrattle.simulate(driveline, **settings.arguments(), progress=watch)
        from gearrattle.report.motion_page import SimulationReport

        return SimulationReport(run)

    emit("motion", work, output, json=json, inputs=[model])
