"""The 1995 cases: against fifty digits inside the predictability horizon, by their crossing counts beyond it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from tests.laws.motion import crossings, simulate
from tests.literature.paper_cases import SPEED, paper_case
from tests.oracles.compare import assert_exact

EXAMPLES = Path(__file__).parents[2] / "examples" / "paper"


@pytest.mark.parametrize(
    ("loaded", "number"),
    [
        (False, 3),
        *(
            pytest.param(*case, marks=pytest.mark.long)
            for case in ((True, 1), (True, 2), (True, 3), (False, 1), (False, 2))
        ),
    ],
)
def test_first_cycle_to_fifty_digits(loaded, number):
    assert_exact(paper_case(number, loaded), 1)


@pytest.mark.long
@pytest.mark.parametrize("number", [1, 2, 3])
def test_three_loaded_cycles_to_fifty_digits(number):
    assert_exact(paper_case(number, loaded=True), 3)


@pytest.mark.long
def test_loaded_case_1_to_the_paper_s_end():
    """It is not sensitive: a test of accuracy over dimensionless time 800."""
    outcome = assert_exact(paper_case(1, loaded=True), 127, 4)
    assert outcome.errors["deflection"] < 5e-9


@pytest.mark.parametrize("number", [1, 2, 3])
@pytest.mark.parametrize("loaded", [True, False], ids=["loaded", "rattling"])
def test_the_example_file_is_this_case(number, loaded):
    file = gr.load(EXAMPLES / f"case{number}{'_loaded' if loaded else ''}.toml")
    theirs = gr.simulate(file, algorithm="exact", cycles=2, samples_per_cycle=24, discard=0, initial="static")
    mine = simulate(paper_case(number, loaded), 2)
    assert list(theirs.events["time"]) == pytest.approx(list(mine.events["time"]), abs=1e-12)
    assert np.allclose(theirs.data["deflection"], mine.data["deflection"], rtol=0, atol=1e-9)


@pytest.mark.parametrize(("number", "early"), [(1, 5), (2, 78), (3, 76)])
def test_crossings_of_the_loaded_cases_up_to_20(number, early):
    run = simulate(paper_case(number, loaded=True), 4)
    assert np.sum(run.events["time"] <= 20 / SPEED) == early


def test_crossings_of_loaded_case_1_up_to_800():
    run = simulate(paper_case(1, loaded=True), 128, 1)
    assert np.sum(run.events["time"] <= 800 / SPEED) == 599


@pytest.mark.parametrize("number", [1, 2, 3])
def test_moderate_load_crosses_no_corner(number):
    run = simulate(paper_case(number, loaded=True, ratio="0.5"), 128, 1)
    assert len(run.events) == 0


@pytest.mark.parametrize("number", [1, 2, 3])
def test_the_loose_gear_rattles_on_both_sides(number):
    run = simulate(paper_case(number, loaded=False), 20)
    later = run.events[run.events["time"] > 10 * float(run.data.time[-1]) / 20]
    met = set(later.loc[later["clearance"] == "gear", "to_region"])
    assert met == {-1, 0, 1}
    assert len(crossings(run, "gear")) > 400
