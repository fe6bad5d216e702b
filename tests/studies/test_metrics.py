"""Metrics as outputs of studies: the numbers of single runs, by subject."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.quantities import evaluation
from gearrattle.quantities.evaluation import add, judge, verdict_of
from gearrattle.quantities.metric_inputs import Inputs
from gearrattle.quantities.metric_sources import inputs_of_chunks
from gearrattle.quantities.quantity_table import QUANTITIES
from gearrattle.studies.outputs import outputs_of

NAMES = ["separation margin", "mean impact intensity", "rattle level of all meshes", "transmissibility at order 1"]


def test_a_metric_in_a_study_is_that_of_the_run() -> None:
    """Of parts, of inertias and of the whole driveline; beside outputs of criteria."""
    model = gr.load("examples/paper/case1.toml").with_({"simulation.cycles": 6, "simulation.discard": 3})
    gaps = [5e-5, 2e-4]
    actual = gr.study(model, {"mesh.gear.backlash": gaps}, [*NAMES, "regime"], workers=1)
    for i, gap in enumerate(gaps):
        run = gr.simulate(model.with_({"mesh.gear.backlash": gap}), audit=False)
        table = gr.metrics(run).set_index(["quantity", "subject"]).value
        for name in NAMES:
            values = actual[name].isel({"mesh.gear.backlash": i})
            if name == "rattle level of all meshes":
                assert values.dims == ()
                assert float(values) == table[name, "all meshes"]
                continue
            (dimension,) = values.dims
            for subject in map(str, values[dimension].values):
                value = float(values.sel({dimension: subject}))
                assert value == table[name, subject] if (name, subject) in table.index else np.isnan(value)
    assert np.all(np.isfinite(actual["separation margin"].sel(part="gear")))
    assert actual["separation margin"].attrs["sampling_error"] == "none"
    assert actual["transmissibility at order 1"].attrs["sampling_error"].startswith("of samples, about")
    assert np.all(np.isnan(actual["separation margin"].sel(part="clutch")))


def test_only_quantities_that_are_asked_for_are_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    """The force exceeded 5 % of the time takes a search on the exact motion: none where it is not asked for."""
    model = gr.load("examples/paper/case1.toml").with_({"simulation.cycles": 4, "simulation.discard": 2})
    run = gr.simulate(model, audit=False)
    asked, counted = Inputs.exceeded, list[str]()

    def exceeded(self: Inputs, quantity: str, subject: str, share: float) -> float | None:
        counted.append(subject)
        return asked(self, quantity, subject, share)

    monkeypatch.setattr(Inputs, "exceeded", exceeded)
    table = gr.metrics(run).set_index(["quantity", "subject"]).value
    assert len(counted) == 1
    for name, times in (("force standard deviation", 0), ("force exceeded 5 % of the time", 1)):
        outputs = outputs_of([name], run)
        counted.clear()
        values = outputs.of(run)[name]
        assert len(counted) == times
        (output,) = outputs.chosen
        reported = dict(zip(output.subjects, values.tolist(), strict=True))
        assert reported["gear"] == table[name, "gear"]


def test_each_sum_is_added_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """To a verdict, to outputs of a study, and to criteria and metrics of one motion together."""
    counted: list[str] = []

    def counting(name: str, own: Callable[..., Any]) -> Callable[..., Any]:
        def adds(*arguments: Any) -> Any:
            counted.append(name)
            return own(*arguments)

        return adds

    monkeypatch.setattr(evaluation, "add_crossings", counting("crossings", evaluation.add_crossings))
    monkeypatch.setattr(evaluation, "add_signals", counting("signals", evaluation.add_signals))
    others = {name: counting(name, own) for name, own in evaluation._STEADY_SUMS.items()}
    monkeypatch.setattr(evaluation, "_STEADY_SUMS", others)
    run = gr.simulate(gr.load("examples/paper/case1.toml"), cycles=4, discard=2, audit=False)
    verdict = judge(run.trajectory)
    assert sorted(counted) == ["crossings", "last cycles", "peaks", "spectra"]
    outputs = outputs_of(["regime", "contact share", "impacts per cycle"], run)
    counted.clear()
    outputs.of(run)
    assert counted == ["crossings"]
    counted.clear()
    sums = add(run.trajectory, None, QUANTITIES, engine_orders=np.array([2.0]))
    assert sorted(counted) == ["crossings", "last cycles", "peaks", "signals", "spectra"]
    assert verdict_of(sums).to_dict() == verdict.to_dict()
    assert inputs_of_chunks(sums, np.array([2.0])).crossings is sums.states["crossings"]


def test_what_needs_an_audit_is_no_output() -> None:
    """Studies run without; the refusal lists what there is."""
    with pytest.raises(gr.ModelError, match=r"contact work rate.*separation margin"):
        gr.study(gr.load("examples/paper/case1.toml"), {"mesh.gear.backlash": [1e-4]}, ["contact work rate"])
