"""What the figures of results show is what the results hold."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.report.plots.chart import Chart, Line
from gearrattle.report.result_kinds import presentation_of
from gearrattle.report.stiffness_page import OverRatios, StiffnessPage
from tests.measured.test_gas_torque import engine


def chart_of(result: object, key: str) -> Chart:
    return {chart.key: chart for chart in presentation_of(result).charts()}[key]


def line_of(chart: Chart, name: str, panel: int = 0) -> Line:
    return {line.name: line for line in chart.panels[panel].lines}[name]


def test_the_torque_over_a_cycle_has_the_mean_and_the_harmonics_of_the_engine() -> None:
    torque = gr.gas_torque(**engine(1), speed="1500 rpm")
    whole = line_of(chart_of(torque, "torque"), "together").y[:-1]
    amplitudes = np.abs(np.fft.rfft(whole)) * 2.0 / whole.size
    assert whole.mean() == pytest.approx(torque.mean, rel=1e-12)
    for wave in torque.harmonics:
        assert amplitudes[round(2.0 * wave.order)] == pytest.approx(wave.amplitude, abs=1e-9 * amplitudes.max())
    bars = chart_of(torque, "harmonics").panels[0].bars
    assert [float(bar.heights[0]) for bar in bars] == [wave.amplitude for wave in torque.harmonics]


@pytest.mark.parametrize("example", ["case3", "eight_dof"])
def test_elements_rest_where_their_law_carries_the_mean_load(example: str) -> None:
    rest = gr.equilibrium(gr.example(example))
    chart = chart_of(rest, "rest")
    assert [panel.title for panel in chart.panels] == list(rest.region)
    for panel in chart.panels:
        curve, dot = panel.lines
        assert dot.x[0] in curve.x
        assert dot.y[0] == curve.y[curve.x == dot.x[0]][0]
        shaded = [
            (band.low is None or band.low <= dot.x[0]) and (band.high is None or dot.x[0] <= band.high)
            for band in panel.bands
        ]
        assert any(shaded) == (rest.region[panel.title] != 0)
        assert all(band.along == "x" for band in panel.bands)


def test_r_lambda_is_the_distance_between_the_rules() -> None:
    stiffness = gr.stiffness(gr.example("case3"))
    low, high = (rule.at for rule in chart_of(stiffness, "eigenvalues").panels[0].rules)
    assert high / low == pytest.approx(stiffness.r_lambda, rel=1e-12)
    over = OverRatios((0.1, 0.5, 1.0), {"clutch": (1.0, 2.0, 3.0), "gear": (10.0, 20.0, 1e5)})
    chart = {chart.key: chart for chart in StiffnessPage(stiffness, over).charts()}["r_lambda"]
    assert line_of(chart, "gear").y.tolist() == [10.0, 20.0, 1e5]
    low, high = chart.panels[0].y_range or (0.0, 0.0)
    assert low <= 1.0
    assert high >= 1e5


def test_a_verdict_shows_impacts_on_both_sides() -> None:
    verdict = gr.criteria(gr.simulate(gr.example("case3"), cycles=20, samples_per_cycle=64))
    chart = chart_of(verdict, "impacts")
    for side in ("drive", "coast"):
        values = line_of(chart, f"{side} side").x.tolist()
        assert values == [getattr(part, f"{side}_impacts_per_cycle") for part in verdict.parts]


def test_channels_keep_their_extremes_however_long(tmp_path: Path) -> None:
    values = np.sin(np.arange(20_000) * 0.01)
    values[12_345], values[777] = 9.0, -8.0
    lines = [f"{i * 1e-3!r},{value!r},1.0" for i, value in enumerate(values.tolist())]
    (tmp_path / "rig.csv").write_text("t [s],n [rpm],k [N]\n" + "\n".join(lines) + "\n", encoding="utf-8")
    contents = gr.measured.look(tmp_path / "rig.csv")
    time, shown = contents.outline[0]
    assert time.size == shown.size <= 1002
    assert (shown.max(), shown.min()) == (9.0, -8.0)
    assert time[shown == 9.0].tolist() == [12.345]
    assert (time[0], time[-1]) == (0.0, 19.999)
    assert [panel.title for panel in chart_of(contents, "channels").panels] == ["n", "k"]


def test_channels_without_two_finite_samples_are_not_drawn(tmp_path: Path) -> None:
    (tmp_path / "rig.csv").write_text("t [s],n [rpm],k [N]\n0,1,nan\n0.1,2,3\n0.2,nan,nan\n", encoding="utf-8")
    contents = gr.measured.look(tmp_path / "rig.csv")
    assert [values.tolist() for _, values in contents.outline] == [[1.0, 2.0], [3.0]]
    assert [panel.title for panel in chart_of(contents, "channels").panels] == ["n"]


def boundary(axes: tuple[str, ...]) -> xr.Dataset:
    shape = (3,) * len(axes)
    codes = np.zeros(shape, dtype=np.int64)
    codes[(1,) * len(axes)] = 2
    data = xr.Dataset(
        {
            "outcome": (axes, np.ones(shape, dtype=np.int64)),
            "verdict": (
                axes,
                codes,
                {"flag_values": [0, 1, 2], "flag_meanings": "quiet single-sided double-sided", "_FillValue": -1},
            ),
        },
        {axis: [1.0, 2.0, 3.0] for axis in axes},
    )
    return gr.studies.regime_boundary(data, "verdict")


def test_a_boundary_over_two_axes_is_drawn_in_their_plane() -> None:
    chart = chart_of(boundary(("a", "b")), "boundary")
    (line,) = chart.panels[0].lines
    assert sorted(zip(line.x.tolist(), line.y.tolist(), strict=True)) == [
        (1.5, 2.0),
        (2.0, 1.5),
        (2.0, 2.5),
        (2.5, 2.0),
    ]


def test_a_boundary_over_one_axis_is_drawn_between_the_neighbours() -> None:
    chart = chart_of(boundary(("a",)), "boundary")
    interval, dots = chart.panels[0].lines
    assert dots.x.tolist() == [1.5, 2.5]
    assert interval.x[np.isfinite(interval.x)].tolist() == [1.0, 2.0, 2.0, 3.0]


def test_a_boundary_over_three_axes_has_no_figure() -> None:
    assert presentation_of(boundary(("a", "b", "c"))).charts() == []


def test_silence_has_no_figure() -> None:
    sound = gr.listen(gr.simulate(gr.example("case3"), cycles=20, samples_per_cycle=64))
    silent = replace(sound, pressure=tuple(np.zeros_like(pressure) for pressure in sound.pressure))
    assert presentation_of(silent).charts() == []


def test_the_spectrum_of_a_tone_holds_its_power() -> None:
    sound = gr.listen(gr.simulate(gr.example("case3"), cycles=20, samples_per_cycle=64))
    tone = np.sin(2.0 * np.pi * 1000.0 * np.arange(48_000) / sound.rate)
    chart = chart_of(replace(sound, pressure=(tone,)), "spectrum")
    (line,) = chart.panels[0].lines
    assert float(np.trapezoid(line.y, line.x)) == pytest.approx(0.5, rel=1e-3)
    assert line.x[line.y.argmax()] == pytest.approx(1000.0, abs=sound.rate / 8192)
