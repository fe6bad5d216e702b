"""The motion at the point that is pointed at: what travels with the page, and what a browser makes of it."""

from __future__ import annotations

import re
from base64 import b64decode
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import deflection_rate
from gearrattle.orbits import Branch
from gearrattle.orbits.orbit import sampled
from gearrattle.report.motion_at_point import chosen_points, motion_at_point, point_data
from gearrattle.report.plots.branches_figure import branch_charts
from gearrattle.report.plots.chords import thinned
from tests.browser import MARKS
from tests.orbits.test_branch import over_frequency
from tests.report.live_page import drawn, page_of_a_file, pixel

browser = [pytest.param((), marks=MARKS)]


def page(folder: Path) -> str:
    return over_frequency().save(folder / "page").read_text(encoding="utf-8")


def decoded(clearance: dict[str, Any], number: int) -> np.ndarray:
    """(S, 2) deflection and rate of a clearance at a chosen point, as the page has them."""
    first = sum(clearance["counts"][:number])
    every = np.frombuffer(b64decode(clearance["curves"]), dtype="<i2").reshape(-1, 2)
    whole = every[first : first + clearance["counts"][number]]
    ranges = np.array([clearance["x_range"], clearance["y_range"]])
    return np.asarray(ranges[:, 0] + (whole.astype(np.float64) + 32767.0) / 65534 * np.ptp(ranges, axis=1))


def curve(branch: Branch, number: int) -> np.ndarray:
    """(S, 2) deflection and rate of the first clearance at a chosen point."""
    return decoded(point_data(branch, chosen_points(branch))["clearances"][0], number)


def misses(points: np.ndarray, line: np.ndarray) -> float:
    """How far the farthest of points is from a polyline."""
    begin, along = line[:-1], np.diff(line, axis=0)
    square = np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
    farthest = 0.0
    for point in points:
        off = point - begin
        share = np.clip(np.einsum("ij,ij->i", off, along) / square, 0.0, 1.0)
        farthest = max(farthest, float(np.hypot(*(off - share[:, None] * along).T).min()))
    return farthest


def test_curves_are_the_motions_to_the_width_of_a_line() -> None:
    branch = over_frequency()
    points = chosen_points(branch)
    number = len(points) // 2
    samples = curve(branch, number)
    data = branch.data.isel(point=points[number])
    assert samples[0] == pytest.approx(samples[-1], abs=1e-4)
    assert samples[:, 0].max() == pytest.approx(float(data["highest"][0]), abs=2e-3)
    assert samples[:, 0].min() == pytest.approx(float(data["lowest"][0]), abs=2e-3)
    trajectory = branch.orbit(points[number]).run.trajectory
    assert samples[0, 0] == pytest.approx(trajectory.deflection[0, 0], abs=1e-4)


def test_levels_are_those_of_the_figures() -> None:
    """Every level lies on a curve of its figure, at the value of its point."""
    branch = over_frequency()
    data = point_data(branch, chosen_points(branch))
    for chart in branch_charts(branch):
        (panel,) = chart.panels
        drawn = np.concatenate([np.column_stack([line.x, line.y]) for line in panel.lines if line.mark == "line"])
        for level in data["levels"][chart.key][0]:
            for pair in zip(data["value"], level, strict=True):
                assert np.nanmin(np.abs(drawn - np.array(pair)).max(axis=1)) < 1e-5, chart.key


def test_long_branches_are_thinned_and_keep_their_ends() -> None:
    branch = gr.continuation(
        gr.example("rattle_oscillator"), "torque.0.harmonics.0.amplitude", (3.0, 3.4), start="linear", step_limit=2e-3
    )
    points = chosen_points(branch)
    assert len(branch.points) > 150
    assert (len(points), points[0], points[-1]) == (120, 0, len(branch.points) - 1)


@pytest.mark.long
def test_motions_with_many_impacts_are_fewer_and_smooth_on_the_screen() -> None:
    """Within half a pixel of the exact flow, of which one point in 7 of 16 000 samples of a period is looked at."""
    branch = gr.continuation(gr.example("case1"), "excitation.speed", ("1432 rpm", "1400 rpm"))
    points = chosen_points(branch)
    data = point_data(branch, points)
    assert len(data["points"]) == 50
    assert [clearance["name"] for clearance in data["clearances"]] == ["clutch", "gear"]
    number = int(np.argmax(branch.data["crossings"].values[points]))
    orbit = branch.orbit(points[number])
    fine = sampled(orbit, 16_000).trajectory
    for k, clearance in enumerate(data["clearances"]):
        assert max(clearance["counts"]) <= 4000
        line = decoded(clearance, number)
        rate = deflection_rate(orbit.model, fine, int(fine.layout.clearance[k]))
        flow = np.column_stack([fine.deflection[:, k], rate])
        low, high = np.abs(line).max(axis=0), np.abs(flow).max(axis=0)
        flow *= 10.0 ** np.round(np.log10(low / high))  # units of the page
        scale = np.array([1200.0, 600.0]) / [np.ptp(clearance["x_range"]), np.ptp(clearance["y_range"])]
        assert misses(flow[::7] * scale, line * scale) < 0.5
        starts = line[clearance["starts"][number]]
        assert len(starts) == orbit.cycles
        assert np.abs((starts[0] - flow[0]) * scale).max() < 0.5


def test_a_curve_keeps_no_more_points_than_it_needs() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 5001)
    circle = 300.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    chosen = thinned(circle, 0.35)
    least = np.pi / np.arccos(1.0 - 0.35 / 300.0)
    assert least <= len(chosen) <= 2.1 * least
    assert misses(circle, circle[chosen]) <= 0.35
    assert len(thinned(circle, 1e-9, 400)) == 400
    assert thinned(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]), 0.1).tolist() == [0, 2]


def test_with_fewer_points_those_are_kept_that_a_larger_distance_needs() -> None:
    time = np.linspace(0.0, 1.0, 3001)
    curve = 400.0 * np.column_stack([time, np.sin(40.0 * time**2)])
    most = len(thinned(curve, 2.0))
    assert 20 < most < len(thinned(curve, 0.3))
    assert misses(curve, curve[thinned(curve, 0.3, most)]) <= 2.0


def test_words_say_stability_and_multiplier() -> None:
    branch = over_frequency()
    data = point_data(branch, chosen_points(branch))
    unstable = [point["words"] for point in data["points"] if not point["stable"]]
    assert unstable
    assert all("unstable, repeats after 1 T, largest multiplier 1." in words for words in unstable)
    assert data["points"][0]["words"].endswith("No impact.")


def test_a_branch_without_a_clearance_of_its_model_shows_nothing() -> None:
    linear = gr.loads(
        'schema = 1\nunits = "dimensionless"\n[[inertia]]\nname = "body"\nJ = 1.0\n[[coupling]]\nname = "spring"\n'
        'between = ["body", "ground"]\nstiffness = 1.0\ndamping = 0.1\n[excitation]\nspeed = 0.5\n'
        '[[torque]]\non = "body"\nharmonics = [{ order = 1, amplitude = 1.0 }]\n'
    )
    assert motion_at_point(gr.continuation(linear, "excitation.speed", (0.5, 0.6))) == ""


def test_the_page_holds_it_once_and_stays_small(tmp_path: Path) -> None:
    text = page(tmp_path)
    assert text.count('id="motion-at-point"') == 1
    (data,) = re.findall(r'<script type="application/json" id="motion-at-point-data">(.*?)</script>', text, flags=re.S)
    assert len(data) < 250_000


@pytest.fixture
def tab(tmp_path: Path) -> Iterator[Any]:
    with page_of_a_file(over_frequency().save(tmp_path / "page")) as tab:
        drawn(tab, "extremes")
        yield tab


@pytest.mark.parametrize("_marks", browser)
def test_the_slider_moves_along_the_branch(_marks: tuple[()], tab: Any) -> None:
    slider = tab.get_by_role("slider", name="Along the branches")
    slider.press("End")
    words = tab.locator(".gr-motion-words")
    assert words.inner_text().startswith("frequency = 1.6: stable")
    assert slider.get_attribute("aria-valuetext") == words.inner_text()
    assert tab.locator("#motion-at-point canvas").count() == 2


@pytest.mark.parametrize("_marks", browser)
def test_the_pointer_shows_the_nearest_motion(_marks: tuple[()], tab: Any) -> None:
    """A pointer over the dashed part of the lower curve shows an unstable motion; a click keeps it."""
    data = over_frequency().data
    unstable = np.flatnonzero(~data["stable"].values)
    at = int(unstable[len(unstable) // 2])
    value, lowest = float(data["value"][at]), float(data["lowest"][at, 0])
    where = pixel(tab, "extremes", value, lowest)
    words = tab.locator(".gr-motion-words")
    tab.mouse.move(*where)
    said = re.match(r"frequency = ([\d.]+): unstable", words.inner_text())
    assert said is not None
    assert float(said[1]) == pytest.approx(value, abs=0.02)
    tab.mouse.click(*where)
    kept = words.inner_text()
    tab.mouse.move(5, 5)
    assert words.inner_text() == kept
