"""A motion as plain arrays, with the names and constants of its driveline.

A ``Trajectory`` comes from any solver (or from a measurement). Criteria, plots and reports treat it in the same way
whatever its source. ``Layout`` holds names and constants of its driveline: inertias, kinematic rows, corners, the
period. All units are SI.

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
"""Quantity and subject, e.g. ("velocity", "flywheel")."""
CASING_FORCE = "casing_force"
"""Quantity: the force of all bearings on the casing, along ``AXES``."""
AXES = ("x", "y")
_SAME_SPEED = 1e-9  # share of a speed: a speed outside a table by less is inside up to rounding


@dataclass(frozen=True)
class NegligibleImpacts:
    """Sizes below which an impact is negligible, a touch. With 0, no impact is negligible by this size.

    Attributes
    ----------
    energy
        m_eff v^2 / 2 [J], for every element that has a free body.
    speed
        ``|v|`` [m/s], for meshes.
    angular_speed
        ``|v|`` [rad/s], for couplings.
    is_assumed
        whether the energy is assumed because the model does not state it.
    """

    energy: float = 0.0
    speed: float = 0.0
    angular_speed: float = 0.0
    is_assumed: bool = False


@dataclass(frozen=True)
class Layout:
    """Names and constants of the driveline of a trajectory.

    Attributes
    ----------
    inertia_names
        (n,) names of the rotating bodies.
    inertia
        (n,) J [kg m^2].
    drag_torque
        (n,) mean drag torque [N m]; for a table over the speed, its value at ``omega``.
    stiffness
        (m,) largest slope of every element; 0 for a pure damper [N m/rad or N/m].
    element_names
        (m,) names of the couplings, then of the meshes.
    is_mesh
        (m,) whether the element is a gear mesh, or one of a bearing (deflection in m, force in N).
    between
        (m, 2) indices of the two inertias at the ends of the element; -1 is ground.
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
        (C,) sliders ("damper.0"; "damper.drive.1" of the second drive stage), limiters ("gear.pull", "gear.push") and
        alternating stiffness ("gear.pairs").
    auxiliary_words
        the state in words that every piece of an auxiliary means.
    prescribed
        indices of the bodies whose motion is prescribed: no impact moves them.
    ramp
        the change of the reference speed, which begins at ``omega``; None for a constant speed.
    drag_tables
        for bodies whose drag torque is a table, by index: speeds [rad/s], ascending, and drag torques [N m].
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
        (2 B,) forces of the bearings on the bodies that they hold, "front.x", "front.y".
    bearing_rows
        (2 B, m) these forces from those of the elements.
    casing_rows
        (2, m) force on the casing from those of the elements.
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
    casing_rows: Array = field(default_factory=lambda: np.zeros((2, 0)))

    def drag_torque_at(self, body: int, speed: Array) -> Array:
        """Return the drag torque [N m] of a body at reference speeds [rad/s] of any shape.

        NaN at speeds outside its table.
        """
        if body not in self.drag_tables:
            return np.full(np.shape(speed), self.drag_torque[body])
        speeds, torques = self.drag_tables[body]
        covered = (speed >= speeds[0] * (1.0 - _SAME_SPEED)) & (speed <= speeds[-1] * (1.0 + _SAME_SPEED))
        return np.where(covered, np.interp(speed, speeds, torques), np.nan)

    def largest_drag_torque(self, body: int) -> float:
        """Return the largest size of the drag torque of a body over the range of reference speeds [N m]."""
        if self.ramp is None or body not in self.drag_tables:
            return abs(float(self.drag_torque[body]))
        low = min(self.ramp.begin, self.ramp.end)
        high = max(self.ramp.begin, self.ramp.end)
        speeds = self.drag_tables[body][0]
        passed = np.array([low, *speeds[(speeds > low) & (speeds < high)], high])
        return float(np.max(np.abs(self.drag_torque_at(body, passed))))

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
        (E,) region labels: 0 centre, positive on the drive side, negative on the coast side.
    velocity
        (E,) signed deflection rate at the crossing [rad/s or m/s].
    force_integral
        (E,) integral of the element's force from t = 0 to the crossing [N m s or N s]; the impulse of a contact is
        the value at its end minus the value at its start. NaN for solvers that do not supply the integral.
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
    """The cost of a computation.

    ``steps`` is the number of accepted steps, ``rejected_steps`` that of rejected ones. ``function_calls`` is the
    number of evaluations of the right-hand side by the algorithm itself (for ``exact``: propagations and polynomial
    expansions). ``average_trial_step`` is the mean of all steps, accepted or rejected [s]; ``smallest_step`` is the
    shortest accepted step [s] (None: not recorded). ``energy_residual`` is the residual of the energy balance, relative
    to all works and losses (None: no audit).
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
    """An object that computes exact values of a motion between its samples."""

    def signals(self, trajectory: Trajectory) -> tuple[Signal, ...]:
        """Return quantity and subject of all signals with exact values."""

    def statistics(
        self,
        trajectory: Trajectory,
        signals: Sequence[Signal],
        *,
        with_moments: NDArray[np.bool_] | bool = True,
        cycles: tuple[int, ...] | None = None,
    ) -> Statistics | None:
        """Return extremes and moments of signals over the steady part; None if they take too long.

        ``with_moments`` marks the signals whose moments are needed. ``cycles`` are the ends of consecutive windows, in
        cycles from the start of the steady part; values then have an axis of windows.
        """

    def values(self, trajectory: Trajectory, signals: Sequence[Signal], time: Array) -> Array | None:
        """Return (N, q) signals at times (N,) [s] of the steady part; None as above."""

    def exceeded(self, trajectory: Trajectory, signals: Sequence[Signal], share: float) -> Array | None:
        """Return (q,) levels that the modulus of a signal exceeds for a share of the steady part; None as above."""

    def reach(self, trajectory: Trajectory, plane: tuple[Signal, Signal], centre: tuple[float, float]) -> float | None:
        """Return the largest distance from a centre of the vector that two signals are; None as above."""

    def phase_curves(self, trajectory: Trajectory, elements: Sequence[str], cycles: int) -> Iterator[Array] | None:
        """Yield arrays (N, q, 2) of deflection and rate of elements over the last cycles; None as above."""


@dataclass(frozen=True)
class Sideways:
    """Sideways motion of bodies with a mass.

    Attributes
    ----------
    displacement, velocity, acceleration
        (Nt, p) [m, m/s, m/s^2].
    bearing_force
        (Nt, 2 B) force of every bearing on the body that it holds, along x and along y [N].
    casing_force
        (Nt, 2) force of all bearings in the housing on the casing [N]: minus the sum of those on bodies.
    """

    displacement: Array
    velocity: Array
    acceleration: Array
    bearing_force: Array
    casing_force: Array


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
        (Nt, n) of every inertia [rad, rad/s, rad/s^2]; accelerations are right limits.
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
        the cost of the computation.
    notes
        everything the user must know about this motion.
    energy
        the energy balance (None: no audit).
    first_cycle
        number of cycles before the first sample: more than 0 for a later chunk of a long run.
    auxiliaries
        states of sliders, limiters and alternating stiffness (None: the driveline has none).
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
