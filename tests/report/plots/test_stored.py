"""Charts come out of a file as they went in."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from gearrattle.errors import ModelError
from gearrattle.report.plots.chart_files import packed_charts, read_charts
from gearrattle.report.plots.interactive import chart_json
from gearrattle.report.plots.run_figures import charts
from gearrattle.report.plots.svg_charts import draw
from tests import synthetic
from tests.report.plots.test_typeset import everything


@pytest.fixture(scope="module")
def kept() -> list:
    return [everything(), *charts(synthetic.findings("double-sided"))]


def test_charts_come_back_as_they_were(kept: list, tmp_path: Path) -> None:
    (tmp_path / "a.npz").write_bytes(packed_charts(kept))
    actual = read_charts(tmp_path / "a.npz")
    assert [draw(chart, legend=True) for chart in actual] == [draw(chart, legend=True) for chart in kept]
    assert [chart_json(chart) for chart in actual] == [chart_json(chart) for chart in kept]
    assert np.array_equal(actual[0].panels[0].lines[3].y, kept[0].panels[0].lines[3].y, equal_nan=True)
    assert packed_charts(actual) == packed_charts(kept)


def test_an_empty_list_is_kept(tmp_path: Path) -> None:
    (tmp_path / "a.npz").write_bytes(packed_charts([]))
    assert read_charts(tmp_path / "a.npz") == []


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.7, 0.999])
def test_a_file_cut_off_is_refused(kept: list, tmp_path: Path, share: float) -> None:
    raw = packed_charts(kept[:1])
    path = tmp_path / "a.npz"
    path.write_bytes(raw[: int(share * len(raw))])
    with pytest.raises(ModelError, match=r"a\.npz"):
        read_charts(path)


@pytest.mark.parametrize("seed", range(30))
def test_overwritten_bytes_are_refused_or_do_not_matter(kept: list, tmp_path: Path, seed: int) -> None:
    draws = np.random.default_rng(seed)
    raw = bytearray(packed_charts(kept[:1]))
    at = int(draws.integers(0, len(raw) - 40))
    raw[at : at + 40] = draws.bytes(40)
    path = tmp_path / "a.npz"
    path.write_bytes(raw)
    try:
        actual = read_charts(path)
    except ModelError:
        return
    assert packed_charts(actual) == packed_charts(kept[:1])


@pytest.mark.parametrize(
    "message",
    [
        {"format": 99, "charts": []},
        {"format": 1, "charts": [3]},
        {"format": 1},
        [],
        {"format": 1, "charts": [{"noun": "Path", "x": 1}]},
    ],
)
def test_what_is_no_chart_is_refused(message: object, tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, charts=np.frombuffer(json.dumps(message).encode(), np.uint8))
    with pytest.raises(ModelError):
        read_charts(path)


def test_code_in_a_file_is_not_run(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, charts=np.array([{"a": 1}], dtype=object))
    with pytest.raises(ModelError):
        read_charts(path)
