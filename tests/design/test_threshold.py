"""Thresholds against a closed form, and everything that can be wrong with one."""

from __future__ import annotations

import math

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.design.halving import Report
from gearrattle.design.target import target_of
from gearrattle.design.variable import variable_of
from gearrattle.errors import Cancelled, ModelError
from tests.design.oscillator import LIMIT, T, loaded_gear

AMPLITUDE = "torque.0.harmonics.0.amplitude"


def test_the_amplitude_at_which_a_gear_separates():
    answer = gr.threshold(loaded_gear(), AMPLITUDE, (0.2 * LIMIT, 3.0 * LIMIT), width=1e-3, workers=1)
    quiet, rattling = answer.bracket
    assert quiet <= LIMIT <= rattling
    assert rattling - quiet <= 1e-3 * rattling
    assert answer.value == quiet
    assert "quiet up to" in answer.sentence


def test_zero_within_a_range_is_zero():
    """Twelve steps from -20 to 60 degC pass 8.9e-16."""
    values = variable_of(gr.example("creep"), "oil.temperature", ("-20 degC", "60 degC")).spread(13)
    assert 0.0 in values.tolist()
    assert np.all(np.diff(values) > 0.0)


def test_the_mean_torque_that_holds_the_gear():
    # A* grows with the mean: twice the amplitude needs twice the mean
    answer = gr.threshold(loaded_gear(2.0 * LIMIT), "torque.0.mean", (gr.factor(0.5), gr.factor(3.7)), width=1e-3)
    rattling, quiet = answer.bracket
    assert rattling < 2.0 < quiet
    assert answer.variable.own == 1.0
    assert answer.data["value"].min() == 0.5


def test_a_limit_of_energy_is_met_where_the_energy_crosses_it():
    model = loaded_gear()
    limit = 1e-3
    answer = gr.threshold(model, AMPLITUDE, (0.5 * LIMIT, 6.0 * LIMIT), f"largest impact energy < {limit}", width=1e-3)
    assert answer.bracket is not None
    largest = {}
    for value in answer.bracket:
        verdict = gr.criteria(gr.simulate(model.with_({AMPLITUDE: value}), audit=False))
        largest[value] = max(part.max_impact_energy or 0.0 for part in verdict.parts)
    holding, failing = answer.bracket
    assert answer.value == holding
    assert largest[holding] < limit <= largest[failing]


def test_what_is_proven_ends_where_the_gear_separates():
    low, high = 0.2 * LIMIT, 3.0 * LIMIT
    answer = gr.threshold(loaded_gear(), AMPLITUDE, (low, high), count=4, width=0.05)
    assert answer.proven[0] == pytest.approx(low)
    assert LIMIT - 0.01 * (high - low) < answer.proven[1] <= LIMIT
    assert "Proven" in answer.sentence


def test_nothing_is_proven_of_other_targets():
    answer = gr.threshold(loaded_gear(), AMPLITUDE, (0.5 * LIMIT, 6.0 * LIMIT), "largest impact energy < 1e-3", count=3)
    assert answer.proven is None


def test_where_nothing_changes_there_is_no_threshold():
    answer = gr.threshold(loaded_gear(0.5 * LIMIT), AMPLITUDE, (0.1 * LIMIT, 0.6 * LIMIT), count=3)
    assert answer.value is None
    assert answer.bracket is None
    assert "quiet at any value" in answer.sentence


def test_what_was_simulated_is_all_there():
    answer = gr.threshold(loaded_gear(), AMPLITUDE, (0.2 * LIMIT, 3.0 * LIMIT), count=4, width=0.05)
    scan = answer.data
    holds = scan["holds"].sel(start="rest").values
    values = scan["value"].values
    tried = holds >= 0
    assert np.array_equal(holds[tried] == 1, values[tried] < LIMIT)
    assert (np.diff(values) > 0.0).all()
    assert np.isnan(scan["largest impact energy"].values[scan["holds"].values < 0]).all()


@pytest.mark.parametrize(
    ("path", "ends", "until", "location"),
    [
        ("torque.0.no", (1.0, 2.0), "quiet", "torque.0.no"),
        (AMPLITUDE, (2.0, 1.0), "quiet", "from"),
        (AMPLITUDE, 3.0, "quiet", "range"),
        ("inertia.gear.name", ("a", "b"), "quiet", "inertia"),
        (AMPLITUDE, (1.0, 2.0), "silent", "until"),
        (AMPLITUDE, (1.0, 2.0), "largest impact energy < much", "until"),
        (AMPLITUDE, (1.0, 2.0), "largest impact energy < 1 mm", "mm is not"),
        (AMPLITUDE, (1.0, 2.0), "impacts per cycle < 1 J", "1/cycle"),
        (AMPLITUDE, (1.0, 2.0), "no such output < 1", "outputs"),
        (AMPLITUDE, (1.0, 2.0), "gear: largest impact energy < 1", "until"),
    ],
)
def test_what_is_wrong_is_said_before_anything_runs(path, ends, until, location):
    with pytest.raises(ModelError) as refused:
        gr.threshold(loaded_gear(), path, ends, until)
    assert location in str(refused.value)


@pytest.mark.parametrize(
    ("until", "limit"),
    [
        ("largest impact energy < 0.1 mJ", 1e-4),
        ("m5: largest impact energy < 1e-4", 1e-4),
        ("m5: largest approach speed < 5 mm/s", 0.005),
        ("spline: largest approach speed < 180 deg/s", math.pi),
        ("contact share > 0.9", 0.9),
    ],
)
def test_a_target_takes_units(until, limit):
    assert target_of(gr.example("six_speed"), until).limit == pytest.approx(limit, rel=1e-15)


def test_parts_of_different_units_are_not_compared_with_one_number():
    with pytest.raises(ModelError, match="must name one part: that of all is in m/s and rad/s"):
        target_of(gr.example("six_speed"), "largest approach speed < 0.005")


def test_a_search_that_is_stopped_tells_what_it_knows():
    calls = 0

    def stop(_share: float) -> None:
        nonlocal calls
        calls += 1
        if calls > 6:
            raise Cancelled("enough")

    whole = gr.threshold(loaded_gear(), AMPLITUDE, (0.2 * LIMIT, 3.0 * LIMIT))
    part = gr.threshold(loaded_gear(), AMPLITUDE, (0.2 * LIMIT, 3.0 * LIMIT), workers=1, progress=stop)
    assert 0 < part.data.sizes["value"] <= whole.data.sizes["value"]
    assert any("stopped" in note for note in part.notes)


def test_a_search_that_is_stopped_at_once_knows_nothing():
    def stop(_share: float) -> None:
        raise Cancelled("at once")

    with pytest.raises(Cancelled):
        gr.threshold(loaded_gear(), AMPLITUDE, (0.2 * LIMIT, 3.0 * LIMIT), progress=stop)


def test_the_share_that_is_told_never_falls_nor_ends_early():
    shares: list[float] = []
    report = Report(shares.append, 4.0)
    for _ in range(12):
        report.add(0.5)
    assert shares == sorted(shares)
    assert 0.0 < shares[0] < shares[-1] < 1.0


def test_the_answer_does_not_depend_on_the_number_of_threads():
    one, two = (
        gr.threshold(loaded_gear(), AMPLITUDE, (0.2 * LIMIT, 3.0 * LIMIT), workers=workers) for workers in (1, 2)
    )
    assert one.bracket == two.bracket
    assert one.data.identical(two.data)


def test_its_page_says_all(tmp_path):
    answer = gr.threshold(loaded_gear(), AMPLITUDE, (0.2 * LIMIT, 3.0 * LIMIT), count=4)
    page = gr.save(answer, tmp_path / "page")
    text = page.read_text(encoding="utf-8")
    assert "from the motion before" in text
    assert f"{T:g}" in text or "torque amplitude" in text
