"""``exact`` for large drivelines: a sweep of Taylor windows without regions, in which every clearance is searched.

The loop is ``kernels.window_march``. It has the accuracy of the march by tables; its time grows with the number of
elements and not with its square, and its memory does not grow with the number of visited regions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.derived_values import kept
from gearrattle.engine.kernels import march_arrays
from gearrattle.engine.kernels._jit import vectorised
from gearrattle.engine.kernels.network_series import Driveline
from gearrattle.engine.kernels.variant_arrays import Crossings
from gearrattle.engine.kernels.window_march import SIZE, WINDOW, Sweep, SweepBuffers, sweep_on
from gearrattle.engine.solvers.samples_in_si import (
    StepLimit,
    chatters,
    crossings_of,
    doubled,
    empty_log,
    fastest_of,
    first_of,
    sampled_quantities,
)
from gearrattle.engine.solvers.solver import Motion, Position, Task
from gearrattle.engine.solvers.start_region import starting_pieces
from gearrattle.engine.solvers.window_audit import SweepAuditor
from gearrattle.engine.system.flow import Flow, flow_of, split_cycles
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.plain_arrays import laws_of
from gearrattle.engine.system.sparse_arrays import Majorant, near_of, network_of, windows_of
from gearrattle.outcome import Outcome
from gearrattle.slices import slices

Array = NDArray[np.float64]

_BUDGET = 5_000  # most windows and crossings per slice
_COLUMNS = 500_000  # most columns of the table over all windows of a slice: some tenths of a second
MOST_CORRECTED = 16  # most crossings in a window before its polynomials are computed again


@dataclass(frozen=True)
class Plan:
    """Data of a driveline that do not depend on a run."""

    flow: Flow
    driveline: Driveline


@kept
def plan_of(system: PiecewiseSystem) -> Plan:
    """Lay out a system."""
    flow = flow_of(system)
    bound = Majorant(system)
    windows = windows_of(system, bound)
    laws = [system.laws[k] for k in system.clearances]
    scaled = np.array([march_arrays.BAND if np.any(law.corners != 0.0) else 0.0 for law in laws])
    driveline = Driveline(
        network=network_of(flow, windows),
        laws=laws_of(system.laws),
        near=near_of(flow, bound, system.inputs.period / windows),
        band=scaled * flow.corner_scale,
        inputs=_inputs(flow),
        windows=windows,
    )
    return Plan(flow, driveline)


def _inputs(flow: Flow) -> march_arrays.Inputs:
    """Inputs without knots and without tables."""
    inputs = flow.system.inputs
    high, low = split_cycles(inputs.cycles)
    none = np.zeros(0)
    rows = np.zeros((0, 0))
    return march_arrays.Inputs(
        cycles_high=high,
        cycles_low=low,
        frequency=flow.frequency,
        scale=np.ones(1 + inputs.count),
        steps=none,
        knot_cycle=none,
        knot_fraction=none,
        chains=rows[None],
        fourth=rows,
        pace=0.0,
        links=1,
        turn_cosine=rows,
        turn_sine=rows,
    )


class SweepMarch:
    """A run of the sweep under way (see ``solver.Marching``)."""

    def __init__(self, task: Task) -> None:
        # the plan: windows, network and neighbourhoods
        self._sweep_on = vectorised(sweep_on)
        self.task = task
        self.plan = plan_of(task.system)
        self.flow = self.plan.flow
        flow = self.flow
        system = task.system
        # the state in the scales of the flow, and the pieces it starts in
        scaling = flow.scaling
        clearances = list(system.clearances)
        basis = flow.coordinates.basis @ task.angle
        z = np.concatenate(
            [basis * scaling.deflection, task.velocity * scaling.velocity, flow.inputs_at(np.zeros(1), np.zeros(1))[0]]
        )
        pieces, side = starting_pieces(flow, z, task.angle)
        self.initial = np.array([pieces[k] for k in clearances], dtype=np.int64)
        # columns of the table: deflections, velocities, force integrals, angles of the references
        deflection = np.zeros(len(system.laws))
        deflection[list(flow.coordinates.elements)] = basis
        columns = np.concatenate(
            [deflection, task.velocity, np.zeros(len(clearances)), task.angle[list(flow.coordinates.references)]]
        )
        self.sweep = _sweep(self.plan, pieces, side, columns)
        self.buffers = _buffers(self.plan, columns.size)
        # samples, the first one taken already
        count = task.cycles * task.samples_per_cycle + 1
        self.samples = march_arrays.Samples(
            task.samples_per_cycle,
            0,
            np.zeros((count, columns.size)),
            np.zeros((count, len(clearances)), np.int64),
            flow.waves(task.samples_per_cycle),
        )
        self.samples.states[0] = columns
        self.samples.pieces[0] = self.initial
        self.sweep.counts[march_arrays.SAMPLE] = 1
        self.log = empty_log()
        self._limit = StepLimit(system)
        self.auditor: SweepAuditor | None = None

    def advance(self) -> Outcome:
        """March one slice, then audit slice by slice."""
        if self.auditor is not None:
            return Outcome.DONE if self.auditor.advance() else Outcome.SLICE_SPENT
        outcome = self._march()
        if outcome is Outcome.DONE and self.task.audit:
            self.auditor = SweepAuditor(self.flow, self.plan.driveline, self.samples, self._crossings())
            return Outcome.SLICE_SPENT
        return outcome

    def _march(self) -> Outcome:
        """March one slice; grow the log where the kernel asks for it."""
        # one slice of the compiled loop
        budget = min(_BUDGET, max(10, _COLUMNS // self.sweep.table.shape[1]))
        outcome = Outcome(self._sweep_on(self.plan.driveline, self.sweep, self.samples, self.log, self.buffers, budget))
        # a larger log, or a run that goes on without end
        if outcome is Outcome.LOG_FULL:
            self.log = doubled(self.log)
            return Outcome.SLICE_SPENT
        if outcome is Outcome.SLICE_SPENT:
            if chatters(self.log, int(self.sweep.counts[march_arrays.EVENTS]), self._now()):
                return Outcome.CHATTER
            if self._limit.is_exceeded(int(self.sweep.counts[march_arrays.STEPS]), self._now()):
                return Outcome.NO_PROGRESS
        return outcome

    def _now(self) -> float:
        """Time in periods."""
        counts = self.sweep.counts
        return float(
            counts[march_arrays.CYCLE] + (counts[WINDOW] + self.sweep.clock.sum()) / self.plan.driveline.windows
        )

    def fraction(self) -> float:
        """Samples stored, as a fraction of all; with an audit to follow, half of the work each."""
        marched = float(self.sweep.counts[march_arrays.SAMPLE] / len(self.samples.pieces))
        if not self.task.audit:
            return marched
        return 0.5 * marched if self.auditor is None else 0.5 + 0.5 * self.auditor.fraction()

    def position(self) -> Position:
        """Time, deflections and the last clearance crossed."""
        count = int(self.sweep.counts[march_arrays.EVENTS])
        now = self.sweep.clock[1]
        states = np.polynomial.polynomial.polyval(now, self.sweep.table)
        whole = self._now()
        samples = self._states(states[None])
        u = self.flow.inputs_at(np.array([whole // 1.0]), np.array([whole % 1.0]))
        z = np.hstack([samples[:, : self.flow.states], u])[0]
        deflection = self.flow.deflection[list(self.flow.system.clearances)] @ z
        last = int(self.log.clearance[count - 1]) if count else None
        pieces = [0] * len(self.flow.system.laws)
        for k, piece in zip(self.flow.system.clearances, self.sweep.piece, strict=True):
            pieces[k] = int(piece)
        return Position(whole * self.flow.system.inputs.period, deflection, last, fastest_of(self.flow.system, pieces))

    def _states(self, columns: Array) -> Array:
        """(t, N + R + K) scaled states, reference angles and force integrals, from columns of the table."""
        flow = self.flow
        m = len(self.flow.system.laws)
        n = self.flow.system.size
        elements = list(flow.coordinates.elements)
        carried = m + n + len(flow.system.clearances)
        out = np.empty((len(columns), len(elements) + columns.shape[1] - m))
        for part in slices(*columns.shape):
            x = columns[part, elements] * flow.scaling.deflection
            v = columns[part, m : m + n] * flow.scaling.velocity
            out[part] = np.hstack([x, v, columns[part, carried:], columns[part, m + n : carried]])
        return out

    def stored(self) -> march_arrays.Samples:
        """The samples, with scaled states as of the march through tables."""
        return self.samples._replace(states=self._states(self.samples.states))

    def logged(self) -> march_arrays.Log:
        """The crossings so far, in the order in which they came, with rates as of the march through tables."""
        log = first_of(self.log, int(self.sweep.counts[march_arrays.EVENTS]))
        return log._replace(rate=log.rate / self.flow.corner_scale[log.clearance])

    def motion(self) -> Motion:
        """Sampled states turned into angles, accelerations and forces."""
        task = self.task
        counts = self.sweep.counts
        period = self.flow.system.inputs.period
        samples = self.stored()
        sampled, _ = sampled_quantities(self.flow, samples)
        steps = int(counts[march_arrays.STEPS])
        expansions = int(counts[march_arrays.EXPANSIONS])
        step = task.cycles * period / max(steps, 1)
        return Motion(
            **sampled,
            crossings=self._crossings(),
            initial_piece=self.initial,
            final_force_integral=samples.states[-1, self.flow.states + len(self.flow.coordinates.references) :].copy(),
            steps=steps,
            function_calls=expansions,
            average_step=step,
            average_trial_step=step,
            energy=None if self.auditor is None else self.auditor.result(),
        )

    def _crossings(self) -> Crossings:
        return crossings_of(self.flow, self.logged())


def _sweep(plan: Plan, pieces: tuple[int, ...], side: NDArray[np.int64], columns: Array) -> Any:
    """The sweeper at the start."""
    system = plan.flow.system
    clearances = list(plan.flow.system.clearances)
    table = np.zeros((march_arrays.ORDER + 1, columns.size))
    table[0] = columns
    laws = [(law.stiffness[p], law.damping[p], law.offset[p]) for law, p in zip(system.laws, pieces, strict=True)]
    stiffness, damping, offset = np.array(laws, dtype=float).reshape(-1, 3).T.copy()
    count = len(clearances)
    return Sweep(
        most=MOST_CORRECTED,
        counts=np.zeros(SIZE, np.int64),
        clock=np.zeros(2),
        table=table,
        errors=np.zeros((march_arrays.ORDER + 2, plan.driveline.network.erring.size)),
        reach=np.zeros(len(system.laws)),
        piece=np.array([pieces[k] for k in clearances], dtype=np.int64),
        stiffness=stiffness,
        damping=damping,
        offset=offset,
        side=side,
        exit=np.full(count, 2.0),
        upward=np.zeros(count, np.int64),
        rate=np.zeros(count),
    )


def _buffers(plan: Plan, columns: int) -> Any:
    """Scratch."""
    system = plan.flow.system
    orders = march_arrays.ORDER + 1
    elements = int(np.diff(plan.driveline.near.element_start).max(initial=0))
    inertias = int(np.diff(plan.driveline.near.inertia_start).max(initial=0))
    lengths = {
        "y": columns,
        "u": 1 + 2 * system.inputs.count,
        "waves": (orders + 1, 2 * system.inputs.count),
        "force": len(system.laws),
        "pull": len(system.laws) + system.size,
        "load": plan.driveline.network.driven.size,
        "jump": orders - 1,
        "matrix": (orders, orders),
        "laws": (2, elements),
        "moved": (orders, 2 * elements),
        "turned": (orders, inertias + 1),
        "row": max(2 * elements, inertias + 1),
        "whole": orders,
        "gap": orders,
    }
    return SweepBuffers(**{name: np.zeros(length) for name, length in lengths.items()})
