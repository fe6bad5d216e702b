"""The procedure on one page gives what its stages give."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle import pipeline
from gearrattle.quantities.criteria import criteria
from tests import synthetic


@pytest.fixture(scope="module")
def model() -> gr.Model:
    return gr.loads(synthetic.MODEL)


@pytest.fixture(scope="module")
def findings(model: gr.Model) -> pipeline.Findings:
    return pipeline.run(model, cycles=6, samples_per_cycle=64, discard=2)


def test_the_stages_are_the_public_calls(model: gr.Model, findings: pipeline.Findings) -> None:
    rest = gr.equilibrium(model)
    assert findings.equilibrium.region == rest.region
    assert np.array_equal(findings.modes.frequencies, gr.modes(model, region=rest.region).frequencies)
    assert np.array_equal(findings.modes_contact.frequencies, gr.modes(model).frequencies)
    run = gr.simulate(model, cycles=6, samples_per_cycle=64, discard=2)
    assert np.array_equal(findings.motion.trajectory.angle, run.trajectory.angle)
    assert findings.verdict.to_dict() == criteria(run).to_dict()
    assert findings.model is model


def test_settings_reach_the_simulation(model: gr.Model) -> None:
    actual = pipeline.run(
        model, algorithm="rk4", cycles=2, samples_per_cycle=8, discard=0, step=2e-5, initial="zero", tolerance=1e-9
    )
    motion = actual.motion.trajectory
    assert (motion.cost.algorithm, motion.cycles, motion.samples_per_cycle, motion.discard) == ("rk4", 2, 8, 0)
    assert not motion.angle[0].any()
    assert motion.cost.average_step == pytest.approx(2e-5, rel=0.01)


def test_progress_may_cancel(model: gr.Model) -> None:
    reports: list[float] = []

    def stop(fraction: float) -> None:
        reports.append(fraction)
        raise gr.Cancelled("enough")

    with pytest.raises(gr.Cancelled):
        pipeline.run(model, cycles=50_000, samples_per_cycle=4, discard=0, progress=stop)
    assert len(reports) == 1
    assert 0.0 <= reports[0] <= 1.0
