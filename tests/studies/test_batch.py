"""Cases computed together have the bits of each simulated and judged by itself, and each way of computing runs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import Cancelled
from gearrattle.studies import case_batches, case_runs
from gearrattle.studies.outputs import Outputs
from gearrattle.studies.plan import Plan
from gearrattle.studies.study import prepare
from tests.assembly.test_variants import PATHS
from tests.assembly.test_variants import model as staged
from tests.studies.drivelines import loudness, model

EXAMPLES = Path(__file__).parents[2] / "examples"
OUTPUTS = (
    "verdict severity",
    "verdict",
    "severity",
    "regime",
    "impacts per cycle",
    "drive-side impacts per cycle",
    "coast-side impacts per cycle",
    "impacts per second",
    "contact share",
    "share of region 0",
    "crossings per cycle",
    "function calls",
)
HARDNESS = tuple(
    f"{statistic} {quantity}"
    for statistic in ("mean", "largest")
    for quantity in ("approach speed", "impact momentum", "impact energy", "exchanged momentum", "contact impulse")
)
GAP = "coupling.joint.clearance"


def paper(case: str) -> gr.Model:
    settings = {"simulation.cycles": 14, "simulation.discard": 4, "simulation.samples_per_cycle": 20}
    return gr.load(EXAMPLES / "paper" / f"{case}.toml").with_(settings)


def planned(base: gr.Model, axes: Mapping[str, Any], outputs: tuple[str, ...], **more: Any) -> tuple[Plan, Outputs]:
    """One chunk of all cases."""
    actual = prepare(base, axes, outputs, **more)
    plan = actual.plan
    return Plan(plan.model, plan.axes, plan.samples, plan.count), actual.outputs


def check(plan: Plan, outputs: Outputs) -> np.ndarray:
    """Compare a chunk with the same cases one at a time; which of them were computed together."""
    _, done = case_batches.batched(plan, outputs, 0)
    made = case_runs.compute(plan, outputs, 0)
    for at, changes in plan.cases(0):
        run = gr.simulate(plan.model.with_(changes), audit=False)
        assert made.outcome[at] == case_runs.DONE
        for name, value in outputs.of(run).items():
            assert np.array_equal(made.values[name][at], value, equal_nan=True), (name, changes)
    return done


@pytest.mark.parametrize("case", ["case1", "case2", "case3", "case1_loaded", "case2_loaded", "case3_loaded"])
def test_drivelines_of_the_paper_give_the_same_bits(case: str) -> None:
    axes = {"coupling.clutch.stiffness": [1400.0, 1500.0], "mesh.gear.backlash": [8e-5, 1e-4, 2e-4]}
    assert check(*planned(paper(case), axes, OUTPUTS)).all()


def test_hardness_of_impacts_gives_the_same_bits_and_nothing_where_nothing_hits() -> None:
    axes = {"torque.0.harmonics.0.amplitude": [6.0, 3.0, 1.0, 0.01]}
    plan, outputs = planned(model(), axes, (*OUTPUTS, *HARDNESS))
    assert check(plan, outputs).all()
    actual = case_runs.compute(plan, outputs, 0).values["mean exchanged momentum"]
    assert np.isfinite(actual[0, 0])
    assert np.isnan(actual[-1, 0])


def test_severity_of_every_case_is_by_its_own_energies_and_by_the_thresholds_of_the_model() -> None:
    """The inertia varies: the same speed has another energy in every case."""
    axes = {"inertia.wheel.J": [0.01, 0.02, 0.04, 0.08], "torque.0.harmonics.0.amplitude": [6.0, 3.0, 1.0, 0.01]}
    plan, outputs = planned(model(), axes, ("severity", "largest impact energy", "regime"))
    energies = case_runs.compute(plan, outputs, 0).values["largest impact energy"].ravel()
    middle = float(np.median(energies[energies > 0.0]))
    said = model().with_({"criteria.negligible.impact_energy": middle})
    plan, outputs = planned(said, axes, ("verdict severity", "severity", "largest impact energy", "regime"))
    assert check(plan, outputs).all()
    made = case_runs.compute(plan, outputs, 0).values
    separates = made["regime"] > 0
    expected = np.where(separates, np.where(made["largest impact energy"] < middle, 1, 2), 0)
    assert np.array_equal(made["severity"], expected)
    assert set(np.unique(expected)) == {0, 1, 2}
    assert np.array_equal(made["verdict severity"], expected.max(axis=-1))


def test_a_threshold_may_vary_and_the_motion_stays_the_same() -> None:
    axes = {"criteria.negligible.impact_energy": [0.0, 1e-9, 1e3, 1e6]}
    plan, outputs = planned(model().with_({"torque.0.harmonics.0.amplitude": 6.0}), axes, OUTPUTS)
    check(plan, outputs)
    made = case_runs.compute(plan, outputs, 0).values
    assert made["verdict severity"].tolist() == [2, 2, 1, 1]
    assert np.unique(made["verdict"]).size == 1


@pytest.mark.parametrize("path", PATHS)
def test_every_kind_of_path_gives_the_same_bits(path: str) -> None:
    low, high = PATHS[path]
    plan, outputs = planned(staged(), {path: np.linspace(low, high, 5).tolist()}, OUTPUTS)
    assert check(plan, outputs).all()


def test_samples_over_many_paths_give_the_same_bits() -> None:
    vary = {
        path: {"distribution": "uniform", "from": PATHS[path][0], "to": PATHS[path][1]}
        for path in (
            "mesh.gear.stiffness",
            "coupling.damper.stages.0.stiffness",
            "torque.0.mean",
            "inertia.wheel.drag_torque",
        )
    }
    plan, outputs = planned(staged(), {"excitation.speed": [60.0, 140.0]}, OUTPUTS, vary=vary, samples=6, seed=4)
    assert check(plan, outputs).all()


@pytest.mark.parametrize("initial", ["zero", {"angle": [0.02, 0.0], "velocity": [0.1, -0.3]}])
def test_starts_of_ones_own_give_the_same_bits(initial: Any) -> None:
    base = model().with_({"simulation.initial": initial})
    assert check(*planned(base, {GAP: [0.004, 0.006, 0.008, 0.01]}, OUTPUTS)).all()


def test_a_case_of_another_structure_goes_alone_or_with_its_own() -> None:
    plan, outputs = planned(model(), {GAP: [0.004, 0.0, 0.008, 0.01, 0.02]}, ("crossings per cycle", "function calls"))
    assert check(plan, outputs).tolist() == [True, False, True, True, True]
    mixed = {GAP: [0.0, 0.01], "torque.0.mean": [0.1, 0.2, 0.3, 0.4, 0.5]}
    plan, outputs = planned(model(), mixed, ("crossings per cycle", "function calls"))
    assert check(plan, outputs).tolist() == 5 * [False] + 5 * [True]  # no clearance at all: no loop for it


def test_a_start_on_a_corner_or_in_a_free_gap_goes_alone() -> None:
    base = model().with_({"simulation.initial": {"angle": [0.01, 0.0], "velocity": [0.1, 0.0]}})
    assert check(*planned(base, {GAP: [0.008, 0.01, 0.012, 0.014]}, OUTPUTS)).tolist() == [True, False, True, True]
    unloaded = model().with_({"inertia.wheel.drag_torque": 0.0, "torque.0.mean": 0.0})
    assert not check(*planned(unloaded, {GAP: [0.008, 0.01, 0.012, 0.014]}, OUTPUTS)).any()


@pytest.mark.parametrize(
    ("settings", "outputs", "more"),
    [
        ({}, ("predictable cycles",), {}),
        ({}, ("largest Lyapunov exponent", "verdict"), {}),
        ({}, (), {"function": loudness}),
        ({"simulation.algorithm": "rk4"}, ("verdict",), {}),
    ],
)
def test_what_needs_the_whole_run_a_function_or_another_algorithm_goes_alone(
    settings: dict[str, Any], outputs: tuple[str, ...], more: dict[str, Any]
) -> None:
    plan, kept = planned(model().with_(settings), {GAP: [0.008, 0.01, 0.012, 0.014]}, outputs, **more)
    assert not check(plan, kept).any()


def test_axes_that_are_no_numbers_go_alone() -> None:
    table = {"speed": [50.0, 100.0], "value": [0.3, 0.5]}
    axes = {"torque.0.mean": [0.4, table, 0.5, 0.6], "simulation.cycles": [12]}
    assert not check(*planned(model(), axes, OUTPUTS)).any()
    plan, outputs = planned(model(), {"torque.0.mean": [0.4, table, 0.5, 0.6, 0.7]}, OUTPUTS)
    assert check(plan, outputs).tolist() == [True, False, True, True, True]


def test_a_case_that_the_model_refuses_says_why_and_the_others_are_computed_together() -> None:
    axes = {"coupling.damper.stages.0.until": [0.03, 0.1, 0.15, 0.19], "coupling.damper.stages.1.until": [0.12, 0.2]}
    plan, outputs = planned(staged(), axes, OUTPUTS)
    _, done = case_batches.batched(plan, outputs, 0)
    made = case_runs.compute(plan, outputs, 0)
    refused = made.outcome.ravel() == case_runs.NO_MODEL
    assert refused.tolist() == [False, False, False, False, True, False, True, False]
    assert done.tolist() == (~refused).tolist()
    assert all("stages out of order" in text for text in made.messages.values())


RECORD = {"time": [0.0, 0.25, 0.5, 0.75, 1.0, 1.25], "value": [0.0, 2.0, -1.0, 1.0, 0.5, 0.0]}
NO_LOOP: dict[str, dict[str, Any]] = {
    "a run-up": {"excitation.speed": None, "excitation.sweep": {"from": 60.0, "to": 90.0, "over": 0.5}},
    "a torque record": {"torque.0.signal": RECORD},
    "a prescribed motion": {"torque": [], "motion": [{"on": "engine", "speed": RECORD}]},
    "friction": {"coupling.joint.hysteresis": 0.2, "coupling.joint.stick_stiffness": 500.0},
    "clipped damping": {"coupling.joint.contact_damping": "clipped"},
}


@pytest.mark.parametrize("kind", NO_LOOP)
def test_what_the_loop_does_not_take_goes_alone_in_processes(kind: str) -> None:
    prepared = prepare(model().with_(NO_LOOP[kind]), {GAP: {"from": 0.005, "to": 0.02, "count": 9}}, OUTPUTS)
    assert prepared.scheduler == "local"
    plan = Plan(prepared.plan.model, prepared.plan.axes, prepared.plan.samples, prepared.plan.count)
    assert not check(plan, prepared.outputs).any()


def test_a_few_cases_are_not_worth_a_loop() -> None:
    plan, outputs = planned(model(), {GAP: [0.008, 0.01, 0.012]}, OUTPUTS)
    assert not check(plan, outputs).any()


def test_work_is_stopped_between_slices_and_told_of_as_it_goes() -> None:
    base = paper("case3").with_({"simulation.cycles": 200})
    plan, outputs = planned(base, {"mesh.gear.backlash": {"from": 8e-5, "to": 2e-4, "count": 120}}, ("verdict",))
    shares: list[float] = []

    def told(share: float) -> None:
        shares.append(share)
        if len(shares) == 2:
            raise Cancelled("enough")

    with pytest.raises(Cancelled):
        case_runs.compute(plan, outputs, 0, told)
    assert 0.0 <= shares[0] <= shares[1] < 1.0
