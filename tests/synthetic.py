"""A motion known in closed form, for everything that judges, draws or reports one.

Four bodies, a staged clutch, a spline with lash and a gear mesh with backlash, as the four-inertia example has them.
The deflections are prescribed sums of sines, the angles follow from them, crossings are found on a dense grid and
refined by bisection. It satisfies the kinematics and the element laws, not the equations of motion.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from gearrattle.analysis.statics import Modes
from gearrattle.model import Model, loads
from gearrattle.pipeline import Findings
from gearrattle.quantities.evaluation import judge
from gearrattle.trajectory import Array, Cost, EventLog, Layout, Trajectory

OMEGA = 150.0
PERIOD = 2.0 * np.pi / OMEGA
NAMES = ("flywheel", "hub", "input_gear", "output_gear")

MODEL = """
schema = 1
name = "Synthetic four-inertia train"
inertia = [
  { name = "flywheel", J = 0.3, drag = 1.5e-4 },
  { name = "hub", J = 4.5e-4, drag = 1.35e-4, drag_torque = 0.2 },
  { name = "input_gear", J = 1.05e-2, drag = 1.5e-4 },
  { name = "output_gear", J = 1.5e-3, drag = 3.75e-5, drag_torque = 0.5 },
]
torque = [
  { on = "flywheel", mean = 10.0, harmonics = [{ order = 1, amplitude = 202.5 }, { order = 2, amplitude = 81.0 }] },
  { on = "input_gear", mean = -9.3 },
]

[excitation]
speed = 150.0

[[coupling]]
name = "clutch"
between = ["flywheel", "hub"]
stiffness = 1500.0
damping = 0.225
clearance = 0.16
stiffness_ratio = 0.1
damping_ratio = 0.25

[[coupling]]
name = "spline"
between = ["hub", "input_gear"]
stiffness = 15e3
damping = 0.0075
clearance = 0.05867

[[mesh]]
name = "gear"
between = ["input_gear", "output_gear"]
radii = [0.05, 0.05]
stiffness = 7.2e8
damping = 4500.0
backlash = 1e-4
transmission_error = [{ order = 20, amplitude = 5e-6 }]
"""
"""The model file the motion pretends to come from."""


@dataclass(frozen=True)
class Sines:
    """offset + sum of amplitude sin(order Omega t + phase)."""

    offset: float
    terms: tuple[tuple[float, float, float], ...]

    def __call__(self, time: Array, derivative: int = 0) -> Array:
        value = np.full_like(time, self.offset if derivative == 0 else 0.0)
        for order, amplitude, phase in self.terms:
            rate = order * OMEGA
            value += amplitude * rate**derivative * np.sin(rate * time + phase + 0.5 * np.pi * derivative)
        return value


TRANSMISSION_ERROR = Sines(0.0, ((20.0, 5e-6, 0.0),))
DEFLECTIONS = {
    "double-sided": (
        Sines(0.02, ((1.0, 0.1, 0.3), (2.0, 0.02, 0.0))),
        Sines(0.01, ((1.0, 0.052, 0.0), (2.0, 0.01, 1.0))),
        Sines(0.0, ((1.0, 4.4e-5, 0.2), (7.0, 1.0e-5, 0.5))),
    ),
    "single-sided": (
        Sines(0.02, ((1.0, 0.1, 0.3),)),
        Sines(0.05937, ((1.0, 5e-4, 0.0),)),
        Sines(4.5e-5, ((1.0, 8e-6, 0.2), (7.0, 4e-6, 0.5))),
    ),
    "quiet": (
        Sines(0.02, ((1.0, 0.1, 0.3),)),
        Sines(0.0594, ((1.0, 4e-4, 0.0),)),
        Sines(5.4e-5, ((1.0, 2e-6, 0.2),)),
    ),
}
FLYWHEEL = Sines(0.0, ((1.0, 0.05, 0.1), (2.0, 0.005, 0.0)))


def layout() -> Layout:
    """Return the layout of the synthetic driveline."""
    half = (0.16, 0.05867, 5e-5)
    return Layout(
        inertia_names=NAMES,
        inertia=np.array([0.3, 4.5e-4, 1.05e-2, 1.5e-3]),
        drag_torque=np.array([0.0, 0.2, 0.0, 0.5]),
        stiffness=np.array([1500.0, 15e3, 7.2e8]),
        element_names=("clutch", "spline", "gear"),
        is_mesh=np.array([False, False, True]),
        between=np.array([[0, 1], [1, 2], [2, 3]]),
        radii=np.array([[1.0, 1.0], [1.0, 1.0], [0.05, 0.05]]),
        rows=np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 1.0, -1.0, 0.0], [0.0, 0.0, 0.05, -0.05]]),
        clearance=np.array([0, 1, 2]),
        corners=tuple(np.array([-b, b]) for b in half),
        region_of_first_piece=np.array([-1, -1, -1]),
        stiffness_of_piece=(
            np.array([1500.0, 150.0, 1500.0]),
            np.array([15e3, 0.0, 15e3]),
            np.array([7.2e8, 0.0, 7.2e8]),
        ),
        damping_of_piece=(
            np.array([0.225, 0.05625, 0.225]),
            np.array([0.0075, 0.0, 0.0075]),
            np.array([4500.0, 0.0, 4500.0]),
        ),
        omega=OMEGA,
        period=PERIOD,
        orders=np.array([1.0, 2.0, 20.0]),
        reference=0,
    )


@cache
def trajectory(kind: str = "double-sided", cycles: int = 12, samples: int = 256, discard: int = 4) -> Trajectory:
    """Return a motion whose worst clearance is of the given kind: a key of ``DEFLECTIONS``."""
    plate = layout()
    deflections = DEFLECTIONS[kind]
    time = np.arange(cycles * samples + 1) * (PERIOD / samples)
    angle, velocity, acceleration = (_bodies(deflections, time, order) for order in range(3))
    delta = np.column_stack([f(time) for f in deflections])
    rate = np.column_stack([f(time, 1) for f in deflections])
    region = np.column_stack([_region(delta[:, k], plate.corners[k]) for k in range(3)])
    force = np.column_stack([_force(plate, k, delta[:, k], rate[:, k]) for k in range(3)])
    events = _events(plate, deflections, float(time[-1]))
    return Trajectory(
        layout=plate,
        time=time,
        angle=angle,
        velocity=velocity,
        acceleration=acceleration,
        deflection=delta,
        force=force,
        region=region,
        element_torque=force * plate.radii[:, 0],
        events=events,
        initial_region=region[0],
        final_force_integral=_impulses(plate, deflections, time[-1:], np.arange(3))[0],
        samples_per_cycle=samples,
        cycles=cycles,
        discard=discard,
        cost=Cost("exact", 4321, 9876, 0, len(events), 1.2e-5, 1.3e-5, 0.42),
        notes=("a free gap that carries no load was taken at its middle: gear",),
    )


def _bodies(deflections: tuple[Sines, ...], time: Array, derivative: int) -> Array:
    first = FLYWHEEL(time, derivative)
    second = first - deflections[0](time, derivative)
    third = second - deflections[1](time, derivative)
    fourth = third - (deflections[2](time, derivative) + TRANSMISSION_ERROR(time, derivative)) / 0.05
    return np.column_stack([first, second, third, fourth])


def _region(delta: Array, corners: Array) -> np.ndarray:
    return np.searchsorted(corners, delta) - 1


def _force(plate: Layout, k: int, delta: Array, rate: Array) -> Array:
    low, high = plate.corners[k]
    outer, inner = plate.stiffness_of_piece[k][2], plate.stiffness_of_piece[k][1]
    piece = _region(delta, plate.corners[k]) + 1
    inside = np.clip(delta, low, high)
    return outer * (delta - inside) + inner * inside + plate.damping_of_piece[k][piece] * rate


def _events(plate: Layout, deflections: tuple[Sines, ...], end: float) -> EventLog:
    dense = np.linspace(0.0, end, 40_001)
    rows: list[tuple[float, int, int, int, float]] = []
    for k, deflection in enumerate(deflections):
        for j, corner in enumerate(plate.corners[k]):
            gap = deflection(dense) - corner
            for start in np.flatnonzero(gap[:-1] * gap[1:] < 0.0):
                at = _bisect(deflection, corner, dense[start], dense[start + 1])
                up = gap[start + 1] > 0.0
                rows.append((at, k, j - 1 + (not up), j - 1 + up, float(deflection(np.array([at]), 1)[0])))
    rows.sort()
    columns = [np.array(column) for column in zip(*rows, strict=True)] if rows else [np.zeros(0)] * 5
    time, which = columns[0], columns[1].astype(np.int64)
    integral = _impulses(plate, deflections, time, which)
    flat = integral[np.arange(time.size), which] if rows else np.zeros(0)
    return EventLog(time, which, columns[2].astype(np.int64), columns[3].astype(np.int64), columns[4], flat)


def _bisect(deflection: Sines, corner: float, low: float, high: float) -> float:
    sign = np.sign(deflection(np.array([low]))[0] - corner)
    for _ in range(60):
        middle = 0.5 * (low + high)
        if np.sign(deflection(np.array([middle]))[0] - corner) == sign:
            low = middle
        else:
            high = middle
    return high


def _impulses(plate: Layout, deflections: tuple[Sines, ...], at: Array, _which: np.ndarray) -> Array:
    """Integral of each force from zero to each time, by the trapezoid on a dense grid."""
    if not at.size:
        return np.zeros((0, 3))
    dense = np.linspace(0.0, float(at.max()), 200_001)
    columns = []
    for k, f in enumerate(deflections):
        force = _force(plate, k, f(dense), f(dense, 1))
        total = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(dense))])
        columns.append(np.interp(at, dense, total))
    return np.column_stack(columns)


@dataclass(frozen=True)
class StandInRun:
    """What the report needs of a run."""

    trajectory: Trajectory
    model: Model
    predictability_horizon: float = 0.15
    lyapunov_exponents: Array = field(default_factory=lambda: np.array([7.0, -1.0]))
    largest_lyapunov_exponent: float = 7.0

    @property
    def notes(self) -> list[str]:
        return list(self.trajectory.notes)

    @property
    def cost(self) -> Cost:
        return self.trajectory.cost

    def write(self, path: Path) -> None:
        np.savez_compressed(path.open("wb"), angle=self.trajectory.angle)


@dataclass(frozen=True)
class StandInEquilibrium:
    angle: Array
    deflection: dict[str, float]
    region: dict[str, int]
    acceleration: Array
    notes: tuple[str, ...] = ()


def stand_in_modes(model: Model, frequencies: list[float], damping: list[float], shapes: Array) -> Modes:
    """Return made-up modes whose energies follow from nothing."""
    share = np.full((3, 4), 1.0 / 3.0)
    return Modes(
        model,
        np.array(frequencies),
        np.array(damping),
        shapes,
        NAMES,
        ("clutch", "spline", "gear"),
        np.ones(4),
        share,
        np.full((4, 4), 0.25),
        np.full((4, 4), 0.5),
        ("torque on flywheel",),
        np.full((1, 4), 0.25),
    )


@cache
def findings(kind: str = "double-sided", *, units: str = "SI", **settings: int) -> Findings:
    """Return findings about the synthetic motion; rest and modes are made up, the verdict is judged."""
    motion = trajectory(kind, **settings)
    model = loads(MODEL.replace("schema = 1", f'schema = 1\nunits = "{units}"'), "synthetic.toml")
    shapes = np.array([[1.0, -0.01, 0.0, 0.0], [1.0, 1.0, 0.02, 0.3], [1.0, 0.98, -0.1, 1.0], [1.0, 0.97, 1.0, -0.9]])
    return Findings(
        model=model,
        equilibrium=StandInEquilibrium(
            np.zeros(4),
            {"clutch": 0.066, "spline": 0.0593, "gear": 5e-5},
            {"clutch": 0, "spline": 1, "gear": 0},
            np.zeros(4),
        ),
        modes=stand_in_modes(model, [0.0, 110.0, 5800.0, 0.0], [0.0, 0.02, 0.01, 0.0], shapes),
        modes_contact=stand_in_modes(model, [0.0, 350.0, 5800.0, 37000.0], [0.0, 0.03, 0.01, 0.1], shapes),
        motion=StandInRun(motion, model),
        verdict=judge(motion, units=units),
    )
