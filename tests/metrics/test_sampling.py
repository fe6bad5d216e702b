"""Peaks and moments of an exact motion do not depend on its samples; what must be sampled says its error."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly.statistics import exact_signals, exact_statistics
from gearrattle.signals.summaries import missed, summary_of

EXAMPLES = Path(__file__).parents[2] / "examples"
PEAKED = ["separation", "force_statistics", "loose_gear_motion", "irregularity"]
SAMPLED = ("exceeded", "above the engine orders", "at order")


@pytest.mark.parametrize(("example", "cycles"), [("manual_transmission", 12), ("paper/case3", 8), ("paper/case1", 12)])
def test_the_default_sampling_is_within_a_tenth_of_a_per_cent_of_the_finest(example: str, cycles: int) -> None:
    """512 against 4096 samples a cycle: separation ratio, crest, kurtosis, rms and peak accelerations, irregularity."""
    tables = []
    for samples in (512, 4096):
        run = gr.simulate(
            gr.load(EXAMPLES / f"{example}.toml"), cycles=cycles, discard=cycles // 2, samples_per_cycle=samples
        )
        table = gr.metrics(run, names=PEAKED).set_index(["quantity", "subject"]).value.dropna()
        tables.append(table[[not any(word in quantity for word in SAMPLED) for quantity, _ in table.index]])
        margins = [e.value for e in gr.criteria(run).of("loose_gear") if e.quantity == "margin"]
        assert margins == pytest.approx(table.loc["separation margin"].tolist(), rel=1e-12)
    coarse, fine = tables
    assert len(coarse) >= 10
    assert coarse.to_numpy() == pytest.approx(fine.to_numpy(), rel=1e-6)


@pytest.mark.parametrize(
    ("example", "cycles"),
    [
        ("manual_transmission", 6),
        ("clutch_friction", 6),
        ("run_up", 6),
        ("measured_flywheel", 4),
        ("alternating_mesh", 8),
    ],
)
def test_extremes_and_moments_are_those_of_very_dense_samples(example: str, cycles: int) -> None:
    """Friction, run-ups, records, alternation: never inside the dense samples' range, and beyond it by little."""
    model = gr.load(EXAMPLES / f"{example}.toml")
    coarse, dense = (
        gr.simulate(model, cycles=cycles, discard=cycles // 2, samples_per_cycle=samples, audit=False).trajectory
        for samples in (128, 32768)
    )
    signals, layout = exact_signals(model, coarse), coarse.layout
    found = exact_statistics(model, coarse, signals)
    assert found is not None
    begin = dense.discard * dense.samples_per_cycle
    for i, (kind, name) in enumerate(signals):
        if kind == "force":
            element = layout.element_names.index(name)
            samples = dense.element_torque[begin:, element] / layout.radii[element, 0]
        else:
            samples = getattr(dense, kind)[begin:, layout.inertia_names.index(name)]
        told = summary_of(samples)
        rounding, beyond = 1e-7 * told.reach, 0.02 * told.reach
        assert -rounding <= found.high[i] - told.high <= beyond, (kind, name)
        assert -rounding <= told.low - found.low[i] <= beyond, (kind, name)
        assert found.mean[i] == pytest.approx(told.mean, abs=1e-4 * told.reach)
        assert found.second[i] == pytest.approx(told.second, rel=2e-3)
        assert found.fourth[i] == pytest.approx(told.fourth, rel=2e-3)


def test_a_free_oscillation_has_its_closed_form() -> None:
    """A body on a linear spring to ground, 3 samples a period of its motion: peak A w^2, <a^2> = A^2 w^4 / 2."""
    text = """
    schema = 1
    name = "one body"
    inertia = [{ name = "body", J = 1.0 }]
    excitation = { speed = 1.0 }
    [[coupling]]
    name = "spring"
    between = ["body", "ground"]
    stages = [{ until = 10.0, stiffness = 900.0 }, { stiffness = 1800.0 }]
    [simulation]
    cycles = 2
    discard = 1
    samples_per_cycle = 90
    initial = { angle = [0.1], velocity = [0.0] }
    """
    run = gr.simulate(gr.loads(text))
    found = run.trajectory.exact.statistics(run.trajectory, [("acceleration", "body"), ("velocity", "body")])
    assert found.high == pytest.approx([90.0, 3.0], rel=1e-11)
    assert found.low == pytest.approx([-90.0, -3.0], rel=1e-11)
    assert found.second == pytest.approx([90.0**2 / 2.0, 4.5], rel=1e-10)
    assert found.fourth == pytest.approx([3.0 * 90.0**4 / 8.0, 3.0 * 81.0 / 8.0], rel=1e-10)
    assert np.abs(found.mean).max() < 1e-6


def test_signals_asked_for_alone_have_the_extremes_of_all_together() -> None:
    """Moments may be left out, signal by signal: they are NaN then, and the others keep their values."""
    run = gr.simulate(gr.load(EXAMPLES / "paper" / "case3.toml"), cycles=4, discard=2)
    signals = exact_signals(run.model, run.trajectory)
    together = exact_statistics(run.model, run.trajectory, signals)
    wanted = np.array([quantity == "force" for quantity, _ in signals])
    marked = exact_statistics(run.model, run.trajectory, signals, with_moments=wanted)
    assert together is not None
    assert marked is not None
    assert np.isnan(marked.second).tolist() == (~wanted).tolist()
    assert marked.second[wanted] == pytest.approx(together.second[wanted], rel=1e-12)
    for i, signal in enumerate(signals):
        alone = exact_statistics(run.model, run.trajectory, [signal], with_moments=False)
        assert alone is not None
        assert [alone.low[0], alone.high[0]] == pytest.approx([together.low[i], together.high[i]], rel=1e-11)


def test_chunks_have_the_extremes_of_the_whole() -> None:
    model, settings = gr.load(EXAMPLES / "paper" / "case3.toml"), {"cycles": 8, "discard": 3}
    whole = gr.metrics(gr.simulate(model, **settings), names=PEAKED).set_index(["quantity", "subject"]).value
    parts = gr.metrics(gr.stream(model, chunk=2, **settings), names=PEAKED).set_index(["quantity", "subject"]).value
    both = parts.dropna()
    assert len(both) >= 10
    assert both.to_numpy() == pytest.approx(whole[both.index].to_numpy(), rel=1e-6)


def test_a_saved_motion_still_knows_its_peaks(tmp_path: Path) -> None:
    run = gr.simulate(gr.load(EXAMPLES / "paper" / "case3.toml"), cycles=4, discard=2)
    run.save(tmp_path / "run.nc")
    before, after = (gr.metrics(each, names=PEAKED) for each in (run, gr.open_run(tmp_path / "run.nc")))
    assert after.value.to_numpy() == pytest.approx(before.value.to_numpy(), rel=1e-9, nan_ok=True)


def test_samples_say_by_how_much_a_peak_may_be_missed() -> None:
    """Of a sine at 32 samples a period the estimate is an eighth of (2 pi / 32)^2: 0.48 %, as much as can be missed."""
    time = np.arange(33) / 32.0
    values = np.sin(2.0 * np.pi * (time + 0.5 / 32.0))
    assert float(missed(values)) == pytest.approx((2.0 * np.pi / 32.0) ** 2 / 8.0, rel=0.01)
    assert 1.0 - values.max() == pytest.approx(float(missed(values)), rel=0.01)


def test_a_recording_and_another_algorithm_note_the_error_of_their_peaks() -> None:
    from gearrattle.metrics import recording_of

    model = gr.load(EXAMPLES / "paper" / "case3.toml")
    exact = gr.simulate(model, cycles=6, discard=3)
    assert not gr.metrics(exact, names=["separation"]).note.str.contains("samples").any()
    heard = gr.metrics(recording_of(exact.trajectory), model, names=["separation"])
    stepped = gr.metrics(gr.simulate(model, cycles=6, discard=3, algorithm="rkv"), names=["separation"])
    for table in (heard, stepped):
        note = table[table.quantity == "separation ratio"].note.item()
        assert "a peak of samples" in note
        assert "% higher" in note


def test_a_motion_restored_to_units_has_the_peaks_of_its_own_model() -> None:
    model = gr.load(EXAMPLES / "paper" / "case3.toml")
    scaled = gr.nondimensionalize(model)
    back = scaled.restore(gr.simulate(scaled.model, cycles=3, discard=1))
    plain = gr.simulate(model, cycles=3, discard=1)
    values = [gr.metrics(run, names=["separation"]).value.tolist() for run in (back, plain)]
    assert values[0] == pytest.approx(values[1], rel=1e-6)
