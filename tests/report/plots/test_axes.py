"""Axes carry few round ticks, and values stand where they belong."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gearrattle.report.plots.chart import Bars, Line, Panel
from gearrattle.report.plots.svg_axes import Axis, limits, log_ticks


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6))
def test_ticks_are_few_round_and_inside(low: float, span: float) -> None:
    high = low + span
    if span <= 1e-6 * abs(low):
        return
    ticks = Axis(low, high, 0.0, 100.0).ticks()
    steps = np.diff(ticks)
    assert 3 <= len(ticks) <= 10
    assert all(low - 1e-6 * span <= t <= high + 1e-6 * span for t in ticks)
    assert np.allclose(steps, steps[0], rtol=1e-6)
    mantissa = steps[0] / 10.0 ** math.floor(math.log10(steps[0] * (1 + 1e-9)))
    assert min(abs(mantissa - m) for m in (1.0, 2.0, 5.0)) < 1e-3


def test_decades() -> None:
    assert Axis(1e-6, 1e6, 0.0, 1.0, log=True).ticks() == [1e-6, 1e-3, 1.0, 1e3, 1e6]
    assert Axis(1.0, 100.0, 0.0, 1.0, log=True).ticks() == [1.0, 10.0, 100.0]


def test_values_stand_where_they_belong() -> None:
    assert Axis(-1.0, 3.0, 0.0, 200.0).at(np.array([-1.0, 0.0, 3.0])).tolist() == [0.0, 50.0, 200.0]
    assert Axis(1.0, 100.0, 90.0, 0.0, log=True).at(np.array([1.0, 10.0, 100.0])) == pytest.approx([90.0, 45.0, 0.0])
    assert Axis(1.0, 100.0, 90.0, 0.0, log=True).at(np.array([0.0]))[0] > 90.0


def test_limits_fit_what_a_panel_holds() -> None:
    line = Line(np.array([0.0, 1.0, 2.0]), np.array([-1.0, np.nan, 3.0]), "a")
    x, y = limits(Panel("p", lines=(line,)))
    assert x == (0.0, 2.0)
    assert y == pytest.approx((-1.24, 3.24))
    bars = Bars(np.array([0.0, 1.0, 2.0]), np.array([2.0, 4.0]), "b", base=np.array([0.0, 6.0]))
    x, y = limits(Panel("p", bars=(bars,)))
    assert y[0] == 0.0
    assert y[1] >= 10.0
    assert limits(Panel("p", x_range=(3.0, 4.0), y_range=(5.0, 6.0))) == ((3.0, 4.0), (5.0, 6.0))
    constant = Line(np.array([1.0]), np.array([0.0]), "c")
    assert limits(Panel("p", lines=(constant,)))[1][0] < 0.0 < limits(Panel("p", lines=(constant,)))[1][1]


@pytest.mark.parametrize(
    ("low", "high", "ticks"),
    [
        (1.0, 8.0, [1.0, 2.0, 5.0]),
        (0.3, 4.0, [0.5, 1.0, 2.0]),
        (1.0, 100.0, [1.0, 10.0, 100.0]),
        (1e-9, 1e-1, [1e-9, 1e-7, 1e-5, 1e-3, 1e-1]),
    ],
)
def test_a_logarithmic_axis_has_round_ticks(low, high, ticks):
    assert log_ticks(low, high) == pytest.approx(ticks)
