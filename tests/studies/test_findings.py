"""What is made of a study: boundaries, probabilities and sensitivities against closed forms and plain counting."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy import stats
from scipy.stats import qmc

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.signals.wilson_interval import wilson
from gearrattle.studies.regime_boundary import midpoints
from gearrattle.studies.sensitivity import chance_levels, first_order, rank_correlations, rank_regression

CODES = {"flag_values": [0, 1, 2], "flag_meanings": "quiet single-sided double-sided"}


def points(n: int, d: int, seed: int) -> np.ndarray:
    return qmc.Sobol(d, scramble=True, rng=np.random.default_rng(seed)).random(n)


def grid(codes: Any) -> xr.Dataset:
    """A study over gap (logarithmic) and load (two paths together), one part."""
    codes = np.asarray(codes, dtype=np.int8)
    return xr.Dataset(
        {
            "regime": (("gap", "load", "part"), codes[:, :, None], CODES),
            "outcome": (("gap", "load"), (codes >= 0).astype(np.int8)),
        },
        {"gap": [0.1, 1.0, 10.0], "load": [0, 1], "torque.0.mean": ("load", [5.0, 9.0]), "part": ["gear"]},
    )


def scatter(x: np.ndarray, regime: np.ndarray, level: np.ndarray) -> xr.Dataset:
    return xr.Dataset(
        {
            "regime": (("sample", "part"), regime[:, None].astype(np.int8), CODES),
            "level": ("sample", level),
            "outcome": ("sample", np.ones(len(x), dtype=np.int8)),
        },
        {**{f"x{i}": ("sample", column) for i, column in enumerate(x.T)}, "part": ["gear"]},
    )


@pytest.mark.parametrize(("k", "n"), [(0, 10), (3, 10), (10, 10), (39, 64), (500, 1000)])
@pytest.mark.parametrize("level", [0.9, 0.95])
def test_wilsons_limits_are_the_probabilities_that_just_explain_the_share(k: int, n: int, level: float) -> None:
    """They solve |k/n - p| = z sqrt(p (1 - p) / n), and scipy has them by another path."""
    low, high = (float(limit) for limit in wilson(k, n, level))
    theirs = stats.binomtest(k, n).proportion_ci(level, method="wilson")
    assert (low, high) == pytest.approx((theirs.low, theirs.high), abs=1e-12)
    z = stats.norm.ppf(0.5 + 0.5 * level)
    for p in (low, high):
        if 0.0 < p < 1.0:
            assert abs(k / n - p) == pytest.approx(z * np.sqrt(p * (1.0 - p) / n), rel=1e-10)


def test_wilsons_interval_covers_as_often_as_it_says() -> None:
    """Averaged over p; for one p the coverage of any such interval jumps (Brown, Cai, DasGupta 2001)."""
    n, ps = 40, np.linspace(0.02, 0.98, 97)
    low, high = wilson(np.arange(n + 1), n)
    covered = [stats.binom.pmf(np.arange(n + 1), n, p)[(low <= p) & (p <= high)].sum() for p in ps]
    assert np.mean(covered) == pytest.approx(0.95, abs=0.01)
    assert np.isnan(wilson(0, 0)).all()


def test_probabilities_count_what_was_computed() -> None:
    x = points(8, 2, 0)
    regime = np.array([0, 1, 2, -1, 0, 0, 2, -1])
    actual = gr.studies.rattle_probability(scatter(x, regime, x[:, 0]))
    assert (int(actual["rattling"][0]), int(actual["samples"][0])) == (3, 6)
    assert float(actual["probability"].sel(part="gear")) == 0.5
    assert float(actual["low"][0]) < 0.5 < float(actual["high"][0])
    nothing = gr.studies.rattle_probability(scatter(x, np.full(8, -1), x[:, 0]))
    assert np.isnan(nothing["probability"].values).all()
    with pytest.raises(ModelError, match="needs samples"):
        gr.studies.rattle_probability(grid(np.zeros((3, 2))))
    with pytest.raises(ModelError, match="of codes"):
        gr.studies.rattle_probability(scatter(x, regime, x[:, 0]), "level")
    with pytest.raises(ModelError, match="between 0 and 1"):
        gr.studies.rattle_probability(scatter(x, regime, x[:, 0]), level=95.0)


def test_boundaries_lie_between_neighbours_that_differ() -> None:
    actual = gr.studies.regime_boundary(grid([[0, 0], [2, 0], [2, -1]]))
    rows = {
        tuple(actual[name].values[i].item() for name in ("along", "from", "to", "gap", "load", "torque.0.mean"))
        for i in range(actual.sizes["crossing"])
    }
    across_gap = next(row for row in rows if row[0] == "gap")
    assert across_gap[1:3] == ("quiet", "double-sided")
    assert across_gap[3:] == pytest.approx((np.sqrt(0.1), 0.0, 5.0))
    assert ("load", "double-sided", "quiet", 1.0, 0.5, 7.0) in rows
    assert len(rows) == 2  # the case that failed is no boundary
    assert set(actual["part"].values.tolist()) == {"gear"}
    assert set(zip(actual["below"].values.tolist(), actual["above"].values.tolist(), strict=True)) == {
        (0.1, 1.0),
        (0, 1),
    }


def test_a_boundary_known_beforehand_is_found_to_half_a_cell() -> None:
    """Quiet where a + b < 1: every crossing along a lies within half a step of 1 - b."""
    a, b = np.linspace(0.0, 1.0, 21), np.linspace(0.0, 1.0, 11)
    codes = (a[:, None] + b > 1.0 + 1e-9).astype(np.int8)
    data = xr.Dataset(
        {"verdict": (("a", "b"), codes, CODES), "outcome": (("a", "b"), np.ones_like(codes))}, {"a": a, "b": b}
    )
    actual = gr.studies.regime_boundary(data)
    along = actual["along"].values == "a"
    assert along.sum() == 10
    np.testing.assert_allclose(actual["a"].values[along], 1.0 - actual["b"].values[along], atol=0.025 + 1e-9)


def test_midpoints_of_a_logarithmic_range_are_geometric() -> None:
    np.testing.assert_allclose(midpoints(np.array([1.0, 10.0, 100.0])), [np.sqrt(10.0), np.sqrt(1000.0)])
    np.testing.assert_allclose(midpoints(np.array([1.0, 2.0, 100.0])), [1.5, 51.0])
    np.testing.assert_allclose(midpoints(np.array([1, 2])), [1.5])


@pytest.mark.parametrize("seed", range(3))
def test_first_order_shares_of_ishigamis_function(seed: int) -> None:
    """Closed form (Ishigami, Homma 1990), a = 7, b = 0.1; chance scatters by about 1/sqrt(n)."""
    a, b = 7.0, 0.1
    x = np.pi * (2.0 * points(4096, 3, seed) - 1.0)
    y = np.sin(x[:, 0]) + a * np.sin(x[:, 1]) ** 2 + b * x[:, 2] ** 4 * np.sin(x[:, 0])
    total = a**2 / 8 + b * np.pi**4 / 5 + b**2 * np.pi**8 / 18 + 0.5
    exact = np.array([0.5 * (1 + b * np.pi**4 / 5) ** 2, a**2 / 8, 0.0]) / total
    np.testing.assert_allclose(first_order(x, y), exact, atol=0.02)
    assert abs(rank_correlations(x, y)[1]) < 0.05  # no trend at all, and yet the largest share


@pytest.mark.parametrize("n", [64, 1024])
def test_sensitivities_of_a_linear_function(n: int) -> None:
    """y = sum c_i x_i of independent uniforms: c_i^2 / sum c_j^2 of the variance."""
    c = np.array([4.0, -2.0, 1.0, 0.0])
    x = points(n, 4, 1)
    data = scatter(x, (x[:, 0] > 0.5).astype(int), x @ c)
    actual = gr.studies.sensitivities(data, "level")
    assert actual["value"].values.tolist() == ["x0", "x1", "x2", "x3"]
    np.testing.assert_allclose(actual["first_order"], c**2 / np.sum(c**2), atol=2.0 / np.sqrt(n))
    assert np.argsort(-np.abs(actual["rank_regression"].values)).tolist() == [0, 1, 2, 3]
    assert np.sign(actual["rank_regression"].values[:3]).tolist() == [1.0, -1.0, 1.0]
    assert float(actual["explained"]) > 0.9
    expected = [stats.spearmanr(column, x @ c).statistic for column in x.T]
    np.testing.assert_allclose(actual["spearman"], expected, atol=1e-12)
    regime = gr.studies.sensitivities(data, "regime")
    assert regime["spearman"].dims == ("part", "value")
    assert int(np.argmax(np.abs(regime["first_order"].sel(part="gear").values))) == 0


def test_rank_regression_of_a_monotonic_function_is_exact() -> None:
    """One value alone, through any monotonic function: its ranks are those of the output."""
    x = points(64, 1, 2)
    coefficients, explained = rank_regression(x, -np.exp(7.0 * x[:, 0]))
    assert (coefficients[0], explained) == pytest.approx((-1.0, 1.0), abs=1e-12)


@pytest.mark.parametrize("n", [64, 300])
def test_chance_levels_are_exceeded_by_chance_in_one_case_of_twenty(n: int) -> None:
    """Outputs that follow nothing, normal ones and rare counts alike: 2000 draws, rates within 3.3 deviations."""
    rng = np.random.default_rng(5)
    correlation, share = chance_levels(n)
    x = rng.random((n, 200))
    for draw in (rng.normal, lambda size: rng.poisson(1.0, size).astype(float)):
        ys = [draw(size=n) for _ in range(10)]
        seen = np.mean([first_order(x, y) > share for y in ys])
        assert abs(seen - 0.05) < 3.3 * np.sqrt(0.05 * 0.95 / 2000)
        seen = np.mean([np.abs(rank_correlations(x, y)) > correlation for y in ys])
        assert abs(seen - 0.05) < 3.3 * np.sqrt(0.05 * 0.95 / 2000)


def test_what_cannot_be_told_is_not_told() -> None:
    x = points(16, 2, 3)
    few = gr.studies.sensitivities(scatter(x, np.zeros(16), x[:, 0]), "level")
    assert np.isnan(few["first_order"].values).all()
    assert np.isfinite(few["spearman"].values).all()
    same = gr.studies.sensitivities(scatter(x, np.zeros(16), x[:, 0]), "regime")
    assert np.isnan(same["spearman"].values).all()
    assert np.isnan(same["rank_regression"].values).all()
    with pytest.raises(ModelError, match="did you mean"):
        gr.studies.sensitivities(scatter(x, np.zeros(16), x[:, 0]), "levle")
    with pytest.raises(ModelError, match="need samples"):
        gr.studies.sensitivities(grid(np.zeros((3, 2))), "regime")
    with pytest.raises(ModelError, match="no study's"):
        gr.studies.sensitivities(xr.Dataset({"level": ("sample", x[:, 0])}), "level")
    both = scatter(x, np.zeros(16), x[:, 0]).expand_dims(gap=[1.0, 2.0])
    with pytest.raises(ModelError, match="one place of the axes"):
        gr.studies.sensitivities(both, "level")
