"""The output "sound level": the level that ``listen`` tells of a motion.

Of a driveline with bearings to the housing that is the level of the force on the casing, of another that of the impacts
of all gear meshes with backlash. The path is the assumed casing unless the output names modes of another one
(``signals.impact_sound``). A motion whose meshes have no impact is silent: it has no level.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.results import Run
from gearrattle.signals import reduced_inertia
from gearrattle.signals.casing_sound import FROM_CASING, casing_pressure, source_of
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
from gearrattle.signals.sound_loop import RATE as LOOP_RATE
from gearrattle.signals.sound_loop import SAMPLES as LOOP_SAMPLES
from gearrattle.signals.sound_loop import loop_of
from gearrattle.signals.windows import steady
from gearrattle.studies.output import SOUND, Modes, Output
from gearrattle.trajectory import Layout

Array = NDArray[Any]

SOUND_LEVEL = "sound level"
SOUND_LOOP = "sound loop"
"""Output: a short part of the sound, which repeats without a click (``signals.sound_loop``)."""
LOOP_SAMPLE = "sound sample"
"""Dimension of that: the time of a sample [s]."""
UNIT = "dB"


def known_sound_output(model: Model, layouts: Sequence[Layout]) -> dict[str, Output]:
    """Return the output by its name; nothing of a model without seconds, or without a mesh that can be heard."""
    if model.units != "SI":
        return {}
    from_casing = all(source_of(layout) == FROM_CASING for layout in layouts)
    if not from_casing and not any(audible_meshes(layout) for layout in layouts):
        return {}
    lacking = "" if from_casing else "no impact of a gear mesh"
    times = tuple((np.arange(LOOP_SAMPLES) / LOOP_RATE).tolist())
    loop = Output(SOUND_LOOP, LOOP_SAMPLE, times, ("Pa",) * len(times), criterion=SOUND, stored_as="float32")
    return {SOUND_LEVEL: Output(SOUND_LEVEL, "", (), (UNIT,), criterion=SOUND, lacking=lacking), SOUND_LOOP: loop}


def audible_meshes(layout: Layout) -> list[int]:
    """Return the meshes with backlash whose impacts exchange a momentum, as indices into ``Layout.clearance``."""
    return [
        k
        for k, element in enumerate(layout.clearance.tolist())
        if layout.is_mesh[element] and not layout.is_bearing[element] and np.isfinite(reduced_inertia(layout, element))
    ]


def sounds_of(run: Run, outputs: Sequence[Output]) -> dict[str, Array]:
    """Return the outputs of a run's sound, all through one path.

    The level [dB re 20 uPa] is NaN for silence. ModelError: the run is too long to be heard.
    """
    if not outputs:
        return {}
    seconds = steady(run.trajectory).duration
    if seconds > LONGEST:
        rule = f"a motion whose sound level is an output may last {LONGEST:g} s"
        raise ModelError(Problem("simulation.cycles", f"{seconds:.4g} s", rule, "simulate fewer cycles"))
    # sound pressure
    path = casing_path(outputs[0].modes)
    layout = run.trajectory.layout
    if source_of(layout) == FROM_CASING:
        pressure, _ = casing_pressure(run.trajectory, path)
    else:
        pressure = impact_pressure(run.trajectory, audible_meshes(layout), path)
    # its level, and a loop of it
    level = pressure_level(pressure)
    values = {SOUND_LEVEL: np.array(level if level > -np.inf else np.nan)}
    if any(output.name == SOUND_LOOP for output in outputs):
        values[SOUND_LOOP] = loop_of(pressure, path.rate, layout.period).astype(np.float32)
    return values


@lru_cache(maxsize=4)
def casing_path(modes: Modes) -> SoundPath:
    """Return the path of modes: frequency [Hz], damping ratio, gain [Pa/(N s)]; none: the assumed casing."""
    return modal_path(modes or CASING, float(RATE), "own modes" if modes else ASSUMED)
