"""Motions of one variant of a driveline from three starts: at rest, at the end of the motion before, and pushed.

Motions may coexist: a driveline that is quiet from rest may rattle after a tip-in. So a variant is simulated from three
starts, all by the model's own settings:

- *rest*: the start of the model file,
- *before*: the end of the motion of the neighbouring variant, on the side of the model's own value,
- *pushed*: the model's own start with all clearances set going, each at a speed that takes it across its gap in a
  sixteenth of a period, neighbours in opposite directions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble, is_driven_over_time, start_at, start_table
from gearrattle.model import Model
from gearrattle.results import Run
from gearrattle.signals import is_gap
from gearrattle.simulation.simulate import prepare, simulate
from gearrattle.studies.output import Output
from gearrattle.studies.outputs import values_of

REST = "rest"
BEFORE = "before"
PUSHED = "pushed"
STARTS = (REST, BEFORE, PUSHED)
EVENT = (REST,)
"""Starts of a driveline under ramps or a record of a torque: an event begins as it begins."""
_CROSSING = 1.0 / 16.0  # of a period, in which a push takes a clearance across its gap
State = Mapping[str, Sequence[float]]


@dataclass(frozen=True)
class Motion:
    """Motion of one variant from one start; ``end`` is its last state, as ``simulation.initial`` takes it."""

    start: str
    values: Mapping[str, NDArray[Any]]
    end: State


@dataclass(frozen=True)
class Asked:
    """Request of a motion.

    ``initial`` is the state in which it begins; None: that of the model, or, pushed, its pushed one. ``samples`` are
    those of a cycle; None: as many as the model says.
    """

    model: Model
    start: str
    initial: State | None
    outputs: Sequence[Output]
    samples: int | None


class Counter(Protocol):
    """Counts the parts of a motion that are done."""

    def add(self, part: float) -> None:
        """Count a part; what it raises ends the run."""


def moved_on(asked: Asked, counter: Counter | None = None) -> Motion:
    """Simulate a motion, and keep its outputs and its end."""
    last = 0.0

    def report(share: float) -> None:
        nonlocal last
        if counter is not None and share > last:
            counter.add(share - last)
            last = share

    initial = asked.initial
    if initial is None and asked.start == PUSHED:
        initial = pushed(asked.model)
    run = simulate(asked.model, initial=initial, samples_per_cycle=asked.samples, audit=False, progress=report)
    motion = Motion(asked.start, values_of(asked.outputs, run), _end_of(run))
    report(1.0)
    return motion


def _end_of(run: Run) -> State:
    return start_at(run.trajectory, -1)


def starts_of(model: Model) -> tuple[str, ...]:
    """Return the starts from which a driveline is simulated."""
    return EVENT if is_driven_over_time(model) else STARTS


def pushed(model: Model) -> State:
    """Return the pushed start of a model: its own angles, and speeds that take every gap across in a short time.

    Of all velocities with these rates it is the one that changes the model's own by the least kinetic energy.
    """
    driveline = assemble(model)
    layout = driveline.layout
    system = driveline.system
    task = prepare(model, {}, audit=False).task
    # rates of the gaps, neighbours in opposite directions
    gaps = [k for k in range(len(layout.clearance_names)) if is_gap(layout, k)]
    rows = system.rows[[int(layout.clearance[k]) for k in gaps]]
    widths = np.array([_gap(layout.corners[k]) for k in gaps])
    signs = (-1.0) ** np.arange(len(gaps))
    rates = signs * widths / (_CROSSING * layout.period)
    # the least change of the velocities that makes them
    weight = 1.0 / np.sqrt(system.inertia)
    velocity = task.velocity + weight * (np.linalg.pinv(rows * weight) @ rates)
    return start_table(model, task.angle, velocity)


def _gap(corners: NDArray[np.float64]) -> float:
    """Width of the piece around zero."""
    above = corners[corners > 0.0]
    below = corners[corners < 0.0]
    return float(above.min() - below.max()) if above.size and below.size else 0.0
