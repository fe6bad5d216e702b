"""The output "sound level": the level that ``listen`` tells of the impacts of all gear meshes with backlash.

The path is the assumed casing unless the output names modes of another one (``signals.impact_sound``). A motion whose
meshes have no impact is silent: it has no level.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.results import Run
from gearrattle.signals import reduced_inertia
from gearrattle.signals.impact_sound import (
    ASSUMED,
    CASING,
    LONGEST,
    RATE,
    SoundPath,
    impact_pressure,
    modal_path,
    pressure_level,
)
from gearrattle.signals.windows import steady
from gearrattle.studies.output import SOUND, Modes, Output
from gearrattle.trajectory import Layout

SOUND_LEVEL = "sound level"
UNIT = "dB"


def known_sound_output(model: Model, layouts: Sequence[Layout]) -> dict[str, Output]:
    """Return the output by its name; nothing of a model without seconds, or without a mesh that can be heard."""
    if model.units != "SI" or not any(audible_meshes(layout) for layout in layouts):
        return {}
    return {SOUND_LEVEL: Output(SOUND_LEVEL, "", (), (UNIT,), criterion=SOUND, lacking="no impact of a gear mesh")}


def audible_meshes(layout: Layout) -> list[int]:
    """Return the meshes with backlash whose impacts exchange a momentum, as indices into ``Layout.clearance``."""
    return [
        k
        for k, element in enumerate(layout.clearance.tolist())
        if layout.is_mesh[element] and not layout.is_bearing[element] and np.isfinite(reduced_inertia(layout, element))
    ]


def sound_level(run: Run, modes: Modes) -> float:
    """Return the level of a run [dB re 20 uPa]; NaN for silence. ModelError: it is too long to be heard."""
    seconds = steady(run.trajectory).duration
    if seconds > LONGEST:
        rule = f"a motion whose sound level is an output may last {LONGEST:g} s"
        raise ModelError(Problem("simulation.cycles", f"{seconds:.4g} s", rule, "simulate fewer cycles"))
    level = pressure_level(impact_pressure(run.trajectory, audible_meshes(run.trajectory.layout), casing_path(modes)))
    return level if level > -np.inf else float("nan")


@lru_cache(maxsize=4)
def casing_path(modes: Modes) -> SoundPath:
    """Return the path of modes: frequency [Hz], damping ratio, gain [Pa/(N s)]; none: the assumed casing."""
    return modal_path(modes or CASING, float(RATE), "own modes" if modes else ASSUMED)
