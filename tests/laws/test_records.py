"""Steps, ramps and pulses of a torque against closed forms.

A chain of n equal inertias between two grounds, damped in proportion to its stiffness, has the natural frequencies
omega_k = 2 sqrt(K / J) sin(k pi / (2 (n + 1))) and the modes sqrt(2 / (n + 1)) sin(i k pi / (n + 1)). In each of them
the response to a torque of straight lines and jumps is a sum of step and ramp responses, one a corner. A free body
answers with powers of time. Ramps that cancel cost digits: the formulas are evaluated in extended precision.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr

PI = np.longdouble("3.14159265358979323846264")
INERTIA, STIFFNESS, DAMPING = 0.04, 250.0, 0.006
CASE_1 = ([0.0, 1.0, 1.05, 3.0], [0.0, 0.0, 50.0, 50.0])
SHAPES = {
    "step": ([0.0, 0.21], [0.0, 3.0], "step"),
    "jump": ([0.0, 0.21, 0.21, 2.0], [0.0, 0.0, 3.0, 3.0], "linear"),
    "ramp": ([0.0, 0.21, 0.26, 2.0], [0.0, 0.0, 3.0, 3.0], "linear"),
    "pulse": ([0.0, 0.1, 0.1007], [0.0, 3.0, 0.0], "step"),
    "triangle": ([0.0, 0.1, 0.1007, 0.1014, 2.0], [0.0, 0.0, 3.0, 0.0, 0.0], "linear"),
    "sawtooth": ([0.0, 0.0, 0.13, 0.13, 2.0], [0.0, 1.0, 2.3, 0.0, 0.0], "linear"),
}
Corners = Sequence[tuple[np.longdouble, np.longdouble, np.longdouble]]
"""Times, and jumps of value and slope."""


def corners_of(time: Sequence[float], value: Sequence[float], interpolation: str) -> Corners:
    """Return where a record jumps or bends."""
    t, v = np.array(time, dtype=np.longdouble), np.array(value, dtype=np.longdouble)
    if interpolation == "step":
        return [(at, jump, np.longdouble(0)) for at, jump in zip(t, np.diff(v, prepend=0), strict=True)]
    corners, slope = [(t[0], v[0], np.longdouble(0))], np.longdouble(0)
    for i in range(len(t) - 1):
        if t[i] == t[i + 1]:
            corners.append((t[i], v[i + 1] - v[i], -slope))
            slope = np.longdouble(0)
        else:
            steeper = (v[i + 1] - v[i]) / (t[i + 1] - t[i])
            corners.append((t[i], np.longdouble(0), steeper - slope))
            slope = steeper
    return corners


def signal(time: Sequence[float], value: Sequence[float], interpolation: str, **settings: float) -> dict[str, object]:
    return {"time": list(time), "value": list(value), "interpolation": interpolation, **settings}


def chain(n: int, record: dict[str, object], cycles: int = 4) -> gr.Model:
    """Return a chain between two grounds, the first inertia driven by a record; a period is 0.1 s."""
    names = ["ground", *(f"b{i}" for i in range(n)), "ground"]
    couplings = [
        {"name": f"c{i}", "between": [names[i], names[i + 1]], "stiffness": STIFFNESS, "damping": DAMPING}
        for i in range(n + 1)
    ]
    return gr.Model.from_tables(
        {
            "schema": 1,
            "inertia": [{"name": name, "J": INERTIA} for name in names[1:-1]],
            "coupling": couplings,
            "excitation": {"frequency": 10.0},
            "torque": [{"on": "b0", "signal": record}],
            "simulation": {"initial": "zero", "cycles": cycles, "discard": 0, "samples_per_cycle": 32},
        }
    )


def free_body(record: dict[str, object], **changes: object) -> gr.Model:
    """Return a body of 1 kg m^2 under a record, for 3 periods of a second each."""
    tables = {
        "schema": 1,
        "inertia": [{"name": "body", "J": 1.0}],
        "excitation": {"frequency": 1.0},
        "torque": [{"on": "body", "signal": record}],
        "simulation": {"initial": "zero", "cycles": 3, "discard": 0, "samples_per_cycle": 20},
    }
    return gr.Model.from_tables(tables | changes)


def mode_response(time: np.ndarray, omega: float, ratio: float, corners: Corners) -> tuple[np.ndarray, np.ndarray]:
    """q'' + 2 z w q' + w^2 q = sum of steps a and ramps s (t - t_k): (t,) q and q'."""
    turning, decay = omega * np.sqrt(1.0 - ratio**2), ratio * omega
    time = time.astype(np.longdouble)
    value, rate = np.zeros_like(time), np.zeros_like(time)
    for begin, step, slope in corners:
        since = np.maximum(time - begin, 0.0)
        fading = np.exp(-decay * since)
        impulse = fading * np.sin(turning * since) / turning
        to_step = (1.0 - fading * np.cos(turning * since) - decay * impulse) / omega**2
        to_ramp = (since - impulse - 2.0 * decay * to_step) / omega**2
        value += step * to_step + slope * to_ramp
        rate += step * impulse + slope * to_step
    return value, rate


def chain_response(n: int, time: np.ndarray, corners: Corners) -> tuple[np.ndarray, np.ndarray]:
    """Return (t, n) angles and velocities of the chain by its modes."""
    angle, velocity = np.zeros((2, time.size, n), dtype=np.longdouble)
    position = np.arange(1, n + 1)
    for k in range(1, n + 1):
        omega = 2.0 * np.sqrt(np.longdouble(STIFFNESS) / INERTIA) * np.sin(k * PI / (2 * (n + 1)))
        shape = np.sqrt(np.longdouble(2) / (n + 1)) * np.sin(PI * (position * k % (2 * (n + 1))) / (n + 1))
        value, rate = mode_response(time, omega, 0.5 * DAMPING / STIFFNESS * omega, corners)
        angle += value[:, None] * shape * shape[0] / INERTIA
        velocity += rate[:, None] * shape * shape[0] / INERTIA
    return angle, velocity


@pytest.mark.parametrize(
    ("n", "shape"), [*((n, shape) for n in (1, 2, 4) for shape in SHAPES), (128, "step"), (128, "triangle")]
)
def test_the_response_of_a_chain(n: int, shape: str) -> None:
    record = SHAPES[shape]
    run = gr.simulate(chain(n, signal(*record)), audit=n < 128)
    angle, velocity = chain_response(n, run.data.time.values, corners_of(*record))
    for name, want in (("angle", angle), ("velocity", velocity)):
        np.testing.assert_allclose(run.data[name].values, want, rtol=0, atol=1e-12 * np.abs(want).max())
    if run.trajectory.energy is not None:
        assert run.trajectory.energy.relative_residual <= 1e-12


def test_speed_gained_by_a_free_body() -> None:
    """The integral of the torque: 50 N m rising within 0.05 s, then held for 1.95 s."""
    gained = {"linear": 98.75, "step": 97.5}
    for interpolation, speed in gained.items():
        run = gr.simulate(free_body(signal(*CASE_1, interpolation)))
        assert run.data.velocity.values[-1, 0] == pytest.approx(speed, rel=1e-14)
        assert run.trajectory.notes == ()


@pytest.mark.parametrize("interpolation", ["linear", "step"])
def test_a_run_begins_anywhere_in_a_record(interpolation: str) -> None:
    """From 1.02 s of the record, in mid-rise: the rest of the rise, and what is held."""
    record = signal([0.0, 1.0, 1.05, 5.0], [0.0, 0.0, 50.0, 50.0], interpolation, start=1.02, scale=2.0)
    run = gr.simulate(free_body(record))
    gained = 2.0 * (35.0 * 0.03 + 50.0 * 2.97) if interpolation == "linear" else 2.0 * 50.0 * 2.97
    assert run.data.velocity.values[-1, 0] == pytest.approx(gained, rel=1e-13)


@pytest.mark.parametrize(
    ("start", "gained"),
    [(0.0, 1.0 + 1.0 + 6.0), (0.5, 0.5 + 1.0 + 8.0), (4.0, 12.0)],
    ids=["first", "inside", "behind"],
)
def test_the_last_value_of_steps_is_held(start: float, gained: float) -> None:
    """1 N m until 1 s of the record, 2 until 1.5, then 4 for ever: here for 1.5 s or longer."""
    record = signal([0.0, 1.0, 1.5], [1.0, 2.0, 4.0], "step", start=start)
    run = gr.simulate(free_body(record))
    assert run.data.velocity.values[-1, 0] == pytest.approx(gained, rel=1e-14)
    longer = gr.simulate(free_body(record), cycles=5)
    assert longer.data.velocity.values[-1, 0] == pytest.approx(gained + 8.0, rel=1e-14)


def gap(record: dict[str, object]) -> gr.Model:
    """Return a free body in a gap of 0.02 rad on either side, in front of a spring."""
    spring = {"name": "stop", "between": ["body", "ground"], "stiffness": 4000.0, "damping": 3.0, "clearance": 0.02}
    return free_body(record, coupling=[spring])


@pytest.mark.parametrize(
    ("record", "crossing", "speed"),
    [  # T t^2 / 2 J, and T t^3 / 6 J r, from t = 1.003 on
        (([0.0, 1.003], [0.0, 2.5], "step"), np.sqrt(2.0 * 0.02 / 2.5), np.sqrt(2.0 * 0.02 * 2.5)),
        (([0.0, 1.003, 1.003, 4.0], [0.0, 0.0, 2.5, 2.5], "linear"), np.sqrt(0.016), np.sqrt(0.1)),
        (([0.0, 1.003, 1.503, 4.0], [0.0, 0.0, 5.0, 5.0], "linear"), np.cbrt(0.012), 5.0 * np.cbrt(0.012) ** 2),
    ],
    ids=["step", "jump", "ramp"],
)
def test_the_first_crossing_of_a_gap(record: tuple, crossing: float, speed: float) -> None:
    run = gr.simulate(gap(signal(*record)), audit=True)
    first = run.events.iloc[0]
    assert first["time"] == pytest.approx(1.003 + crossing, rel=1e-12)
    assert first["velocity"] == pytest.approx(speed, rel=1e-12)
    assert (first["from_region"], first["to_region"]) == (0, 1)
    time = run.data.time.values
    before = time < first["time"]
    since = np.maximum(time[before] - 1.003, 0.0)
    want = 5.0 / 3.0 * since**3 if record[1][-1] == 5.0 else 1.25 * since**2
    np.testing.assert_allclose(run.data.angle.values[before, 0], want, rtol=0, atol=1e-12 * 0.02)
    assert run.trajectory.energy is not None
    assert run.trajectory.energy.relative_residual <= 1e-12


def test_samples_at_jumps_are_those_after_them() -> None:
    """Jumps at every sample, most of which are no dyadic parts of a period and rounded: T = J w' + D w there."""
    rng = np.random.default_rng(3)
    for per_cycle in (20, 30, 48):
        time = np.arange(3 * per_cycle + 1) / per_cycle
        for interpolation in ("step", "linear"):
            value = rng.normal(size=time.size)
            record = signal(time, value, "step")
            if interpolation == "linear":  # every line has a slope of its own
                ends = value[:-1] + rng.normal(size=time.size - 1)
                times = np.stack([time[:-1], time[1:]], axis=1).ravel()
                record = signal(times.tolist(), np.stack([value[:-1], ends], axis=1).ravel().tolist(), "linear")
            model = free_body(record, inertia=[{"name": "body", "J": 2.0, "drag": 0.3}])
            run = gr.simulate(model, samples_per_cycle=per_cycle)
            torque = 2.0 * run.data.acceleration.values[:, 0] + 0.3 * run.data.velocity.values[:, 0]
            np.testing.assert_allclose(torque[:-1], value[:-1], rtol=0, atol=1e-12 * np.abs(value).max())


def test_peaks_before_and_after_jumps_are_known() -> None:
    """A torque rises to 50 N m, jumps to -20 and rises to nothing: no sample has either extreme."""
    record = signal([0.0, 1.0, 2.01, 2.01, 2.9, 3.0], [0.0, 0.0, 50.0, -20.0, 0.0, 0.0], "linear")
    run = gr.simulate(free_body(record), samples_per_cycle=8)
    assert np.ptp(run.data.acceleration.values) < 69.0
    assert run.trajectory.exact is not None
    known = run.trajectory.exact.statistics(run.trajectory, [("acceleration", "body"), ("velocity", "body")])
    assert known is not None
    np.testing.assert_allclose([known.low[0], known.high[0]], [-20.0, 50.0], rtol=1e-13)
    np.testing.assert_allclose([known.low[1], known.high[1]], [0.0, 25.25], rtol=1e-13, atol=1e-13)
    assert known.mean[0] == pytest.approx((25.25 - 8.9) / 3.0, rel=1e-13)


def moved(speed: dict[str, object], cycles: int = 3) -> gr.Model:
    """Return a body that follows a speed, and a free one behind a spring."""
    return gr.Model.from_tables(
        {
            "schema": 1,
            "inertia": [{"name": "drive", "J": 2.0}, {"name": "load", "J": INERTIA}],
            "coupling": [{"name": "shaft", "between": ["drive", "load"], "stiffness": STIFFNESS, "damping": DAMPING}],
            "excitation": {"frequency": 1.0},
            "motion": [{"on": "drive", "speed": speed, "about": 0.0}],
            "simulation": {"initial": "zero", "cycles": cycles, "discard": 0, "samples_per_cycle": 40},
        }
    )


def test_a_speed_of_straight_lines() -> None:
    """The deflection d obeys d'' + 2 z w d' + w^2 d = drive's acceleration: steps at the corners of its speed."""
    time, value = [0.0, 1.0, 1.2, 1.25, 3.0], [0.0, 0.0, 4.0, 1.0, 1.0]
    run = gr.simulate(moved(signal(time, value, "linear")), audit=True)
    omega = np.sqrt(np.longdouble(STIFFNESS) / INERTIA)
    corners = [(at, slope, np.longdouble(0)) for at, _, slope in corners_of(time, value, "linear")]
    deflection, rate = mode_response(run.data.time.values, omega, 0.5 * DAMPING / STIFFNESS * omega, corners)
    torque = STIFFNESS * deflection + DAMPING * rate
    scale = np.abs(deflection).max()
    turned = run.data.angle.values[:, 0] - run.data.angle.values[:, 1]
    np.testing.assert_allclose(turned, deflection, rtol=0, atol=2e-12 * scale)
    np.testing.assert_allclose(run.data.element_torque.values[:, 0], torque, rtol=0, atol=2e-12 * STIFFNESS * scale)
    at = run.data.time.values[:-1]
    slopes = np.array([0.0, 20.0, -60.0, 0.0])[np.searchsorted(time, at + 1e-9, side="right") - 1]
    np.testing.assert_allclose(run.data.acceleration.values[:-1, 0], slopes, rtol=1e-12, atol=1e-12)
    wanted = 2.0 * slopes + torque[:-1].astype(float)
    np.testing.assert_allclose(run.data.drive_torque.values[:-1, 0], wanted, rtol=0, atol=1e-11 * 120.0)
    assert run.trajectory.energy is not None
    assert run.trajectory.energy.relative_residual <= 1e-12


@pytest.mark.parametrize("interpolation", ["linear", "step"])
def test_records_beside_a_sweep_and_in_chunks(tmp_path: Path, interpolation: str) -> None:
    """A gap under pulses, along a run-up: whole, in chunks, saved and opened again."""
    rng = np.random.default_rng(5)
    time = np.sort(rng.uniform(0.0, 4.0, 30))
    record = signal([0.0, *time.tolist(), 4.5], rng.normal(size=32) * 60.0, interpolation)
    model = gap(record).with_({"excitation.sweep": {"from": 6.0, "to": 30.0, "over": 3.0}})
    model = model.with_({"torque": [*model.to_tables()["torque"], TURNING]})
    run = gr.simulate(model, cycles=4, audit=True)
    assert len(run.events) > 20
    assert run.trajectory.energy is not None
    assert run.trajectory.energy.relative_residual <= 1e-12
    parts = list(gr.stream(model, cycles=4, chunk=1))
    assert np.array_equal(parts[-1].trajectory.angle[-1], run.trajectory.angle[-1])
    assert sum(len(part.events) for part in parts) == len(run.events)
    run.save(tmp_path / "run.nc")
    again = gr.open_run(tmp_path / "run.nc")
    assert again.model == run.model
    assert again.data.identical(run.data)


TURNING = {"on": "body", "harmonics": [{"order": 2, "amplitude": 3.0}]}


def test_a_study_over_a_record() -> None:
    """Each case is the run of its own model; a lower speed makes longer runs, over which the last step is held."""
    model = gap(signal([0.0, 1.0, 1.4], [0.0, 30.0, -8.0], "step"))
    axes = {"torque.0.signal.scale": [0.5, 1.0, 2.0], "excitation.frequency": [0.5, 1.0]}
    cases = gr.study(model, axes, outputs=["largest impact energy", "crossings per cycle"], workers=1)
    for case in np.ndindex(3, 2):
        values = {path: axis[i] for (path, axis), i in zip(axes.items(), case, strict=True)}
        run = gr.simulate(model.with_(values))
        assert cases["crossings per cycle"].values[case] == len(run.events) / 3.0
        assert len(run.events) > 0
