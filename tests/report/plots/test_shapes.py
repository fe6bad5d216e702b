"""Shapes and dashes that mean something are the same in every drawing; equal scales are equal."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from gearrattle.report.plots.chart import Chart, Dash, Key, Line, Panel, Shape
from gearrattle.report.plots.shapes import SHAPES, swatch
from gearrattle.report.plots.svg_axes import widened
from gearrattle.report.plots.svg_charts import draw
from gearrattle.report.plots.typeset import matplotlib_figure

X = np.array([0.0, 1.0, 2.0])
DASHED: tuple[Dash, ...] = ("solid", "dashed")
NAMES = [name for name in get_args(Shape) if name]


def chart(*lines: Line, **settings: object) -> Chart:
    keys = tuple(Key(line.name, line.colour, line.shape, line.dash) for line in lines)
    panel = replace(Panel("panel", lines=lines), **settings)  # type: ignore[arg-type]
    return Chart("key", "Title", "Caption.", (panel,), legend=keys)


def test_every_shape_has_a_path_a_marker_and_a_letter_of_its_own() -> None:
    assert sorted(SHAPES) == sorted(NAMES)
    for what in ("path", "matplotlib", "letter"):
        assert len({getattr(drawn, what) for drawn in SHAPES.values()}) == len(SHAPES)


@pytest.mark.parametrize("shape", NAMES)
def test_a_shape_is_drawn_at_every_point_and_in_the_legend(shape: Shape) -> None:
    drawing = chart(Line(X, X, "points", mark="points", width=8.0, shape=shape))
    svg = draw(drawing, legend=True).decode("utf-8")
    assert svg.count(f'd="{SHAPES[shape].path}"') == X.size + 1
    figure = matplotlib_figure(drawing)
    assert figure.axes[0].lines[0].get_marker() == SHAPES[shape].matplotlib
    assert figure.legends[0].legend_handles[0].get_marker() == SHAPES[shape].matplotlib  # type: ignore[union-attr]
    assert swatch(drawing.legend[0]) == SHAPES[shape].letter


def test_dashes_that_mean_something_are_kept_whatever_the_colours() -> None:
    lines = [Line(X, X + k, f"{dash} {k}", f"#{k}{k}{k}{k}{k}{k}", dash=dash) for k in (1, 2) for dash in DASHED]
    drawing = chart(*lines)
    svg = draw(drawing).decode("utf-8")
    assert len(re.findall(r'stroke-dasharray="5 3"', svg)) == 2
    patterns = [line._unscaled_dash_pattern[1] for line in matplotlib_figure(drawing).axes[0].lines]  # type: ignore[attr-defined]
    assert [pattern is None for pattern in patterns] == [True, False, True, False]


def test_equal_scales_are_equal_in_every_drawing() -> None:
    panel = Panel("panel", x_range=(-1.0, 1.0), y_range=(-1.0, 1.0), equal_scales=True)
    (left, right), (low, high) = widened(panel, 2.5)
    assert (right - left) / (high - low) == pytest.approx(2.5)
    assert low == -1.0
    (left, right), (low, high) = widened(panel, 0.5)
    assert (right - left, high - low) == pytest.approx((2.0, 4.0))
    drawing = chart(Line(X, X, "line"), x_range=(-1.0, 1.0), y_range=(-1.0, 1.0), equal_scales=True)
    assert matplotlib_figure(drawing).axes[0].get_aspect() == 1.0
