"""Records, prescribed motions and sweeps from the model file to the run: closed forms, other integrators and routes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import gearrattle as gr
from gearrattle.assembly import assemble, signals_of
from gearrattle.model import Model

TAME = """
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
[[coupling]]
name = "mount"
between = ["load", "ground"]
stiffness = 80.0
clearance = 0.05
stiffness_ratio = 0.5
damping = 0.6
damping_ratio = 0.5
[excitation]
speed = 30.0
[simulation]
cycles = 10
discard = 0
samples_per_cycle = 64
"""
TIME = np.linspace(0.0, 2.5, 180)
SHAPE = 4.0 + 3.0 * np.sin(7.0 * TIME) + np.cos(23.0 * TIME)


def with_record(**extra: Any) -> Model:
    signal = {"time": TIME.tolist(), "value": SHAPE.tolist(), **extra}
    return gr.loads(TAME + '[[torque]]\non = "engine"\n').with_({"torque.0.signal": signal})


def with_motion(kind: str, values: np.ndarray, **extra: Any) -> Model:
    tables = gr.loads(TAME).to_tables()
    return Model.from_tables(
        {**tables, "motion": [{"on": "engine", kind: {"time": TIME.tolist(), "value": values.tolist()}, **extra}]}
    )


def mount(deflection: float, rate: float) -> float:
    """Return the torque of the mount."""
    inside = abs(deflection) < 0.05
    corner = np.clip(deflection, -0.05, 0.05)
    return float(40.0 * corner + 80.0 * (deflection - corner) + (0.3 if inside else 0.6) * rate)


def integrated(run: gr.Run, torque: Any) -> np.ndarray:
    """Return the last angles of the tame driveline by an integrator that knows nothing of corners."""

    def rates(time: float, y: np.ndarray) -> list[float]:
        shaft = 100.0 * (y[0] - y[1]) + 0.3 * (y[2] - y[3])
        return [
            y[2],
            y[3],
            (torque(time) - shaft) / 0.1,
            (shaft - mount(y[1], y[3]) - 0.4 * y[3]) / 0.02,
        ]

    t = run.trajectory
    start = np.concatenate([t.angle[0], t.velocity[0]])
    kept = {"method": "RK45", "rtol": 1e-11, "atol": 1e-13, "max_step": 1e-3}
    return np.asarray(solve_ivp(rates, (0.0, t.end), start, **kept).y[:2, -1])


def test_a_record_drives_as_its_spline() -> None:
    run = gr.simulate(with_record(scale=1.5))
    spline = CubicSpline(TIME, SHAPE)
    assert len(run.events) > 0
    assert run.trajectory.angle[-1] == pytest.approx(integrated(run, lambda t: 1.5 * spline(t)), rel=1e-8)
    assert run.cost.energy_residual is not None
    assert run.cost.energy_residual < 1e-11


def test_the_static_start_sees_the_mean_of_the_record() -> None:
    mean = float(CubicSpline(TIME, SHAPE).integrate(0.0, TIME[-1])) / TIME[-1]
    rest = gr.equilibrium(with_record())
    assert rest.angle == pytest.approx(
        gr.equilibrium(gr.loads(TAME + f'[[torque]]\non = "engine"\nmean = {mean}\n')).angle
    )
    reported = gr.equilibrium(with_record(static=2.0))
    assert reported.angle == pytest.approx(
        gr.equilibrium(gr.loads(TAME + '[[torque]]\non = "engine"\nmean = 2\n')).angle
    )


def test_what_the_start_sees_does_not_change_the_torque() -> None:
    initial = {"angle": [0.05, 0.02], "velocity": [0.0, 0.0]}
    one, other = (gr.simulate(with_record(**extra), initial=initial) for extra in ({}, {"static": 2.0}))
    assert other.trajectory.angle == pytest.approx(one.trajectory.angle, abs=1e-12)


def test_a_run_may_begin_inside_a_record() -> None:
    late, spline = gr.simulate(with_record(start=0.7), cycles=5, initial="zero"), CubicSpline(TIME, SHAPE)
    assert late.trajectory.angle[-1] == pytest.approx(integrated(late, lambda t: spline(t + 0.7)), rel=1e-8)


def test_mean_harmonics_and_record_add_up() -> None:
    both = with_record().with_({"torque.0.mean": 1.0, "torque.0.harmonics": [{"order": 1, "amplitude": 2.0}]})
    run, spline = gr.simulate(both, initial="zero"), CubicSpline(TIME, SHAPE)
    expected = integrated(run, lambda t: spline(t) + 1.0 + 2.0 * np.sin(30.0 * t))
    assert run.trajectory.angle[-1] == pytest.approx(expected, rel=1e-8)


def test_a_record_shorter_than_the_run_is_told() -> None:
    with pytest.raises(
        gr.ModelError, match=r"torque.0.signal: found a record that ends after 2.5 s; the run takes 4.1"
    ):
        gr.simulate(with_record(), cycles=20)
    with pytest.raises(gr.ModelError, match="simulate 8 cycles at most"):
        gr.simulate(with_record(start=0.7))


def test_other_algorithms_say_that_they_cannot() -> None:
    with pytest.raises(gr.ModelError, match="needs exact"):
        gr.simulate(with_record(), "rk4")


def test_a_saved_run_opens_without_the_record(tmp_path: Path) -> None:
    rows = "\n".join(f"{t!r},{v!r}" for t, v in zip(TIME.tolist(), SHAPE.tolist(), strict=True))
    (tmp_path / "record.csv").write_text(f"t [s], T [N*m]\n{rows}\n")
    text = TAME + '[[torque]]\non = "engine"\nsignal = { file = "record.csv", time = "t", value = "T" }\n'
    (tmp_path / "model.toml").write_text(text)
    run = gr.simulate(gr.load(tmp_path / "model.toml"))
    run.save(tmp_path / "run.nc")
    (tmp_path / "record.csv").unlink()
    opened = gr.open_run(tmp_path / "run.nc")
    assert opened.model == run.model
    assert opened.data.identical(run.data)
    assert gr.simulate(opened.model).trajectory.angle[-1].tolist() == run.trajectory.angle[-1].tolist()


def test_chunks_of_a_stream_are_the_run() -> None:
    for model in (with_record(), with_motion("speed", SHAPE)):
        run, chunks = gr.simulate(model), list(gr.stream(model, chunk=3))
        assert np.concatenate([c.trajectory.angle[1:] for c in chunks]).tolist() == run.trajectory.angle[1:].tolist()


def test_a_prescribed_speed_drives_what_hangs_on_it() -> None:
    run = gr.simulate(with_motion("speed", SHAPE))
    spline = CubicSpline(TIME, SHAPE)
    about = float(spline.integrate(0.0, TIME[-1])) / TIME[-1]
    angle, t = spline.antiderivative(), run.trajectory
    assert t.velocity[:, 0] == pytest.approx(spline(t.time) - about, abs=1e-11)
    assert t.angle[:, 0] == pytest.approx(angle(t.time) - about * t.time, abs=1e-11)
    assert t.acceleration[:, 0] == pytest.approx(spline(t.time, 1), abs=1e-9)

    def rates(time: float, y: np.ndarray) -> list[float]:
        shaft = 100.0 * (angle(time) - about * time - y[0]) + 0.3 * (spline(time) - about - y[1])
        return [y[1], (shaft - mount(y[0], y[1]) - 0.4 * y[1]) / 0.02]

    start = [t.angle[0, 1], t.velocity[0, 1]]
    actual = solve_ivp(rates, (0.0, t.end), start, rtol=1e-11, atol=1e-13, max_step=1e-3)
    assert len(run.events) > 0
    assert t.angle[-1, 1] == pytest.approx(actual.y[0, -1], rel=1e-7)


def test_an_angle_record_and_its_speed_say_the_same() -> None:
    angle = 5.0 + 30.0 * TIME + 0.1 * np.sin(11.0 * TIME)
    fine = CubicSpline(TIME, angle)
    by_angle = gr.simulate(with_motion("angle", angle))
    points = np.linspace(0.0, 2.5, 5000)
    tables = gr.loads(TAME).to_tables()
    speed = {"time": points.tolist(), "value": fine(points, 1).tolist()}
    by_speed = gr.simulate(Model.from_tables({**tables, "motion": [{"on": "engine", "speed": speed}]}))
    assert by_angle.trajectory.angle == pytest.approx(by_speed.trajectory.angle, abs=1e-6)


def test_everything_turns_with_the_motion_at_the_start() -> None:
    """Whatever counts as zero: about a standstill the whole free train begins at the flywheel's speed."""
    text = TAME.replace('between = ["load", "ground"]', 'between = ["load", "wheel"]')
    text = text.replace("[[coupling]]", '[[inertia]]\nname = "wheel"\nJ = 1.0\n[[coupling]]', 1)
    motion = {"on": "engine", "speed": {"time": TIME.tolist(), "value": SHAPE.tolist()}, "about": 0.0}
    run = gr.simulate(Model.from_tables({**gr.loads(text).to_tables(), "motion": [motion]}))
    assert run.trajectory.velocity[0] == pytest.approx([SHAPE[0]] * 3, rel=1e-12)
    assert run.trajectory.deflection[0] == pytest.approx([0.0], abs=1e-15)


def test_the_torque_that_keeps_a_motion_up() -> None:
    """Simulate freely under a torque, prescribe the speed that came out, and find the torque again."""
    text = TAME + '[[torque]]\non = "engine"\nmean = 4\nharmonics = [{ order = 1, amplitude = 3 }]\n'
    free = gr.simulate(gr.loads(text), samples_per_cycle=2048, initial="zero")
    speed = {"time": free.trajectory.time.tolist(), "value": free.trajectory.velocity[:, 0].tolist()}
    motion = {"on": "engine", "speed": speed, "about": 0.0}
    start = {"angle": [0.0, 0.0], "velocity": [0.0, 0.0]}
    model = Model.from_tables({**gr.loads(TAME).to_tables(), "motion": [motion]})
    held = gr.simulate(model, samples_per_cycle=64, initial=start)
    torque = 4.0 + 3.0 * np.sin(30.0 * held.trajectory.time)
    actual = held.data.drive_torque.sel(motion="engine").to_numpy()
    assert actual[2:-2] == pytest.approx(torque[2:-2], abs=2e-3)
    assert held.trajectory.angle[:, 1] == pytest.approx(free.trajectory.angle[::32, 1], abs=1e-7)


def test_transmissibility_refers_to_the_prescribed_motion() -> None:
    run = gr.simulate(with_motion("speed", SHAPE))
    entries = [e for e in gr.criteria(run).entries if e.name == "transmissibility"]
    assert entries
    assert any("engine" in f"{e.subject} {e.formula} {e.note}" for e in entries)


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        ({"on": "engin", "speed": {}}, "engin"),
        ({"on": "engine"}, "needs one of speed, angle and harmonics"),
        ({"on": "ground", "speed": {"time": [0, 1, 2, 3], "value": [1, 1, 1, 1]}}, "no inertia has this name"),
    ],
)
def test_bad_motions(motion: dict[str, Any], words: str) -> None:
    with pytest.raises(gr.ModelError, match=words):
        Model.from_tables({**gr.loads(TAME).to_tables(), "motion": [motion]})


def test_what_a_motion_excludes() -> None:
    tables = {**with_motion("speed", SHAPE).to_tables()}
    with pytest.raises(gr.ModelError, match="a torque on it changes nothing"):
        Model.from_tables({**tables, "torque": [{"on": "engine", "mean": 1.0}]})
    with pytest.raises(gr.ModelError, match="prescribed already"):
        Model.from_tables({**tables, "motion": tables["motion"] * 2})
    both = [*tables["motion"], {**tables["motion"][0], "on": "load"}]
    with pytest.raises(gr.ModelError, match="at least one inertia must be free") as caught:
        Model.from_tables({**tables, "motion": both})
    assert "both ends move as prescribed" in str(caught.value)


def test_linear_tools_hold_the_inertia_fast_or_refuse() -> None:
    model = with_motion("speed", SHAPE)
    held = gr.loads(TAME).with_({"inertia.engine.J": 1e12})
    assert gr.modes(model).inertia_names == ("load",)
    assert gr.modes(model).frequencies == pytest.approx(gr.modes(held).frequencies[1:], rel=1e-9)
    for call in (gr.nondimensionalize, gr.contact_ratio, gr.advise, lambda m: gr.reduce(m, "20 Hz")):
        with pytest.raises(gr.ModelError, match=r"needs every inertia free|rests on harmonics"):
            call(model)


SWEEP = {"from": 25.0, "to": 60.0, "over": 2.0}
HARMONICS = [{"order": 1.0, "amplitude": {"speed": [20.0, 40.0, 70.0], "value": [6.0, 3.0, 4.0]}}]


def swept(**extra: Any) -> Model:
    text = TAME + '[[torque]]\non = "engine"\nmean = { speed = [20, 70], value = [2, 5] }\n'
    changes = {"excitation.sweep": SWEEP, "torque.0.harmonics": HARMONICS, "simulation.cycles": None}
    return gr.loads(text).with_({**changes, "simulation.discard": None, **extra})


def test_a_sweep_follows_angle_and_tables() -> None:
    run = gr.simulate(swept())

    def torque(time: float) -> float:
        share = min(time / 2.0, 1.0)
        speed = 25.0 + 35.0 * share
        angle = 25.0 * time + 35.0 * time**2 / 4.0 if time < 2.0 else 85.0 + 60.0 * (time - 2.0)
        return float(np.interp(speed, [20, 70], [2, 5]) + np.interp(speed, [20, 40, 70], [6, 3, 4]) * np.sin(angle))

    assert run.trajectory.angle[-1] == pytest.approx(integrated(run, torque), rel=1e-8)
    assert run.trajectory.end == pytest.approx(2.0, rel=0.2)
    assert run.trajectory.end >= 2.0
    assert run.trajectory.discard == 0
    speed = run.data["speed"]
    assert speed.to_numpy() == pytest.approx(25.0 + 35.0 * np.minimum(run.trajectory.time / 2.0, 1.0), rel=1e-14)
    assert any("refer to the first speed" in note for note in run.notes)


def test_a_sweep_that_stays_is_the_speed_itself() -> None:
    model = swept(**{"excitation.sweep": {"from": 30.0, "to": 30.0, "over": 1.0}})
    plain = model.with_({"excitation.speed": 30.0})
    one, other = (gr.simulate(m, cycles=10, discard=0) for m in (model, plain))
    assert one.trajectory.angle == pytest.approx(other.trajectory.angle, abs=1e-10)


def test_a_mesh_follows_a_sweep_too() -> None:
    text = TAME + '[[mesh]]\nname = "gears"\nbetween = ["engine", "load"]\nradii = [0.05, 0.05]\n'
    text = text.replace('between = ["engine", "load"]\nstiffness', 'between = ["engine", "ground"]\nstiffness')
    text += "stiffness = 4e4\ndamping = 60\ntransmission_error = [{ order = 2, amplitude = 1e-3 }]\n"
    run = gr.simulate(gr.loads(text).with_({"excitation.sweep": SWEEP, "simulation.cycles": None}))

    def rates(time: float, y: np.ndarray) -> list[float]:
        angle, speed = 25.0 * time + 35.0 * time**2 / 4.0, 25.0 + 17.5 * time
        e, slope = 1e-3 * np.sin(2.0 * angle), 2e-3 * speed * np.cos(2.0 * angle)
        force = 4e4 * (0.05 * (y[0] - y[1]) - e) + 60.0 * (0.05 * (y[2] - y[3]) - slope)
        left = -100.0 * y[0] - 0.3 * y[2] - 0.05 * force
        return [y[2], y[3], left / 0.1, (0.05 * force - mount(y[1], y[3]) - 0.4 * y[3]) / 0.02]

    t = run.trajectory
    at = int(np.searchsorted(t.time, 2.0)) - 1
    start = np.concatenate([t.angle[0], t.velocity[0]])
    actual = solve_ivp(rates, (0.0, t.time[at]), start, rtol=1e-9, atol=1e-13, max_step=1e-3).y[:2, -1]
    assert t.angle[at] == pytest.approx(actual, rel=1e-7)


def test_a_longer_run_stays_at_the_last_speed() -> None:
    model = swept()
    signals = signals_of(model.with_({"simulation.cycles": 30}))
    assert signals is not None
    assert signals.knots[-1] >= 30 * 2.0 * np.pi / 25.0
    assert gr.simulate(model, cycles=30).data["speed"].to_numpy()[-1] == 60.0


def test_a_table_that_ends_before_the_sweep_is_an_error() -> None:
    with pytest.raises(gr.ModelError, match="the sweep ends at 80"):
        swept(**{"excitation.sweep.to": 80.0})
    model = swept(**{"coupling.mount.clearance": None})
    with pytest.raises(gr.ModelError, match="cannot follow a sweep"):
        model.with_({"coupling.shaft.hysteresis": {"speed": [20, 70], "value": [1, 2]}})


def test_linear_tools_take_the_first_speed() -> None:
    model = swept()
    ratio = gr.contact_ratio(model)
    assert ratio.to_dict() == gr.contact_ratio(model.with_({"excitation.speed": 25.0})).to_dict()
    assert "the sweep counts as its first speed" in ratio.attrs["notes"]
    assert assemble(model).system.inputs.count == 0
    with pytest.raises(gr.ModelError, match="at one speed"):
        gr.reduce(model, "20 Hz")


@pytest.mark.parametrize("kind", ["record", "sweep"])
def test_without_dimensions_and_back(kind: str) -> None:
    model = with_record(static=1.0) if kind == "record" else swept()
    scaled = gr.nondimensionalize(model)
    run = scaled.restore(gr.simulate(scaled.model, cycles=6))
    assert run.trajectory.angle == pytest.approx(gr.simulate(model, cycles=6).trajectory.angle, rel=1e-7, abs=1e-10)


def test_the_whole_procedure_runs(tmp_path: Path) -> None:
    from gearrattle.pipeline import run as procedure

    for model in (with_record(), swept(), with_motion("speed", SHAPE)):
        findings = procedure(model, cycles=8)
        assert findings.advice is None
        assert findings.verdict.sentence


def test_what_looks_at_the_motion_once_a_period_refuses() -> None:
    for model in (with_record(), with_motion("speed", SHAPE), swept()):
        with pytest.raises(gr.ModelError, match="repeat every period"):
            gr.bifurcation(model, "coupling.shaft.stiffness", [90.0, 110.0])
        with pytest.raises(gr.ModelError, match="repeat every period"):
            gr.basins(model, {"velocity.load": [0.0, 1.0]})


def test_studies_compute_what_single_runs_do() -> None:
    for model in (with_record(), with_motion("speed", SHAPE), swept()):
        study = gr.study(model, axes={"coupling.shaft.stiffness": [90.0, 110.0]}, outputs=["crossings per cycle"])
        for stiffness in (90.0, 110.0):
            run = gr.simulate(model.with_({"coupling.shaft.stiffness": stiffness}))
            actual = float(study["crossings per cycle"].sel({"coupling.shaft.stiffness": stiffness}))
            inside = (run.events.time > run.trajectory.discard * run.trajectory.layout.period).sum()
            assert actual == pytest.approx(inside / (run.trajectory.cycles - run.trajectory.discard))


def test_a_record_goes_with_its_body_into_a_group() -> None:
    """A body of twice the speed is lumped onto its neighbour: its torque counts twice."""
    text = TAME.replace('between = ["load", "ground"]', 'between = ["load", "wheel"]')
    text = text.replace("[[coupling]]", '[[inertia]]\nname = "wheel"\nJ = 1.0\n[[coupling]]', 1)
    text += '[[inertia]]\nname = "pinion"\nJ = 1e-4\n[[mesh]]\nname = "gears"\nbetween = ["pinion", "wheel"]\n'
    text += 'radii = [0.05, 0.1]\nstiffness = 1e9\n[[torque]]\non = "pinion"\n'
    signal = {"time": TIME.tolist(), "value": SHAPE.tolist(), "scale": 3.0, "static": 1.0}
    smaller = gr.reduce(gr.loads(text).with_({"torque.0.signal": signal}), "20 Hz").model
    kept = smaller.torques[0].signal
    assert kept is not None
    assert (smaller.torques[0].on, kept.scale, kept.static) == ("wheel", 6.0, 2.0)
    ramped = gr.loads(text).with_({"torque.0.mean": 1.5, "torque.0.ramps": [{"at": 0.5, "over": 0.2, "to": 4.0}]})
    torque = gr.reduce(ramped, "20 Hz").model.torques[0]
    assert (torque.on, torque.mean) == ("wheel", 3.0)
    assert [(ramp.at, ramp.over, ramp.to) for ramp in torque.ramps] == [(0.5, 0.2, 8.0)]
