"""``gearrattle advise``: what to do before simulating, and what a run will show."""

from __future__ import annotations

from typing import TYPE_CHECKING

import gearrattle
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, ModelFile, Output, Settings, number_or_text

if TYPE_CHECKING:
    from gearrattle.advice import Advice
    from gearrattle.cli.background import Watch

_DEFAULTS = Settings()


def advise(
    model: ModelFile,
    /,
    *,
    up_to: str | None = None,
    output: Output = None,
    settings: Settings = _DEFAULTS,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Say what to lump, how to scale, which clearances will open, which algorithm to use, what it will cost.

    Parameters
    ----------
    up_to
        End of the band for lumping, e.g. "75 Hz"; default: the highest order of any torque.
    """
    driveline = changed_model(model, changes)

    def work(watch: Watch) -> Advice:
        watch.enter("advising")
        return gearrattle.advise(driveline, **settings.arguments(), up_to=number_or_text(up_to), progress=watch)

    emit("advice", work, output, json=json, inputs=[model])
