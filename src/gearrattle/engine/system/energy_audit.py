"""The energy audit: the balance of works, losses and stored energy along a motion.

    d/dt [ v.J v / 2 + sum_k U_k(delta_k) ] = sum_i T_i v_i - sum_i D_i v_i^2 - sum_k L_k delta_k' - sum_k F_k e_k'

with U_k the elastic potential, L_k = F_k - dU_k/d delta_k the force of the element beyond its elastic force (c_k
delta_k' for a law alone), and the last sum the work of the transmission errors. A slider's spring stores s e^2 / 2,
which is lost when the slider is released. Every term on the right is a product of two linear forms of the state z. Its
integral follows from the integral of z z' over the time in every region (``system.state_moments``), which is computed
on dense output, interval by interval between crossings and samples that are at least a long step apart. The left side
follows from the sampled states at both ends. The two sides share no formula: a wrong table, a missed crossing or a
wrong region makes a residual. Inputs over time, which z represents by polynomials, are counted as specified: the power
of the difference is integrated with three nodes per interval of the polynomials, so a wrong polynomial makes a residual
too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels._jit import vectorised
from gearrattle.engine.kernels.march_arrays import step_of
from gearrattle.engine.kernels.quadrature import ALL_TERMS, FEW_TERMS, Moves, Room, integrate_moments
from gearrattle.engine.system.flow import Flow, Pieces
from gearrattle.engine.system.law import PiecewiseLaw
from gearrattle.engine.system.piecewise_signals import INNER, INNER_WEIGHTS, Signals
from gearrattle.engine.system.region import finest_level, strips
from gearrattle.engine.system.state_moments import NODES, NODES_WITH_SIGNALS, Steps

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

LONG = 4
"""Finest steps in a long step."""
MOST_STEPS = 1e6
"""Most steps in an interval; an audit with more is refused."""
_UNCUT = 1e-9  # share of an interval below which a difference is rounding
SLICE = 5e7
"""Multiplications per slice: some tenths of a second, because Ctrl-C takes effect between slices."""
TOGETHER = 2048
"""Most intervals in a partial sum: partial sums reduce rounding."""


@dataclass(frozen=True)
class EnergyAudit:
    """Works and losses of a motion [J]."""

    # (n,) work of the torques on every inertia that is a degree of freedom, mean drag torques included
    torque_work: Array
    error_work: Array  # (m,) work of every transmission error, and of prescribed motions through every element
    drag_loss: Array  # (n,) viscous drag
    # (m,) damping and friction of every element, and what a stiffness that alternates takes; negative where that gives
    # more
    element_loss: Array
    stored: tuple[float, float]  # energy at the start and at the end
    # (m,) the share of the element_loss that dry friction took; empty in files of earlier versions
    friction_loss: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def residual(self) -> float:
        """Energy that the balance does not explain: gained, or lost if negative."""
        gained = self.torque_work.sum() + self.error_work.sum()
        lost = self.drag_loss.sum() + self.element_loss.sum()
        return float(self.stored[1] - self.stored[0] - gained + lost)

    @property
    def turnover(self) -> float:
        """The reference of the residual: the sum of all moduli of works and losses, and of the energy stored."""
        parts = (self.torque_work, self.error_work, self.drag_loss, self.element_loss)
        return float(np.abs(np.concatenate(parts)).sum() + max(abs(energy) for energy in self.stored))

    @property
    def relative_residual(self) -> float:
        """|residual| / turnover; 0 for a motion without any energy."""
        return abs(self.residual) / self.turnover if self.turnover > 0.0 else 0.0


def stored_energy(flow: Flow, deflection: Array, velocity: Array) -> float:
    """Kinetic and elastic energy; deflections (m,) of every element, velocities (n,) [SI]."""
    kinetic = 0.5 * float(flow.system.inertia @ velocity**2)
    return kinetic + sum(_potential(law, float(d)) for law, d in zip(flow.system.laws, deflection, strict=True))


def _sliders(flow: Flow) -> Array:
    """(auxiliaries,) half the stiffness of every slider's spring."""
    return np.array([0.5 * auxiliary.memory.max() for auxiliary in flow.system.auxiliaries])


def _potential(law: PiecewiseLaw, deflection: float) -> float:
    """Elastic energy: the force integrated from zero, piece by piece."""
    low = min(0.0, deflection)
    high = max(0.0, deflection)
    ends = np.concatenate([[low], law.corners[(law.corners > low) & (law.corners < high)], [high]])
    middle = 0.5 * (ends[:-1] + ends[1:])
    area = float(np.diff(ends) @ [law.elastic(float(d)) for d in middle])
    return area if deflection >= 0.0 else -area


class Auditor:
    """An audit under way: works in slices, so that a long one shows progress and can be cancelled."""

    def __init__(
        self,
        flow: Flow,
        initial: Pieces,
        *,
        samples: Callable[[IntArray], Array],
        count: int,
        per_cycle: float,
        time: Array,
        watch: IntArray,
        upward: IntArray,
        memory: Array,
        first_cycle: int = 0,
    ) -> None:
        """Prepare the audit of a motion.

        initial: piece of every element and auxiliary at the start.
        samples: returns (t, Z) states z of the samples at some indices; sample i is taken at i / per_cycle periods.
        count: number of samples.
        per_cycle: samples per period.
        time, watch, upward: (E,) crossing times in periods, watched quantity, 1 for its upper bound.
        memory: (E, S) memories before each crossing, scaled.
        first_cycle: whole periods before the first sample.
        """
        # regions visited, their rates and their finest steps
        self.flow = flow
        self.samples = samples
        self.count = count
        regions, visited = _visited(flow, initial, watch, upward)
        generators = np.array([flow.generator(pieces) for pieces in regions])
        finest = np.array([step_of(finest_level(_turning(flow, matrix))) for matrix in generators])
        # samples at which the quadrature starts again
        apart = max(1, int(per_cycle * LONG * finest.max()))
        restarts = np.append(np.arange(apart, count - 1, apart), count - 1)
        states = samples(np.append(0, restarts))
        self.ends = states[0], states[-1]
        # states over deflections, in which the powers are small sums
        by_deflections, self.back = _by_deflections(flow)
        self.restarts = np.ascontiguousarray(states @ by_deflections.T)
        # intervals end at samples, crossings and knots
        knots = flow.knots[1:-1] - first_cycle
        first_knot = int(np.searchsorted(knots, 0.0, side="right"))
        knots = knots[first_knot : np.searchsorted(knots, restarts[-1] / per_cycle)]
        at = np.concatenate([restarts / per_cycle, time, knots])
        order = np.argsort(at, kind="stable")
        self.durations = np.diff(np.concatenate([[0.0], at[order]]))
        # rates counted from each region's shift, so that products of moments cancel little
        shift = np.array([_shift(flow, pieces) for pieces in regions])
        generators = by_deflections @ generators @ self.back
        generators[..., flow.states] += _times(generators, shift) / flow.scaling.inputs[0]
        nodes = NODES_WITH_SIGNALS if flow.chain.size else NODES
        # tables of steps
        self.steps = Steps(generators, finest, float(self.durations.max(initial=0.0)), nodes)
        self.moves = _moves(flow, regions, (generators, shift, by_deflections), self.steps)
        # the path: region, first sample, knot, and whether the interval is whole
        begins = np.concatenate([[-1], order[:-1]])  # what each interval begins with: a sample, a crossing or a knot
        of_sample = begins < len(restarts)
        of_knot = begins - len(restarts) - len(time)
        self.interval = apart / per_cycle
        is_long = np.abs(self.durations - self.interval) < _UNCUT * self.interval
        self.path = np.stack(
            [
                visited[np.cumsum(~of_sample & (of_knot < 0))],
                np.where(of_sample, begins + 1, -1),  # the first one begins at -1
                np.where(of_knot >= 0, of_knot + first_knot + 1, -1),
                of_sample & (order < len(restarts)) & is_long,
            ],
            axis=1,
        )
        # energy released by auxiliary elements at crossings
        self.let_go = _let_go(flow, initial, watch, upward, memory)
        self.first_cycle = first_cycle
        self.per_cycle = per_cycle
        self.regions = regions
        self.visited = visited
        self.time = time
        # room for the moments
        rows = 4 * self.moves.generator.shape[1]
        terms = self.moves.powers.shape[1]
        count = (2 + self.steps.length.shape[1]) * len(regions)
        self.sums, self.recent = np.zeros((2, count, flow.width, rows))
        self.room = Room._make(map(np.zeros, (rows, rows, rows, terms * rows, terms)))
        self.done = 0
        self._work = np.cumsum(self._steps() * flow.width**2)

    def _steps(self) -> Array:
        """(I,) approximate number of steps in every interval."""
        region = self.path[:, 0]
        return np.asarray(self.durations / self.steps.length[region, -1] + 2.0 * self.steps.length.shape[1])

    @property
    def is_endless(self) -> bool:
        """Whether an interval would take millions of steps, because of fast modes without memory for long steps."""
        return bool(self._steps().max(initial=0.0) > MOST_STEPS)

    def advance(self, products: float = SLICE) -> bool:
        """Integrate over the next intervals, of about ``products`` multiplications; True: they were the last."""

        spent = self._work[self.done - 1] if self.done else 0.0
        end = max(self.done + 1, int(np.searchsorted(self._work, spent + products)))
        while self.done < min(end, len(self.durations)):
            part = slice(self.done, min(end, len(self.durations), self.done + TOGETHER))
            vectorised(integrate_moments)(
                self.moves, self.path[part], self.durations[part], self.restarts, self.room, self.recent.reshape(-1)
            )
            self.sums += self.recent
            self.recent[:] = 0.0
            self.done = part.stop
        return self.done == len(self.durations)

    def fraction(self) -> float:
        """Part of the audit that is done, 0 ... 1."""
        return self.done / max(1, len(self.durations))

    def result(self) -> EnergyAudit:
        """The audit, once ``advance`` has returned True."""
        flow = self.flow
        period = self.flow.system.inputs.period
        springs = [float(_sliders(flow) @ (flow.memory_rows @ z) ** 2) for z in self.ends]
        begin, end = (
            stored_energy(flow, flow.deflection @ z, flow.velocity @ z) + spring
            for z, spring in zip(self.ends, springs, strict=True)
        )
        n = flow.system.size
        m = len(flow.system.laws)
        torque, drag, loss, rubbed, error = np.split(period * self._works(), np.cumsum([n, n, m, m]))
        drag = flow.system.drag * drag
        if flow.system.signals is not None and flow.system.signals.reference.size:
            self._add_difference(flow.system.signals, torque, error)
        return EnergyAudit(torque, -error, drag, loss + self.let_go, (begin, end), rubbed + self.let_go)

    def _works(self) -> Array:
        """(2 n + 3 m,) integrals of torque and drag over its constant, losses, friction, errors with the other sign."""
        flow = self.flow
        regions = len(self.regions)
        upper = np.triu(self.sums[..., : flow.width])
        sums = upper + np.triu(upper, 1).swapaxes(1, 2)
        stacked = sums.reshape(-1, regions, *sums.shape[1:])
        begun = stacked[:-2].reshape(regions, -1, *sums.shape[1:])
        rest = stacked[-2]
        whole = stacked[-1]
        moments = rest + self.steps.integrals(begun, whole, self.interval)
        forms = np.array([_forms(flow, pieces) for pieces in self.regions]) @ self.back
        forms[..., flow.states] += _times(forms, self.moves.shift) / flow.scaling.inputs[0]
        one, other = _pairs(flow.system.size, len(flow.system.laws))
        return np.asarray(np.einsum("rpz,rzy,rpy->p", forms[:, one], moments, forms[:, other], optimize=True))

    def _add_difference(self, signals: Signals, torque: Array, error: Array) -> None:
        """Add the difference of works between the specified inputs and the polynomials that represent them in z.

        signals: the polynomials, compared with their reference.
        torque, error: (n,), (m,) works of the polynomials; added to [J].
        """
        flow = self.flow
        knots = self.flow.knots - self.first_cycle
        rows = np.arange(self.count)
        grid = rows / self.per_cycle
        samples = self.samples(rows)
        of_sample = self.visited[np.searchsorted(self.time, grid, side="right")]
        within = np.flatnonzero((knots[1:] > 0.0) & (knots[:-1] < grid[-1]))
        length = np.diff(knots)[within, None]
        time = knots[within, None] + length * INNER
        weight = flow.system.inputs.period * length * INNER_WEIGHTS * (time < grid[-1]) * (time > 0.0)
        work = weight * (signals.reference[within] - _used(flow, signals, within, length * INNER)).transpose(1, 0, 2)
        for i, c in np.argwhere(signals.torque != 0.0):
            velocity = np.interp(time, grid, samples @ flow.velocity[i])
            torque[i] += signals.torque[i, c] * np.sum(work[c] * velocity)
        forces = np.array([flow.force_rows(pieces) for pieces in self.regions])
        for k, c in np.argwhere(signals.error != 0.0):
            force = np.einsum("tz,tz->t", samples, forces[of_sample, k])
            error[k] += signals.error[k, c] * np.sum(work[c] * np.interp(time, grid, force))


def _used(flow: Flow, signals: Signals, intervals: IntArray, since: Array) -> Array:
    """(G, C, P) inputs as z has them, of channels with an error their first derivatives [SI].

    intervals: (G,) of these.
    since: (G, P) periods since the interval's start.
    """
    period = flow.system.inputs.period
    pace = signals.pace(flow.system.inputs.period)
    chains = (flow.chains[intervals] / flow.chain).reshape(len(intervals), signals.channels, signals.degree + 1)
    by_rate = np.any(signals.error != 0.0, axis=0)
    chains[:, by_rate, :-1] = chains[:, by_rate, 1:] * (pace / period)
    chains[:, by_rate, -1] = 0.0
    powers = np.ones((len(intervals), signals.degree + 1, since.shape[1]))
    np.cumprod(pace * since[:, None] / np.arange(1, signals.degree + 1)[:, None], axis=1, out=powers[:, 1:])
    return np.asarray(chains @ powers)


def _visited(flow: Flow, initial: Pieces, watch: IntArray, upward: IntArray) -> tuple[list[Pieces], IntArray]:
    """The regions, and (E + 1,) the index of the region at the start and after every crossing."""
    index = {initial: 0}
    regions = [initial]
    visited = [0]
    here = 0
    kinds = 2 * int(watch.max(initial=0)) + 2
    beyond = [-1] * kinds  # by region, then watch and direction
    for crossing in (2 * watch + upward).tolist():
        reached = beyond[here * kinds + crossing]
        if reached < 0:
            pieces = flow.system.beyond(regions[here], *divmod(crossing, 2))
            reached = index.setdefault(pieces, len(regions))
            beyond[here * kinds + crossing] = reached
            if reached == len(regions):
                regions.append(pieces)
                beyond += [-1] * kinds
        here = reached
        visited.append(here)
    return regions, np.array(visited)


def _let_go(flow: Flow, initial: Pieces, watch: IntArray, upward: IntArray, memory: Array) -> Array:
    """(m,) energy in the springs of sliders that were released, by element [J]."""
    system = flow.system
    lost = np.zeros(len(flow.system.laws))
    pieces = initial
    if not system.memories:
        return lost
    sliders = _sliders(flow)
    for which, up, held in zip(watch, upward, memory, strict=True):
        pieces = system.beyond(pieces, int(which), int(up))
        known = flow.known(pieces)
        for i, c in enumerate(system.memories):
            if not np.isnan(known[i]):
                lost[system.auxiliaries[c].element] += sliders[c] * (held[i] ** 2 - known[i] ** 2) / flow.memory[i] ** 2
    return lost


def _shift(flow: Flow, pieces: Pieces) -> Array:
    """(Z,) shift of z with which as many forces of clearances as possible are zero at z = 0."""
    shift = np.zeros(flow.width)
    count = len(flow.coordinates.elements)
    laws = [
        (k, law.stiffness[p], law.offset[p]) for k, (law, p) in enumerate(zip(flow.system.laws, pieces, strict=False))
    ]
    offset = [(k, -force / stiffness) for k, stiffness, force in laws if stiffness != 0.0 and force != 0.0]
    if offset:
        elements, deflection = zip(*offset, strict=True)
        shift[:count] = np.linalg.lstsq(flow.deflection[list(elements), :count], np.array(deflection), rcond=None)[0]
    return shift


def _times(rows: Array, shift: Array) -> Array:
    """(R, rows) products of rows (R, rows, Z) with the shift (R, Z) of each region."""
    return np.asarray((rows @ shift[:, :, None])[..., 0])


def _by_deflections(flow: Flow) -> tuple[Array, Array]:
    """(Z, Z) from z to z with deflections minus errors in place of relative angles, and (Z, Z) its inverse.

    An angle that is prescribed or recorded may be a hundred times a deflection: products of such angles would cancel.
    """
    there = np.eye(flow.width)
    count = len(flow.coordinates.elements)
    rows = flow.scaling.deflection[:, None] * flow.deflection[list(flow.coordinates.elements)]
    there[:count, flow.states :] = rows[:, flow.states :]
    return there, 2.0 * np.eye(flow.width) - there


def _moves(flow: Flow, regions: list[Pieces], of: tuple[Array, Array, Array], steps: Steps) -> Moves:
    """Pack every region; ``of``: their generators and shifts, and the deflections in z."""
    generators, shift, by_deflections = of
    return Moves(
        step=steps.length,
        advance=strips(steps.increments).reshape(-1, -(-flow.width // 4), flow.width, 4),
        generator=strips(generators),
        shift=shift,
        known=np.array([flow.known(pieces) for pieces in regions]),
        first_memory=flow.states - flow.memory.size,
        chains=np.ascontiguousarray(flow.chains),
        followed=np.ascontiguousarray(by_deflections[: len(flow.coordinates.elements), flow.width - flow.chain.size :]),
        powers=np.append(steps.abscissas, 1.0)[:, None] ** np.arange(ALL_TERMS if flow.chain.size else FEW_TERMS),
        weights=steps.weights,
    )


def _turning(flow: Flow, matrix: Array) -> Array:
    """The generator with the chain of every signal closed to a ring, for the choice of steps.

    Powers of a chain vanish from some order on, so they do not bound the error of a series of few terms, or of few
    nodes. A ring turns at the pace of the chain, and no entry of its powers is smaller than that of the chain.
    """
    signals = flow.system.signals
    if signals is None:
        return matrix
    closed = matrix.copy()
    links = signals.degree + 1
    for first in range(flow.width - flow.chain.size, flow.width, links):
        closed[first + links - 1, first] = signals.pace(flow.system.inputs.period)
    return closed


def _forms(flow: Flow, pieces: Pieces) -> Array:
    """(2 n + 5 m, Z) velocities, torques, rates, forces, rates of errors, forces not elastic, of these friction."""
    error_rate = flow.system.rows @ flow.velocity - flow.rate
    force = flow.force_rows(pieces)
    loss = force - _elastic_rows(flow, pieces)
    friction = _friction_rows(flow, pieces)
    return np.vstack([flow.velocity, flow.torque, flow.rate, force, error_rate, loss, friction])


def _pairs(n: int, m: int) -> IntArray:
    """(2, 2 n + 3 m) forms whose products are powers: of torques, drag over its constant, losses, friction, errors with
    the other sign."""
    inertia = np.arange(n)
    element = np.arange(m)
    velocity = inertia
    torque = n + inertia
    rate = 2 * n + element
    force, error_rate, loss, friction = (2 * n + i * m + element for i in range(1, 5))
    pairs = [(torque, velocity), (velocity, velocity), (loss, rate), (friction, rate), (force, error_rate)]
    return np.hstack([np.stack(pair) for pair in pairs])


def _elastic_rows(flow: Flow, pieces: Pieces) -> Array:
    """(m, Z) the part of every element's force that is stored: by its law, and by sliders that stick."""
    rows = np.empty_like(flow.deflection)
    for k, (law, piece) in enumerate(zip(flow.system.laws, pieces, strict=False)):
        rows[k] = law.stiffness[piece] * flow.deflection[k]
        rows[k, flow.states] += law.offset[piece] / flow.scaling.inputs[0]
    for auxiliary, piece, memory in flow.beside(pieces):
        rows[auxiliary.element] += auxiliary.moves[piece] * auxiliary.memory[piece] * memory
    return rows


def _friction_rows(flow: Flow, pieces: Pieces) -> Array:
    """(m, Z) the part of every element's force that sliders which slip have: constant torques."""
    rows = np.zeros_like(flow.deflection)
    for auxiliary, piece, _ in flow.beside(pieces):
        if auxiliary.remembers:
            rows[auxiliary.element, flow.states] += auxiliary.offset[piece] / flow.scaling.inputs[0]
    return rows
