"""Extremes, moments, exceeded levels and curves of a simulated motion between its samples, by quantity and name."""

from __future__ import annotations

import weakref
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.prescribed_motion import coordinates_of, free_names, free_of
from gearrattle.assembly.system import assemble
from gearrattle.derived_values import kept
from gearrattle.engine.system.exact_statistics import SampledMotion, Statistics, Walk, walk_of
from gearrattle.engine.system.flow import Flow, Pieces, flow_of
from gearrattle.engine.system.row_series import Rows, Series
from gearrattle.model import Model
from gearrattle.slices import slices
from gearrattle.trajectory import AXES, CASING_FORCE, Signal, Trajectory

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_DIRECTIONS = 64  # of half a turn, in which the components of a vector are looked at
_MOST_KEPT = 4_000_000  # numbers of a motion's states, 32 MB; longer motions are evaluated again for every call


@kept
def _engine(model: Model) -> tuple[Flow, dict[tuple[Pieces, float], Series]]:
    """The flow of a driveline, and the series of its regions computed so far."""
    return flow_of(assemble(model).system), {}


class Between:
    """Exact values of a trajectory between its samples (``trajectory.Exact``)."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self._walked: tuple[weakref.ref[Trajectory], Walk | None] | None = None
        self._told: dict[tuple[Any, ...], Statistics | None] = {}  # of the motion that was walked last

    def __reduce__(self) -> tuple[type[Between], tuple[Model]]:
        """Leave the cached walk out of copies and pickles; another process computes its own."""
        return Between, (self.model,)

    def signals(self, trajectory: Trajectory) -> tuple[Signal, ...]:
        """Return quantity and name of all signals that are known between samples.

        Accelerations and velocities of the bodies that are free, forces of all meshes, clearances and bearings, and
        the force on the casing.
        """
        layout = trajectory.layout
        names = [layout.inertia_names[i] for i in free_of(self.model)]
        meshes = dict(zip(layout.element_names, (layout.is_mesh & ~layout.is_bearing).tolist(), strict=True))
        forces = [name for name, is_mesh in meshes.items() if is_mesh or name in layout.clearance_names]
        moving = [(quantity, name) for quantity in ("velocity", "acceleration") for name in names]
        casing = [(CASING_FORCE, axis) for axis in AXES if layout.bearing_names]
        return (*moving, *(("force", name) for name in (*forces, *layout.bearing_names)), *casing)

    def statistics(
        self,
        trajectory: Trajectory,
        signals: Sequence[Signal],
        *,
        with_moments: BoolArray | bool = True,
        cycles: tuple[int, ...] | None = None,
    ) -> Statistics | None:
        """Return extremes and moments of some signals over the steady part of a motion.

        Parameters
        ----------
        with_moments
            whether moments are needed, for all signals or by signal (q,); otherwise they are NaN.
        cycles
            ends of consecutive windows, in cycles from the start of the steady part; None: one window, all of it.

        Returns
        -------
        Statistics | None
            (q,) in the order of the signals [SI], (windows, q) with ``cycles``; None if they would take too long
            (``system.exact_statistics``).
        """
        walk = self._walk(trajectory)
        if walk is None:
            return None
        key = tuple(signals), np.asarray(with_moments).tobytes(), cycles
        if key not in self._told:
            rows = self._rows(trajectory, signals)
            self._told[key] = walk.statistics(rows, with_moments=with_moments, cycles=cycles)
        return self._told[key]

    def values(self, trajectory: Trajectory, signals: Sequence[Signal], time: Array) -> Array | None:
        """Return (N, q) signals at times (N,) [s] of the steady part; None as in ``statistics``."""
        walk = self._walk(trajectory)
        begin = trajectory.first_cycle + trajectory.discard
        periods = time / trajectory.layout.period - begin
        return None if walk is None else walk.values(self._rows(trajectory, signals), periods)

    def exceeded(self, trajectory: Trajectory, signals: Sequence[Signal], share: float) -> Array | None:
        """Return (q,) the level that a signal's modulus exceeds for a share of the steady part; None as above."""
        walk = self._walk(trajectory)
        return None if walk is None else walk.exceeded(self._rows(trajectory, signals), share)

    def reach(self, trajectory: Trajectory, plane: tuple[Signal, Signal], centre: tuple[float, float]) -> float | None:
        """Return the largest distance from a centre of the vector that two signals are over the steady part.

        It is the largest component in 64 directions around it, so it may be 3e-4 of itself too small. None as in
        ``statistics``.
        """
        walk = self._walk(trajectory)
        if walk is None:
            return None
        angles = np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
        directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        components = self._rows(trajectory, plane)
        extremes = walk.statistics(lambda pieces: directions @ components(pieces), with_moments=False)
        if extremes is None:
            return None
        offset = directions @ np.array(centre)
        return float(np.maximum(extremes.high - offset, offset - extremes.low).max())

    def phase_curves(self, trajectory: Trajectory, elements: Sequence[str], cycles: int) -> Iterator[Array] | None:
        """Yield arrays (N, q, 2) of deflection and rate of elements over the last cycles of the steady part.

        The arrays are consecutive in time and computed one by one. None as in ``statistics``.
        """
        discard = trajectory.cycles - cycles
        is_all = discard == trajectory.discard
        walk = self._walk(trajectory) if is_all else self._new_walk(replace(trajectory, discard=discard))
        if walk is None:
            return None
        signals = [(quantity, name) for name in elements for quantity in ("deflection", "rate")]
        values = walk.curves(self._rows(trajectory, signals))
        return None if values is None else (piece.reshape(len(piece), len(elements), 2) for piece in values)

    def _rows(self, trajectory: Trajectory, signals: Sequence[Signal]) -> Rows:
        flow = _engine(self.model)[0]
        bodies = list(free_names(self.model))
        layout = trajectory.layout
        elements = [*layout.element_names, *layout.bearing_names]

        def rows(pieces: Pieces) -> Array:
            force = flow.force_rows(pieces)
            known: dict[str, tuple[Array, Sequence[str]]] = {
                "velocity": (flow.velocity, bodies),
                "acceleration": (flow.acceleration_rows(pieces), bodies),
                "deflection": (flow.deflection, elements),
                "rate": (flow.rate, elements),
                "force": (force, elements),
            }
            if layout.bearing_names:
                known["force"] = (np.concatenate([force, layout.bearing_rows @ force]), elements)
                known[CASING_FORCE] = (layout.casing_rows @ force, AXES)
            return np.array([known[kind][0][known[kind][1].index(name)] for kind, name in signals])

        return rows

    def _walk(self, trajectory: Trajectory) -> Walk | None:
        """The motion cut into parts; kept for the next call if its states have at most ``_MOST_KEPT`` numbers."""
        if self._walked is not None and self._walked[0]() is trajectory:
            return self._walked[1]
        self._told = {}
        walk = self._new_walk(trajectory)
        if walk is None or walk.path.samples.size < _MOST_KEPT:
            self._walked = weakref.ref(trajectory), walk
        return walk

    def _new_walk(self, trajectory: Trajectory) -> Walk | None:
        """The motion cut into parts."""
        flow, known = _engine(self.model)

        def series_of(pieces: Pieces, length: float) -> Series:
            key = pieces, length
            return known[key] if key in known else known.setdefault(key, Series.of(flow, pieces, length))

        return walk_of(flow, _path(self.model, flow, trajectory), series_of)


def exact_between(model: Model, trajectory: Trajectory) -> Trajectory:
    """Return a trajectory with exact values between its samples; only for the algorithm that can supply them."""
    known = trajectory.exact
    if trajectory.cost.algorithm != "exact" or (isinstance(known, Between) and known.model is model):
        return trajectory
    return replace(trajectory, exact=Between(model))


def _path(model: Model, flow: Flow, trajectory: Trajectory) -> SampledMotion:
    """Samples and crossings of a motion in the coordinates of the flow."""
    # pieces at the start, and crossings of corners
    t = trajectory
    first = trajectory.layout.region_of_first_piece
    period = trajectory.layout.period
    auxiliaries = trajectory.auxiliaries
    log = trajectory.events
    pieces = dict(zip(flow.system.places, (t.initial_region - first).tolist(), strict=False))
    begin = t.discard * t.samples_per_cycle
    memories = np.zeros((len(t.time), 0))
    time = log.time
    watch = log.clearance
    upward = (log.to_region > log.from_region).astype(np.int64)
    # friction and alternating stiffness: states, passages and memories
    if auxiliaries is not None:
        pieces |= dict(zip(flow.system.places[len(first) :], auxiliaries.initial.tolist(), strict=True))
        passages = auxiliaries.passages
        time = passages.time
        watch = passages.watch
        upward = passages.upward
        memories = auxiliaries.memory[:, list(flow.system.memories)] * flow.memory
    # samples of the judged part in the coordinates of the flow
    count = len(flow.system.laws) + len(flow.system.auxiliaries)
    samples = np.empty((len(t.time) - begin, flow.width))
    deflections = len(flow.coordinates.basis)
    moving = flow.states - flow.memory.size
    from_angle = flow.coordinates.basis.T * flow.scaling.deflection
    for part in slices(*samples.shape):
        rows = slice(begin + part.start, begin + part.stop)
        samples[part, :deflections] = coordinates_of(model, t, 0, rows) @ from_angle
        velocity = coordinates_of(model, t, 1, rows)
        np.multiply(velocity, flow.scaling.velocity, out=samples[part, deflections:moving])
        samples[part, moving : flow.states] = memories[rows]
    _write_inputs(flow, t, samples[:, flow.states :])
    # crossings in periods
    return SampledMotion(
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
    """Write scaled inputs (t, U + Q) at the samples of the window; only one period if they are periodic."""
    per_cycle = trajectory.samples_per_cycle
    before = trajectory.first_cycle * trajectory.samples_per_cycle
    waves = flow.waves(per_cycle) * flow.input_size
    alike = len(waves) == per_cycle
    if alike:
        for first in range(0, len(inputs), per_cycle):
            some = inputs[first : first + per_cycle, : flow.inputs]
            some[:] = waves[: len(some)]
    if alike and not flow.chain.size:
        return
    skipped = before + trajectory.discard * per_cycle
    for rows in slices(*inputs.shape):
        cycle, part = np.divmod(skipped + np.arange(rows.start, rows.stop), per_cycle)
        if alike:
            inputs[rows, flow.inputs :] = flow.chains_at(cycle, part / per_cycle)
        else:
            inputs[rows] = flow.inputs_at(cycle, part / per_cycle)
