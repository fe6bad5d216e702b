"""Random run-ups with tables over speed and records, and their motion by a plain integration of what the model says.

Two bodies, a spring to the ground, and one gap. The torque of the first body follows tables over the speed, whose
corners may stand very near to the ends of the sweep; the second one may follow a record, some points of which coincide
with corners, or nearly. The integration takes sines, tables and spline as they are written, and restarts at corners,
points and crossings. No part of the package is used for it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import gearrattle as gr

Array = np.ndarray

INERTIA = (0.04, 0.01)
SPRING, SPRING_DAMPING = 250.0, 0.05
STIFFNESS = 900.0
DAMPING = 0.02
CLEARANCE = 0.004
DRAG = 0.002
STEP = 1e-4
"""[s]; the fastest mode turns by 0.04 rad in it. A lighter touch than that may be missed."""
ANGLE, VELOCITY = (1e-3, -2e-3), (0.1, -0.2)
NUDGE = 1e-10
"""How far the second integration starts from the first one, as a part of a typical size."""

TOML = """
schema = 1
inertia = [ {{ name = "first", J = 0.04 }}, {{ name = "second", J = 0.01, drag = 0.002 }} ]
coupling = [
  {{ name = "spring", between = ["first", "ground"], stiffness = 250.0, damping = 0.05 }},
  {{ name = "gap", between = ["first", "second"], stiffness = 900.0, damping = 0.02, clearance = 0.004 }},
]
excitation = {{ sweep = {{ from = {first}, to = {last}, over = {over} }} }}
simulation = {{ cycles = {cycles}, initial = {{ angle = {angle}, velocity = {velocity} }} }}
[[torque]]
on = "first"
mean = {{ speed = {mean_speed}, value = {mean} }}
harmonics = [ {{ order = {order}, phase = {phase}, amplitude = {{ speed = {speed}, value = {amplitude} }} }} ]
"""
RECORD = """
[[torque]]
on = "second"
signal = {{ time = {time}, value = {value} }}
"""


@dataclass(frozen=True)
class RunUp:
    """A model as text, and the same numbers.

    Attributes
    ----------
    sweep
        first and last speed [rad/s], and how long it takes [s].
    mean, amplitude
        tables, (2, S) speeds [rad/s] and values [N m] each.
    wave
        order and phase [rad] of the harmonic.
    record
        (2, P) times [s] and values [N m]; None: no record.
    cycles
        length of the run in periods.
    text
        TOML.
    """

    sweep: tuple[float, float, float]
    mean: Array
    amplitude: Array
    wave: tuple[float, float]
    record: Array | None
    cycles: int
    text: str

    @property
    def breaks(self) -> list[float]:
        """Times at which an input has a corner [s]."""
        first, last, over = self.sweep
        speeds = np.concatenate([self.mean[0], self.amplitude[0]])
        points = [] if self.record is None else self.record[0].tolist()
        return sorted({over, *(over * (speeds - first) / (last - first)).tolist(), *points})


def _table(rng: np.random.Generator, first: float, last: float) -> Array:
    low, high = sorted((first, last))
    near = (high - low) * 10.0 ** rng.uniform(-8.0, -1.0, 2)
    inner = rng.uniform(low, high, int(rng.integers(0, 3)))
    speeds = np.unique([low, low + near[0], *inner, high - near[1], high])
    return np.array([speeds, rng.uniform(-3.0, 3.0, speeds.size)])


def _record(rng: np.random.Generator, corners: list[float], end: float) -> Array:
    """A smooth course; some points stand on corners of tables, or within 1e-15 to 1e-3 of the run beside them."""
    inner = np.array([t for t in corners if 0.0 < t < end])
    others = [inner + sign * end * 10.0 ** rng.uniform(-15.0, -3.0, inner.size) for sign in (-1.0, 1.0)]
    time = np.unique(np.concatenate([np.linspace(0.0, end, int(rng.integers(12, 60))), inner, *others]))
    time = time[(time >= 0.0) & (time <= end)]
    turns = rng.uniform(0.5, 4.0, 3)[:, None] * time / end
    return np.array([time, np.sin(2.0 * np.pi * (turns + rng.random((3, 1)))).sum(axis=0)])


def draw(seed: int) -> RunUp:
    """A sweep that takes 1e-6 to 30 periods, in a run of at least two."""
    rng = np.random.default_rng(seed)
    first, last = rng.uniform(20.0, 400.0, 2).tolist()
    periods = 10.0 ** rng.uniform(-6.0, 1.5)
    over, order = 2.0 * np.pi / first * periods, float(rng.choice([0.5, 1.0, 2.0, 6.0]))
    mean, amplitude = _table(rng, first, last), _table(rng, first, last)
    phase, cycles = float(rng.uniform(-3.0, 3.0)), int(np.ceil(periods)) + 2
    text = TOML.format(
        first=first,
        last=last,
        over=over,
        cycles=cycles,
        angle=list(ANGLE),
        velocity=list(VELOCITY),
        mean_speed=mean[0].tolist(),
        mean=mean[1].tolist(),
        order=order,
        phase=phase,
        speed=amplitude[0].tolist(),
        amplitude=amplitude[1].tolist(),
    )
    plain = RunUp((first, last, over), mean, amplitude, (order, phase), None, cycles, text)
    if rng.random() < 0.5:
        return plain
    end = cycles * 4.0 * np.pi / first  # a period is one or two turns
    record = _record(rng, plain.breaks, end)
    text += RECORD.format(time=record[0].tolist(), value=record[1].tolist())
    return RunUp(plain.sweep, mean, amplitude, plain.wave, record, cycles, text)


def integrated(run_up: RunUp, end: float, nudge: float = 0.0) -> tuple[Array, Array, Array]:
    """Integrate by DOP853 from corner to corner.

    Parameters
    ----------
    run_up
        see there.
    end
        of the run [s].
    nudge
        moves the start by this part of the clearance, and of 1 rad/s.

    Returns
    -------
    tuple[Array, Array, Array]
        (E,) times of crossings [s], (E,) pieces entered (-1, 0, 1), and the state at the end.
    """
    first, last, over = run_up.sweep
    rate, (order, phase) = (last - first) / over, run_up.wave
    spline = None if run_up.record is None else CubicSpline(*run_up.record, bc_type="not-a-knot")

    def torques(t: float) -> tuple[float, float]:
        inside = min(t, over)
        speed = first + rate * inside if t < over else last
        angle = (first + 0.5 * rate * inside) * inside + last * (t - inside)
        mean, size = np.interp(speed, *run_up.mean), np.interp(speed, *run_up.amplitude)
        return mean + size * np.sin(order * angle + phase), 0.0 if spline is None else float(spline(t))

    def fall(t: float, y: Array, piece: int) -> list[float]:
        a, b, u, v = y.tolist()
        driven, second = torques(t)
        contact = STIFFNESS * (a - b - piece * CLEARANCE) + DAMPING * (u - v) if piece else 0.0
        force = SPRING * a + SPRING_DAMPING * u
        return [u, v, (driven - force - contact) / INERTIA[0], (second + contact - DRAG * v) / INERTIA[1]]

    def gap(corner: int, sign: int, crossed: tuple[float, int]):
        """Distance to a corner; divided by the time since it was crossed, so that this root is gone."""

        def distance(t: float, y: Array, piece: int) -> float:
            if crossed[1] != -sign:
                return sign * (corner * CLEARANCE - (y[0] - y[1]))
            if t == crossed[0]:
                return -sign * (y[2] - y[3])
            return sign * (corner * CLEARANCE - (y[0] - y[1])) / (t - crossed[0])

        distance.terminal, distance.direction = True, -1.0
        return distance

    leaving = {-1: [(-1, 1)], 0: [(1, 1), (-1, -1)], 1: [(1, -1)]}
    size = np.array([CLEARANCE, -0.7 * CLEARANCE, 1.0, 0.4])
    t = 0.0
    y = np.array([*ANGLE, *VELOCITY]) + nudge * size
    piece = 1 if ANGLE[0] - ANGLE[1] > CLEARANCE else 0
    times = []
    pieces = []
    crossed = (0.0, 0)  # the last crossing's time and direction
    for stop in [*(b for b in run_up.breaks if 0.0 < b < end), end]:
        while t < stop:
            ways = leaving[piece]
            part = solve_ivp(
                fall,
                (t, stop),
                y,
                "DOP853",
                rtol=1e-12,
                atol=1e-15,
                max_step=STEP,
                args=(piece,),
                events=[gap(*way, crossed) for way in ways],
            )
            assert part.status >= 0, part.message
            t, y = float(part.t[-1]), part.y[:, -1]
            if part.status == 1:
                crossed = t, next(sign for (_, sign), at in zip(ways, part.t_events, strict=True) if len(at))
                piece += crossed[1]
                times.append(t)
                pieces.append(piece)
    return np.array(times), np.array(pieces, dtype=int), y


def model_of(run_up: RunUp) -> gr.Model:
    """The model of the package."""
    return gr.loads(run_up.text, "run_up")
