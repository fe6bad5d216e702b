"""``gearrattle criteria``: the verdict on a saved motion."""

from __future__ import annotations

import sys
from pathlib import Path

from gearrattle.cli.options import Json


def criteria(run: Path, /, *, json: Json = False) -> None:
    """Judge a motion saved by "simulate", "run" or "stream": does it rattle, where, how badly?

    Parameters
    ----------
    run
        Saved motion (netCDF-4, .nc), or the folder of a "stream".
    """
    import gearrattle
    from gearrattle.calls.judge import criteria as judged
    from gearrattle.cli.columns import columns
    from gearrattle.errors import ModelError, Problem
    from gearrattle.json_types import json_text

    if run.suffix == ".toml":
        remedy = f"gearrattle run {run} simulates and judges a model"
        raise ModelError(Problem(str(run), "a model file", "a saved motion (.nc) is needed", remedy))
    verdict = judged(gearrattle.open_stream(run) if run.is_dir() else gearrattle.open_run(run))
    if json:
        print(json_text(verdict.to_dict()))
        return
    print(f"{verdict.verdict}: {verdict.sentence}")
    rows = [
        (
            part.name,
            part.regime,
            f"{part.impacts_per_cycle:.4g}",
            _number(part.max_approach_speed, part.speed_unit),
            _number(part.max_impact_energy, part.energy_unit),
            f"{100.0 * part.contact_share:.3g} %",
            _number(part.margin_db, "dB"),
        )
        for part in verdict.parts
    ]
    if rows:
        head = ("part", "regime", "impacts/cycle", "approach speed", "impact energy", "in contact", "margin")
        print(columns(head, rows))
    for note in verdict.notes:
        print(f"note: {note}", file=sys.stderr)


def _number(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{value:.4g} {unit}".removesuffix(" 1")
