"""A motion as plain arrays, with the names and constants of its driveline.

A ``Trajectory`` comes from any solver (or from a measurement) and is judged by criteria, plotted and reported without
anyone asking where it came from. ``Layout`` holds names and constants of the driveline it belongs to: inertias,
kinematic rows, corners, the period. No units beyond SI, no files, no solver.

Shapes: Nt samples, n inertias, m elements (all couplings in file order, then all meshes), K clearances (the elements
that have at least one corner, in the same order), E events, p directions in which bodies with a mass move sideways,
B bearings.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.crossings_in_order import Auxiliaries
from gearrattle.engine.system.energy_audit import EnergyAudit
from gearrattle.engine.system.exact_statistics import Statistics
from gearrattle.engine.system.run_up_phase import Ramp

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
Signal = tuple[str, str]
"""Quantity and subject."""
_SAME_SPEED = 1e-9  # of a speed: as much beyond a table is rounding


@dataclass(frozen=True)
class NegligibleImpacts:
    """Below which sizes an impact is a touch; 0: none is, by this size.

    Attributes
    ----------
    energy
        m_eff v^2 / 2 [J], of every element that has a free body.
    speed
        ``|v|`` of meshes [m/s].
    angular_speed
        ``|v|`` of couplings [rad/s].
    is_assumed
        whether the energy is assumed, for the model says nothing of it.
    """

    energy: float = 0.0
    speed: float = 0.0
    angular_speed: float = 0.0
    is_assumed: bool = False


@dataclass(frozen=True)
class Layout:
    """Names and constants of the driveline a trajectory belongs to.

    Attributes
    ----------
    inertia_names
        (n,) names of the rotating bodies.
    inertia
        (n,) J [kg m^2].
    drag_torque
        (n,) mean drag torque; of a table over the speed, its value at ``omega`` [N m].
    stiffness
        (m,) largest slope of every element; 0 for a pure damper [N m/rad or N/m].
    element_names
        (m,) couplings, then meshes.
    is_mesh
        (m,) whether the element is a gear mesh, or one of a bearing (deflection in m, force in N).
    between
        (m, 2) indices of the two inertias the element lies between; -1 is ground.
    radii
        (m, 2) base radii of these two gears [m]; 1, 1 for a coupling, 0, 0 for a bearing.
        ``radii[:, 0]`` refers a force to the first of them.
    rows
        (m, n) W: deflections from angles, transmission errors and displacements apart [m or 1].
    clearance
        (K,) indices of the elements that have a corner.
    corners
        K ascending arrays of corner positions [rad or m].
    region_of_first_piece
        (K,) label of the piece below the lowest corner (<= 0); labels count up by one.
    stiffness_of_piece, damping_of_piece
        K arrays, slope and damping of each piece, lowest first.
    omega
        reference speed Omega [rad/s].
    period
        common period T of all orders [s].
    orders
        ascending distinct orders of the excitation (torques and transmission errors).
    reference
        index of the inertia transmissibility refers to (the first torque table's; 0 without torques).
    auxiliary_names
        (C,) sliders ("damper.0", "damper.drive.1": the second drive stage's), limiters ("gear.pull",
        "gear.push") and alternating stiffness ("gear.pairs").
    auxiliary_words
        what the pieces of each stand for.
    prescribed
        indices of the bodies whose motion is prescribed: no impact moves them.
    ramp
        how the reference speed changes, from ``omega`` on; None if it does not.
    drag_tables
        speeds [rad/s], ascending, and drag torques [N m] of the bodies whose drag torque is a table, by index.
    negligible
        which impacts are touches.
    component_paths
        (m,) the component that every element belongs to, "mesh.gear"; empty where it is not known.
    direction_names
        (p,) directions, "gear.x", "gear.y".
    direction_mass
        (p,) mass of the body of each [kg].
    direction_rows
        (m, p) W: deflections from displacements [1].
    bearing_names
        (2 B,) forces of the bearings on their bodies, "front.x", "front.y".
    bearing_rows
        (2 B, m) these forces from those of the elements.
    """

    inertia_names: tuple[str, ...]
    inertia: Array
    drag_torque: Array
    stiffness: Array
    element_names: tuple[str, ...]
    is_mesh: NDArray[np.bool_]
    between: IntArray
    radii: Array
    rows: Array
    clearance: IntArray
    corners: tuple[Array, ...]
    region_of_first_piece: IntArray
    stiffness_of_piece: tuple[Array, ...]
    damping_of_piece: tuple[Array, ...]
    omega: float
    period: float
    orders: Array
    reference: int
    auxiliary_names: tuple[str, ...] = ()
    auxiliary_words: tuple[tuple[str, ...], ...] = ()
    prescribed: tuple[int, ...] = ()
    ramp: Ramp | None = None
    drag_tables: Mapping[int, tuple[Array, Array]] = field(default_factory=dict)
    negligible: NegligibleImpacts = NegligibleImpacts()
    component_paths: tuple[str, ...] = ()
    direction_names: tuple[str, ...] = ()
    direction_mass: Array = field(default_factory=lambda: np.zeros(0))
    direction_rows: Array = field(default_factory=lambda: np.zeros((0, 0)))
    bearing_names: tuple[str, ...] = ()
    bearing_rows: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def drag_torque_at(self, body: int, speed: Array) -> Array:
        """Return the drag torque [N m] of a body at reference speeds [rad/s] of any shape.

        NaN at those that its table does not cover.
        """
        if body not in self.drag_tables:
            return np.full(np.shape(speed), self.drag_torque[body])
        speeds, torques = self.drag_tables[body]
        covered = (speed >= speeds[0] * (1.0 - _SAME_SPEED)) & (speed <= speeds[-1] * (1.0 + _SAME_SPEED))
        return np.where(covered, np.interp(speed, speeds, torques), np.nan)

    def largest_drag_torque(self, body: int) -> float:
        """Return the largest drag torque of a body at the speeds that the driveline passes [N m]."""
        if self.ramp is None or body not in self.drag_tables:
            return float(self.drag_torque[body])
        low = min(self.ramp.begin, self.ramp.end)
        high = max(self.ramp.begin, self.ramp.end)
        speeds = self.drag_tables[body][0]
        passed = np.array([low, *speeds[(speeds > low) & (speeds < high)], high])
        return float(np.max(self.drag_torque_at(body, passed)))

    @property
    def is_bearing(self) -> NDArray[np.bool_]:
        """(m,) whether the element is one of a bearing: it turns nothing."""
        return np.asarray(self.radii[:, 0] == 0.0)

    @property
    def clearance_names(self) -> tuple[str, ...]:
        """Names of the elements that have a corner, in element order."""
        return tuple(self.element_names[k] for k in self.clearance)


@dataclass(frozen=True)
class EventLog:
    """Every crossing of a corner, ordered by time, then element.

    Attributes
    ----------
    time
        (E,) [s].
    clearance
        (E,) index into ``Layout.clearance``.
    from_region, to_region
        (E,) region labels of the contract (0 centre, + drive, - coast).
    velocity
        (E,) signed deflection rate at the crossing [rad/s or m/s].
    force_integral
        (E,) integral of the element's force from t = 0 to the crossing [N m s or N s]; a contact
        impulse is the difference between its end and its start. NaN where a solver does not supply it.
    """

    time: Array
    clearance: IntArray
    from_region: IntArray
    to_region: IntArray
    velocity: Array
    force_integral: Array

    def __len__(self) -> int:
        """Return the number of crossings."""
        return int(self.time.size)


@dataclass(frozen=True)
class Cost:
    """What a computation cost.

    ``steps`` counts accepted steps, ``function_calls`` evaluations of the right-hand side (for ``exact``: propagations
    and polynomial expansions) that the algorithm itself asked for; ``average_trial_step`` is the mean of all steps
    tried [s], accepted or not; ``rejected_steps`` were tried in vain, ``smallest_step`` is the shortest accepted [s]
    (None: not recorded); ``energy_residual`` is the energy the audit cannot account for, relative to all works and
    losses (None: no audit).
    """

    algorithm: str
    steps: int
    function_calls: int
    jacobian_calls: int
    events: int
    average_step: float
    average_trial_step: float
    wall_time: float
    energy_residual: float | None = None
    rejected_steps: int = 0
    smallest_step: float | None = None


class Exact(Protocol):
    """What knows a motion between its samples."""

    def signals(self, trajectory: Trajectory) -> tuple[Signal, ...]:
        """Return quantity and subject of everything it knows."""

    def statistics(
        self,
        trajectory: Trajectory,
        signals: Sequence[Signal],
        *,
        with_moments: NDArray[np.bool_] | bool = True,
        cycles: tuple[int, ...] | None = None,
    ) -> Statistics | None:
        """Return extremes and moments, of all or of those marked, over the steady part; None: they take too long.

        ``cycles``: ends of windows that follow each other, in cycles of it; values then have an axis for these.
        """

    def exceeded(self, trajectory: Trajectory, signals: Sequence[Signal], share: float) -> Array | None:
        """Return (q,) what the modulus of each exceeds for a share of the steady part; None: they take too long."""

    def phase_curves(self, trajectory: Trajectory, elements: Sequence[str], cycles: int) -> Iterator[Array] | None:
        """Return deflection and rate of elements over the last cycles, lines in pieces (N, q, 2); None: too long."""


@dataclass(frozen=True)
class Sideways:
    """Sideways motion of bodies with a mass.

    Attributes
    ----------
    displacement, velocity, acceleration
        (Nt, p) [m, m/s, m/s^2].
    bearing_force
        (Nt, 2 B) force of every bearing on its body, along x and along y [N].
    """

    displacement: Array
    velocity: Array
    acceleration: Array
    bearing_force: Array

    @property
    def casing_force(self) -> Array:
        """(Nt, 2) force of all bearings on the casing, along x and along y [N]: minus the sum of those on bodies."""
        return -np.stack([self.bearing_force[:, axis::2].sum(axis=1) for axis in (0, 1)], axis=1)


@dataclass(frozen=True)
class Trajectory:
    """A sampled motion with its exact log of corner crossings.

    Attributes
    ----------
    layout
        names and constants of the driveline.
    time
        (Nt,) uniform grid t = k T / samples_per_cycle, from first_cycle T on [s].
    angle, velocity, acceleration
        (Nt, n) [rad, rad/s, rad/s^2]; accelerations are right limits.
    deflection, force
        (Nt, K) of the elements with a corner [rad or m, N m or N].
    region
        (Nt, K) region labels.
    element_torque
        (Nt, m) torque of every element referred to ``between[0]`` [N m].
    events
        every crossing from the first sample (0 < t) to the last.
    initial_region
        (K,) region labels just after the first sample.
    final_force_integral
        (K,) force integral at the end [N m s or N s]; NaN where unknown.
    samples_per_cycle, cycles, discard
        the output grid; criteria use [discard T, end].
    cost
        what it took.
    notes
        everything the user must know about this motion.
    energy
        where the energy went (None: no audit).
    first_cycle
        whole cycles before the first sample: more than 0 for a later chunk of a long run.
    auxiliaries
        sliders, limiters, alternating stiffness (None: the driveline has none).
    exact
        what knows the motion between its samples (None: nothing does).
    sideways
        displacements and forces of bearings (None: no body has a mass).
    """

    layout: Layout
    time: Array
    angle: Array
    velocity: Array
    acceleration: Array
    deflection: Array
    force: Array
    region: IntArray
    element_torque: Array
    events: EventLog
    initial_region: IntArray
    final_force_integral: Array
    samples_per_cycle: int
    cycles: int
    discard: int
    cost: Cost
    notes: tuple[str, ...] = field(default=())
    energy: EnergyAudit | None = None
    first_cycle: int = 0
    auxiliaries: Auxiliaries | None = None
    exact: Exact | None = field(default=None, repr=False, compare=False)
    sideways: Sideways | None = None

    @property
    def end(self) -> float:
        """Time of the last sample [s]."""
        return float(self.time[-1])
