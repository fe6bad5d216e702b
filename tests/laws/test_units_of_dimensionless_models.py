"""A dimensionless model shows no unit of SI: not in tables, datasets, charts, reports or studies.

A phase is an angle in any model, and the calibration constant of the rattle level is a unit by its definition.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5netcdf
import pytest

import gearrattle as gr
from gearrattle.cli import main

EXAMPLES = Path(__file__).parents[2] / "examples"
NAMES = ("paper/case3", "manual_transmission", "driveline_lash", "clutch_friction")
BARE = {"", "1", "1/cycle", "cycles", "dB", "%"}
SI = r"(?:kg|mm|m|N m|N|rad|mrad|deg|rpm|Hz|kHz|J|mJ|uJ|W|s|ms)(?:[²^/*][\w²^/ ]*)?"
SHOWN = re.compile(rf"\d\s(?:{SI})(?![\w-])|\[(?:{SI})\]|1/s\b|rad/s")
WALL = re.compile(r"(?:computing time|of \d+ cycles|function calls and)(?: [\d.]+ m?s\b)+")
"""Time on the clock, which any model takes."""
RUN: dict[str, Any] = {"cycles": 12, "discard": 4}


def dimensionless(name: str) -> gr.Model:
    """Return an example without units."""
    return gr.nondimensionalize(gr.load(EXAMPLES / f"{name}.toml")).model


@pytest.fixture(scope="module", params=NAMES)
def run(request: pytest.FixtureRequest) -> gr.Run:
    """Return a short run of an example without units."""
    return gr.simulate(dimensionless(request.param), **RUN)


def units_in(data: Any) -> Iterator[tuple[str, str]]:
    """Yield names and units of all variables of a Dataset or DataArray; the phases, angles of their own, left out."""
    for name, variable in {**data.coords, **getattr(data, "data_vars", {"": data})}.items():
        if not str(name).startswith("phase"):
            yield str(name), str(variable.attrs.get("units", ""))


def strangers(data: Any) -> list[tuple[str, str]]:
    """Return what of a Dataset has a unit of SI."""
    return [(name, unit) for name, unit in units_in(data) if unit not in BARE]


def test_criteria_and_metrics_have_none(run: gr.Run) -> None:
    verdict = gr.criteria(run)
    assert {entry.unit for entry in verdict.entries} <= BARE
    assert set(gr.metrics(run).unit) <= BARE
    assert not SHOWN.findall(str(verdict))


def test_data_and_files_have_none(run: gr.Run, tmp_path: Path) -> None:
    assert strangers(run.data) == []
    run.save(tmp_path / "run.nc")
    with h5netcdf.File(tmp_path / "run.nc") as file:
        assert {str(v.attrs["units"]) for v in file.variables.values() if "units" in v.attrs} <= BARE


@pytest.mark.slow
def test_signals_have_none(run: gr.Run) -> None:
    channel = f"velocity.{run.model.inertias[-1].name}"
    other = f"velocity.{run.model.inertias[0].name}"
    assert strangers(gr.spectral.psd(run, channel)) == []
    assert strangers(gr.spectral.cross_psd(run, channel, other)) == []
    assert strangers(gr.spectral.coherence(run, channel, other)) == []
    assert strangers(gr.spectral.order_map(run, channel, turns=2)) == []
    assert strangers(gr.spectral.waterfall(run, channel)) == []


@pytest.mark.slow
def test_studies_have_none() -> None:
    model = dimensionless("paper/case1").with_({"simulation.cycles": 12, "simulation.discard": 4})
    kept = ("verdict", "largest Lyapunov exponent", "predictable cycles", "rms acceleration", "impacts per second")
    path, value = "torque.0.mean", model.torques[0].mean
    over = [value, 1.1 * value + 0.001]
    assert strangers(gr.study(model, {path: over}, kept, workers=1)) == []
    assert strangers(gr.bifurcation(model, path, over, outputs=kept, direction="up", workers=1)) == []
    where = f"angle.{model.inertias[0].name}"
    assert strangers(gr.basins(model, {where: [0.0, 0.1]}, outputs=kept, workers=1)) == []


def test_comparisons_have_none() -> None:
    comparison = gr.compare(dimensionless("paper/case3"), ["rk4"], cycles=6)
    statistics = [
        item
        for row in comparison.attrs["comparison"].rows
        if row.statistics is not None
        for item in row.statistics.items
    ]
    assert {item.unit for item in statistics} <= BARE
    assert not SHOWN.findall(" ".join(item.measure for item in statistics))


@pytest.mark.parametrize("name", [NAMES[0], pytest.param(NAMES[1], marks=pytest.mark.long)])
def test_a_report_has_none(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = dimensionless(name).with_({"name": "bare"})
    (tmp_path / "bare.toml").write_text(model.to_toml(), encoding="utf-8")
    assert main(["run", str(tmp_path / "bare.toml"), "-o", str(tmp_path / "out"), "--cycles", "12"]) == 0
    said = capsys.readouterr().out
    page = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    page = re.sub(r"<(style|script)\b.*?</\1>", " ", page, flags=re.DOTALL)
    words = re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", page))
    words = WALL.sub(" ", words)
    assert [words[max(0, m.start() - 60) : m.end() + 10] for m in SHOWN.finditer(words)] == []
    assert not SHOWN.findall(WALL.sub(" ", said))


def test_the_stiffness_command_shows_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bare.toml").write_text(dimensionless("paper/case3").to_toml(), encoding="utf-8")
    assert main(["stiffness", str(tmp_path / "bare.toml")]) == 0
    assert not SHOWN.findall(capsys.readouterr().out)
