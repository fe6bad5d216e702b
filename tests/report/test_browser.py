"""A real browser shows the interactive figures and prints the inked ones."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from gearrattle import load, spectra
from gearrattle.pipeline import run as pipeline
from gearrattle.recording import Channel, Recording
from gearrattle.report.saved import save
from tests import synthetic
from tests.browser import MARKS, alive, browse

EXAMPLES = Path(__file__).parents[2] / "examples"

pytestmark = MARKS


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return synthetic.findings("double-sided").save(tmp_path_factory.mktemp("browser"))


def test_figures_come_alive_without_a_network(page: Path, tmp_path: Path) -> None:
    done = alive(page, tmp_path, 'data-state="drawing"', 5)
    figures = re.findall(r'<figure[^>]*data-key="(\w+)"[^>]*class="([^"]*)"', done.stdout)
    drawn = {key for key, classes in figures if "drawn" in classes}
    assert {"deflection", "acceleration", "impacts", "phase_plane", "spectrum"} <= drawn
    assert done.stdout.count('class="gr-canvas"') >= len(drawn)


@pytest.mark.long
def test_a_page_of_spectra_comes_alive(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    cause = rng.standard_normal(8000)
    channels = (
        Channel("T", "torque", "hub", "N m", cause),
        Channel("a", "acceleration", "hub", "rad/s^2", cause + rng.standard_normal(8000)),
    )
    save(spectra(Recording(np.arange(8000) / 1e3, channels, "rig"), "a", "T"), tmp_path)
    done = alive(tmp_path / "report.html", tmp_path, 'class="gr-canvas"')
    keys = re.findall(r'<figure[^>]*data-key="(\w+)"', done.stdout)
    assert keys == ["psd", "reference_psd", "cross", "response", "coherence"]
    assert 'class="gr-canvas"' in done.stdout


@pytest.mark.long
def test_it_prints(page: Path, tmp_path: Path) -> None:
    target = tmp_path / "report.pdf"
    browse(page, tmp_path / "profile", f"--print-to-pdf={target}", "--no-pdf-header-footer")
    assert target.read_bytes().startswith(b"%PDF")
    if shutil.which("pdftotext"):
        words = subprocess.run(["pdftotext", str(target), "-"], capture_output=True, text=True, check=True).stdout
        assert "Double-sided rattle" in words
        assert words.count("time / T [cycles]") == 6
        assert "density at its peak" in words


@pytest.mark.long
def test_the_maps_of_a_run_up_come_alive(tmp_path: Path) -> None:
    actual = pipeline(load(EXAMPLES / "run_up.toml"), cycles=16)
    bodies = len(actual.motion.trajectory.layout.inertia_names)
    done = alive(actual.save(tmp_path / "report"), tmp_path, 'class="gr-canvas"', bodies)
    drawn = re.search(r'<figure[^>]*data-key="run_up_spectra"[^>]*class="([^"]*)"', done.stdout)
    assert drawn is not None
    assert "drawn" in drawn[1]
    live = done.stdout.partition('id="run_up_spectra-live"')[2].partition("</figure>")[0]
    assert live.count('class="gr-canvas"') == bodies
