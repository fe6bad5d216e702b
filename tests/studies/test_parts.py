"""Axes, distributions and the grid of cases: values as the model has them, refusals with places, boxes that tile."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import stats

from gearrattle.errors import ModelError
from gearrattle.studies.distributions import distributions_of, sampled
from gearrattle.studies.plan import Plan, Samples
from gearrattle.studies.study_axes import axes_of
from tests.studies.drivelines import model

GAP, TORQUE = "coupling.joint.clearance", "torque.0.mean"


def test_values_and_ranges_are_read_as_the_model_reads_them() -> None:
    inputs = {GAP: {"from": "0.1 deg", "to": "10 deg", "count": 3, "spacing": "log"}, TORQUE: ["1 N*m", 2.5]}
    gap, torque = axes_of(inputs, model())
    np.testing.assert_allclose(gap.coordinate, np.deg2rad([0.1, 1.0, 10.0]), rtol=1e-12)
    assert torque.coordinate == (1.0, 2.5)
    assert torque.at(1) == {TORQUE: 2.5}


def test_paths_together_are_one_axis() -> None:
    (load,) = axes_of({"load": {TORQUE: [1, 2, 3], "inertia.wheel.drag_torque": [0.1, 0.2, 0.3]}}, model())
    assert (load.name, len(load), load.coordinate) == ("load", 3, (0, 1, 2))
    assert load.at(2) == {TORQUE: 3.0, "inertia.wheel.drag_torque": 0.3}


@pytest.mark.parametrize(
    ("values", "match"),
    [
        ({"coupling.joint.clearence": [1.0]}, "did you mean"),
        ({GAP: ["1 kg"]}, "clearance"),
        ({GAP: [-1.0]}, "clearance"),
        ({GAP: []}, "list of values"),
        ({GAP: "0.1 deg"}, "list of values"),
        ({GAP: {"from": 0.1, "count": 3}}, "needs to"),
        ({GAP: {"from": 0.1, "to": 0.2, "count": 1}}, "from 2"),
        ({GAP: {"from": 0.1, "to": 0.2, "steps": 3}}, "a range has"),
        ({TORQUE: {"from": 0.0, "to": 1.0, "count": 3, "spacing": "log"}}, "positive"),
        ({TORQUE: {"from": 0.0, "to": 1.0, "count": 3, "spacing": "even"}}, "linear"),
        ({"load": {TORQUE: [1, 2], GAP: [0.1]}}, "equally many"),
    ],
)
def test_wrong_axes_are_refused(values: dict[str, Any], match: str) -> None:
    with pytest.raises(ModelError, match=match):
        axes_of(values, model())


def test_every_wrong_axis_is_told() -> None:
    with pytest.raises(ModelError) as caught:
        axes_of({GAP: [-1.0], "torque.7.mean": [1.0]}, model())
    assert len(caught.value.problems) >= 2


@pytest.mark.parametrize(
    ("table", "law"),
    [
        ({"distribution": "uniform", "from": 0.01, "to": 0.03}, stats.uniform(0.01, 0.02)),
        ({"distribution": "normal", "mean": 0.02, "deviation": 0.001}, stats.truncnorm(-3, 3, 0.02, 0.001)),
        ({"distribution": "triangular", "from": 0.01, "to": 0.05, "likely": 0.02}, stats.triang(0.25, 0.01, 0.04)),
        (
            {"distribution": "log-normal", "median": 0.02, "factor": 1.5, "cut": 6.0},
            stats.lognorm(np.log(1.5), 0, 0.02),
        ),
    ],
)
@pytest.mark.parametrize("method", ["latin-hypercube", "sobol", "random"])
def test_samples_follow_their_distribution(table: dict[str, Any], law: Any, method: str) -> None:
    actual = sampled(distributions_of({GAP: table}, model()), 512, method, 3)
    assert actual.shape == (512, 1)
    assert stats.kstest(actual[:, 0], law.cdf).pvalue > 0.01
    np.testing.assert_array_equal(actual, sampled(distributions_of({GAP: table}, model()), 512, method, 3))
    assert np.any(actual != sampled(distributions_of({GAP: table}, model()), 512, method, 4))


@pytest.mark.parametrize(
    ("table", "match"),
    [
        ({"distribution": "gaussian", "mean": 1.0}, "must be one of"),
        ({"distribution": "normal", "mean": 0.02}, "needs"),
        ({"distribution": "normal", "mean": 0.02, "sigma": 1.0, "deviation": 0.001}, "no parameter"),
        (
            {"distribution": "normal", "mean": 0.02, "deviation": -1.0},
            "deviation: found -1.0; must be greater than zero",
        ),
        ({"distribution": "normal", "mean": 0.02, "deviation": "0 deg"}, 'found "0 deg"; must be greater than zero'),
        ({"distribution": "normal", "mean": 0.02, "deviation": 0.01}, "clearance"),  # reaches below zero
        ({"distribution": "uniform", "from": 0.03, "to": 0.02}, "below"),
        ({"distribution": "triangular", "from": 0.01, "to": 0.02, "likely": 0.5}, "between"),
        ({"distribution": "log-normal", "median": 0.02, "factor": 0.9}, "above 1"),
        (0.02, "must be one of"),
    ],
)
def test_wrong_distributions_are_refused(table: Any, match: str) -> None:
    with pytest.raises(ModelError, match=match):
        distributions_of({GAP: table}, model())


def test_a_deviation_with_a_unit_need_be_no_value_of_the_model() -> None:
    """5 rpm is no speed that the table of the drag torque covers; as 0.5236 it was taken, as a text it was not."""
    drag = {"speed": [90.0, 110.0], "value": [0.1, 0.2]}
    covered = model().with_({"excitation.speed": 100.0, "inertia.wheel.drag_torque": drag})
    table = {"distribution": "normal", "mean": "100 rad/s", "deviation": "5 rpm"}
    (actual,) = distributions_of({"excitation.speed": table}, covered)
    assert actual.parameters["deviation"] == pytest.approx(np.pi / 6.0, rel=1e-15)


@pytest.mark.parametrize("size", [1, 3, 4, 7, 12, 100])
@pytest.mark.parametrize("with_samples", [False, True])
def test_chunks_tile_the_grid_in_order(size: int, with_samples: bool) -> None:
    axes = axes_of({GAP: [0.01, 0.02, 0.03], TORQUE: [1.0, 2.0, 3.0, 4.0]}, model())
    samples = Samples(("coupling.joint.stiffness",), np.linspace(700, 900, 5)[:, None]) if with_samples else None
    plan = Plan(model(), axes, samples, size)
    seen: list[tuple[int, ...]] = []
    for chunk in range(plan.chunks):
        box = plan.box(chunk)
        places = [tuple(i + part.start for i, part in zip(at, box, strict=True)) for at, _ in plan.cases(chunk)]
        assert len(places) <= max(size, 1)
        seen += places
    assert seen == list(np.ndindex(*plan.shape))
    assert plan.changes(seen[-1])[TORQUE] == 4.0


def test_a_fingerprint_tells_what_is_computed_from_how_it_is_cut() -> None:
    axes = axes_of({GAP: [0.01, 0.02]}, model())
    plan = Plan(model(), axes, None, 1)
    assert plan.fingerprint == Plan(model(), axes, None, 2).fingerprint
    assert plan.fingerprint != Plan(model(), axes_of({GAP: [0.01, 0.021]}, model()), None, 1).fingerprint
    assert plan.fingerprint != Plan(model().with_({TORQUE: 0.5}), axes, None, 1).fingerprint
