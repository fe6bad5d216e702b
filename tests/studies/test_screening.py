"""The threshold against closed forms, and against exact simulations on either side of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr

OMEGA = 80.0
AMPLITUDE = 2.0
DRAG = 0.5
DRIVER = 0.02
LOOSE = 1e-3
RATIO = 0.05 / 0.04
PAIR = f"""
schema = 1
name = "a driven shaft and a loose gear"
inertia = [{{ name = "shaft", J = {DRIVER} }}, {{ name = "wheel", J = {LOOSE}, drag_torque = {DRAG} }}]
torque = [{{ on = "shaft", mean = {DRAG * RATIO}, harmonics = [{{ order = 2, amplitude = {AMPLITUDE} }}] }}]

[excitation]
speed = {OMEGA}

[simulation]
cycles = 60
discard = 40
samples_per_cycle = 64

[[mesh]]
name = "mesh"
between = ["shaft", "wheel"]
radii = [0.05, 0.04]
stiffness = 1e8
damping = 2000.0
backlash = 1e-4
"""
RIGID = LOOSE * RATIO * AMPLITUDE / (DRIVER + LOOSE * RATIO**2) / DRAG
BOUND = 1.0 / np.cos(np.pi / 64.0)  # between samples a sine rises by at most this


def pair(**changes: Any) -> gr.Model:
    return gr.loads(PAIR).with_({key.replace("__", "."): value for key, value in changes.items()})


def test_the_ratio_of_a_rigid_pair_is_its_closed_form() -> None:
    """J (R_d/R_l) T / (J_d + J_l (R_d/R_l)^2) / T_drag at any speed: a free pair follows its torque."""
    actual = gr.screen(pair(), [20.0, "800 rpm", 200.0], [0.5, 1.0, 2.0])
    assert actual.margin.dims == ("speed", "load", "gear")
    assert actual.speed.values == pytest.approx([20.0, 800.0 * np.pi / 30.0, 200.0])
    for j, factor in enumerate((0.5, 1.0, 2.0)):
        values = actual.separation_ratio.values[:, j, 0]
        assert np.all(values >= factor * RIGID * (1.0 - 1e-4))
        assert np.all(values <= factor * RIGID * BOUND * (1.0 + 1e-4))
    assert actual.margin.values == pytest.approx(20.0 * np.log10(actual.separation_ratio.values), rel=1e-12)
    assert actual.gear.values.tolist() == ["mesh"]
    assert actual.driver.values.tolist() == ["shaft"]


def test_a_stiff_mesh_lifts_where_the_margin_says() -> None:
    """Both ratios tell the same of a mesh that is all but rigid, and the linear motion is exact below 1."""
    actual = gr.screen(pair(), [OMEGA], [0.2, 0.9 / RIGID, 1.1 / RIGID, 2.0 / RIGID])
    assert actual.lift_ratio.values == pytest.approx(actual.separation_ratio.values, rel=1e-2)
    assert actual.inside.values[0].tolist() == [True, True, False, False]


def test_simulations_agree_on_both_sides_of_the_threshold() -> None:
    """Exact motions: quiet a fifth below lift-off, rattling a fifth above."""
    actual = gr.screen(pair(), [OMEGA, 160.0], [0.8 / RIGID, 1.2 / RIGID], simulate=True, workers=1)
    assert ((actual.lift_ratio < 1.0) == (actual.regime == 0)).all()
    assert set(np.unique(actual.regime)) != {0}


def test_progress_rises_to_one_and_may_end_the_work() -> None:
    """Of the thresholds alone, and of the simulations after them."""
    for simulate in (False, True):
        reports: list[float] = []
        gr.screen(pair(), [OMEGA, 160.0], [0.5, 1.0], simulate=simulate, workers=1, progress=reports.append)
        assert reports == sorted(reports)
        assert len(reports) >= 4
        assert reports[-1] == pytest.approx(1.0)

    def stop(fraction: float) -> None:
        raise gr.Cancelled(f"{fraction}")

    with pytest.raises(gr.Cancelled):
        gr.screen(pair(), [OMEGA], progress=stop)


class Reports:
    """Takes shares, and how long the work still takes, as the command line does."""

    def __init__(self) -> None:
        self.reports: list[tuple[float, float | None]] = []
        self._seconds: float | None = None

    def expect(self, seconds: float) -> None:
        self._seconds = seconds

    def __call__(self, share: float) -> None:
        self.reports.append((share, self._seconds))


def test_how_long_is_told_by_the_simulations_alone() -> None:
    """Thresholds stand for a fiftieth of the work; of eight cases they are most, and 50 times too long was told."""
    progress = Reports()
    gr.screen(pair(), [OMEGA, 160.0], [0.5, 1.0], check=2, workers=1, progress=progress)
    before = [seconds for share, seconds in progress.reports if share < 0.02]
    after = [seconds for share, seconds in progress.reports if share > 0.02]
    assert before
    assert all(seconds is not None and np.isnan(seconds) for seconds in before)
    assert after
    assert all(seconds is not None and 0.0 <= seconds < 60.0 for seconds in after)
    progress = Reports()
    gr.screen(pair(), [OMEGA, 160.0], progress=progress)
    assert {seconds for _, seconds in progress.reports} == {None}


def test_loads_by_path_vary_together() -> None:
    """Twice the drag, half the ratio; coordinates keep what the loads were."""
    loads = {"inertia.wheel.drag_torque": [DRAG, 2.0 * DRAG], "torque.0.mean": [DRAG * RATIO, 2.0 * DRAG * RATIO]}
    actual = gr.screen(pair(), [OMEGA], loads)
    first, second = actual.separation_ratio.values[0, :, 0]
    assert second == pytest.approx(0.5 * first, rel=1e-9)
    assert actual["inertia.wheel.drag_torque"].values.tolist() == [DRAG, 2.0 * DRAG]


def test_what_cannot_be_screened_is_refused() -> None:
    """No loose gear, negative factors, amplitudes over speed, paths that lead nowhere."""
    with pytest.raises(gr.ModelError, match="loose gear"):
        gr.screen(pair(inertia__wheel__drag_torque=0.0, torque__0__mean=0.0), [OMEGA])
    with pytest.raises(gr.ModelError, match="factors of zero or more"):
        gr.screen(pair(), [OMEGA], [-1.0])
    with pytest.raises(gr.ModelError, match=r"torque.0.*by path"):
        gr.screen(gr.load("examples/run_up.toml"), ["800 rpm"], [1.0])
    with pytest.raises(gr.ModelError, match="nowhere"):
        gr.screen(pair(), [OMEGA], {"inertia.nowhere.J": [1.0]})
