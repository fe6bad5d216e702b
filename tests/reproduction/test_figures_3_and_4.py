"""Regimes over the load, and contact ratios over the amplitude: closed forms, and a threshold no crossing enters."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.analysis.contact_ratios.describing import under_sine
from gearrattle.errors import Cancelled
from gearrattle.reproduction import figure3, figure4
from gearrattle.reproduction.load_sweep import FORCE, RESONANCE, Stop, loose_gear, mesh_alone, sweep
from gearrattle.reproduction.measurements import Scope
from gearrattle.reproduction.paper_cases import load_case
from gearrattle.reproduction.paper_stiffness import natural
from gearrattle.reproduction.reproduction_record import DIFFERS, LOST, REPRODUCED


@pytest.fixture(scope="module")
def third():
    return figure3.section(Scope(True), lambda: None)


@pytest.fixture(scope="module")
def fourth():
    return figure4.section(Scope(True), lambda: None)


def row_of(section, words):
    (actual,) = [row for row in section.rows if words in row.item]
    return actual


def test_the_loose_gear_at_its_own_drag_is_case_1():
    assert loose_gear(0.5).torques == load_case(1).torques
    assert loose_gear(0.5).inertias == load_case(1).inertias
    means = sum(t.mean for t in loose_gear(7.0).torques) - sum(b.drag_torque for b in loose_gear(7.0).inertias)
    assert means == pytest.approx(0.0, abs=1e-12)


def test_the_mesh_alone_rings_where_it_should():
    model = mesh_alone(0.8, 0.1, 0.01)
    assert gr.modes(model).frequencies[-1] == pytest.approx(RESONANCE, rel=1e-9)
    assert pytest.approx(natural(1.0, 1.0)[-1], rel=0.01) == RESONANCE


def test_a_closed_mesh_answers_as_the_oscillator_does():
    """Amplitude F / |K - m w^2 + i w c| in half-gaps, and the mean one half-gap and the load further out."""
    (stop, _) = sweep(lambda load: mesh_alone(2.0, 0.2, load), [0.3], 60, lambda: None)
    zeta = 4500.0 / (2.0 * 7.2e8 / RESONANCE)
    assert stop.regime == "quiet"
    assert stop.amplitude == pytest.approx(0.3 / abs(1.0 - 4.0 + 4.0j * zeta), rel=2e-3)
    run = gr.simulate(mesh_alone(2.0, 0.2, 0.0), cycles=2, audit=False)
    assert run.data.deflection.values[-1, 0] == pytest.approx(1.2 * 5e-5, rel=1e-9)
    assert run.data.force.values[-1, 0] == pytest.approx(0.2 * FORCE, rel=1e-9)


def test_a_motion_goes_on_where_the_last_load_left_it():
    """One load twice is one run twice as long."""
    up, down = sweep(lambda load: mesh_alone(0.8, 0.1, load), [0.03], 30, lambda: None)
    whole = gr.simulate(mesh_alone(0.8, 0.1, 0.03), cycles=60, discard=50, samples_per_cycle=64, audit=False)
    deflection = whole.data.deflection.values[50 * 64 :, 0] / 5e-5
    assert (up.rising, down.rising, up.start) == (True, False, None)
    assert down.amplitude == pytest.approx(0.5 * np.ptp(deflection), rel=1e-6)


def test_all_three_regimes_have_a_history(third):
    assert row_of(third, "three vibro-impact regimes").status == REPRODUCED
    histories = third.charts[0].panels
    assert [panel.title.split(",")[0] for panel in histories] == ["no impact", "single-sided", "double-sided"]
    quiet, single, double = (panel.lines[0].y for panel in histories)
    assert quiet.min() > 1.0
    assert single.max() > 1.0 > single.min() > -1.0
    assert double.max() > 1.0 > -1.0 > double.min()


def test_contact_is_lost_where_the_smooth_motion_says(third):
    figures = row_of(third, "contact is lost").figures
    assert figures["last"] < figures["limit"] < figures["first"]


def test_near_resonance_two_motions_exist_under_one_load(third):
    assert "two motions exist" in third.tables[1].note


def stops(*regimes: str) -> tuple[Stop, ...]:
    up = [Stop(float(i), True, kind, 1.0, 1.0, 1.0, None) for i, kind in enumerate(regimes)]
    return (*up, *(Stop(stop.load, False, "quiet", 1.0, 1.0, 1.0, None) for stop in reversed(up)))


def test_ranges_and_twofold_loads():
    values = stops("quiet", "quiet", "single-sided", "double-sided")
    assert list(figure3.ranges(values, True)) == [("quiet", 0, 1), ("single-sided", 2, 2), ("double-sided", 3, 3)]
    assert list(figure3.ranges(values, False)) == [("quiet", 0, 3)]
    assert figure3.twofold(values) == [2, 3]


@pytest.mark.parametrize("amplitude", [0.12, 0.6, 1.2])
def test_the_mean_of_a_sine_under_load_carries_it(amplitude):
    """With u = (1 - m) / A: (A/pi) (sqrt(1 - u^2) - u arccos u) = 0.1, mean slope arccos(u) / pi."""
    actual = figure4.under_load(amplitude, 0.1)
    assert actual.mean_force == pytest.approx(0.1, abs=1e-12)
    u = np.cos(np.pi * actual.mean_slope)
    assert amplitude / np.pi * (np.sqrt(1 - u * u) - u * np.arccos(u)) == pytest.approx(0.1, abs=1e-12)


def test_a_sine_is_single_sided_until_the_widest():
    """At m = A - 1 the lowest point is at -1, and with u = (1 - m) / A that is A (1 + u) = 2."""
    widest = figure4.widest(0.1)
    u = np.cos(np.pi * figure4.under_load(widest, 0.1).mean_slope)
    assert widest * (1.0 + u) == pytest.approx(2.0, rel=1e-9)


def test_large_amplitudes_saturate_as_the_series_says():
    slope, gain = figure4.curve(np.array([40.0]), 0.0)
    assert slope[0] == pytest.approx(1.0 - 2.0 / (40.0 * np.pi), abs=1e-5)
    assert gain[0] == pytest.approx(1.0 - 4.0 / (40.0 * np.pi), abs=1e-5)
    assert gain[0] == under_sine(figure4.GAP, 40.0).gain


def test_trends_of_figure_4_are_the_paper_s(fourth):
    falls, saturates = row_of(fourth, "falls with single-sided"), row_of(fourth, "goes to one")
    assert falls.status == saturates.status == REPRODUCED
    assert falls.figures["rank_gain"] < -0.9
    assert saturates.figures["gain"] == pytest.approx(1.0 - 4.0 / (np.pi * saturates.figures["amplitude"]), abs=1e-3)


def test_the_describing_function_is_the_gain_of_exact_motions(fourth):
    for kind in ("single-sided", "double-sided"):
        gain = row_of(fourth, f"without simulation, {kind}, equivalent gain").figures
        assert gain["median"] < 0.02
        assert gain["most"] < 0.1


def test_what_the_text_does_not_settle_is_said_to_be_lost(third, fourth):
    assert row_of(third, "its histories").status == row_of(fourth, "its values").status == LOST
    two = row_of(fourth, "three routes")
    assert two.status == DIFFERS
    assert (round(two.figures["slope"], 3), round(two.figures["gain"], 3)) == (0.667, 0.391)


def test_a_tick_can_end_a_sweep():
    def stop() -> None:
        raise Cancelled("enough")

    with pytest.raises(Cancelled):
        sweep(lambda load: mesh_alone(0.8, 0.1, load), [0.1], 6, stop)
