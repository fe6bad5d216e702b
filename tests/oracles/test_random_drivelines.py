"""The program against fifty digits on random drivelines: every crossing, every sample, every clearance's region."""

from __future__ import annotations

import pytest

from tests.oracles.compare import assert_exact, assert_exact_inside_horizon
from tests.oracles.random_drivelines import FAMILIES, random_problem


@pytest.mark.parametrize("family", FAMILIES)
def test_random_driveline(family):
    problem = random_problem(family, 0)
    assert_exact(problem.model, 1, problem.samples_per_cycle)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(42))
@pytest.mark.parametrize("family", FAMILIES)
def test_many_random_drivelines(family, seed):
    problem = random_problem(family, seed)
    assert_exact_inside_horizon(problem.model, problem.cycles, problem.samples_per_cycle)
