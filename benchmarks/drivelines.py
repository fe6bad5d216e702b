"""Drivelines to try forecasts on: the paper's and the examples', each with loads, speeds and gaps drawn anew.

Factors are log-uniform: torques' means 1/4 to 4, amplitudes 1/4 to 4, speed 1/2 to 2, clearances 1/2 to 2. Nothing is
selected; a seed gives the same drivelines everywhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

import gearrattle as gr
from gearrattle.model.balance import BALANCE

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
FILES = (
    "paper/case1.toml",
    "paper/case2.toml",
    "paper/case3.toml",
    "paper/case1_loaded.toml",
    "paper/case2_loaded.toml",
    "paper/case3_loaded.toml",
    "paper/eight_dof.toml",
    "manual_transmission.toml",
    "driveline_lash.toml",
)
EACH = 5


def drawn(seed: int = 1995, bodies: int = EACH) -> Iterator[tuple[str, gr.Model]]:
    """Yield ``each`` variants of every file, with a name; the first is the file as it is."""
    for number, file in enumerate(FILES):
        model = gr.load(EXAMPLES / file)
        yield Path(file).stem, model
        for i in range(1, bodies):
            yield f"{Path(file).stem} {i}", model.with_(changes(model, np.random.default_rng([seed, i, number])))


def changes(model: gr.Model, rng: np.random.Generator) -> dict[str, float]:
    """Draw new loads, speed and gaps for a model, by the paths of its file."""

    def factor(largest: float) -> float:
        return float(largest ** rng.uniform(-1.0, 1.0))

    mean, amplitude = factor(4.0), factor(4.0)
    changed: dict[str, float] = {}
    tables = model.to_tables()
    speed = tables["excitation"]
    key = "speed" if "speed" in speed else "frequency"
    changed[f"excitation.{key}"] = _number(speed[key]) * factor(2.0)
    for i, torque in enumerate(tables.get("torque", [])):
        if torque.get("mean") and torque["mean"] != BALANCE:  # it follows from the drags
            changed[f"torque.{i}.mean"] = _number(torque["mean"]) * mean
        for j, harmonic in enumerate(torque.get("harmonics", [])):
            changed[f"torque.{i}.harmonics.{j}.amplitude"] = _number(harmonic["amplitude"]) * amplitude
    for kind, gap in (("coupling", "clearance"), ("mesh", "backlash")):
        for element in tables.get(kind, []):
            if element.get(gap):
                changed[f"{kind}.{element['name']}.{gap}"] = _number(element[gap]) * factor(2.0)
    return changed


def _number(value: object) -> float:
    assert isinstance(value, float | int), value
    return float(value)
