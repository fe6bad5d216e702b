"""Charts of rows: names on the left, points on one x axis."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest

from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.row_charts import MOST_ROWS, ROW, Series, row_chart
from gearrattle.report.plots.svg_charts import draw
from gearrattle.report.plots.typeset import matplotlib_figure


def chart_of(values: np.ndarray, *, log: bool = False, marks: tuple[float, ...] = ()) -> Chart | None:
    names = [f"row {i}" for i in range(len(values))]
    return row_chart("rows", "Rows", "Each row.", names, [Series("value", values)], level="value", marks=marks, log=log)


@pytest.mark.parametrize("log", [False, True])
@pytest.mark.parametrize("count", [1, 4, 40, 128])
def test_rows_are_named_top_to_bottom_and_the_rest_is_counted(count: int, log: bool) -> None:
    chart = chart_of(np.geomspace(1e-3, 1e5, count), log=log)
    assert chart is not None
    (panel,) = chart.panels
    rows = min(count, MOST_ROWS)
    assert [label.words for label in sorted(panel.labels, key=lambda label: -label.y)] == [
        f"row {i}" for i in range(rows)
    ]
    assert chart.panel_height == ROW * rows + 14
    (line,) = panel.lines
    assert line.y.tolist() == list(range(rows - 1, -1, -1))
    assert ("88 rows more are in the table." in chart.caption) == (count == 128)
    low, high = panel.x_range or (0.0, 0.0)
    assert low < line.x.min() <= line.x.max() < high or log
    assert draw(chart).startswith(b"<svg")
    with warnings.catch_warnings(action="error"):
        assert matplotlib_figure(chart).axes


def test_names_stand_left_of_every_point() -> None:
    chart = chart_of(np.array([-2.0, 0.0, 3.0]))
    assert chart is not None
    assert max(label.x for label in chart.panels[0].labels) < -2.0


def test_marks_are_within_the_axis_whatever_the_values() -> None:
    chart = chart_of(np.array([0.01]), marks=(-5.0, 0.0, 5.0))
    assert chart is not None
    low, high = chart.panels[0].x_range or (0.0, 0.0)
    assert [rule.at for rule in chart.panels[0].rules] == [-5.0, 0.0, 5.0]
    assert low < -5.0 < 5.0 < high


def test_without_a_finite_value_there_is_no_chart() -> None:
    assert chart_of(np.array([np.nan, np.inf])) is None
    assert chart_of(np.zeros(0)) is None
    assert chart_of(np.array([0.0, -1.0]), log=True) is None


def test_what_is_not_positive_is_left_out_of_a_logarithmic_axis() -> None:
    chart = chart_of(np.array([0.0, 2.0, -3.0]), log=True)
    assert chart is not None
    assert chart.panels[0].lines[0].y.tolist() == [1.0]
    assert chart.panels[0].x_log


def test_an_interval_is_drawn_from_low_to_high() -> None:
    one = np.array([1.0])
    chart = row_chart(
        "rows", "Rows", "Each row.", ["a"], [Series("value", one, low=one - 0.5, high=one + 2.0)], level="x"
    )
    assert chart is not None
    assert chart.panels[0].lines[0].x[:2].tolist() == [0.5, 3.0]
    assert not re.search("nan", draw(chart).decode())
