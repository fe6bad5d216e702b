"""``gearrattle simulate``: the motion alone."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from gearrattle.cli.options import Json, Settings
from gearrattle.wording import counted

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.results import Run

_DEFAULTS = Settings()
_ENDINGS = (".nc", ".csv")


def simulate(
    model: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    settings: Settings = _DEFAULTS,
    json: Json = False,
) -> None:
    """Simulate a model and save the motion.

    Parameters
    ----------
    model
        Model file (TOML).
    output
        File for the motion, ending in .nc (netCDF-4: everything) or .csv (the samples); default: nothing is saved.
    """
    import gearrattle
    from gearrattle.cli.background import watched
    from gearrattle.cli.columns import columns
    from gearrattle.errors import ModelError, Problem
    from gearrattle.json_types import json_text
    from gearrattle.writing import Staging

    if output is not None and output.suffix not in _ENDINGS:
        raise ModelError(Problem("-o", f'"{output}"', "must end in .nc or .csv"))
    if output is not None and output.is_dir():
        raise ModelError(Problem("-o", f'"{output}"', "is a folder; a file is needed"))
    driveline = gearrattle.load(model)

    def work(watch: Watch) -> Run:
        computed = gearrattle.simulate(driveline, **settings.arguments(), progress=watch)
        if staging is not None and output is not None:
            watch.enter("saving")
            computed.save(staging.path / output.name)
        return computed

    staging: Staging | None = None
    if output is None:
        run = watched(work)
    else:
        with Staging(output.parent) as staging:
            run = watched(work)
            staging.commit()
    for note in run.notes:
        print(f"note: {note}", file=sys.stderr)
    content = _content(run, output)
    if json:
        print(json_text(content))
        return
    rows = [(name, str(number)) for name, number in content["crossings"].items()]
    print(columns(("clearance", "crossings"), rows))
    cost = run.cost
    cycles, steps = counted(run.trajectory.cycles, "cycle"), counted(cost.steps, "step")
    print(f"{cycles} by {cost.algorithm}: {steps} in {cost.wall_time:.3g} s")
    if output is not None:
        print(f"saved: {output}")


def _content(run: Run, output: Path | None) -> dict[str, Any]:
    """Say what came out, in JSON types."""
    from gearrattle.json_types import json_value

    trajectory = run.trajectory
    names = trajectory.layout.clearance_names
    return {
        "model": run.model.name,
        "cycles": trajectory.cycles,
        "discard": trajectory.discard,
        "samples_per_cycle": trajectory.samples_per_cycle,
        "period": trajectory.layout.period,
        "crossings": {name: int((trajectory.events.clearance == k).sum()) for k, name in enumerate(names)},
        "cost": json_value(asdict(run.cost)),
        "notes": list(run.notes),
        "output": None if output is None else str(output),
    }
