"""An inertia whose angle is prescribed by harmonics: closed forms, equal drivelines, records, momentum."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.model import Model

LINEAR = """
schema = 1
[[inertia]]
name = "engine"
J = 0.1
[[inertia]]
name = "load"
J = 0.02
drag = 0.4
[[coupling]]
name = "shaft"
between = ["engine", "load"]
stiffness = 100.0
damping = 0.3
[excitation]
speed = 30.0
[[motion]]
on = "engine"
harmonics = [{ order = 1, amplitude = "5 deg", phase = 0.3 }, { order = 2.5, amplitude = 0.01, phase = "-80 deg" }]
[simulation]
cycles = 10
discard = 0
samples_per_cycle = 64
"""
RATTLING = """
schema = 1
[[inertia]]
name = "engine"
J = 0.1
[[inertia]]
name = "hub"
J = 0.01
drag = 0.05
[[inertia]]
name = "wheel"
J = 0.004
drag = 0.01
drag_torque = 0.4
[[coupling]]
name = "joint"
between = ["engine", "hub"]
stiffness = 800.0
damping = 0.5
clearance = 0.01
[[mesh]]
name = "gear"
between = ["hub", "wheel"]
radii = [0.05, 0.04]
stiffness = 1.0e6
damping = 40.0
backlash = 2.0e-4
transmission_error = [{ order = 3, amplitude = 2.0e-6 }]
[excitation]
speed = 80.0
[simulation]
cycles = 12
discard = 0
samples_per_cycle = 64
"""
SINES = [{"order": 1, "amplitude": 0.05, "phase": 0.2}, {"order": 2, "amplitude": 0.03, "phase": 1.1}]
ZERO = {"angle": [0.0, 0.0, 0.0], "velocity": [0.0, 0.0, 0.0]}


def rattling(on: str, sines: list[dict[str, Any]] | None = None, **changes: Any) -> Model:
    return gr.loads(RATTLING).with_({"motion": [{"on": on, "harmonics": SINES if sines is None else sines}], **changes})


def sines_at(model: Model, time: np.ndarray, derivative: int = 0) -> np.ndarray:
    """Return the prescribed angle, written out by hand."""
    total = np.zeros(time.shape, dtype=np.complex128)
    for harmonic in model.motions[0].harmonics:
        rate = 1j * harmonic.order * model.excitation.omega
        total += harmonic.amplitude * rate**derivative * np.exp(rate * time + 1j * harmonic.phase)
    return total.imag


def test_base_motion_of_one_body_is_the_closed_form() -> None:
    """J q'' + (D + C) q' + K q = C theta' + K theta: steady response and decaying free motion."""
    model = gr.loads(LINEAR)
    run = gr.simulate(model, initial="zero")
    t, J, C, K, D = run.trajectory, 0.02, 0.3, 100.0, 0.4
    roots = np.roots([J, C + D, K])
    steady = np.zeros((2, t.time.size), dtype=np.complex128)
    for harmonic in model.motions[0].harmonics:
        s = 1j * harmonic.order * 30.0
        wave = harmonic.amplitude * np.exp(1j * harmonic.phase) * (C * s + K) / (J * s**2 + (C + D) * s + K)
        steady += np.array([[1.0], [s]]) * wave * np.exp(s * t.time)
    free = np.linalg.solve(np.array([[1.0, 1.0], roots]), -steady.imag[:, 0].astype(complex))
    decaying = free[:, None] * np.exp(roots[:, None] * t.time)
    expected = steady.imag[0] + decaying.sum(axis=0).real
    speed = steady.imag[1] + (roots[:, None] * decaying).sum(axis=0).real
    assert np.abs(t.angle[:, 1] - expected).max() < 1e-12 * np.abs(expected).max()
    assert np.abs(t.velocity[:, 1] - speed).max() < 1e-12 * np.abs(speed).max()


def test_the_prescribed_body_stands_among_the_others() -> None:
    run = gr.simulate(gr.loads(LINEAR), initial="zero")
    t = run.trajectory
    for quantity, derivative in (("angle", 0), ("velocity", 1), ("acceleration", 2)):
        expected = sines_at(run.model, t.time, derivative)
        actual = run.data[quantity].sel(inertia="engine").to_numpy()
        assert np.abs(actual - expected).max() < 1e-12 * np.abs(expected).max(), quantity
    assert t.layout.prescribed == (0,)
    assert run.data.drive_torque.dims == ("time", "motion")


def test_it_is_an_error_of_opposite_sign_between_ground_and_the_next_body() -> None:
    """Through impacts, to the last bit: delta = theta - q has the error -theta between ground and q."""
    moved = gr.simulate(rattling("engine"), initial=ZERO)
    tables = gr.loads(RATTLING).to_tables()
    tables["inertia"] = tables["inertia"][1:]
    errors = [{**sine, "amplitude": -sine["amplitude"]} for sine in SINES]
    tables["coupling"] = [{**tables["coupling"][0], "between": ["ground", "hub"], "kinematic_error": errors}]
    grounded = gr.simulate(Model.from_tables(tables), initial={key: [0.0, 0.0] for key in ZERO})
    assert len(moved.events) > 50
    assert moved.events.equals(grounded.events)
    for quantity in ("angle", "velocity", "acceleration"):
        free = getattr(moved.trajectory, quantity)[:, 1:]
        assert np.array_equal(free, getattr(grounded.trajectory, quantity)), quantity
    assert np.array_equal(moved.trajectory.deflection, grounded.trajectory.deflection)


def test_it_is_a_transmission_error_of_opposite_sign_on_a_mesh() -> None:
    """The same for a gear: a gear at rest and e = -R theta."""
    sines = [{**sine, "amplitude": 0.05 * sine["amplitude"]} for sine in SINES]
    tables = gr.loads(RATTLING).to_tables()
    mesh = {**tables["mesh"][0], "transmission_error": []}
    moved = gr.simulate(rattling("hub", sines, mesh=[mesh], coupling=[]), initial=ZERO)
    errors = [{**sine, "amplitude": -0.05 * sine["amplitude"]} for sine in sines]
    still = rattling(
        "hub", [{"order": 1, "amplitude": 0.0}], mesh=[{**mesh, "transmission_error": errors}], coupling=[]
    )
    held = gr.simulate(still, initial=ZERO)
    assert len(moved.events) > 20
    largest = np.abs(held.trajectory.angle[:, 2]).max()
    assert np.abs(moved.trajectory.angle[:, 2] - held.trajectory.angle[:, 2]).max() < 1e-12 * largest
    assert moved.events.time.to_numpy() == pytest.approx(held.events.time.to_numpy(), rel=1e-12, abs=1e-15)


def test_elements_on_both_sides_have_errors_of_their_own() -> None:
    """A body in the middle moves the coupling before it and the mesh behind it, which know nothing of each other."""
    both, behind, before = (
        gr.simulate(rattling("hub", **changes), initial=ZERO, cycles=2).trajectory
        for changes in ({}, {"coupling": []}, {"mesh": []})
    )
    assert min(len(t.events) for t in (behind, before)) > 5
    assert np.abs(both.angle[:, 0] - before.angle[:, 0]).max() < 1e-12 * np.abs(before.angle[:, 0]).max()
    assert np.abs(both.angle[:, 2] - behind.angle[:, 2]).max() < 1e-12 * np.abs(behind.angle[:, 2]).max()


@pytest.mark.parametrize("start", ["static", "zero"])
def test_a_finely_sampled_record_says_the_same(start: str) -> None:
    """A cubic spline is off by (5/384) h^4 of the fourth derivative; its angle counts from the start of the run."""
    sines = [{"order": 1, "amplitude": 0.05, "phase": 0.0}, {"order": 2, "amplitude": 0.03, "phase": 0.0}]
    model = rattling("engine", sines, **{"mesh.gear.transmission_error": []})
    time = np.linspace(0.0, 12.0 * 2.0 * np.pi / 80.0, 12 * 400 + 1)
    record = {"time": time.tolist(), "value": sines_at(model, time).tolist()}
    recorded = model.with_({"motion": [{"on": "engine", "angle": record, "about": 0.0}]})
    cycles = 3  # before impacts have made much of the difference
    one, other = (gr.simulate(m, cycles=cycles, initial=start) for m in (model, recorded))
    off = 5.0 / 384.0 * float(time[1]) ** 4 * np.abs(sines_at(model, time, 4)).max()
    assert len(one.events) == len(other.events) > 10
    assert np.abs(one.trajectory.angle[:, 0] - other.trajectory.angle[:, 0]).max() < 2.0 * off
    assert np.abs(one.trajectory.angle - other.trajectory.angle).max() < 1e3 * off < 1e-6
    assert one.trajectory.velocity[0] == pytest.approx(other.trajectory.velocity[0], rel=1e-6, abs=1e-9)


def test_a_static_start_turns_with_the_body_without_deflecting() -> None:
    """As with a record, whose angle is zero there: angles and velocities go along."""
    model = rattling("engine")
    t = gr.simulate(model, cycles=1).trajectory
    rest = gr.equilibrium(model)
    angle, velocity = (float(sines_at(model, np.zeros(1), d)[0]) for d in (0, 1))
    ratio = np.array([1.0, 1.0, 0.05 / 0.04])
    assert t.angle[0] == pytest.approx(rest.angle + angle * ratio, rel=1e-12)
    assert t.velocity[0] == pytest.approx(velocity * ratio, rel=1e-12)
    assert t.deflection[0] == pytest.approx([rest.deflection["joint"], rest.deflection["gear"]], rel=1e-9, abs=1e-15)


def test_the_drive_torque_is_what_the_balance_of_momentum_says() -> None:
    """Between two bodies on one shaft the shaft's torque cancels; through the mesh, that of the wheel by its ratio."""
    model = rattling("engine", **{"inertia.engine.drag": 0.7, "inertia.engine.drag_torque": 0.25})
    run = gr.simulate(model)
    t = run.trajectory
    acting = t.acceleration * [0.1, 0.01, 0.004] + t.velocity * [0.7, 0.05, 0.01] + [0.25, 0.0, 0.4]
    expected = acting @ [1.0, 1.0, 0.05 / 0.04]
    actual = run.data.drive_torque.sel(motion="engine").to_numpy()
    assert np.abs(actual - expected).max() < 1e-11 * np.abs(acting).max()


def test_energy_that_the_motion_puts_in_is_accounted_for() -> None:
    """The power of the drive torque, less what moves the body itself, is the work through the element."""
    model = gr.loads(LINEAR).with_({"inertia.engine.drag": 0.7})
    run = gr.simulate(model, cycles=200, discard=199, samples_per_cycle=512)
    energy = run.trajectory.energy
    assert energy is not None
    assert energy.relative_residual < 1e-13
    one = gr.simulate(model, cycles=201, samples_per_cycle=512)
    t = one.trajectory
    rate = t.velocity[-512:, 0]
    power = one.data.drive_torque.to_numpy()[-512:, 0] * rate - 0.7 * rate**2
    more = one.trajectory.energy
    assert more is not None
    work = float(more.error_work[0] - energy.error_work[0])
    assert power.mean() * t.layout.period == pytest.approx(work, rel=1e-9)


def test_the_period_counts_the_orders() -> None:
    turn = 2.0 * np.pi / 30.0
    model = gr.loads(LINEAR)
    for orders, turns in (([1, 2.5], 2.0), ([2, 4], 0.5), ([0.5, 1], 2.0), ([20], 0.05), ([1 / 3], 3.0)):
        changed = model.with_({"motion.0.harmonics": [{"order": order, "amplitude": 0.01} for order in orders]})
        run = gr.simulate(changed, cycles=2)
        assert run.data.attrs["period"] == pytest.approx(turns * turn, rel=1e-14), orders
        assert sorted(run.trajectory.layout.orders.tolist()) == sorted(orders)
    odd = gr.simulate(model.with_({"motion.0.harmonics.0.order": 2**0.5}), cycles=2)
    assert any("no common period" in note for note in odd.notes)
    assert odd.data.attrs["period"] == pytest.approx(turn, rel=1e-14)


def test_with_harmonics_alone_the_system_is_plain_and_every_algorithm_takes_it() -> None:
    model = rattling("engine", **{"simulation.cycles": 2})
    system = assemble(model).system
    assert system.signals is None
    assert system.is_plain
    assert system.size == 2
    exact = gr.simulate(model).trajectory
    size = np.abs(exact.angle).max(axis=0)
    for algorithm, settings, bound in (
        ("rk4", {"step": 2e-6}, 1e-4),
        ("rk2", {"step": 2e-6}, 1e-4),
        ("dop853", {"tolerance": 1e-10}, 1e-4),
        ("radau", {"tolerance": 1e-8}, 1e-3),
    ):
        other = gr.simulate(model, algorithm, **settings).trajectory  # type: ignore[arg-type]
        assert np.abs(other.angle - exact.angle).max(axis=0) / size == pytest.approx(0.0, abs=bound), algorithm
        assert np.array_equal(other.angle[:, 0], exact.angle[:, 0])


def test_chunks_of_a_stream_are_the_run() -> None:
    model = rattling("engine")
    run, chunks = gr.simulate(model), list(gr.stream(model, chunk=5))
    assert np.concatenate([c.trajectory.angle[1:] for c in chunks]).tolist() == run.trajectory.angle[1:].tolist()


def test_along_a_sweep_the_harmonics_follow_the_angle() -> None:
    """One ramp, its speed and its end: value, speed and acceleration of the prescribed body, and what hangs on it."""
    ramp = {"from": 25.0, "to": 60.0, "over": 1.0}
    model = gr.loads(LINEAR).with_({"excitation.sweep": ramp, "simulation.cycles": 8})
    run = gr.simulate(model, initial="zero")
    t = run.trajectory
    rising = t.time < 1.0
    phi = np.where(rising, 25.0 * t.time + 17.5 * t.time**2, 42.5 + 60.0 * (t.time - 1.0))
    speed, rate = np.where(rising, 25.0 + 35.0 * t.time, 60.0), np.where(rising, 35.0, 0.0)
    expected = np.zeros((3, t.time.size))
    for h in model.motions[0].harmonics:
        sine, cosine = np.sin(h.order * phi + h.phase), np.cos(h.order * phi + h.phase)
        turning = h.order * speed
        expected += h.amplitude * np.array([sine, turning * cosine, h.order * rate * cosine - turning**2 * sine])
    for quantity, values in zip(("angle", "velocity", "acceleration"), expected, strict=True):
        assert np.abs(getattr(t, quantity)[:, 0] - values).max() < 2e-12 * np.abs(values).max(), quantity
    shaft = 100.0 * (t.angle[:, 0] - t.angle[:, 1]) + 0.3 * (t.velocity[:, 0] - t.velocity[:, 1])
    left = shaft - 0.4 * t.velocity[:, 1] - 0.02 * t.acceleration[:, 1]
    assert np.abs(left).max() < 1e-11 * np.abs(shaft).max()
    assert np.abs(run.data.element_torque.to_numpy()[:, 0] - shaft).max() < 1e-11 * np.abs(shaft).max()


def test_a_sweep_that_stays_is_the_speed_itself() -> None:
    model = rattling("engine", **{"simulation.cycles": 3})
    swept = model.with_({"excitation.sweep": {"from": 80.0, "to": 80.0, "over": 1.0}})
    one, other = (gr.simulate(m, initial="static").trajectory for m in (model, swept))
    assert np.abs(one.angle - other.angle).max() < 1e-9
