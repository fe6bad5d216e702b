"""Designs of samples and what they tell: Sobol' indices and single swings against closed forms."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest
from scipy import integrate

import gearrattle as gr
from gearrattle.errors import ModelError, NotInstalled
from gearrattle.model.paths import value_at
from gearrattle.signals.wilson_interval import wilson
from gearrattle.studies import sobol_indices as module
from gearrattle.studies.designs import DESIGNS
from gearrattle.studies.probability import running, samples_needed
from gearrattle.studies.sobol_indices import indices
from gearrattle.studies.study import prepare
from tests.studies.drivelines import model

STIFFNESS = "coupling.joint.stiffness"
ENGINE = "inertia.engine.J"
WHEEL = "inertia.wheel.J"
RANGES = {STIFFNESS: (600.0, 1000.0), WHEEL: (0.012, 0.03), ENGINE: (0.1, 0.3)}  # not in order of the alphabet
VARY = {path: {"distribution": "uniform", "from": low, "to": high} for path, (low, high) in RANGES.items()}
SHORT = {"simulation.cycles": 2, "simulation.discard": 1, "simulation.samples_per_cycle": 8}


def frequency(run: gr.Run) -> dict[str, float]:
    """Square of the natural frequency in contact: K (1/J1 + 1/J2) for two bodies."""
    return {"square": float(gr.modes(run.model, contact_ratio={"joint": 1.0}).frequencies[-1]) ** 2}


def moments(low: float, high: float, power: int) -> float:
    """E x^power of a uniform x, by quadrature."""
    return float(integrate.quad(lambda x: x**power, low, high, epsabs=0.0)[0] / (high - low))


def exact_indices() -> tuple[dict[str, float], dict[str, float]]:
    """First and total order of y = K (u + v), u = 1/J1, v = 1/J2: products and sums of independent values."""
    k, k2 = (moments(*RANGES[STIFFNESS], p) for p in (1, 2))
    (u, u2), (v, v2) = ([moments(*RANGES[path], p) for p in (-1, -2)] for path in (WHEEL, ENGINE))
    s, s2 = u + v, u2 + 2.0 * u * v + v2
    total = k2 * s2 - (k * s) ** 2
    of_k = k2 - k * k
    of_u = u2 - u * u
    of_v = v2 - v * v
    first = {STIFFNESS: of_k * s * s, WHEEL: k * k * of_u, ENGINE: k * k * of_v}
    whole = {STIFFNESS: of_k * s2, WHEEL: k2 * of_u, ENGINE: k2 * of_v}
    return ({p: x / total for p, x in first.items()}, {p: x / total for p, x in whole.items()})


@pytest.fixture(scope="module")
def saltelli() -> Any:
    return gr.study(
        model(),
        outputs=["regime"],
        vary=VARY,
        samples=64,
        method="saltelli",
        seed=2,
        fixed=SHORT,
        function=frequency,
        workers=1,
    )


@pytest.mark.slow
def test_indices_of_a_natural_frequency(saltelli: Any) -> None:
    actual = gr.studies.sensitivities(saltelli, "square")
    assert actual["value"].values.tolist() == list(RANGES)
    first, total = exact_indices()
    for name, exact in (("first_order", first), ("total_order", total)):
        for path in RANGES:
            one = actual.sel(value=path)
            assert float(one[name]) == pytest.approx(exact[path], abs=0.06)
            assert abs(float(one[name]) - exact[path]) < 1.5 * float(one[f"{name}_half_width"])
    assert int(actual["base_points"]) == 64
    assert int(actual["samples"]) == 128  # what is independent of it


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))])
@pytest.mark.parametrize("method", ["saltelli", "saltelli-pairs"])
def test_indices_of_ishigamis_function(method: str, seed: int) -> None:
    """Closed form (Ishigami, Homma 1990), a = 7, b = 0.1, total and second order as well."""
    a = 7.0
    b = 0.1
    n = 4096
    x = np.pi * (2.0 * DESIGNS[method].shares(3, n, seed) - 1.0)
    assert len(x) == DESIGNS[method].cases(3, n)
    y = np.sin(x[:, 0]) + a * np.sin(x[:, 1]) ** 2 + b * x[:, 2] ** 4 * np.sin(x[:, 0])
    one = 0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2
    two = a * a / 8.0
    both = 8.0 * b * b * np.pi**8 / 225.0
    variance = one + two + both
    actual = indices(y, 3, method)
    np.testing.assert_allclose(actual.first, np.array([one, two, 0.0]) / variance, atol=0.03)
    np.testing.assert_allclose(actual.total, np.array([one + both, two, both]) / variance, atol=0.03)
    if method == "saltelli-pairs":
        assert actual.second[0, 2] == pytest.approx(both / variance, abs=0.04)
        assert actual.second[2, 0] == actual.second[0, 2]
        assert abs(actual.second[0, 1]) < 0.04
    else:
        assert np.isnan(actual.second).all()


def test_intervals_cover_about_as_often_as_they_say() -> None:
    """A sum of two values, 200 seeds: 95 % intervals of random base points hold the truth in at least 88 % of cases."""
    exact, held = np.array([0.8, 0.2]), []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        first, other = rng.random((64, 2)), rng.random((64, 2))
        blocks = [
            first,
            np.column_stack([other[:, 0], first[:, 1]]),
            np.column_stack([first[:, 0], other[:, 1]]),
            other,
        ]
        y = np.stack([block @ [2.0, 1.0] for block in blocks], axis=1).ravel()
        actual = indices(y, 2, "saltelli")
        held.append(np.abs(actual.total - exact) < actual.total_half)
    assert 0.88 < np.mean(held) <= 0.99


def test_a_base_point_with_a_failed_case_is_left_out_whole() -> None:
    x = DESIGNS["saltelli"].shares(2, 256, 1)
    y = x @ [2.0, 1.0]
    whole = indices(y, 2, "saltelli")
    y[[5, 403]] = np.nan
    actual = indices(y, 2, "saltelli")
    assert (whole.base_points, actual.base_points) == (256, 254)
    np.testing.assert_allclose(actual.first, whole.first, atol=0.05)
    assert np.isnan(indices(np.ones(1024), 2, "saltelli").first).all()
    with pytest.raises(ModelError, match="whole blocks of 4"):
        indices(y[:-1], 2, "saltelli")


def test_the_independent_part_of_a_design_is_the_two_samples() -> None:
    from SALib.sample.sobol import sample

    cube = {"num_vars": 3, "names": ["a", "b", "c"], "bounds": [[0, 1]] * 3}
    for method, pairs in (("saltelli", False), ("saltelli-pairs", True)):
        design = DESIGNS[method]
        points = design.shares(3, 8, 4)
        np.testing.assert_array_equal(points, sample(cube, 8, calc_second_order=pairs, seed=np.random.default_rng(4)))
        apart = points[design.independent(3, len(points))]
        assert apart.shape == (16, 3)
        assert np.unique(apart, axis=0).shape == (16, 3)
    assert DESIGNS["one-at-a-time"].independent(3, 7).size == 0


def test_one_value_at_a_time_tells_both_ends() -> None:
    actual = gr.study(
        model(), outputs=["impacts per cycle"], vary=VARY, method="one-at-a-time", fixed=SHORT, function=frequency
    )
    assert actual.sizes["sample"] == 7
    reported = gr.studies.sensitivities(actual, "square")
    own = {path: value_at(model().to_tables(), path) for path in RANGES}

    def square(**changes: float) -> float:
        v = own | {next(p for p in RANGES if p.endswith(k)): x for k, x in changes.items()}
        return v[STIFFNESS] * (1.0 / v[WHEEL] + 1.0 / v[ENGINE])

    assert float(reported["base"]) == pytest.approx(square(), rel=1e-9)
    for path, (low, high) in RANGES.items():
        one = reported.sel(value=path)
        key = "stiffness" if path == STIFFNESS else path.removeprefix("inertia.")
        assert float(one["low"]) == pytest.approx(square(**{key: low}), rel=1e-9)
        assert float(one["high"]) == pytest.approx(square(**{key: high}), rel=1e-9)
        assert (float(one["low_value"]), float(one["high_value"])) == (low, high)
        assert float(one["base_value"]) == own[path]
        assert float(one["swing"]) == pytest.approx(abs(float(one["high"]) - float(one["low"])), rel=1e-12)
    by_part = gr.studies.sensitivities(actual, "impacts per cycle")
    assert by_part["swing"].dims == ("part", "value")


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"samples": 48, "method": "saltelli"}, "power of two, so that .* balanced .32 or 64"),
        ({"samples": 0, "method": "saltelli"}, "needs a number"),
        ({"samples": 4, "method": "one-at-a-time"}, "takes no number"),
        ({"samples": 4, "method": "saltelly"}, 'must be "latin-hypercube" or "sobol" or .*did you mean "saltelli"'),
        ({"method": "one-at-a-time", "vary": {}}, "let values scatter"),
        ({"method": "one-at-a-time", "vary": {"coupling.joint.preload": VARY[STIFFNESS]}}, "no number there"),
    ],
)
def test_designs_that_do_not_suit_are_refused(arguments: dict[str, Any], match: str) -> None:
    with pytest.raises(ModelError, match=match):
        prepare(model(), **{"vary": VARY, **arguments})


@pytest.mark.slow
def test_probabilities_come_from_independent_samples_alone(saltelli: Any) -> None:
    actual = gr.studies.rattle_probability(saltelli, "regime")
    assert int(actual["samples"][0]) == 128
    every = saltelli["regime"].values[:, 0].reshape(64, 5)
    assert int(actual["rattling"][0]) == np.count_nonzero(every[:, [0, -1]] > 0)
    single = gr.study(model(), outputs=["regime"], vary=VARY, method="one-at-a-time", fixed=SHORT)
    with pytest.raises(ModelError, match="one-at-a-time"):
        gr.studies.rattle_probability(single)


def test_without_the_library_the_command_is_told(saltelli: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("SALib", "SALib.sample", "SALib.sample.sobol", "SALib.analyze", "SALib.analyze.sobol"):
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setattr(module, "_RECENT", {})
    with pytest.raises(NotInstalled, match=r"gearrattle\[studies\]"):
        prepare(model(), vary=VARY, samples=8, method="saltelli")
    with pytest.raises(NotInstalled, match=r"gearrattle\[studies\]"):
        gr.studies.sensitivities(saltelli, "square")


@pytest.mark.parametrize("probability", [0.5, 0.1, 0.001])
@pytest.mark.parametrize("half_width", [0.1, 0.02, 0.003])
def test_as_many_samples_as_are_needed_and_no_more(probability: float, half_width: float) -> None:
    n = samples_needed(half_width, probability)

    def half(count: int) -> float:
        low, high = wilson(probability * count, count)
        return 0.5 * float(high - low)

    assert half(n) <= half_width < half(n - 1)


def test_the_number_for_an_even_chance_is_the_closed_form() -> None:
    """At p = 1/2 the half-width is z / (2 sqrt(n + z^2))."""
    z = 1.959963984540054
    assert samples_needed(0.05) == int(np.ceil((z / 0.1) ** 2 - z * z))
    assert samples_needed(0.05, level=0.99) > samples_needed(0.05)
    for bad in ({"half_width": 0.0}, {"half_width": 0.6}, {"half_width": 0.1, "probability": 1.0}):
        with pytest.raises(ModelError, match="must lie between"):
            samples_needed(**bad)  # type: ignore[arg-type]


def test_a_running_share_counts_what_was_computed() -> None:
    n, share, low, high = running(np.array([0, 1, -1, 2, 0]))
    assert n.tolist() == [1, 2, 3, 4]
    assert share.tolist() == pytest.approx([0.0, 0.5, 2 / 3, 0.5])
    assert np.all((low <= share) & (share <= high))


def test_an_estimate_tells_what_the_samples_are_worth() -> None:
    words = prepare(model(), vary=VARY, samples=64, method="sobol", fixed=SHORT).estimate(1).words
    assert "95 % interval of a probability from 64 samples is at most ±12 percentage points; for ±5.9 take " in words
    assert "samples" not in prepare(model(), vary=VARY, method="one-at-a-time", fixed=SHORT).estimate(1).words


def test_the_same_samples_are_analyzed_once_and_no_caller_changes_another(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    by_salib = module._by_salib
    monkeypatch.setattr(module, "_RECENT", {})
    monkeypatch.setattr(module, "_by_salib", lambda *settings: calls.append(settings) or by_salib(*settings))
    y = np.random.default_rng(1).normal(size=32 * 5)
    first = module.indices(y, 3, "saltelli")
    kept = first.total.copy()
    first.total[:] = 0.0
    assert module.indices(y.copy(), 3, "saltelli").total.tolist() == kept.tolist()
    assert len(calls) == 1
    y[7] += 1.0
    assert module.indices(y, 3, "saltelli").total.tolist() != kept.tolist()
    assert module.indices(y, 3, "saltelli", level=0.5).total_half.tolist() != first.total_half.tolist()
    assert len(calls) == 3
    monkeypatch.setattr(module, "_MOST_RECENT", 2)
    module.indices(2.0 * y, 3, "saltelli")
    assert len(module._RECENT) == 2
