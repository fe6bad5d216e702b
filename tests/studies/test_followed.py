"""Outputs that need samples, and metrics, of cases followed together are those of each case simulated by itself."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.engine.solvers.variants import Batch
from gearrattle.studies import case_batches, case_runs
from gearrattle.studies.case_batches import can_batch, can_follow
from gearrattle.studies.output import EVENT
from gearrattle.studies.outputs import RUN_OUTPUTS, Outputs, _known
from gearrattle.studies.plan import Plan
from gearrattle.studies.study import prepare
from tests.assembly.test_variants import PATHS
from tests.assembly.test_variants import model as staged
from tests.studies.drivelines import loudness, model

EXAMPLES = Path(__file__).parents[2] / "examples"
GAP = "coupling.joint.clearance"
GAPS = {GAP: [0.004, 0.006, 0.008, 0.01]}
SCATTERING = (
    "mesh.gear.stiffness",
    "coupling.damper.stages.0.stiffness",
    "torque.0.mean",
    "inertia.wheel.drag_torque",
    "excitation.speed",
)
ROUNDING = 1e-12
"""Of the largest value of an output: times of crossings count from another cycle."""


def paper(case: str) -> gr.Model:
    settings = {"simulation.cycles": 22, "simulation.discard": 9, "simulation.samples_per_cycle": 32}
    return gr.load(EXAMPLES / "paper" / f"{case}.toml").with_(settings)


def every_output(base: gr.Model) -> tuple[str, ...]:
    """Names of all outputs of criteria and metrics; those of an event are of whole runs."""
    known = _known(["no such output"], [gr.simulate(base, audit=False)])
    return tuple(name for name in known if name not in RUN_OUTPUTS and known[name].criterion != EVENT)


def planned(base: gr.Model, axes: Mapping[str, Any], names: tuple[str, ...], **more: Any) -> tuple[Plan, Outputs]:
    """One chunk of all cases."""
    actual = prepare(base, axes, names, **more)
    plan = actual.plan
    actual.outputs.known.clear()
    return Plan(plan.model, plan.axes, plan.samples, plan.count), actual.outputs


def check(plan: Plan, outputs: Outputs, monkeypatch: pytest.MonkeyPatch) -> np.ndarray:
    """Compare a chunk with the same cases one at a time; which of them were followed together."""
    together, done = case_batches.batched(plan, outputs, 0)
    with monkeypatch.context() as patched:
        patched.setattr(case_runs, "batched", lambda *_: ({}, np.zeros(plan.count, dtype=np.bool_)))
        alone = case_runs.compute(plan, outputs, 0)
    for name, values in together.items():
        expected = alone.values[name].reshape(values.shape)[done].astype(float)
        scale = np.max(np.abs(expected), initial=0.0, where=np.isfinite(expected))
        np.testing.assert_allclose(values[done], expected, rtol=ROUNDING, atol=ROUNDING * scale, err_msg=name)
    return done


@pytest.mark.parametrize("case", ["case1", "case2", "case3", "case1_loaded", "case2_loaded", "case3_loaded"])
def test_every_output_of_the_drivelines_of_the_paper(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    axes = {"coupling.clutch.stiffness": [1400.0, 1500.0], "mesh.gear.backlash": [8e-5, 1e-4, 2e-4]}
    base = paper(case)
    assert check(*planned(base, axes, every_output(base)), monkeypatch).all()


@pytest.mark.parametrize("path", PATHS)
def test_every_output_along_every_kind_of_path(path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    low, high = PATHS[path]
    base = staged()
    plan, outputs = planned(base, {path: np.linspace(low, high, 4).tolist()}, every_output(base))
    assert check(plan, outputs, monkeypatch).all()


def test_every_output_where_many_values_scatter(monkeypatch: pytest.MonkeyPatch) -> None:
    ranges = {path: PATHS[path] for path in SCATTERING}
    vary = {path: {"distribution": "uniform", "from": low, "to": high} for path, (low, high) in ranges.items()}
    base = staged()
    assert check(*planned(base, {}, every_output(base), vary=vary, samples=12, seed=7), monkeypatch).all()


@pytest.mark.parametrize(("cycles", "discard"), [(12, 0), (5, 2), (3, 0), (12, 3)])
def test_steady_parts_of_any_length(cycles: int, discard: int, monkeypatch: pytest.MonkeyPatch) -> None:
    base = model().with_({"simulation.cycles": cycles, "simulation.discard": discard})
    for names in (("TR rms", "peak-to-peak acceleration"), every_output(base)):
        assert check(*planned(base, GAPS, names), monkeypatch).all()


def test_a_start_of_ones_own(monkeypatch: pytest.MonkeyPatch) -> None:
    base = model().with_({"simulation.initial": {"angle": [0.02, 0.0], "velocity": [0.1, -0.3]}})
    assert check(*planned(base, GAPS, every_output(base)), monkeypatch).all()


def test_only_the_cycles_that_are_judged_are_sampled(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = []
    motion = Batch.motion

    def noted(self: Batch, *of: Any) -> Any:
        rows.append(len(self.samples.states))
        return motion(self, *of)

    monkeypatch.setattr(Batch, "motion", noted)
    base = model().with_({"simulation.cycles": 40, "simulation.discard": 20})
    for names, cycles in (("TR rms",), 8), (("rms of the fluctuation",), 20):
        plan, outputs = planned(base, GAPS, names)
        rows.clear()
        assert case_batches.batched(plan, outputs, 0)[1].all()
        assert rows == 4 * [32 * cycles + 1]
    plan, outputs = planned(base, GAPS, ("mean impact intensity", "regime"))
    rows.clear()
    assert case_batches.batched(plan, outputs, 0)[1].all()
    assert rows == []


def test_a_case_that_cannot_be_told_goes_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    plan, outputs = planned(model(), GAPS, ("TR rms", "regime"))
    expected = case_runs.compute(plan, outputs, 0)
    motion, asked = Batch.motion, []

    def unclear(self: Batch, *of: Any) -> Any:
        asked.append(len(asked))
        if len(asked) == 2:
            return None
        if len(asked) == 3:
            raise FloatingPointError
        return motion(self, *of)

    monkeypatch.setattr(Batch, "motion", unclear)
    assert case_batches.batched(plan, outputs, 0)[1].tolist() == [True, False, False, True]
    asked.clear()
    actual = case_runs.compute(plan, outputs, 0)
    assert np.all(actual.outcome == case_runs.DONE)
    np.testing.assert_allclose(actual.values["TR rms"], expected.values["TR rms"], rtol=ROUNDING)


@pytest.mark.parametrize(
    ("names", "more", "follows", "in_threads"),
    [
        (("regime",), {}, True, True),
        (("regime", "TR rms"), {}, True, False),
        (("mean impact intensity",), {}, True, False),
        (("predictable cycles",), {}, False, False),
        (("TR rms over all stable motions",), {}, False, False),
        (("TR rms",), {"function": loudness}, False, False),
    ],
)
def test_what_can_be_followed(names: tuple[str, ...], more: dict[str, Any], follows: bool, in_threads: bool) -> None:
    plan, outputs = planned(model(), GAPS, names, **more)
    assert (can_follow(outputs, plan), can_batch(outputs, plan)) == (follows, in_threads)
