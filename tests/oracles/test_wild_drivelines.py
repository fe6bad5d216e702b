"""The program against fifty digits on drivelines without manners."""

from __future__ import annotations

import pytest

from tests.oracles.compare import HORIZON, compare
from tests.oracles.wild_drivelines import wild_problem


def check(seed: int) -> None:
    """Compare over as many cycles as the motion can be predicted for, one at least."""
    problem = wild_problem(seed)
    for cycles in range(problem.cycles, 0, -1):
        outcome = compare(problem.model, cycles, problem.samples_per_cycle)
        if outcome.tolerance <= HORIZON:
            break
    else:
        pytest.skip("a perturbation outgrows the comparison within one cycle")
    assert not outcome.faults, "\n".join([*outcome.faults, "", problem.model.toml()])


@pytest.mark.parametrize("seed", [2, 4, 6])
def test_wild_driveline(seed):
    check(seed)


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1, 3, 5, *range(7, 416)])
def test_many_wild_drivelines(seed):
    check(seed)
