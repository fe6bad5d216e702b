"""``gearrattle run``: the whole procedure, from the model file to the report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import gearrattle
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, ModelFile, Negligible, OutputPath, Settings, negligible_of

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.pipeline import Findings

_DEFAULTS = Settings()


def run(
    model: ModelFile,
    /,
    *,
    output: OutputPath = None,
    settings: Settings = _DEFAULTS,
    changes: Changes = (),
    negligible: Negligible = (),
    json: Json = False,
) -> None:
    """Do everything: check, modes, simulate, judge, report.

    Parameters
    ----------
    output
        Folder for the results; default: the model file's name with "-results", here.
    """
    driveline = changed_model(model, changes)
    limits = negligible_of(negligible)

    def work(watch: Watch) -> Findings:
        return gearrattle.run(driveline, **settings.arguments(), negligible=limits, progress=watch, phase=watch.enter)

    emit("run", work, output or Path(f"{model.stem}-results"), json=json, inputs=[model])
