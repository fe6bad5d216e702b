"""``gearrattle remedy``: which change, or pair of changes, makes a driveline quiet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gearrattle
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, ModelFile, Output, Settings, Whole, named_as, number_or_text

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.design.remedies import Remedies

_SETTINGS = Settings()


def remedy(
    model: ModelFile,
    file: Path | None = None,
    /,
    *,
    target: str | None = None,
    speeds: str | None = None,
    singles: bool = False,
    keep: Path | None = None,
    workers: Whole | None = None,
    changes: Changes = (),
    output: Output = None,
    settings: Settings = _SETTINGS,
    json: Json = False,
) -> None:
    """Find which single change, and which pair, makes a driveline quiet, by exact runs.

    Parameters
    ----------
    file
        Remedy file (TOML): target, speeds, and under [candidates] by path or pattern from, to (or factor) and cost.
        Default: drag torques, backlashes, gaps, stages and inertias, from 0.7 to 1.3 times their values.
    target
        quiet (default), half (half the energy of the hardest impact), or "largest impact energy < 0.1 mJ".
    speeds
        At which it must hold beside the model's own: "760,800 rpm". Default: 3 % below and above.
    singles
        Try no pairs.
    keep
        Folder that remembers every motion: a second call with it goes on where the first one stopped.
    workers
        Threads; default: as many as there are cores.
    """
    from gearrattle.design.remedy_file import read_remedies

    driveline = settings.on(changed_model(model, changes))
    asked = read_remedies(file) if file is not None else {}
    options = {**asked, **({"target": target} if target is not None else {})}
    if speeds is not None:
        options["speeds"] = _speeds(speeds)

    def work(watch: Watch) -> Remedies:
        watch.enter("simulating")
        with named_as({"speeds": "--speeds", "until": "--target"}):
            return gearrattle.remedies(
                driveline, **options, pairs=not singles, keep=keep, workers=workers, progress=watch
            )

    inputs = [model] if file is None else [model, file]
    emit("remedies", work, output, json=json, inputs=inputs, keeps_known=True)


def _speeds(words: str) -> Sequence[Any]:
    """Read a list of speeds."""
    from gearrattle.model.units import with_last_unit

    return [number_or_text(speed) for speed in with_last_unit(words.split(","))]
