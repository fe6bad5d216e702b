"""The page of a basin study: shares and intervals as the Dataset holds them, cells that tile the map, honest words."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from gearrattle.report.plots.basins_figure import basin_map, keys_of
from gearrattle.report.plots.palette import PAPER
from gearrattle.report.study_pages.basins_page import attractor_table, summary_of
from tests.report.examples import V, X, basins


@pytest.fixture(scope="module")
def grid() -> xr.Dataset:
    return basins("grid")


@pytest.fixture(scope="module")
def drawn() -> xr.Dataset:
    return basins("drawn")


def test_cells_tile_the_map_with_the_colours_of_their_attractors(grid: xr.Dataset) -> None:
    (panel,) = basin_map(grid).panels
    area = sum(float(((c.right - c.left) * (c.high - c.low)).sum()) for c in panel.cells)
    whole = np.prod([end[1] - end[0] for end in (panel.x_range, panel.y_range) if end])
    assert area == pytest.approx(whole, rel=1e-12)
    keys = keys_of(grid)
    for code, key in keys.items():
        cells = next(c for c in panel.cells if c.name == key.name)
        inside = 0
        for left, right, low, high in zip(cells.left, cells.right, cells.low, cells.high, strict=True):
            here = grid["basin"].sel({f"initial.{X}": slice(left, right), f"initial.{V}": slice(low, high)})
            assert np.all(here == code)
            inside += here.size
        assert inside == int((grid["basin"] == code).sum())
    rings = [line for line in panel.lines if line.colour == PAPER]
    assert rings[0].x.size == grid.sizes["attractor"]


def test_drawn_states_are_points(drawn: xr.Dataset) -> None:
    (panel,) = basin_map(drawn).panels
    assert sum(line.x.size for line in panel.lines if line.name != "attractors") == 12


def test_words_and_tables_say_what_the_dataset_holds(grid: xr.Dataset, drawn: xr.Dataset) -> None:
    assert "95 % interval" not in summary_of(grid)
    assert "95 % interval" in summary_of(drawn)
    assert "parts them" in summary_of(grid)
    assert "little room" not in summary_of(grid)
    assert "little room" in summary_of(grid.assign_attrs(between=5e-3))
    rows = attractor_table(grid).rows
    assert sum(int(row[1]) for row in rows) == 30
    assert rows[0][3] == "a grid has none"
    half = grid.assign(basin=grid["basin"].where(grid["basin"] != 1, -1))
    assert "had not settled and are counted to no motion" in summary_of(half)
    none = grid.assign(basin=grid["basin"].where(grid["basin"] != 2, 0))
    assert "lead to chaos" in summary_of(none)
