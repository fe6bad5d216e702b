"""What uncertain parameters could explain: closed forms, the information form of the same update, correlations."""

from __future__ import annotations

import math

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.measured.validation.explained_by_parameters import correlation, effects, update
from gearrattle.measured.validation.parameter_uncertainty import Drawn
from gearrattle.report.validation_tables import parameter_tables
from tests.measured.validation import made

J = "inertia.wheel.J"
FIRST = "torque.0.harmonics.0.amplitude"
THIRD = "torque.0.harmonics.1.amplitude"
ERRORS = {J: 0.02, FIRST: 0.1, THIRD: 0.04}
"""One per cent each."""
SLOPES = {J: -1.0, FIRST: 100.0 / 116.0, THIRD: 16.0 / 116.0}
"""d ln(rms) / d ln(parameter): a is the torque over J, and its square the sum of those of both orders."""


@pytest.fixture(scope="module")
def validation() -> gr.typing.Validation:
    return gr.validate(made.run(), made.record(gain=1.03), parameters=ERRORS, draws=24, seed=1)


def test_effects_are_the_closed_forms(validation: gr.typing.Validation) -> None:
    reported = validation.parameters
    assert reported is not None
    for parameter in reported.parameters:
        effect = next(effect for effect in parameter.effects if effect.measure == "rms")
        assert effect.value == pytest.approx(SLOPES[parameter.path] / 1.03, rel=0.02)  # % of what was measured
        assert abs(effect.value - SLOPES[parameter.path] / 1.03) < 4.0 * effect.error + 1e-3
        assert effect.needed == pytest.approx(100.0 * math.log(1.03) / SLOPES[parameter.path], rel=0.02)


def test_the_levels_pull_along_their_gradient(validation: gr.typing.Validation) -> None:
    """One precise datum: x = g d / g.g, and whatever leaves it unchanged stays open."""
    reported = validation.parameters
    assert reported is not None
    g = 0.01 * np.array([SLOPES[path] for path in ERRORS])
    shift = g * math.log(1.03) / (g @ g)
    assert [p.shift for p in reported.parameters] == pytest.approx(shift.tolist(), rel=0.03)
    spread = np.eye(3) - np.outer(g, g) / (g @ g)
    assert [p.left for p in reported.parameters] == pytest.approx(np.sqrt(np.diag(spread)).tolist(), rel=0.02)
    assert np.array(reported.estimated) == pytest.approx(correlation(spread), abs=0.02)
    assert reported.before == pytest.approx([100.0 * math.log(1.03)], abs=0.01)  # resampling passes within 1e-4
    assert abs(reported.after[0]) < 0.01 * reported.before[0]
    assert reported.chi_square[1] < reported.chi_square[0]
    assert any(J in sentence for sentence in validation.findings)


def test_exchangeable_parameters_are_named() -> None:
    """Inertia and the torque that moves it: a level tells their quotient alone."""
    validation = gr.validate(made.run(), made.record(), parameters={J: 0.04, FIRST: 0.2}, draws=12)
    assert validation.parameters is not None
    assert validation.parameters.estimated[0][1] > 0.99
    assert any("cannot be told apart" in sentence for sentence in validation.findings)
    tables = parameter_tables(validation)
    assert [table.title for table in tables] == [
        "Parameters, each alone",
        "Parameters, all together",
        "Which go together",
    ]
    assert tables[2].rows[0][:2] == (J, FIRST)


def test_too_few_runs_say_so() -> None:
    validation = gr.validate(made.run(), made.record(), parameters=ERRORS, draws=5)
    assert validation.parameters is None
    assert any("draws=6 or more" in note for note in validation.notes)
    assert parameter_tables(validation) == []


def test_the_update_in_information_form() -> None:
    """(R^-1 + G' V^-1 G)^-1, and its right side: the same by other algebra."""
    rng = np.random.default_rng(4)
    for free, data in ((2, 5), (4, 3), (3, 1)):
        g, root = rng.standard_normal((data, free)), rng.standard_normal((data, data))
        v = root @ root.T + 0.1 * np.eye(data)
        mixed = rng.standard_normal((free, 2 * free))
        stated = correlation(mixed @ mixed.T)
        d = rng.standard_normal(data)
        shift, spread = update(g, d, v, stated)
        expected = np.linalg.inv(np.linalg.inv(stated) + g.T @ np.linalg.solve(v, g))
        assert spread == pytest.approx(expected, abs=1e-10)
        assert shift == pytest.approx(expected @ g.T @ np.linalg.solve(v, d), abs=1e-10)


def test_errors_of_effects_hold_what_scatter_makes_of_them() -> None:
    """Of a line with noise, 95 of 100 effects lie within Student's interval of their truth."""
    from scipy.stats import t

    rng = np.random.default_rng(8)
    truth = np.array([0.5, -0.2])
    count = 16
    inside = []
    for _ in range(300):
        z = rng.standard_normal((count, 2))
        logs = (1.0 + z @ truth + 0.3 * rng.standard_normal(count))[:, None, None]
        slopes, errors = effects(Drawn({"a": (1.0, 0.1), "b": (1.0, 0.1)}, np.eye(2), z, logs))
        inside += (np.abs(slopes[:, 0, 0] - truth) <= t.ppf(0.975, count - 3) * errors[:, 0, 0]).tolist()
    assert 0.92 < np.mean(inside) < 0.98


def _fit(correlated: float) -> gr.typing.Fit:
    """A fit of inertia and first torque, one per cent each."""
    from gearrattle.measured.identification.fit_result import FittedParameter

    parameters = tuple(
        FittedParameter(path, value, value, 0.01 * value, 0.1 * value, 10.0 * value, "")
        for path, value in ((J, 2.0), (FIRST, 10.0))
    )
    covariance = 1e-4 * np.array([[1.0, correlated], [correlated, 1.0]])
    return gr.typing.Fit(gr.loads(made.MODEL), parameters, (), 0.0, 1, covariance, (), 1, (), ())


@pytest.mark.parametrize(
    "correlated", [-1.0, 0.9, *(pytest.param(value, marks=pytest.mark.long) for value in (0.0, 1.0))]
)
def test_a_fit_brings_its_correlations(correlated: float) -> None:
    """The variance of ln(rms) is s' R s: what moves together may cancel, or add up."""
    validation = gr.validate(made.run(), made.record(), parameters=_fit(correlated), draws=60, seed=2)
    reported = next(entry for entry in validation["a"].level("rms").budget if entry.source == "parameters")
    s = np.array([SLOPES[J], SLOPES[FIRST]])
    expected = math.sqrt(s @ np.array([[1.0, correlated], [correlated, 1.0]]) @ s)
    assert reported.value == pytest.approx(expected, rel=0.3)  # of 60 runs: three standard errors are 0.27
    assert "correlated as fitted" in reported.how
    assert validation.parameters is not None
    assert validation.parameters.stated[0][1] == pytest.approx(correlated)
