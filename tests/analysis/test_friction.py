"""What calls make of friction and clipped contact damping: right, or said in a note."""

from __future__ import annotations

from dataclasses import fields
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.engine.system.crossings_in_order import Auxiliaries, Passages
from tests.architecture.places import EXAMPLES

SHORT = {"cycles": 4, "samples_per_cycle": 32, "discard": 2}
LEFT_OUT = "dry friction of damper counts as let go"


@pytest.fixture(scope="module")
def model() -> gr.Model:
    return gr.load(EXAMPLES / "clutch_friction.toml")


@pytest.fixture(scope="module")
def run(model: gr.Model) -> gr.Run:
    return gr.simulate(model, **SHORT)


def assert_same(one: Auxiliaries | Passages, two: Auxiliaries | Passages) -> None:
    for field in fields(one):
        before, after = getattr(one, field.name), getattr(two, field.name)
        if field.name == "passages":
            assert_same(before, after)
        else:
            np.testing.assert_array_equal(before, after, strict=True)


def test_a_saved_run_comes_back_with_its_sliders(run: gr.Run, tmp_path: Path) -> None:
    run.save(tmp_path / "run.nc")
    again = gr.open_run(tmp_path / "run.nc")
    assert_same(again.trajectory.auxiliaries, run.trajectory.auxiliaries)
    assert again.data.equals(run.data)
    assert again.flow_gradient.equals(run.flow_gradient)
    assert again.model == run.model


def test_the_states_of_sliders_have_words(run: gr.Run) -> None:
    words = run.data.slider.attrs["flag_meanings"].split(", ")
    assert words[:4] == ["sticks", "slips forward", "slips backward", "let go"]
    slider = run.data.sel(auxiliary="damper.drive.1")
    limit = 0.5 * (8.0 - 0.6)
    slips = slider.slider.values == words.index("slips forward")
    assert slips.any()
    assert np.all(slider.slider_force.values[slips] == limit)
    assert np.all(slider.slider_force.values[slider.slider.values == words.index("let go")] == 0.0)
    assert np.abs(slider.slider_force.values).max() <= limit * (1 + 1e-12)


def test_the_force_of_the_damper_is_law_and_sliders(run: gr.Run) -> None:
    """Stages and damping by hand, plus what the sliders say of themselves."""
    deflection = run.data.deflection.sel(clearance="damper").values
    rate = run.data.velocity.sel(inertia="flywheel").values - run.data.velocity.sel(inertia="hub").values
    degree = np.degrees(deflection)
    elastic = 0.5 * np.clip(degree, -3.0, 4.0)
    elastic += 6.0 * np.clip(degree - 4.0, 0.0, 10.0) + 5.0 * np.clip(degree + 3.0, -6.0, 0.0)
    assert degree.min() > -9.0
    assert degree.max() < 14.0
    damping = np.where(run.data.region.sel(clearance="damper").values == 0, 0.01, 0.05)
    sliders = sum(
        run.data.slider_force.sel(auxiliary=name).values
        for name in run.data.auxiliary.values
        if name.startswith("damper")
    )
    assert np.allclose(run.data.force.sel(clearance="damper").values, elastic + damping * rate + sliders, atol=1e-11)


def test_chunks_of_a_stream_have_their_sliders(model: gr.Model, run: gr.Run) -> None:
    chunks = [chunk.trajectory.auxiliaries for chunk in gr.stream(model, **SHORT, chunk=1)]
    whole = run.trajectory.auxiliaries
    for name in ("force", "memory", "piece"):
        joined = np.concatenate([getattr(c, name)[0 if i == 0 else 1 :] for i, c in enumerate(chunks)])
        assert np.array_equal(joined, getattr(whole, name))
    for name in ("time", "watch", "upward", "memory"):
        joined = np.concatenate([getattr(c.passages, name) for c in chunks])
        assert np.array_equal(joined, getattr(whole.passages, name))


def test_a_study_gives_what_runs_give(model: gr.Model, tmp_path: Path) -> None:
    path = "coupling.damper.stages.1.hysteresis"
    small = model.with_({"simulation.cycles": 4, "simulation.discard": 2, "simulation.samples_per_cycle": 32})
    actual = gr.study(small, axes={path: [2.0, 8.0]}, outputs=["crossings per cycle"], output=tmp_path / "s.zarr")
    for height, reported in zip((2.0, 8.0), actual["crossings per cycle"].values.ravel(), strict=True):
        alone = gr.simulate(small.with_({path: height}))
        late = alone.events["time"] > 2 * alone.trajectory.layout.period
        assert reported == pytest.approx(late.sum() / 2)
    assert np.ptp(actual["crossings per cycle"].values) > 0


def test_without_dimensions_and_back(model: gr.Model, run: gr.Run) -> None:
    plain = gr.nondimensionalize(model)
    back = plain.restore(gr.simulate(plain.model, **SHORT))
    mine, theirs = run.trajectory.auxiliaries, back.trajectory.auxiliaries
    log, other = mine.passages, theirs.passages
    pairs = [(mine, theirs, "force"), (mine, theirs, "memory")]
    for ours, restored, name in (*pairs, *((log, other, name) for name in ("time", "memory", "velocity"))):
        want, actual = getattr(ours, name), getattr(restored, name)
        size = np.nanmax(np.abs(want), axis=0) if want.ndim > 1 else np.nanmax(np.abs(want))
        assert np.nanmax(np.abs(actual - want) / np.where(size > 0, size, 1.0)) < 1e-8, name
    apart = np.cumsum(np.diff(log.time, prepend=0.0) > 1e-9)  # sliders that stick at one instant have no order
    assert np.array_equal(log.watch[np.lexsort((log.watch, apart))], other.watch[np.lexsort((other.watch, apart))])


def test_linear_results_say_what_they_leave_out(model: gr.Model, run: gr.Run) -> None:
    assert any(LEFT_OUT in note for note in gr.equilibrium(model).notes)
    assert any(LEFT_OUT in note for note in run.notes)
    assert any(LEFT_OUT in note for note in gr.modes(model).notes)
    assert any(LEFT_OUT in note for note in gr.stiffness(model).notes)
    assert any(LEFT_OUT in note for note in gr.campbell(model).modes[0].notes)
    assert any(LEFT_OUT in note for note in gr.condense(model, "75 Hz").notes)
    assert any(LEFT_OUT in note for note in gr.reduce(model, "75 Hz").notes)
    assert any(LEFT_OUT in note for note in gr.contact_ratio(run).attrs["notes"])
    assert any("spline, gear counts as not clipped" in note for note in gr.modes(model).notes)
    smooth = gr.load(EXAMPLES / "manual_transmission.toml")
    assert gr.modes(smooth).notes == gr.stiffness(smooth).notes == ()


@pytest.mark.slow
def test_advice_claims_no_exact_linear_motion(model: gr.Model) -> None:
    """Inside one piece the linear response is a motion of the driveline only without friction."""
    quiet = model.with_({"torque.0.harmonics": [{"order": 2, "amplitude": 1.0}], "torque.0.mean": 1.0})
    advice = gr.advise(quiet, cycles=20)
    assert "exact motion" not in advice.report
    assert "Use exact" in advice.line("algorithm").words
    assert any(LEFT_OUT in line for line in advice.line("clearances").evidence)


def shafts(hysteresis: str, between: str = '["b", "c"]') -> gr.Model:
    """Three bodies behind a gear pair, the last on a stiff shaft that may have friction."""
    return gr.loads(f"""
        schema = 1
        name = "train"
        inertia = [{{ name = "a", J = 0.1 }}, {{ name = "b", J = 0.02 }}, {{ name = "c", J = 0.03 }},
                   {{ name = "d", J = 0.3 }}]
        excitation = {{ speed = 100.0 }}
        [[coupling]]
        name = "soft"
        between = ["a", "b"]
        stiffness = 500.0
        damping = 0.1
        clearance = 0.01
        [[coupling]]
        name = "shaft"
        between = {between}
        stiffness = 1e7
        damping = 10.0
        {hysteresis}
        [[mesh]]
        name = "gear"
        between = ["c", "d"]
        radii = [0.05, 0.1]
        stiffness = 1e10
        [[torque]]
        on = "a"
        harmonics = [{{ order = 1, amplitude = 10.0 }}]
    """)


def test_an_element_with_friction_is_not_merged_unless_asked() -> None:
    stiff = gr.reduce(shafts(""), "30 Hz")
    assert [c.name for c in stiff.model.couplings] == ["soft"]
    rubs = gr.reduce(shafts('hysteresis = "2 N*m"'), "30 Hz")
    assert [c.name for c in rubs.model.couplings] == ["soft", "shaft"]
    assert not rubs.elements["shaft"].merged
    assert rubs.elements["shaft"].reason == "has dry friction"
    forced = gr.reduce(shafts('hysteresis = "2 N*m"'), "30 Hz", merge=["shaft"])
    assert "friction given up: shaft." in forced.notes


def test_friction_goes_through_the_ratio_of_a_merged_gear() -> None:
    """A coupling behind a merged gear pair is seen from a shaft that turns twice as fast: torque / 2, stiffness / 4."""
    model = gr.loads("""
        schema = 1
        inertia = [{ name = "a", J = 0.1 }, { name = "b", J = 0.02 }, { name = "c", J = 0.03 }, { name = "d", J = 0.3 }]
        excitation = { speed = 100.0 }
        [[coupling]]
        name = "soft"
        between = ["a", "b"]
        stiffness = 500.0
        clearance = 0.01
        [[coupling]]
        name = "rubs"
        between = ["c", "d"]
        stages = [
          { stiffness = 100.0, until = 0.1, hysteresis = 2.0, stick_stiffness = 900.0 },
          { stiffness = 400.0, hysteresis = { speed = [50, 150], value = [3.0, 5.0] } },
        ]
        [[mesh]]
        name = "gear"
        between = ["b", "c"]
        radii = [0.05, 0.1]
        stiffness = 1e10
        [[torque]]
        on = "a"
        harmonics = [{ order = 1, amplitude = 10.0 }]
    """)
    small = gr.reduce(model, "20 Hz")
    rubs = next(c for c in small.model.couplings if c.name == "rubs")
    ratio = 0.5 if rubs.between[0] == "b" else 1.0
    stages = rubs.stages or ()
    assert [s.hysteresis for s in stages] == pytest.approx([2.0 * ratio, 4.0 * ratio])
    assert stages[0].stick_stiffness == pytest.approx(900.0 * ratio**2)
    long, short = (gr.simulate(m, cycles=5, samples_per_cycle=64, discard=0) for m in (model, small.model))
    twist = [r.data.deflection.sel(clearance="rubs").values for r in (long, short)]
    assert np.abs(twist[0] - twist[1] * ratio).max() < 2e-3 * np.abs(twist[0]).max()
    assert len(short.trajectory.auxiliaries.passages.time) > 4


@pytest.mark.parametrize("speed", [0.0, 104.71975511965978, 157.07963267948966, 418.8790204786391])
def test_friction_over_speed_follows_the_speed(speed: float) -> None:
    """The dual-mass flywheel's loop at the speed of the model, and its share of the losses."""
    model = gr.load(EXAMPLES / "dual_mass_flywheel.toml")
    if speed == 0.0:
        with pytest.raises(gr.ModelError, match="nothing is extrapolated"):
            model.with_({"excitation.speed": 600.0})
        return
    run = gr.simulate(model.with_({"excitation.speed": speed}), **SHORT)
    loop = np.interp(speed, np.array([0.0, 1e3, 2e3, 3e3, 4e3]) * 2 * np.pi / 60, [8.0, 13.0, 28.0, 53.0, 88.0])
    force = run.data.slider_force.sel(auxiliary="arc_springs.0").values
    assert np.abs(force).max() <= 0.5 * loop * (1 + 1e-12)
    slips = np.isin(run.data.slider.sel(auxiliary="arc_springs.0").values, (1, 2))
    assert np.allclose(np.abs(force[slips]), 0.5 * loop, rtol=1e-14)
    assert slips.any() == (speed < 400.0)


def test_other_algorithms_are_refused_before_anything_runs(model: gr.Model) -> None:
    reports: list[float] = []
    with pytest.raises(gr.ModelError, match=r"need exact; the model has damper\.0.*take hysteresis"):
        gr.compare(model, ["rk4"], cycles=5, progress=reports.append)
    assert reports == []
    with pytest.raises(gr.ModelError, match=r'algorithm = "exact"'):
        gr.simulate(model, "rk4", cycles=2)


def test_switches_have_time_name_and_state(run: gr.Run) -> None:
    table, watch = run.switches, run.trajectory.auxiliaries.passages.watch
    assert list(table.columns) == ["time", "auxiliary", "state"]
    assert len(table) == int((watch >= len(run.trajectory.layout.clearance)).sum()) > 50
    assert np.all(np.diff(table["time"]) >= 0.0)
    gear = table[table["auxiliary"] == "gear.push"]
    assert set(gear["state"]) == {"idle"}  # contact begins at the limit, which ends by itself
    inner = table[table["auxiliary"] == "damper.0"]["state"].tolist()
    assert all((a == "sticks") != (b == "sticks") for a, b in pairwise(inner))
    smooth = gr.load(EXAMPLES / "manual_transmission.toml")
    assert gr.simulate(smooth, cycles=1, samples_per_cycle=8, discard=0).switches.empty


def test_friction_is_no_parameter_of_a_fit(model: gr.Model, tmp_path: Path) -> None:
    frequency = gr.modes(model).frequencies[1] / (2 * np.pi)
    (tmp_path / "data.toml").write_text(
        f'[[mode]]\nnumber = 2\nfrequency = "{frequency} Hz"\nstandard_error = "0.2 Hz"\n'
    )
    with pytest.raises(gr.ModelError, match="friction enters neither modes nor linear responses"):
        gr.identification.fit(model, tmp_path / "data.toml", ["coupling.damper.stages.1.hysteresis"])
    actual = gr.identification.fit(model, tmp_path / "data.toml", ["coupling.damper.stages.2.stiffness"])
    assert any(LEFT_OUT in note for note in actual.notes)
