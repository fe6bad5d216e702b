"""The page of a basin study: shares and intervals as the Dataset holds them, cells that tile the map, honest words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.report.plots.basins import basin_map, keys_of
from gearrattle.report.plots.palette import PAPER
from gearrattle.report.study import StudyReport
from gearrattle.report.study_pages.basins import attractor_table, summary_of
from tests.report.test_study import Balance
from tests.studies.oscillator import model

X, V = "deflection.flanks", "rate.flanks"


@pytest.fixture(scope="module")
def grid() -> xr.Dataset:
    over = {X: {"from": -0.6, "to": 0.8, "count": 11}, V: {"from": -4.0, "to": 4.0, "count": 9}}
    return gr.basins(model(), over, workers=1)


@pytest.fixture(scope="module")
def drawn() -> xr.Dataset:
    box = {X: {"from": -0.6, "to": 0.6}, V: {"from": -4.0, "to": 4.0}}
    return gr.basins(model(), box, samples=40, seed=1, workers=1)


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
            here = grid["basin"].sel({f"initial {X}": slice(left, right), f"initial {V}": slice(low, high)})
            assert np.all(here == code)
            inside += here.size
        assert inside == int((grid["basin"] == code).sum())
    rings = [line for line in panel.lines if line.colour == PAPER]
    assert rings[0].x.size == grid.sizes["attractor"]


def test_drawn_states_are_points(drawn: xr.Dataset) -> None:
    (panel,) = basin_map(drawn).panels
    assert sum(line.x.size for line in panel.lines if line.name != "attractors") == 40


def test_words_and_tables_say_what_the_dataset_holds(grid: xr.Dataset, drawn: xr.Dataset) -> None:
    assert "95 % interval" not in summary_of(grid)
    assert "95 % interval" in summary_of(drawn)
    assert "parts them" in summary_of(grid)
    assert "little room" not in summary_of(grid)
    assert "little room" in summary_of(grid.assign_attrs(between=5e-3))
    rows = attractor_table(grid).rows
    assert sum(int(row[1]) for row in rows) == 99
    assert rows[0][3] == "a grid has none"
    half = grid.assign(basin=grid["basin"].where(grid["basin"] != 1, -1))
    assert "had not settled and are counted to no motion" in summary_of(half)
    none = grid.assign(basin=grid["basin"].where(grid["basin"] != 2, 0))
    assert "lead to chaos" in summary_of(none)


@pytest.mark.parametrize("which", ["grid", "drawn", "line", "cube"])
def test_the_page_stands_whole(which: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    settings = {"cycles": 60, "discard": 40, "workers": 1}
    if which == "line":
        data = gr.basins(model(), {V: [-4.0, 0.0, 4.0]}, **settings)
    elif which == "cube":
        over = {"deflection.joint": [-0.01, 0.01], "rate.joint": [-1.0, 1.0], "velocity.wheel": [0.0, 1.0, 2.0]}
        from tests.studies.drivelines import model as two_bodies

        data = gr.basins(two_bodies(), over, workers=1)
    else:
        data = request.getfixturevalue(which)
    StudyReport(data, {}, title="a < b", cost="It took 3 s.").fill(tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    balance = Balance()
    balance.feed(page)
    assert not balance.open
    assert "a &lt; b" in page
    assert (tmp_path / "figures" / "basins.svg").stat().st_size > 1000
