"""The sparse arrays of a system for ``kernels.network_series``; the window length; the neighbours of a clearance.

Window length and neighbours follow from one bound. Take the largest stiffness and damping of every element over its
pieces, and the modulus of every coefficient: the rates of all states then form a matrix A that is at least |A_r| in
every region r. If h |A^j|^(1/j) is at most ``window_norm``, the Taylor series of every region has a negligible
remainder over a window h. The terms of exp(h A) bound how far a change of one force spreads within a window. A is never
stored as a matrix.

Only for systems without auxiliaries and without inputs over time, whose elements join at most two inertias:
``solvers.scheme_choice`` checks this.
"""

from __future__ import annotations

from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.march_arrays import NEGLIGIBLE, ORDER, window_norm
from gearrattle.engine.kernels.network_series import Near, Network
from gearrattle.engine.system.flow import Flow
from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

WIDEST_TURN = 0.5
"""Largest phase angle that an input passes in a window [rad]."""


def is_sparse(system: PiecewiseSystem) -> bool:
    """Whether every element joins at most two inertias."""
    return bool(np.all(np.count_nonzero(system.rows, axis=1) <= 2))


def ends_of(system: PiecewiseSystem) -> tuple[IntArray, Array]:
    """(m, 2) inertias that each element joins, (m, 2) their entries in W; ground: index of the other end, entry 0."""
    ends = np.zeros((len(system.laws), 2), dtype=np.int64)
    for k, row in enumerate(system.rows):
        nonzero = np.flatnonzero(row)
        ends[k] = (nonzero[0], nonzero[-1]) if nonzero.size else (0, 0)
    arm = np.take_along_axis(system.rows, ends, axis=1)
    arm[ends[:, 0] == ends[:, 1], 1] = 0.0
    return ends, np.ascontiguousarray(arm)


class Majorant:
    """The bound A on the rates of all regions [1/s]; states are scaled by energy, deflections before velocities."""

    def __init__(self, system: PiecewiseSystem) -> None:
        self.ends, arm = ends_of(system)
        root_inertia = np.sqrt(system.inertia)
        self.arm = np.abs(arm) / root_inertia[self.ends]
        self.drag = system.drag / system.inertia
        stiffest = np.array([np.abs(law.stiffness).max() for law in system.laws])
        self.damping = np.array([np.abs(law.damping).max() for law in system.laws])
        mobility = np.sum(self.arm**2, axis=1)
        is_mobile = mobility > 0
        least_stiffness = np.where(is_mobile, 1.0, 0.0) / np.where(is_mobile, mobility, 1.0) / system.inputs.period**2
        self.scale = np.sqrt(np.maximum(stiffest, np.maximum(least_stiffness, 1e-300)))
        self.stiffness = stiffest / self.scale

    def rate(self, velocity: Array) -> Array:
        """(m,) deflection rates of the elements."""
        return np.asarray(np.sum(self.arm * velocity[self.ends], axis=1))

    def pull(self, force: Array, size: int) -> Array:
        """(n,) sum of the element forces (m,) on each inertia."""
        out = np.zeros(size)
        np.add.at(out, self.ends, self.arm * force[:, None])
        return out

    def times(self, deflection: Array, velocity: Array) -> tuple[Array, Array]:
        """Return the product of A and the states."""
        rate = self.rate(velocity)
        force = self.stiffness * deflection + self.damping * rate
        return self.scale * rate, self.drag * velocity + self.pull(force, velocity.size)

    def radius(self) -> float:
        """|A^(ORDER + 1)|^(1 / (ORDER + 1)) in the norm of the largest row sum [1/s]."""
        states = np.ones(len(self.damping)), np.ones(len(self.drag))
        log = 0.0
        for _ in range(ORDER + 1):
            states = self.times(*states)
            largest = max(part.max(initial=0.0) for part in states)
            if largest == 0.0:
                return 0.0
            states = (states[0] / largest, states[1] / largest)
            log = log + float(np.log(largest))
        return float(np.exp(log / (ORDER + 1)))

    def reached(self, element: int, length: float) -> IntArray:
        """(n,) the first Taylor order at which a change of an element's force moves each inertia within a window.

        Changes below the part ``NEGLIGIBLE`` of the states' typical size do not count; ORDER + 1: no change.
        """
        force = np.zeros(len(self.damping))
        force[element] = self.stiffness[element] + self.damping[element] * self.rate(np.ones(len(self.drag)))[element]
        source = self.pull(force, len(self.drag))
        deflection = np.zeros(len(self.damping))
        velocity = np.zeros(len(self.drag))
        first_order = np.full(len(self.drag), ORDER + 1)
        decay = 1.0
        for j in range(ORDER):
            rates = self.times(deflection, velocity)
            deflection = length / (j + 1) * rates[0]
            velocity = length / (j + 1) * (rates[1] + decay * source)
            decay *= window_norm(ORDER + 1) / (j + 1)
            first_order = np.where(velocity > NEGLIGIBLE / ORDER, np.minimum(first_order, j + 1), first_order)
        first_order[self.ends[element]] = 1
        return first_order


def windows_of(system: PiecewiseSystem, bound: Majorant) -> int:
    """Number of windows per period."""
    fastest = bound.radius() * system.inputs.period / window_norm(ORDER + 1)
    turning = 2 * np.pi * float(system.inputs.cycles.max(initial=0.0)) / WIDEST_TURN
    return max(1, ceil(fastest), ceil(turning))


def network_of(flow: Flow, windows: int) -> Network:
    """Pack a sparse system into the arrays of the sweep."""
    # inertias at both ends of each element, and their arms
    system = flow.system
    coordinates = flow.coordinates
    inputs = flow.system.inputs
    ends, arm = ends_of(system)
    elements = len(system.laws)
    none = np.zeros(len(system.laws))
    # clearances, references and inertias that are driven
    clearances = np.array(system.clearances, dtype=np.int64)
    references = np.array(coordinates.references, dtype=np.int64)
    driven = np.flatnonzero(np.any((inputs.torque_cosine != 0) | (inputs.torque_sine != 0), axis=1))
    # elements with transmission errors
    error_at = np.argwhere((inputs.error_cosine != 0) | (inputs.error_sine != 0))
    erring = np.unique(error_at[:, 0])
    error_of = _places(erring, len(system.laws))
    # amplitudes of torques and errors
    torque = np.hstack([inputs.torque_cosine, inputs.torque_sine])[driven].T
    error = np.column_stack([waves[tuple(error_at.T)] for waves in (inputs.error_cosine, inputs.error_sine)])
    error_at = np.column_stack([error_of[error_at[:, 0]], error_at[:, 1]])
    # deflections that are sums of others'
    tied = np.setdiff1d(np.arange(len(system.laws)), coordinates.elements)
    ties = [np.flatnonzero(coordinates.combination[k]) for k in tied]
    weights = [coordinates.combination[k, tie] for k, tie in zip(tied, ties, strict=True)]
    # columns: deflections first, then velocities
    return Network(
        length=inputs.period / windows,
        first=unsigned(elements + ends[:, 0]),
        second=unsigned(elements + ends[:, 1]),
        first_arm=arm[:, 0].copy(),
        second_arm=arm[:, 1].copy(),
        mobility=np.concatenate([none, 1.0 / system.inertia]),
        drag=np.concatenate([none, system.drag]),
        clearances=clearances,
        clearance=_places(clearances, len(system.laws)),
        references=unsigned(elements + references),
        mean=np.concatenate([none, inputs.mean]),
        driven=unsigned(elements + driven),
        torque=np.ascontiguousarray(torque),
        error_of=error_of,
        erring=erring,
        error_at=error_at,
        error=np.ascontiguousarray(error),
        turn=2 * np.pi * inputs.cycles / windows,
        tied=tied,
        tie_start=_starts(ties),
        tie=np.array(coordinates.elements, dtype=np.int64)[_joined(ties, np.int64)],
        tie_weight=_joined(weights, float),
    )


def near_of(flow: Flow, bound: Majorant, length: float) -> Near:
    """List the inertias and elements that a force change of every clearance reaches in a window of this length [s]."""
    # one clearance after the other
    system = flow.system
    references = list(flow.coordinates.references)
    arms = ends_of(system)[1]
    inertias = []
    elements = []
    ends = []
    active = []
    positions = []
    for k in system.clearances:
        # the first order of the window in which its force is felt by inertias and elements
        inertia_order = bound.reached(k, length)
        element_order = inertia_order[bound.ends].min(axis=1)  # its force acts on an inertia one order later
        sort_key = element_order.copy()
        sort_key[k] = 0  # the clearance itself comes first
        # those felt up to the last order, the ones felt first in front
        near = np.argsort(inertia_order, kind="stable")[: np.count_nonzero(inertia_order <= ORDER)]
        links = np.argsort(sort_key, kind="stable")[: np.count_nonzero(element_order <= ORDER)]
        # positions in that list: of the elements' ends and of the references
        position = np.full(system.size, near.size)
        position[near] = np.arange(near.size)
        positions.append(np.where(inertia_order[references] <= ORDER, position[references], -1))
        inertias.append(near)
        elements.append(links)
        ends.append(position[bound.ends[links]])
        # how many are felt in each order
        active.append(
            [(np.count_nonzero(inertia_order <= j), np.count_nonzero(element_order <= j)) for j in range(ORDER + 1)]
        )
    # all lists end to end
    inertia = _joined(inertias, np.int64).astype(int)
    element = _joined(elements, np.int64).astype(int)
    end = np.concatenate([np.zeros((0, 2), np.int64), *ends])
    return Near(
        inertia_start=_starts(inertias),
        inertia=unsigned(len(system.laws) + inertia),
        drag=system.drag[inertia],
        mobility=1.0 / system.inertia[inertia],
        element_start=_starts(elements),
        element=unsigned(element),
        first=unsigned(end[:, 0]),
        second=unsigned(end[:, 1]),
        first_arm=arms[element, 0].copy(),
        second_arm=arms[element, 1].copy(),
        reference=np.array(positions, dtype=np.int64).reshape(len(positions), len(references)),
        active=np.array(active, dtype=np.int64).reshape(-1, ORDER + 1, 2),
    )


def unsigned(index: IntArray) -> NDArray[np.uint64]:
    """Indices without a sign, so that a compiled loop does not test for negative ones."""
    return np.ascontiguousarray(index.astype(np.uint64))


def _places(chosen: IntArray, count: int) -> IntArray:
    """(count,) the position of every index in ``chosen``; -1: not in it."""
    positions = np.full(count, -1, dtype=np.int64)
    positions[chosen] = np.arange(len(chosen))
    return positions


def _starts(lists: list[IntArray]) -> IntArray:
    return np.concatenate([[0], np.cumsum([len(part) for part in lists])]).astype(np.int64)


def _joined(lists: list[Array] | list[IntArray], kind: type) -> NDArray[Any]:
    return np.concatenate([np.zeros(0, kind), *lists]).astype(kind)
