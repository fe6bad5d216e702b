"""The public calls on a small driveline: settings, notes, errors, and runs that survive a file."""

import sys
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.simulation.simulate import prepare

TOML = """
schema = 1
name = "two inertias, a gap"
[[inertia]]
name = "engine"
J = 0.2
[[inertia]]
name = "gear"
J = 0.01
drag_torque = "0.4 N*m"
[[coupling]]
name = "damper"
between = ["ground", "engine"]
stiffness = 40.0
damping = 0.05
[[mesh]]
name = "mesh"
between = ["engine", "gear"]
radii = [0.05, 0.025]
stiffness = 1e7
damping = 200.0
backlash = "0.1 mm"
[excitation]
speed = "1200 rpm"
[[torque]]
on = "engine"
harmonics = [{ order = 1, amplitude = 15.0 }, { order = 0.5, amplitude = 3.0, phase = "30 deg" }]
[[torque]]
on = "gear"
mean = 0.0
"""


@pytest.fixture(scope="module")
def model() -> gr.Model:
    return gr.loads(TOML)


@pytest.fixture(scope="module")
def run(model: gr.Model) -> gr.Run:
    return gr.simulate(model, cycles=6, samples_per_cycle=32, discard=2)


def test_the_dataset_has_the_names_and_shapes_promised(run: gr.Run) -> None:
    data = run.data
    assert dict(data.sizes) == {"time": 193, "inertia": 2, "clearance": 1, "element": 2}
    assert list(data.clearance.values) == ["mesh"]
    assert list(data.element.values) == ["damper", "mesh"]
    assert data.attrs["period"] == pytest.approx(2 * 2 * np.pi / (1200 * np.pi / 30), rel=1e-14)
    assert data.time.values[-1] == pytest.approx(6 * data.attrs["period"], rel=1e-15)
    angle = data.angle
    delta = 0.05 * angle.sel(inertia="engine") - 0.025 * angle.sel(inertia="gear")
    assert np.abs(delta - data.deflection.sel(clearance="mesh")).max() <= 1e-13


def test_the_equation_of_motion_holds_at_every_sample(run: gr.Run, model: gr.Model) -> None:
    data, speed = run.data, model.excitation.omega
    t = data.time.values
    applied = 15.0 * np.sin(speed * t) + 3.0 * np.sin(0.5 * speed * t + np.pi / 6)
    taken = data.element_torque
    engine = applied + taken.sel(element="damper").values - taken.sel(element="mesh").values
    gear = -0.4 + taken.sel(element="mesh").values * 0.025 / 0.05
    assert 0.2 * data.acceleration.sel(inertia="engine").values == pytest.approx(engine, abs=1e-9)
    assert 0.01 * data.acceleration.sel(inertia="gear").values == pytest.approx(gear, abs=1e-9)


def test_events_are_ordered_chained_and_match_the_sampled_regions(run: gr.Run) -> None:
    events = run.events
    assert list(events.columns[:5]) == ["time", "clearance", "from_region", "to_region", "velocity"]
    assert events.time.is_monotonic_increasing
    assert (events.from_region.values[1:] == events.to_region.values[:-1]).all()
    assert (np.sign(events.velocity) == events.to_region - events.from_region).all()
    after = np.searchsorted(events.time.values, run.data.time.values, side="right") - 1
    region = run.data.region.sel(clearance="mesh").values
    inside = after >= 0
    assert (region[inside] == events.to_region.values[after[inside]]).all()
    delta = run.data.deflection.sel(clearance="mesh").values / 5e-5
    assert (np.abs(delta[region == 0]) <= 1 + 1e-9).all()
    assert (np.abs(delta[region != 0]) >= 1 - 1e-9).all()


def test_a_run_survives_its_file(run: gr.Run, tmp_path: Path) -> None:
    run.save(tmp_path / "run.nc")
    again = gr.open_run(tmp_path / "run.nc")
    assert again.data.identical(run.data)
    assert again.events.equals(run.events)
    assert (again.cost, again.notes, again.model) == (run.cost, run.notes, run.model)
    assert gr.criteria(again).to_dict() == gr.criteria(run).to_dict()
    assert [p.name for p in tmp_path.iterdir()] == ["run.nc"]


def test_plain_xarray_opens_the_file(run: gr.Run, tmp_path: Path) -> None:
    import xarray as xr

    run.save(tmp_path / "run.nc")
    with xr.open_dataset(tmp_path / "run.nc") as data:
        assert np.array_equal(data.angle.values, run.data.angle.values)
        assert list(data.inertia.values) == ["engine", "gear"]
    with xr.open_dataset(tmp_path / "run.nc", group="events") as events:
        assert np.array_equal(events.time.values, run.events.time.values)


def test_csv_has_the_columns_promised(run: gr.Run, tmp_path: Path) -> None:
    import pandas as pd

    run.save(tmp_path / "run.csv")
    table = pd.read_csv(tmp_path / "run.csv", dtype=str)  # not every version reads numbers to the last bit
    assert list(table.columns) == [
        "time",
        "angle.engine",
        "angle.gear",
        "velocity.engine",
        "velocity.gear",
        "acceleration.engine",
        "acceleration.gear",
        "deflection.mesh",
        "force.mesh",
    ]
    force = np.array([float(text) for text in table["force.mesh"]])
    assert np.array_equal(force, run.data.force.sel(clearance="mesh"))


@pytest.mark.parametrize("name", ["run.txt", "run.h5"])
def test_another_ending_is_refused_and_nothing_written(run: gr.Run, tmp_path: Path, name: str) -> None:
    with pytest.raises(gr.ModelError, match=r"\.nc, \.csv, \.pdf, \.pptx or \.xlsx"):
        run.save(tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("content", [b"", b"no netCDF at all", b"\x89HDF\r\n\x1a\n damaged"])
def test_a_file_that_is_no_run_is_one_clear_error(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "x.nc").write_bytes(content)
    with pytest.raises(gr.ModelError, match="netCDF file written by"):
        gr.open_run(tmp_path / "x.nc")
    with pytest.raises(gr.ModelError, match="no such file"):
        gr.open_run(tmp_path / "missing.nc")


@pytest.mark.parametrize(
    ("file", "call", "expected"),
    [
        ({}, {}, (200, 100)),
        ({}, {"cycles": 20}, (20, 10)),
        ({}, {"cycles": 500}, (500, 100)),
        ({}, {"cycles": 20, "discard": 0}, (20, 0)),
        ({}, {"discard": 30}, (200, 30)),
        ({"cycles": 50}, {}, (50, 25)),
        ({"cycles": 50, "discard": 40}, {}, (50, 40)),
        ({"cycles": 50, "discard": 40}, {"cycles": 60}, (60, 30)),
        ({"discard": 5}, {"cycles": 60}, (60, 5)),
    ],
)
def test_precedence_of_cycles_and_discard(
    model: gr.Model, file: dict[str, int], call: dict[str, int], expected: tuple[int, int]
) -> None:
    changed = model.with_({f"simulation.{key}": value for key, value in file.items()})
    trajectory = gr.simulate(changed, samples_per_cycle=1, **call).trajectory
    assert (trajectory.cycles, trajectory.discard) == expected


@pytest.mark.parametrize(
    ("call", "words"),
    [
        ({"cycles": 5, "discard": 5}, "discard"),
        ({"cycles": 0}, "cycles"),
        ({"samples_per_cycle": 0}, "samples_per_cycle"),
        ({"algorithm": "rk5"}, "rk4"),
        ({"tolerance": -1.0}, "tolerance"),
        ({"algorithm": "rk4", "step": "5 mm"}, "step"),
        ({"initial": "rest"}, "static"),
        ({"initial": {"angle": [0.0], "velocity": [0.0, 0.0]}}, "2 inertias"),
    ],
)
def test_bad_settings_are_refused_by_name(model: gr.Model, call: dict[str, object], words: str) -> None:
    with pytest.raises(gr.ModelError, match=words):
        gr.simulate(model, **call)  # type: ignore[arg-type]


def test_progress_is_told_and_what_it_raises_ends_the_run(model: gr.Model) -> None:
    reports: list[float] = []
    gr.simulate(model, cycles=4000, samples_per_cycle=8, progress=reports.append)
    assert reports == sorted(reports)
    assert 0 < reports[0] < reports[-1] <= 1

    def stop(_fraction: float) -> None:
        raise gr.Cancelled

    with pytest.raises(gr.Cancelled):
        gr.simulate(model, cycles=400, samples_per_cycle=64, progress=stop)


def test_notes_tell_of_an_unloaded_gap_and_of_an_accelerated_train(model: gr.Model) -> None:
    loose = model.with_({"inertia.gear.drag_torque": 0.0})
    assert any("mesh" in note and "middle" in note for note in gr.simulate(loose, cycles=1).notes)
    free = gr.loads(TOML.replace('["ground", "engine"]', '["gear", "engine"]').replace("0.025]", "0.05]"))
    assert any("accelerates" in note for note in gr.simulate(free, cycles=1).notes)


def test_a_model_of_one_inertia_and_nothing_else_is_still_a_model() -> None:
    text = "schema = 1\n[[inertia]]\nname = 'a'\nJ = 2.0\n[excitation]\nspeed = 1.0\n[[torque]]\non = 'a'\nharmonics = [{ order = 1, amplitude = 4.0 }]\n"  # noqa: E501
    run = gr.simulate(gr.loads(text), cycles=3, samples_per_cycle=8, initial="zero")
    t = run.data.time.values
    assert run.data.velocity.values[:, 0] == pytest.approx(2.0 * (1 - np.cos(t)), abs=1e-13)
    assert run.data.angle.values[:, 0] == pytest.approx(2.0 * (t - np.sin(t)), abs=1e-12)


def test_a_run_tells_how_far_ahead_it_is_predicted(model: gr.Model) -> None:
    long = gr.simulate(model, cycles=60, samples_per_cycle=4, discard=10)
    assert 0 < long.predictability_horizon < long.trajectory.end
    assert long.lyapunov_exponents.shape == (4,)
    assert long.lyapunov_exponents[0] > 0
    lashed = model.with_({"mesh.mesh.backlash": 0.0})
    calm = gr.simulate(lashed, cycles=60, samples_per_cycle=4)
    assert calm.predictability_horizon == float("inf")
    assert calm.lyapunov_exponents[0] < 0


def test_the_flow_gradient_is_labelled_and_predicts_a_neighbouring_motion(model: gr.Model) -> None:
    start = {"angle": [0.01, 0.02], "velocity": [0.5, -1.0]}
    run = gr.simulate(model, cycles=1, samples_per_cycle=4, initial=start)
    gradient = run.flow_gradient
    names = ["deflection.mesh", "deflection.damper", "velocity.engine", "velocity.gear"]
    assert list(gradient.state.values) == list(gradient.start.values) == names
    nudge = 1e-9
    near = gr.simulate(
        model, cycles=1, samples_per_cycle=4, initial={"angle": [0.01, 0.02], "velocity": [0.5, -1.0 + nudge]}
    )
    moved = (near.data.velocity - run.data.velocity).values[-1] / nudge
    assert moved == pytest.approx(gradient.sel(start="velocity.gear").values[2:], rel=1e-3, abs=1e-5)


def test_chatter_ends_the_run_with_the_element_and_the_time(model: gr.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gearrattle.engine.solvers.samples_in_si._MOST_A_PERIOD", 3)
    monkeypatch.setattr("gearrattle.engine.solvers.exact._BUDGET", 50)
    with pytest.raises(gr.ConvergenceError, match=r"crossings pile up in mesh at t = .* s; try: add damping") as caught:
        gr.simulate(model, cycles=50, samples_per_cycle=8)
    assert 0 < caught.value.time < 50 * 0.11
    assert set(caught.value.state) == {"deflection.mesh"}


def test_an_unstable_fixed_step_is_a_convergence_error_with_time_and_state(model: gr.Model) -> None:
    stiff = model.with_({"coupling.damper.stiffness": 1e8})
    with pytest.raises(
        gr.ConvergenceError, match=r"rk4: the state is no longer finite .* try: a smaller step"
    ) as caught:
        gr.simulate(stiff, "rk4", cycles=50, samples_per_cycle=8, step=2e-3)
    assert caught.value.time > 0
    assert set(caught.value.state) == {"deflection.mesh"}


UNDAMPED = {"coupling.damper.damping": 0.0, "mesh.mesh.damping": 0.0}


@pytest.mark.parametrize(
    ("damps", "is_undamped"),
    [
        ({}, True),
        ({"coupling.damper.damping": 1e-9}, False),
        ({"mesh.mesh.damping": 1e-9}, False),
        ({"inertia.gear.drag": 1e-9}, False),
        ({"coupling.damper.hysteresis": 0.1}, False),
        ({"inertia.gear.drag_torque": 0.0}, True),
    ],
)
def test_where_nothing_decays_a_run_says_so(model: gr.Model, damps: dict[str, float], is_undamped: bool) -> None:
    changed = model.with_({**UNDAMPED, **damps})
    notes = gr.simulate(changed, cycles=2, samples_per_cycle=4).notes
    assert any("nothing decays" in note for note in notes) is is_undamped


def test_an_undamped_motion_does_not_decay(model: gr.Model) -> None:
    """What the note says: without a torque, the energy after twenty periods is that of the start."""
    free = model.with_({**UNDAMPED, "torque.0.harmonics.0.amplitude": 0.0, "torque.0.harmonics.1.amplitude": 0.0})
    start = {"angle": [0.02, 0.04], "velocity": [0.0, 0.0]}
    run = gr.simulate(free, cycles=20, discard=0, samples_per_cycle=64, initial=start)
    motion = run.trajectory
    kinetic = 0.5 * (motion.velocity**2 @ np.array([0.2, 0.01]))
    spring = 20.0 * motion.angle[:, 0] ** 2
    beyond = np.maximum(np.abs(motion.deflection[:, 0]) - 5e-5, 0.0)
    work = -0.4 * motion.angle[:, 1]  # of the drag torque, which is constant
    energy = kinetic + spring + 0.5e7 * beyond**2 - work
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)


def calls_of(model: gr.Model, **settings: Any) -> int:
    """Functions of Python that a simulation calls."""
    count = 0

    def profiler(_: FrameType, event: str, __: object) -> None:
        nonlocal count
        count += event == "call"

    before = sys.getprofile()
    sys.setprofile(profiler)
    try:
        gr.simulate(model, **settings)
    finally:
        sys.setprofile(before)
    return count


@pytest.mark.compiled
def test_a_run_again_makes_nothing_again() -> None:
    """All that a model, its settings and its regions give is kept: what is left is the march and its motion."""
    settings: dict[str, Any] = {"cycles": 2, "discard": 0, "samples_per_cycle": 16, "audit": False}
    for name in ("case3", "clutch_friction", "run_up"):
        model = gr.example(name)
        first = calls_of(model, **settings)
        gr.simulate(model, **settings)
        again = calls_of(model, **settings)
        assert again < 400, name  # 256 to 286; 800 to 16,000 when every run settled, started and packed anew
        assert again < first / 4, name


def test_settings_as_of_the_last_call_are_checked_as_others(model: gr.Model) -> None:
    settings: dict[str, Any] = {"samples_per_cycle": 8, "audit": False}
    assert gr.simulate(model, cycles=1, **settings).model is gr.simulate(model, cycles=1, **settings).model
    with pytest.raises(gr.ModelError, match="cycles"):
        gr.simulate(model, cycles=True, **settings)
    assert gr.simulate(model, cycles=2, **settings).trajectory.cycles == 2


def test_a_start_is_nobody_s_to_change(model: gr.Model) -> None:
    """The state in which runs begin is kept, and handed out as a copy."""
    plans = [prepare(model, {"initial": "steady"}, audit=False) for _ in range(2)]
    plans[0].task.angle[:] = np.nan
    assert np.isfinite(plans[1].task.angle).all()
    assert np.isfinite(prepare(model, {"initial": "steady"}, audit=False).task.angle).all()
