"""Extremes and moments of a simulated motion between its samples (``system.statistics``), by quantity and name.

Takes a Model and a Trajectory of the exact algorithm; gives Statistics of accelerations, velocities and mesh forces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.prescribed import free_names, free_of
from gearrattle.assembly.system import assemble
from gearrattle.model import Model
from gearrattle.system.flow import Flow, Pieces, flow_of
from gearrattle.system.statistics import Path, Statistics, statistics_of
from gearrattle.trajectory import Signal, Trajectory

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


def exact_signals(model: Model, trajectory: Trajectory) -> tuple[Signal, ...]:
    """Return quantity and name of everything whose statistics are known between samples.

    Accelerations and velocities of the bodies that are free, forces of all meshes and clearances.
    """
    layout, names = trajectory.layout, free_names(model)
    forces = [
        name for k, name in enumerate(layout.element_names) if bool(layout.is_mesh[k]) or name in layout.clearance_names
    ]
    moving = [(quantity, name) for quantity in ("velocity", "acceleration") for name in names]
    return (*moving, *(("force", name) for name in forces))


def exact_statistics(
    model: Model, trajectory: Trajectory, signals: Sequence[Signal], *, with_moments: BoolArray | bool = True
) -> Statistics | None:
    """Return extremes and moments of some signals over the steady part of a motion.

    Args:
        model: the driveline.
        trajectory: a motion of the exact algorithm, with its log.
        signals: quantity and name of each, among ``exact_signals``.
        with_moments: whether moments are wanted, of all signals or of each (q,); without, they are NaN.

    Returns:
        (q,) in the order of the signals [SI]; None where they would take too long (``statistics_of``).
    """
    flow = flow_of(assemble(model))
    bodies, elements = list(free_names(model)), list(trajectory.layout.element_names)

    def rows(pieces: Pieces) -> Array:
        of = {"velocity": flow.velocity, "acceleration": flow.acceleration_rows(pieces)}
        force = flow.force_rows(pieces)
        return np.array(
            [force[elements.index(name)] if kind == "force" else of[kind][bodies.index(name)] for kind, name in signals]
        )

    return statistics_of(flow, _path(model, flow, trajectory), rows, with_moments=with_moments)


@dataclass(frozen=True)
class Between:
    """What a trajectory of the exact algorithm can tell between its samples (``trajectory.Exact``).

    Attributes:
        model: the driveline.
    """

    model: Model

    def signals(self, trajectory: Trajectory) -> tuple[Signal, ...]:
        """Return ``exact_signals``."""
        return exact_signals(self.model, trajectory)

    def statistics(
        self, trajectory: Trajectory, signals: Sequence[Signal], *, with_moments: BoolArray | bool = True
    ) -> Statistics | None:
        """Return ``exact_statistics``."""
        return exact_statistics(self.model, trajectory, signals, with_moments=with_moments)


def exact_between(model: Model, trajectory: Trajectory) -> Trajectory:
    """Return a trajectory that can tell what the motion does between its samples; itself by any other algorithm."""
    known = trajectory.exact
    if trajectory.cost.algorithm != "exact" or (isinstance(known, Between) and known.model is model):
        return trajectory
    return replace(trajectory, exact=Between(model))


def _path(model: Model, flow: Flow, trajectory: Trajectory) -> Path:
    """The motion in the coordinates of the flow."""
    t, first, period = trajectory, trajectory.layout.region_of_first_piece, trajectory.layout.period
    free, beside, log = free_of(model), trajectory.companions, trajectory.events
    pieces = dict(zip(flow.system.places, (t.initial_region - first).tolist(), strict=False))
    window = slice(t.discard * t.samples_per_cycle, None)
    memories = np.zeros((len(t.time), 0))
    time, watch, upward = log.time, log.clearance, (log.to_region > log.from_region).astype(np.int64)
    if beside is not None:
        pieces |= dict(zip(flow.system.places[len(first) :], beside.initial.tolist(), strict=True))
        time, watch, upward = beside.time, beside.watch, beside.upward
        memories = beside.stretch[:, list(flow.system.memories)] * flow.memory
    count = len(flow.system.laws) + len(flow.system.companions)
    angle, velocity = t.angle[window], t.velocity[window]
    if len(free) < angle.shape[1]:
        angle, velocity = angle[:, free], velocity[:, free]
    samples = np.empty((len(angle), flow.width))
    deflections, moving = len(flow.coordinates.basis), flow.states - flow.memory.size
    samples[:, :deflections] = angle @ (flow.coordinates.basis.T * flow.scaling.deflection)
    np.multiply(velocity, flow.scaling.velocity, out=samples[:, deflections:moving])
    samples[:, moving : flow.states] = memories[window]
    _write_inputs(flow, t, samples[:, flow.states :])
    return Path(
        tuple(int(pieces.get(k, 0)) for k in range(count)),
        samples,
        t.samples_per_cycle,
        t.discard * t.samples_per_cycle,
        time / period - t.first_cycle,
        watch,
        upward,
        t.first_cycle,
    )


def _write_inputs(flow: Flow, trajectory: Trajectory, inputs: Array) -> None:
    """Write scaled inputs (t, U + Q) at the samples of the window: those of one period, where all are alike."""
    per_cycle, before = trajectory.samples_per_cycle, trajectory.first_cycle * trajectory.samples_per_cycle
    waves = flow.waves(per_cycle) * flow.input_size
    alike = len(waves) == per_cycle
    if alike:
        for first in range(0, len(inputs), per_cycle):
            some = inputs[first : first + per_cycle, : flow.inputs]
            some[:] = waves[: len(some)]
    if alike and not flow.chain.size:
        return
    cycle, part = np.divmod(before + np.arange(trajectory.discard * per_cycle, len(trajectory.time)), per_cycle)
    if alike:
        inputs[:, flow.inputs :] = flow.chains_at(cycle, part / per_cycle)
    else:
        inputs[:] = flow.inputs_at(cycle, part / per_cycle)
