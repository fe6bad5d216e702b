"""Every figure of the table says what the motion did."""

from __future__ import annotations

import json
from xml.etree import ElementTree

import numpy as np
import pytest

from gearrattle.pipeline import Findings
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.chords import SCREEN, WITHIN, distances
from gearrattle.report.plots.clearance_figures import deflections, forces, overview
from gearrattle.report.plots.corner_marks import reach, shading
from gearrattle.report.plots.history_figures import accelerations
from gearrattle.report.plots.impact_figures import impacts
from gearrattle.report.plots.interactive import chart_json
from gearrattle.report.plots.palette import COAST, DRIVE
from gearrattle.report.plots.phase_plane import deflection_rate, phase_plane
from gearrattle.report.plots.region_figures import regions
from gearrattle.report.plots.run_figures import FIGURES, charts
from gearrattle.report.plots.run_up_figures import run_up_orders, run_up_spectra
from gearrattle.report.plots.sideways_figures import bearing_forces, displacements, orbits
from gearrattle.report.plots.spectrum_figures import spectra
from gearrattle.report.plots.svg_charts import draw
from gearrattle.report.plots.torque_angle_figure import torque_angles
from gearrattle.signals import find_impacts, last_cycles, region_shares, steady
from tests import synthetic

KINDS = tuple(synthetic.DEFLECTIONS)


@pytest.fixture(scope="module", params=KINDS)
def findings(request: pytest.FixtureRequest) -> Findings:
    return synthetic.findings(request.param)


@pytest.fixture(scope="module")
def rattling() -> Findings:
    return synthetic.findings("double-sided")


@pytest.mark.parametrize("figure", FIGURES, ids=lambda figure: figure.__name__)
def test_every_figure_draws_both_ways(figure, findings: Findings) -> None:
    chart = figure(findings)
    if chart is None:
        sometimes = (torque_angles, run_up_spectra, run_up_orders, orbits, displacements, bearing_forces)
        assert findings.verdict.verdict == "quiet" or figure in sometimes
        return
    assert chart.panels
    assert chart.caption.endswith(".")
    for panel in chart.panels:
        assert panel.lines or panel.bars or panel.cells or panel.note
        assert all(line.x.shape == line.y.shape and np.isfinite(line.y).all() for line in panel.lines)
    json.dumps(chart_json(chart), allow_nan=False)
    ElementTree.fromstring(draw(chart))


def test_keys_name_files_and_do_not_repeat(rattling: Findings) -> None:
    keys = [chart.key for chart in charts(rattling)]
    assert len(set(keys)) == len(keys) == len(FIGURES) - 6  # none has friction, moves sideways, changes its speed
    assert all(key.isidentifier() for key in keys)


def test_histories_show_the_last_cycles_sample_by_sample(rattling: Findings) -> None:
    motion = rattling.motion.trajectory
    for column, panel in enumerate(accelerations(rattling).panels):
        (line,) = panel.lines
        window = last_cycles(motion, 4)
        assert panel.title == synthetic.NAMES[column]
        assert line.x[[0, -1]].tolist() == [motion.cycles - 4, motion.cycles]
        assert np.array_equal(line.y, window.closed(motion.acceleration)[:, column])


def test_deflections_are_scaled_and_marked_at_their_corners(rattling: Findings) -> None:
    motion = rattling.motion.trajectory
    gear = deflections(rattling).panels[2]
    curve, *marks = gear.lines
    assert gear.unit == "µm"
    assert np.allclose(curve.y, 1e6 * last_cycles(motion, 4).closed(motion.deflection)[:, 2])
    expected = find_impacts(motion).of(2).within(last_cycles(motion, 4))
    drive, coast = marks
    assert drive.y == pytest.approx(50.0)
    assert coast.y == pytest.approx(-50.0)
    assert np.allclose(np.sort(np.concatenate([drive.x, coast.x])), expected.time / synthetic.PERIOD)


def test_overview_shows_all_and_greys_what_is_discarded(rattling: Findings) -> None:
    motion = rattling.motion.trajectory
    gear = overview(rattling).panels[2]
    assert gear.lines[0].x[[0, -1]].tolist() == [0.0, motion.cycles]
    assert gear.lines[0].y.max() == pytest.approx(1e6 * motion.deflection[:, 2].max())
    grey = next(band for band in gear.bands if band.along == "x")
    assert (grey.low, grey.high) == (0.0, motion.discard)


def test_force_is_that_of_the_trajectory(rattling: Findings) -> None:
    motion = rattling.motion.trajectory
    panel = forces(rattling).panels[1]
    assert panel.title == "spline"
    assert np.array_equal(panel.lines[0].y, last_cycles(motion, 4).closed(motion.force)[:, 1])


def test_regions_are_those_of_every_time_and_impact(findings: Findings) -> None:
    """At every sample the region of the log; filled as long as the clearance is in contact; a dot for every impact."""
    motion = findings.motion.trajectory
    window = last_cycles(motion, 4)
    for k, panel in enumerate(regions(findings).panels):
        steps, *dots = panel.lines
        ends = steps.x[1::2]
        sample = np.arange(window.first, window.last)
        at = np.searchsorted(ends, motion.time[sample] / synthetic.PERIOD, side="right")
        away = np.abs(motion.deflection[sample, k][:, None] - motion.layout.corners[k]).min(axis=1)
        clear = away > 1e-6 * np.ptp(motion.layout.corners[k])
        labels = np.searchsorted(motion.layout.corners[k], motion.deflection[sample, k])
        expected = labels + motion.layout.region_of_first_piece[k]
        np.testing.assert_array_equal(steps.y[1::2][at][clear], expected[clear])
        filled = sum(float((cells.right - cells.left).sum()) for cells in panel.cells)
        shares = region_shares(motion, k, window)
        assert filled / 4 == pytest.approx(sum(share for label, share in shares.items() if label))
        mine = find_impacts(motion).of(k).within(window)
        assert sum(line.x.size for line in dots) == len(mine)


def test_deflection_rate_is_the_derivative(findings: Findings) -> None:
    motion = findings.motion.trajectory
    kind = findings.verdict.verdict
    for k, deflection in enumerate(synthetic.DEFLECTIONS[kind]):
        exact = deflection(motion.time, 1)
        assert np.allclose(deflection_rate(findings, k), exact, rtol=0.0, atol=1e-9 * np.abs(exact).max() + 1e-12)


def test_phase_plane_pairs_rate_with_deflection(rattling: Findings) -> None:
    motion = rattling.motion.trajectory
    clutch = phase_plane(rattling).panels[0].lines[0]
    window = last_cycles(motion, 8)
    samples = np.column_stack(
        [1e3 * window.closed(motion.deflection)[:, 0], window.closed(deflection_rate(rattling, 0))]
    )
    drawn = np.column_stack([clutch.x, clutch.y])
    np.testing.assert_allclose(drawn[[0, -1]], samples[[0, -1]])
    scale = np.array(SCREEN) / np.ptp(drawn, axis=0)
    begin, end = drawn[:-1] * scale, drawn[1:] * scale
    away = [distances(np.broadcast_to(sample, begin.shape), begin, end).min() for sample in samples * scale]
    assert max(away) <= WITHIN


def test_impact_histograms_count_every_impact_once(rattling: Findings) -> None:
    motion = rattling.motion.trajectory
    mine = find_impacts(motion).within(steady(motion)).of(2)
    phases, speeds, pushes = impacts(rattling).panels
    assert sum(line.x.size for line in phases.lines) == len(mine)
    for panel in (speeds, pushes):
        drive, coast = panel.bars
        assert drive.heights.sum() == mine.drive.sum()
        assert coast.heights.sum() == (~mine.drive).sum()
    assert speeds.x_range[1] == pytest.approx(1e3 * np.abs(mine.velocity).max())
    assert {line.colour for line in phases.lines} == {DRIVE, COAST}
    assert all(0.0 <= line.x.min() <= line.x.max() < 1.0 for line in phases.lines)


def test_nothing_impacts_where_it_is_quiet() -> None:
    assert impacts(synthetic.findings("quiet")) is None


def test_spectra_peak_at_the_excited_orders(rattling: Findings) -> None:
    flywheel = spectra(rattling).panels[0]
    line = flywheel.lines[0]
    assert line.x[np.argmax(line.y)] == pytest.approx(1.0)
    labels = [rule.label for rule in flywheel.rules]
    assert labels == ["f1", "f2"]
    assert flywheel.rules[0].at == pytest.approx(350.0 / synthetic.OMEGA)


def test_few_samples_a_cycle_are_drawn_as_points() -> None:
    stroboscopic = synthetic.findings("double-sided", cycles=40, samples=1, discard=10)
    exact = {"spectrum", "regions"}  # not drawn from the samples
    for chart in charts(stroboscopic):
        assert isinstance(chart, Chart)
        assert all(line.mark == "points" for panel in chart.panels for line in panel.lines if chart.key not in exact)


def test_dimensionless_models_show_no_units(rattling: Findings) -> None:
    bare = synthetic.findings("double-sided", units="dimensionless")
    for chart in charts(bare):
        assert {panel.unit for panel in chart.panels} <= {"", "rate", "cycle", "impacts", "dB", "1/cycle", "region"}
        assert not any("[" in panel.x_title for panel in chart.panels if chart.share_x is False)


def test_shading_knows_drive_from_coast() -> None:
    bands, rules = shading(synthetic.layout(), 2, 1e6)
    assert [(band.low, band.high, band.colour) for band in bands] == [
        (None, pytest.approx(-50.0), COAST),
        (pytest.approx(50.0), None, DRIVE),
    ]
    assert [rule.at for rule in rules] == pytest.approx([-50.0, 50.0])


@pytest.mark.parametrize(
    ("values", "low", "high"),
    [
        ([-0.5, 0.5], -1.0, 1.0),
        ([0.9, 1.1], 0.9, 1.1),
        ([1.4, 1.5], 1.0, 1.5),
        ([0.0, 0.0], -1.0, 1.0),
    ],
)
def test_reach_shows_the_corners_worth_seeing(values: list[float], low: float, high: float) -> None:
    actual = reach(np.array(values), np.array([-1.0, 1.0]))
    margin = 0.08 * (high - low)
    assert actual == pytest.approx((low - margin, high + margin))


def test_the_loop_of_friction_and_the_motion_over_it() -> None:
    """One panel for the one coupling with friction; the motion stays inside its static loop but for damping."""
    import gearrattle as gr
    from gearrattle.pipeline import run
    from gearrattle.report.summary import findings_content
    from tests.architecture.places import EXAMPLES

    model = gr.load(EXAMPLES / "clutch_friction.toml")
    findings = run(model.with_({"coupling.damper.stages.0.damping": 0.0}), cycles=6, samples_per_cycle=128)
    chart = torque_angles(findings)
    assert chart is not None
    assert [panel.title for panel in chart.panels] == ["damper"]
    _, loop, motion = chart.panels[0].lines
    assert (loop.x.min(), loop.x.max()) == pytest.approx((motion.x.min(), motion.x.max()))
    assert np.ptp(motion.y) > 0.5 * np.ptp(loop.y)
    reported = findings_content(findings)
    assert reported["energy"]["friction_loss"]["damper"] > 0.0
    assert reported["energy"]["friction_loss"]["gear"] == 0.0
    watch = findings.motion.trajectory.auxiliaries.passages.watch
    assert sum(reported["simulation"]["switches"].values()) == int((watch >= 3).sum())
