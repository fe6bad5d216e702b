"""At the stated horizon the error of chaotic motions lies within the stated scatter of rounding."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.engine.system.perturbation_growth import GROWTH, ROUNDING, ROUNDING_95
from tests.oracles.horizon import measured, motions
from tests.oracles.random_drivelines import random_problem

QUICK = (("mesh", 1), ("stiff", 36))


def test_the_error_at_the_horizon_is_the_stated_rounding_grown_ten_million_fold() -> None:
    actual = [measured(f"{family} {seed}", random_problem(family, seed).model) for family, seed in QUICK]
    rounding = np.array([one.error / GROWTH for one in actual if one is not None])
    assert rounding.size == len(QUICK)
    assert np.all(rounding < ROUNDING_95)
    assert ROUNDING / 5.0 < np.exp(np.mean(np.log(rounding))) < 5.0 * ROUNDING


@pytest.mark.long
def test_of_sixty_chaotic_motions_95_in_100_stay_below_the_stated_bound() -> None:
    rounding = np.array([one.rounding for one in motions(40)])
    assert rounding.size > 60
    assert ROUNDING / 2.0 < np.exp(np.mean(np.log(rounding))) < 2.0 * ROUNDING
    assert np.quantile(rounding, 0.95) < ROUNDING_95
