"""A model in communication steps: torques, speeds and values of the model come from outside, step by step.

The motion is that of the algorithm ``exact``, with all harmonics of the model inside; only what comes from outside is
approximated. Within a step, h long,

* a torque is a straight line, value + rate (t - t_k), and adds to the torques of the model;
* a speed goes in a straight line from where it is to value + rate h, so that the angle is smooth;
* a value of the model may be another one than before: the state goes on, and harmonics keep their phases.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import Driveline, carried_along, period_of, prescribed_angles, with_prescribed
from gearrattle.engine.solvers.communication_steps import Begin, CommunicationSteps, with_channels
from gearrattle.engine.solvers.solver import Task
from gearrattle.engine.solvers.step_audit import added
from gearrattle.engine.system.energy_audit import EnergyAudit
from gearrattle.engine.system.flow import in_periods
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model import Model
from gearrattle.outcome import Outcome
from gearrattle.simulation.co_simulation_ports import Ports, channels_of, check_ports, with_turned
from gearrattle.simulation.impact_counter import ImpactCounter
from gearrattle.simulation.integrate import failure
from gearrattle.simulation.simulate import prepare

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

_PER_PERIOD = 100.0  # usual steps in a period


class Now(NamedTuple):
    """A driveline at a communication point [SI]; at the end of a step these are left limits."""

    # angle, velocity, acceleration: (n,) of all inertias
    angle: Array
    velocity: Array
    acceleration: Array
    displacement: Array  # (p,) of bodies that move sideways
    element_torque: Array  # (m,) referred to between[0]
    # deflection, region: (K,) of the clearances
    deflection: Array
    region: IntArray
    # of every clearance: sides on which corners were crossed in this period or the one before, 0, 1 or 2; impacts since
    # the start without touches, and the sum of their energies
    regime: list[int]
    impacts: list[int]
    impact_energy: list[float]


class CoSimulation:
    """A driveline under way, from one communication point to the next.

    Attributes
    ----------
    inputs
        (C, 2) value and rate of every torque [N m, N m/s], then of every speed [rad/s, rad/s^2]; set before a step.
    values
        the values of the model that may change, by path [SI]; set before a step.
    time
        of the present point, from the start of the motion on [s].
    """

    def __init__(self, model: Model, ports: Ports, step: float | None = None, *, audit: bool = False) -> None:
        """Begin at the start of the model.

        step: usual length of a step, by which numbers are scaled [s]; None for a hundredth of the period.
        audit: whether the energy is audited.
        ModelError for a model with inputs over time, for wrong ports, and without a static equilibrium.
        """
        check_ports(model, ports)
        self.original = model
        self.ports = ports
        self.length = period_of(model).period / _PER_PERIOD if step is None else step
        self.audit = audit
        self.inputs = np.zeros((ports.channels, 2))
        self.values = {path: float(model[path]) for path in ports.paths}
        self.begin()

    def begin(self) -> None:
        """Begin at the start, with the present inputs and values; ModelError for values that the model refuses."""
        first = len(self.ports.torques)
        driveline, task = self._prepared()
        # bodies whose speed is an input, and what goes along with them
        turned = np.zeros((len(self.ports.speeds), 3))
        turned[:, 1] = self.inputs[first:, 0]
        if self.ports.speeds:
            along = np.zeros(len(driveline.model.motions))
            along[-len(self.ports.speeds) :] = turned[:, 1]
            task = replace(task, velocity=task.velocity + carried_along(driveline.model, along))
        # the motion at its start
        self._begun_with = self.inputs.copy()
        self._failed: ConvergenceError | None = None
        self._energy: EnergyAudit | None = None  # of the marches before this one
        self.time = 0.0
        self._turned = turned  # angle, speed and acceleration of these bodies
        self._take(driveline, CommunicationSteps(task, Begin(0, 0.0, self._polynomials())), 0.0)
        self._look()

    def _prepared(self, initial: str | None = None) -> tuple[Driveline, Task]:
        """The driveline with the present values, and its task at the start, with channels."""
        changes = {path: value for path, value in self.values.items() if value != float(self.original[path])}
        model = with_turned(self.original.with_(changes) if changes else self.original, self.ports.speeds)
        plan = prepare(model, {"algorithm": "exact", "cycles": 1, "discard": 0, "initial": initial}, audit=False)
        torque, error = channels_of(model, self.ports)
        system = with_channels(plan.task.system, torque, error, self.length, 2 if self.ports.speeds else 1)
        return Driveline(model, system, plan.layout), replace(plan.task, system=system, audit=self.audit)

    def _take(self, driveline: Driveline, march: CommunicationSteps, periods: float) -> None:
        """Go on with another driveline and march.

        periods: the present time, in periods of the inputs.
        """
        self.model = driveline.model
        self.layout = driveline.layout
        self._march = march
        self._impacts = ImpactCounter(driveline.layout)
        self._origin = self.time, periods
        self._used = dict(self.values)

    def settle(self) -> None:
        """Take over inputs and values that were set; ModelError where the model refuses values: the last ones stay."""
        is_changed = self.values != self._used
        if not is_changed and (self.time > 0.0 or np.array_equal(self.inputs, self._begun_with)):
            return
        try:
            if self.time > 0.0:
                self._carry_over()
            else:
                self.begin()
        except ModelError:
            self.values = dict(self._used)
            raise

    def _carry_over(self) -> None:
        """Go on from the present state with the present values."""
        # the present state, in the model before
        here = self._march.point()
        memories = self._march.task.system.memories
        periods = self._periods(self.time)
        # the model with the present values, whose own start does not count
        driveline, task = self._prepared("zero")
        is_alike = period_of(driveline.model).turns == period_of(self.model).turns
        if not is_alike or task.system.memories != memories:
            rule = "changes the number of turns in a period, or which sliders there are"
            raise ModelError(Problem("parameters", "a new value", rule, "begin a new simulation with it"))
        # a march that goes on
        auxiliary_pieces = here.piece[len(task.system.clearances) :]
        task = replace(task, angle=here.angle, velocity=here.velocity, auxiliary_pieces=auxiliary_pieces)
        task = replace(task, memory=here.memory[list(memories)])
        whole = int(periods)
        march = CommunicationSteps(task, Begin(whole, periods - whole, self._polynomials()))
        self._energy = self.energy()
        so_far = self._impacts.sums()
        self._take(driveline, march, periods)
        self._impacts.take(so_far)
        self._look()

    def step(self, end: float) -> None:
        """March to a time [s], under the present inputs and values.

        ModelError for a time before the present point, an input that is no number, a value that the model refuses.
        """
        if self._failed is not None:
            raise self._failed
        self.settle()
        length = end - self.time
        if not 0.0 <= length < np.inf:
            rule = f"must not lie before the present point, {self.time:.9g} s"
            raise ModelError(Problem("end of the step", f"{end:.9g} s", rule, "restore a state to go back"))
        if not np.isfinite(self.inputs).all():
            raise ModelError(Problem("inputs", "a value that is no finite number", "must be finite"))
        if length == 0.0:
            return
        # the motion
        polynomials = self._polynomials(length)
        outcome = self._march.step(self._periods(end), polynomials)
        if outcome is not Outcome.DONE:
            self._failed = failure(self._march.position(), outcome, "exact", self.layout)
            raise self._failed
        self.time = end
        # bodies whose speed is an input
        angle = polynomials[len(self.ports.torques) :].T
        if self.ports.speeds:
            self._turned[:, 0] = angle[0] + length * (angle[1] + length * angle[2])
            self._turned[:, 1] = angle[1] + 2.0 * length * angle[2]
            self._turned[:, 2] = 2.0 * angle[2]
        # impacts, and all quantities at the end
        self._impacts.add(self._march.crossed(), int(self._march.at[0]))
        self._look()

    def _periods(self, time: float) -> float:
        """A time [s] in periods of the inputs."""
        since, periods = self._origin
        return float(periods + in_periods(np.array([time - since]), self.layout.period)[0])

    def _polynomials(self, length: float = 0.0) -> Array:
        """(C, D + 1) torques and angles from the present point on; of length 0: as they stand."""
        first = len(self.ports.torques)
        polynomials = np.zeros((self.ports.channels, 3 if self.ports.speeds else 2))
        polynomials[:first, :2] = self.inputs[:first]
        polynomials[first:, :2] = self._turned[:, :2]
        if self.ports.speeds and length > 0.0:
            target = self.inputs[first:, 0] + length * self.inputs[first:, 1]
            polynomials[first:, 2] = (target - self._turned[:, 1]) / (2.0 * length)
        return polynomials

    def _look(self) -> None:
        """Write ``now``, all quantities at the present point."""
        point = self._march.point()
        layout = self.layout
        clearances = len(layout.clearance)
        moving = [point.angle, point.velocity, point.acceleration]
        if layout.prescribed:
            moving = [with_prescribed(self.model, free, self._prescribed(order)) for order, free in enumerate(moving)]
        angle, velocity, acceleration = (values[: len(layout.inertia_names)] for values in moving)
        self.now = Now(
            angle=angle,
            velocity=velocity,
            acceleration=acceleration,
            displacement=point.angle[len(point.angle) - len(layout.direction_names) :],
            element_torque=point.force * layout.radii[:, 0],
            deflection=point.deflection,
            region=point.piece[:clearances] + layout.region_of_first_piece,
            regime=self._impacts.regime(),
            impacts=list(self._impacts.count),
            impact_energy=list(self._impacts.energy),
        )

    def _prescribed(self, order: int) -> Array:
        """(P,) angles of all bodies that move as prescribed, or a derivative."""
        time = np.array([self._periods(self.time) * self.layout.period])
        angle: Array = prescribed_angles(self.model, time, order)[0]
        angle[len(angle) - len(self.ports.speeds) :] += self._turned[:, order]
        return angle

    def energy(self) -> EnergyAudit | None:
        """The energy audit of the motion so far; None without a step, or without ``audit``."""
        return added(self._energy, self._march.energy())

    def snapshot(self) -> dict[str, Any]:
        """All that a co-simulation of the same model and ports needs to go on from here; owns its arrays."""
        energy = self.energy()
        return {
            "march": self._march.snapshot(),
            "inputs": self.inputs.copy(),
            "values": np.array(list(self.values.values())),
            "used": np.array(list(self._used.values())),
            "begun_with": self._begun_with.copy(),
            "turned": self._turned.copy(),
            "time": np.array([self.time, *self._origin]),
            "impacts": self._impacts.sums(),
            "energy": {} if energy is None else {name: np.array(value) for name, value in vars(energy).items()},
        }

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Go on from a snapshot."""
        used = dict(zip(self.values, snapshot["used"].tolist(), strict=True))
        if used != self._used:
            self.values = used
            driveline, task = self._prepared("zero")
            self._take(driveline, CommunicationSteps(task), 0.0)
        self._march.restore(snapshot["march"])
        self._failed = None
        energy = snapshot["energy"]
        self._energy = EnergyAudit(**{**energy, "stored": tuple(energy["stored"].tolist())}) if energy else None
        self.inputs[:] = snapshot["inputs"]
        self.values = dict(zip(self.values, snapshot["values"].tolist(), strict=True))
        self._begun_with = snapshot["begun_with"].copy()
        self._turned[:] = snapshot["turned"]
        self.time, *origin = snapshot["time"].tolist()
        self._origin = origin[0], origin[1]
        self._impacts = ImpactCounter(self.layout)
        self._impacts.take(snapshot["impacts"])
        self._look()
