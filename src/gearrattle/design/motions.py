"""Motions of one variant of a driveline from three starts: at rest, from a neighbouring variant, and after a push.

Motions may coexist: a driveline that is quiet from rest may rattle after a tip-in. So a variant is simulated from three
starts, with the model's own settings:

- *rest*: the start of the model file,
- *before*: the final state of the neighbouring variant, on the side of the model's own value,
- *pushed*: the model's own start, with a speed in every clearance that takes it across its gap in a sixteenth of a
  period, in opposite directions for neighbours.
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
"""Starts of a driveline under ramps or a record of a torque: an event has only its own start."""
_CROSSING = 1.0 / 16.0  # share of a period in which a push takes a clearance across its gap
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

    ``initial`` is the initial state; None: that of the model, or the pushed one if ``start`` is PUSHED. ``samples`` is
    the number of samples in a cycle; None: the number in the model.
    """

    model: Model
    start: str
    initial: State | None
    outputs: Sequence[Output]
    samples: int | None


class Counter(Protocol):
    """Counts finished parts of a motion."""

    def add(self, part: float) -> None:
        """Count a part; an exception ends the run."""


def moved_on(asked: Asked, counter: Counter | None = None) -> Motion:
    """Simulate a motion; return its outputs and its final state."""
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
    """Return the pushed start of a model: its own angles, with velocities that cross every gap in a short time.

    Of all velocities with these rates of the gaps, it takes those whose change has the least kinetic energy.
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
    # the least change of the velocities that gives these rates
    weight = 1.0 / np.sqrt(system.inertia)
    velocity = task.velocity + weight * (np.linalg.pinv(rows * weight) @ rates)
    return start_table(model, task.angle, velocity)


def _gap(corners: NDArray[np.float64]) -> float:
    """Width of the piece around zero."""
    above = corners[corners > 0.0]
    below = corners[corners < 0.0]
    return float(above.min() - below.max()) if above.size and below.size else 0.0
