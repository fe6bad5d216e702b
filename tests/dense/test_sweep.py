"""The sweep, which only large drivelines get by default, against the dense check and against the march through tables.

All families of the dense check are small; made to sweep, they try every corner rule the sweep has.
"""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.engine.solvers import Motion, scheme_choice, window_solver
from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.solvers.window_solver import SweepMarch
from tests.dense.case import Case, run
from tests.dense.families import seeded
from tests.dense.grazing import MAKERS
from tests.dense.judge import check
from tests.dense.test_attack import IN_A_PART, PARTS, attack
from tests.engine.solvers.tasks import finished, same_bits

ALWAYS = range(2)


@pytest.fixture
def sweeping(monkeypatch):
    """Every run of ``exact`` sweeps."""
    monkeypatch.setattr(scheme_choice, "is_large", lambda _system: True)


@pytest.mark.usefixtures("sweeping")
@pytest.mark.parametrize("family", MAKERS)
def test_every_crossing_and_instant(family):
    attack(family, ALWAYS)


@pytest.mark.long
@pytest.mark.usefixtures("sweeping")
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("family", MAKERS)
def test_every_crossing_and_instant_of_ten_thousand(family, part):
    attack(family, range(part * IN_A_PART, (part + 1) * IN_A_PART))


@pytest.mark.usefixtures("sweeping")
@pytest.mark.parametrize("most", [0, 2, *(pytest.param(most, marks=pytest.mark.long) for most in (1, 1000))])
@pytest.mark.parametrize("family", ["chain", "tree", "loop", "flight", "stages", "error", "everything"])
def test_however_often_the_polynomials_are_made_afresh(monkeypatch, family, most):
    monkeypatch.setattr(window_solver, "MOST_CORRECTED", most)
    for seed in ALWAYS:
        case = seeded(family, seed, MAKERS[family])
        assert check(case, run(case)).faults == []


def both(case: Case) -> tuple[Motion, Motion]:
    """The motion by tables and by the sweep."""
    return finished(ExactMarch(case.task())), finished(SweepMarch(case.task()))


@pytest.mark.parametrize("family", ["chain", "tree", "loop", "parallel", "undamped", "stages", "one-sided", "error"])
def test_tables_and_sweep_find_the_same_crossings(family):
    for seed in ALWAYS:
        case = seeded(family, seed)
        tables, swept = both(case)
        for name in ("clearance", "from_piece", "to_piece"):
            assert np.array_equal(getattr(tables.crossings, name), getattr(swept.crossings, name)), (family, seed)
        end = case.period * case.length
        assert np.allclose(tables.crossings.time, swept.crossings.time, rtol=0, atol=1e-9 * end)
        for name in ("angle", "velocity", "acceleration", "deflection", "force", "final_force_integral"):
            a, b = getattr(tables, name), getattr(swept, name)
            assert np.allclose(a, b, rtol=0, atol=1e-8 * np.abs(a).max(initial=1e-300)), (family, seed, name)


@pytest.mark.parametrize("family", ["chain", "tree", "loop", "flight", "stages", "error"])
def test_where_a_slice_ends_changes_no_bit(monkeypatch, family):
    case = seeded(family, 1)
    whole = finished(SweepMarch(case.task()))
    for budget in (1, 2, 7):
        monkeypatch.setattr(window_solver, "_BUDGET", budget)
        monkeypatch.setattr("gearrattle.engine.solvers.samples_in_si.FIRST_LOG", 1)
        same_bits(whole, finished(SweepMarch(case.task())))
