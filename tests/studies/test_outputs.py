"""Outputs: what there is does not depend on a motion, and what a motion lacks has the value that says so."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.cli import main
from gearrattle.errors import ModelError
from gearrattle.quantities.quantity_table import CRITERIA
from gearrattle.report.study_pages import page_of
from gearrattle.signals import gap_names
from gearrattle.studies.outputs import check_names
from gearrattle.studies.plan import Plan
from gearrattle.studies.structures import structures_of
from gearrattle.studies.study_axes import axes_of
from gearrattle.studies.study_store import OUTCOME
from tests.quantities.reading import evaluate
from tests.studies.drivelines import TOML, model

AMPLITUDE, GAP = "torque.0.harmonics.0.amplitude", "coupling.joint.clearance"
SEVERITY = ["largest impact energy", "mean impact energy", "largest contact impulse", "impacts per cycle"]
QUIET_FIRST, QUIET_LAST = [0.01, 1.0, 3.0, 6.0, 12.0], [12.0, 6.0, 3.0, 1.0, 0.01]


def test_a_study_whose_first_case_has_no_impact_keeps_what_impacts_have() -> None:
    rising, falling = (gr.study(model(), {AMPLITUDE: entry}, SEVERITY) for entry in (QUIET_FIRST, QUIET_LAST))
    for name in SEVERITY:
        np.testing.assert_array_equal(rising[name].values, falling[name].values[::-1])
    energy, mean = rising["largest impact energy"].values[:, 0], rising["mean impact energy"].values[:, 0]
    np.testing.assert_array_equal(energy[:3], 0.0)
    assert np.isnan(mean[:3]).all()
    assert (energy[3:] > mean[3:]).all()
    assert (mean[3:] > 0.0).all()
    assert (rising["largest contact impulse"].values[:3] == 0.0).all()


def test_cases_computed_together_and_alone_lack_the_same() -> None:
    alone = gr.study(model(), {AMPLITUDE: QUIET_FIRST}, [*SEVERITY, "TR rms"])
    together = gr.study(model(), {AMPLITUDE: QUIET_FIRST}, SEVERITY)
    for name in SEVERITY:
        np.testing.assert_array_equal(alone[name].values, together[name].values)


def test_the_answer_says_how_many_cases_have_no_impact() -> None:
    actual = gr.study(model(), {AMPLITUDE: QUIET_FIRST}, SEVERITY)
    page = page_of(actual)
    assert "joint: no impact in 3 of 5 computed cases." in page.summary(actual)
    lacking = [{"subject": "joint", "lacking": "no impact", "cases": 3, "of": 5}]
    assert page.content(actual)["lacking"] == lacking


def test_samples_whose_first_is_quiet_give_probabilities_and_sensitivities() -> None:
    vary = {AMPLITUDE: {"distribution": "uniform", "from": 0.1, "to": 12.0}}
    names = ["regime", "largest impact energy"]
    actual = gr.study(model(), outputs=names, vary=vary, samples=16, method="sobol", seed=1)
    rattles = int((actual["regime"] > 0).sum())
    assert 0 < rattles < 16
    assert int(gr.studies.rattle_probability(actual).sel(part="joint")["rattling"]) == rattles
    assert int((actual["largest impact energy"] > 0.0).sum()) == rattles
    follows = gr.studies.sensitivities(actual, "largest impact energy").sel(part="joint")
    assert float(follows["spearman"][0]) > 0.8


def test_sobol_indices_need_no_impact_in_every_case() -> None:
    vary = {
        name: {"distribution": "uniform", "from": low, "to": high}
        for name, low, high in ((AMPLITUDE, 0.1, 12.0), (GAP, 0.008, 0.012))
    }
    actual = gr.study(model(), outputs=["largest impact energy"], vary=vary, samples=16, method="saltelli", seed=1)
    total = gr.studies.sensitivities(actual, "largest impact energy").sel(part="joint")["total_order"].values
    assert np.isfinite(total).all()
    assert total[0] > total[1]


def test_an_optimum_without_impacts_beats_one_with_impacts() -> None:
    actual = gr.optimize(
        model(),
        {AMPLITUDE: (0.1, 12.0)},
        {"largest impact energy": "min"},
        population=8,
        generations=2,
        seed=1,
        constraints={"joint: largest impact energy": {"below": 1.0}},
    )
    best = int(actual.attrs["best"])
    assert float(actual["value"][best, 0]) == 0.0
    assert int(actual["certified"][best]) == 1
    assert "joint: no impact in" in page_of(actual).summary(actual)
    assert page_of(actual).content(actual)["lacking"][0]["of"] == 16


def test_the_worst_design_is_found_from_a_quiet_one() -> None:
    quiet = model().with_({AMPLITUDE: 0.1})
    actual = gr.optimize(quiet, {AMPLITUDE: (0.1, 12.0)}, {"mean impact energy": "max"}, population=8, generations=2)
    assert float(actual["value"][int(actual.attrs["best"]), 0]) > 0.0


@pytest.mark.parametrize(
    "goals",
    [
        {"objectives": {"joint: mean impact energy": "min"}},
        {"objectives": {"verdict": "min"}, "constraints": {"joint: mean impact energy": {"below": 1.0}}},
    ],
)
def test_what_the_best_design_would_lack_is_no_objective(goals: dict[str, dict[str, object]]) -> None:
    with pytest.raises(ModelError, match=r'no impact, so such a design could not win.*"joint: largest impact energy"'):
        gr.optimize(model(), {AMPLITUDE: (0.1, 12.0)}, **goals)  # type: ignore[arg-type]


def test_an_unknown_name_is_refused_with_the_nearest_before_a_case_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    study = importlib.import_module("gearrattle.studies.study")
    monkeypatch.setattr(study, "first_run", lambda _: pytest.fail("a case was run"))
    with pytest.raises(ModelError, match='did you mean "largest impact energy"') as caught:
        gr.study(model(), {AMPLITUDE: QUIET_FIRST}, ["largest impact enrgy", "impacts a cycle"])
    assert len(caught.value.problems) == 2


def test_a_gap_that_is_closed_in_the_first_case_is_a_part() -> None:
    actual = gr.study(model(), {GAP: [0.0, 0.004, 0.01]}, ["regime", "verdict", *SEVERITY, "contact share"])
    assert actual["regime"].attrs["can_rattle"] == "joint"
    assert actual["regime"].values[:, 0].tolist() == [0, 2, 2]
    assert actual["verdict"].values.tolist() == [0, 2, 2]
    assert actual["impacts per cycle"].values[0, 0] == 0.0
    assert actual["largest impact energy"].values[0, 0] == 0.0
    assert actual["contact share"].values[0, 0] == 1.0


def test_a_gap_that_two_axes_open_together_is_a_part() -> None:
    base = model().with_({"coupling.joint.damping": 0.0})
    axes = {GAP: [0.0, 0.01], "coupling.joint.stiffness": [0.0, 800.0]}
    structures = structures_of(Plan(base, axes_of(axes, base), None, 1))
    gaps = [gap_names(assemble(structure).layout) for structure in structures]
    assert gaps == [(), ("joint",)]


def test_an_order_that_the_first_case_lacks_is_an_output() -> None:
    order = "torque.0.harmonics.0.order"
    actual = gr.study(model(), {order: [1.0, 2.0]}, ["amplitude at order 1", "amplitude at order 2"])
    engine = actual["amplitude at order 2"].sel(inertia="engine").values
    assert np.isnan(engine[0])
    assert engine[1] > 0.0


@pytest.mark.parametrize("amplitude", [0.01, 6.0, 12.0])
def test_every_entry_of_a_motion_is_one_of_a_period_or_occasional(amplitude: float) -> None:
    """The law behind it all: what there is does not depend on the motion."""
    run = gr.simulate(model().with_({AMPLITUDE: amplitude}))
    period = gr.simulate(model(), cycles=1, discard=0)
    for variable in CRITERIA:
        ever = {(e.subject, e.quantity): e for e in variable.occasional(run.trajectory.layout)}
        always = {(e.subject, e.quantity) for e in evaluate(variable, period.trajectory)} - set(ever)
        now = {(e.subject, e.quantity): e for e in evaluate(variable, run.trajectory)}
        assert always <= set(now) <= always | set(ever)
        assert all(ever[key].unit == entry.unit for key, entry in now.items() if key in ever)
    check_names([e.quantity for entry in CRITERIA for e in evaluate(entry, run.trajectory)], [model()])


def test_the_command_counts_quiet_cases(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "two.toml").write_text(TOML, encoding="utf-8")
    text = f'model = "two.toml"\noutputs = ["mean impact energy"]\n[axis]\n"{AMPLITUDE}" = [0.01, 6.0, 12.0]\n'
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    assert main(["study", str(tmp_path / "study.toml"), "-o", str(tmp_path / "o")]) == 0
    assert "joint: no impact in 1 of 3 computed cases." in capsys.readouterr().out
    kept = gr.open_study(tmp_path / "o")
    assert (kept[OUTCOME] == 1).all()
    assert kept["mean impact energy"].attrs["lacking"] == "no impact"
