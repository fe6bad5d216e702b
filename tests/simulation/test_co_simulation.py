"""A model in communication steps: the motion of a run, of records of torque and speed, and of a changed model."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import period_of
from gearrattle.signals import find_impacts
from gearrattle.signals.crossing_sums import regime
from gearrattle.signals.negligible import are_touches
from gearrattle.signals.windows import steady
from gearrattle.simulation.co_simulation import CoSimulation, Now
from gearrattle.simulation.co_simulation_ports import Ports

REGIMES = ("quiet", "single-sided", "double-sided")
STATES = ("angle", "velocity", "deflection", "region")
QUANTITIES = ("angle", "velocity", "acceleration", "deflection", "element_torque", "region")


def chain(size: int) -> gr.Model:
    """Return an engine that drives bodies by springs, and two gears by meshes with backlash."""
    bodies = [{"name": f"b{i}", "J": 0.01, "drag": 1e-3} for i in range(size)]
    springs = [
        {"name": f"k{i}", "between": [f"b{i}", f"b{i + 1}"], "stiffness": 2e4, "damping": 0.5} for i in range(size - 3)
    ]
    meshes = [
        {
            "name": f"m{i}",
            "between": [f"b{i}", f"b{i + 1}"],
            "radii": [0.05, 0.05],
            "stiffness": 1e7,
            "damping": 100.0,
            "backlash": 1e-4,
        }
        for i in (size - 3, size - 2)
    ]
    tables = {
        "schema": 1,
        "name": "chain",
        "inertia": bodies,
        "coupling": springs,
        "mesh": meshes,
        "excitation": {"speed": 100.0},
        "torque": [{"on": "b0", "harmonics": [{"order": 2.0, "amplitude": 50.0}]}],
    }
    return gr.Model.from_tables(tables)


def ports_of(model: gr.Model) -> Ports:
    moved = [motion.on for motion in model.motions]
    return Ports(torques=tuple(inertia.name for inertia in model.inertias if inertia.name not in moved))


def stepped(under_way: CoSimulation, length: float, count: int, first: int = 0) -> list[Now]:
    points = []
    for k in range(first, first + count):
        under_way.step((k + 1) * length)
        points.append(under_way.now)
    return points


def assert_same(points: list[Now], run: gr.Run, tolerance: float, names: tuple[str, ...] = QUANTITIES) -> None:
    """Assert that points are the samples of a run but its first, relative to the largest of every quantity."""
    for name in names:
        want = run.data[name].to_numpy()[1:]
        actual = np.array([getattr(point, name) for point in points])
        np.testing.assert_allclose(actual, want, rtol=0, atol=tolerance * max(np.abs(want).max(initial=0.0), 1e-300))


@pytest.mark.parametrize(
    ("name", "cycles", "tolerance"),
    [
        ("case1_loaded", 4, 1e-11),
        ("case3", 1, 1e-9),
        ("clutch_friction", 2, 1e-11),
        ("dual_mass_flywheel", 2, 1e-11),
        ("propeller_shaft", 2, 1e-11),
        ("bearing_clearance", 2, 1e-9),
        ("planetary_set", 1, 1e-9),
    ],
)
def test_without_inputs_it_is_a_run(name: str, cycles: int, tolerance: float) -> None:
    model = gr.example(name)
    period = period_of(model).period
    under_way = CoSimulation(model, ports_of(model), period / 10)
    points = stepped(under_way, period / 10, 10 * cycles)
    run = gr.simulate(model, cycles=cycles, samples_per_cycle=10, discard=0)
    assert_same(points, run, tolerance)
    if "displacement" in run.data:
        assert_same(points, run, tolerance, ("displacement",))
    impacts = find_impacts(run.trajectory)
    impacts = impacts.where(~are_touches(impacts, run.trajectory.layout))
    for k, (count, energy) in enumerate(zip(points[-1].impacts, points[-1].impact_energy, strict=True)):
        assert count == (impacts.clearance == k).sum()
        assert energy == pytest.approx(impacts.energy[impacts.clearance == k].sum(), rel=1e-6)


@pytest.mark.parametrize("name", ["case1_loaded", "case3", "clutch_friction", "six_speed", "driveline_lash"])
def test_a_regime_is_that_of_the_last_period(name: str) -> None:
    model = gr.example(name)
    period = period_of(model).period
    under_way = CoSimulation(model, ports_of(model), period / 8)
    last = stepped(under_way, period / 8, 24)[-1]
    trajectory = gr.simulate(model, cycles=3, discard=2, samples_per_cycle=8).trajectory
    want = [regime(trajectory, k, steady(trajectory)) for k in range(len(last.regime))]
    assert [REGIMES[sides] for sides in last.regime] == want


def test_changes_by_the_clock_fall_into_steps() -> None:
    """A mesh of alternating stiffness, which changes at the ends of periods too: there left limits are other ones."""
    model = gr.example("alternating_mesh")
    length = period_of(model).period / 7
    points = stepped(CoSimulation(model, ports_of(model), length), length, 14)
    run = gr.simulate(model, cycles=2, samples_per_cycle=7, discard=0)
    assert_same(points, run, 1e-11, STATES)
    want = run.data["acceleration"].to_numpy()[1:]
    apart = np.abs(np.array([point.acceleration for point in points]) - want).max(axis=1) / np.abs(want).max()
    assert (apart > 0.1).tolist() == 2 * [*6 * [False], True]
    assert apart[apart < 0.1].max() < 1e-11


def test_straight_lines_of_torque_are_a_record() -> None:
    model = gr.example("case1_loaded")
    period = period_of(model).period
    time = np.arange(81) * (period / 20)
    torque = 30.0 * np.sin(2.3 * time / period)
    under_way = CoSimulation(model, Ports(torques=("hub", "flywheel")), period / 20)
    points = []
    for k in range(80):
        under_way.inputs[1] = torque[k], (torque[k + 1] - torque[k]) / (time[k + 1] - time[k])
        under_way.step(float(time[k + 1]))
        points.append(under_way.now)
    tables = model.to_tables()
    signal = {"time": time.tolist(), "value": torque.tolist(), "interpolation": "linear"}
    recorded = gr.Model.from_tables({**tables, "torque": [*tables["torque"], {"on": "flywheel", "signal": signal}]})
    steady = gr.simulate(model, cycles=1).data
    start = {key: steady[key].isel(time=0).to_numpy().tolist() for key in ("angle", "velocity")}
    run = gr.simulate(recorded, cycles=3, samples_per_cycle=20, discard=0, initial=start)
    assert_same(points[:60], run, 1e-10)


def test_a_constant_torque_is_a_mean() -> None:
    model = gr.example("case1_loaded").with_({"simulation.initial": "zero"})
    period = period_of(model).period
    under_way = CoSimulation(model, Ports(torques=("flywheel",)), period / 10)
    under_way.inputs[0, 0] = 3.0
    points = stepped(under_way, period / 10, 20)
    more = model.with_({"torque.0.mean": model["torque.0.mean"] + 3.0})
    assert_same(points, gr.simulate(more, cycles=2, samples_per_cycle=10, discard=0), 1e-11)


def test_a_speed_from_outside_prescribes_the_motion() -> None:
    """The speed of the flywheel as straight lines: a record of its angle, cubic between the same points, is close."""
    model = gr.example("case1_loaded").with_({"simulation.initial": "zero"})
    period = period_of(model).period
    omega = 2.0 * np.pi / period
    steps = 400
    length = period / steps
    under_way = CoSimulation(model, Ports(speeds=("flywheel",)), length)
    points = []
    for k in range(2 * steps):
        under_way.inputs[0] = 2.0 * (1.0 - np.cos(omega * (k + 1) * length)), 0.0
        under_way.step((k + 1) * length)
        points.append(under_way.now)
    tables = dict(model.to_tables())
    tables["torque"] = [row for row in tables["torque"] if row["on"] != "flywheel"]
    time = np.arange(3 * steps + 1) * length
    angle = 2.0 * (time - np.sin(omega * time) / omega)
    tables["motion"] = [
        {"on": "flywheel", "about": 0.0, "angle": {"time": time.tolist(), "value": angle.tolist()}},
    ]
    run = gr.simulate(gr.Model.from_tables(tables), cycles=2, samples_per_cycle=steps, discard=0)
    assert_same(points, run, 1e-4, ("angle", "velocity", "deflection"))
    actual = np.array([point.velocity[0] for point in points])
    np.testing.assert_allclose(actual, 2.0 * (1.0 - np.cos(omega * time[1 : 2 * steps + 1])), rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["case1_loaded", "alternating_mesh"])
def test_a_changed_value_goes_on_from_the_state(name: str) -> None:
    """After a whole period the motion is that of the changed model from the state reached."""
    model = gr.example(name)
    path = next(path for path in model.paths("inertia.*.J"))
    period = period_of(model).period
    under_way = CoSimulation(model, Ports(paths=(path,)), period / 7)
    last = stepped(under_way, period / 7, 7)[-1]
    under_way.values[path] = 1.02 * model[path]
    points = stepped(under_way, period / 7, 14, first=7)
    changed = model.with_({path: 1.02 * model[path]})
    start = {"angle": last.angle.tolist(), "velocity": last.velocity.tolist()}
    run = gr.simulate(changed, cycles=2, samples_per_cycle=7, discard=0, initial=start)
    assert_same(points, run, 1e-9, STATES)


@pytest.mark.parametrize("name", ["case3", "clutch_friction", "alternating_mesh", "bearing_clearance"])
def test_a_value_that_does_not_change_the_motion(name: str) -> None:
    """A value that is changed to its neighbour among the doubles, in the middle of a period: memories are kept."""
    model = gr.example(name)
    path = next(path for path in model.paths("inertia.*.J"))
    length = period_of(model).period / 9
    one = CoSimulation(model, Ports(paths=(path,)), length)
    other = CoSimulation(model, Ports(paths=(path,)), length)
    stepped(one, length, 4)
    stepped(other, length, 4)
    other.values[path] = float(np.nextafter(model[path], np.inf))
    points, others = (stepped(under_way, length, 6, first=4) for under_way in (one, other))
    for field in ("angle", "velocity", "element_torque"):
        here, there = (np.array([getattr(point, field) for point in motion]) for motion in (points, others))
        np.testing.assert_allclose(there, here, rtol=0, atol=1e-9 * np.abs(here).max())
    assert points[-1].impacts == others[-1].impacts


def test_the_speed_of_the_excitation_changes_without_a_jump_of_phase() -> None:
    """A rigid body under one harmonic, J w' = a sin(phase): the speeds by the integrals over both parts."""
    text = """
    schema = 1
    name = "one body"
    [[inertia]]
    name = "body"
    J = 2.0
    [[coupling]]
    name = "soft"
    between = ["body", "ground"]
    stiffness = 1e-12
    [excitation]
    speed = "10 rad/s"
    [[torque]]
    on = "body"
    harmonics = [ { order = 1, amplitude = 3.0 } ]
    [simulation]
    initial = "zero"
    """
    under_way = CoSimulation(gr.loads(text), Ports(paths=("excitation.speed",)), 0.01)
    under_way.step(0.3)
    under_way.values["excitation.speed"] = 20.0
    under_way.step(0.5)
    first = (1.0 - np.cos(3.0)) / 10.0
    second = (np.cos(3.0) - np.cos(3.0 + 20.0 * 0.2)) / 20.0
    assert under_way.now.velocity[0] == pytest.approx(1.5 * (first + second), abs=1e-12)
    assert under_way.now.acceleration[0] == pytest.approx(1.5 * np.sin(7.0), abs=1e-12)


def test_a_snapshot_goes_on_elsewhere() -> None:
    model = gr.example("case3")
    ports = Ports(torques=("flywheel",), speeds=(), paths=("mesh.gear.backlash",))
    length = period_of(model).period / 10
    one = CoSimulation(model, ports, length)
    one.values["mesh.gear.backlash"] = 1.1e-4
    one.inputs[0] = 2.0, 5.0
    stepped(one, length, 7)
    one.inputs[0] = 1.0, 0.0
    snapshot = one.snapshot()
    want = stepped(one, length, 10, first=7)
    other = CoSimulation(model, ports, length)
    other.restore(snapshot)
    assert other.values == {"mesh.gear.backlash": 1.1e-4}
    for a, b in zip(stepped(other, length, 10, first=7), want, strict=True):
        for field in Now._fields:
            assert np.array_equal(getattr(a, field), getattr(b, field)), field


@pytest.mark.parametrize("size", [4, 128])
def test_any_number_of_bodies(size: int) -> None:
    model = chain(size)
    period = period_of(model).period
    names = [inertia.name for inertia in model.inertias]
    under_way = CoSimulation(model, Ports(torques=(names[0], names[-1])), period / 50)
    points = stepped(under_way, period / 50, 10)
    run = gr.simulate(model, cycles=1, samples_per_cycle=50, discard=0)
    for name in ("angle", "velocity"):
        want = run.data[name].to_numpy()[1:11]
        actual = np.array([getattr(point, name) for point in points])
        np.testing.assert_allclose(actual, want, rtol=0, atol=1e-8 * np.abs(want).max())


@pytest.mark.parametrize(
    ("ports", "words"),
    [
        (Ports(torques=("flywheal",)), 'did you mean "flywheel"'),
        (Ports(torques=("hub",), speeds=("hub",)), "once"),
        (Ports(speeds=("flywheel", "hub", "input_gear", "output_gear")), "at least one inertia must be free"),
        (Ports(paths=("mesh.gear.between",)), "path of a number"),
        (Ports(paths=("simulation.cycles",)), "setting"),
    ],
)
def test_wrong_ports(ports: Ports, words: str) -> None:
    with pytest.raises(gr.ModelError, match=words):
        CoSimulation(gr.example("case3"), ports)


@pytest.mark.parametrize("name", ["run_up", "tip_in", "measured_flywheel"])
def test_inputs_over_time_come_from_the_host(name: str) -> None:
    with pytest.raises(gr.ModelError, match="comes from the host"):
        CoSimulation(gr.example(name), Ports())


def test_what_a_host_does_wrong_keeps_the_motion() -> None:
    model = gr.example("case3")
    length = period_of(model).period / 10
    ports = Ports(torques=("flywheel",), paths=("mesh.gear.backlash", "excitation.speed"))
    wrong, right = CoSimulation(model, ports, length), CoSimulation(model, ports, length)
    stepped(wrong, length, 3)
    with pytest.raises(gr.ModelError, match="before the present point"):
        wrong.step(length)
    wrong.inputs[0, 0] = np.nan
    with pytest.raises(gr.ModelError, match="finite"):
        wrong.step(4 * length)
    wrong.inputs[0, 0] = 0.0
    wrong.values["mesh.gear.backlash"] = -1.0
    with pytest.raises(gr.ModelError, match="must not be negative"):
        wrong.step(4 * length)
    assert wrong.values["mesh.gear.backlash"] == model["mesh.gear.backlash"]
    stepped(right, length, 3)
    for a, b in zip(stepped(wrong, length, 5, first=3), stepped(right, length, 5, first=3), strict=True):
        assert np.array_equal(a.angle, b.angle)


@pytest.mark.parametrize("name", ["case3", "clutch_friction", "alternating_mesh", "bearing_clearance", "planetary_set"])
def test_the_energy_balance(name: str) -> None:
    """Through impacts, sliders, changes by the clock, a changed value and another object that goes on."""
    model = gr.example(name)
    ports = Ports(torques=ports_of(model).torques[:1], paths=(next(iter(model.paths("inertia.*.J"))),))
    length = period_of(model).period / 10
    one = CoSimulation(model, ports, length, audit=True)
    one.inputs[0] = 0.1, 2.0
    stepped(one, length, 12)
    one.values[ports.paths[0]] *= 1.1
    stepped(one, length, 7, first=12)
    other = CoSimulation(model, ports, length, audit=True)
    other.restore(one.snapshot())
    stepped(other, length, 4, first=19)
    works = []
    for under_way in (one, other):
        energy = under_way.energy()
        assert energy is not None
        assert energy.relative_residual < 1e-10
        works.append(energy.torque_work)
    assert not np.array_equal(*works)


def test_a_value_that_changes_the_period_is_refused() -> None:
    """An order that makes the common period longer; the motion goes on with the last value."""
    model = gr.example("case1_loaded")
    path = "torque.0.harmonics.4.order"
    length = period_of(model).period / 10
    wrong, right = (CoSimulation(model, Ports(paths=(path, "torque.0.mean")), length) for _ in range(2))
    for under_way in (wrong, right):
        stepped(under_way, length, 5)
    wrong.values[path] = 5.5
    with pytest.raises(gr.ModelError, match="turns in a period"):
        wrong.step(6 * length)
    assert wrong.values[path] == 5.0
    for under_way in (wrong, right):
        under_way.values["torque.0.mean"] = 11.0  # the means no longer balance: the train is accelerated
    for a, b in zip(stepped(wrong, length, 5, first=5), stepped(right, length, 5, first=5), strict=True):
        assert np.array_equal(a.angle, b.angle)
