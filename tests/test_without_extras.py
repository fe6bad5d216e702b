"""What works where no extra is installed, and how the rest is refused: by name, with the command that installs it."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from importlib import import_module
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.errors import NotInstalled
from tests.architecture.places import EXAMPLES
from tests.dependencies import DEPENDENCIES, EXTRAS, PROJECT

CASE = str(EXAMPLES / "paper" / "case3.toml")
FIGURES = 'pip install "gearrattle[figures]"'
STUDIES = 'pip install "gearrattle[studies]"'
SHORT = ["--cycles", "4", "--discard", "2", "--samples-per-cycle", "64"]


def _core() -> set[str]:
    """Packages that an installation without extras brings."""
    packages, _ = DEPENDENCIES.brought(PROJECT["dependencies"])
    return {name for name, package in packages.items() if package is not None}


def _left_out() -> list[str]:
    """Top-level modules of the packages that an installation without extras does not bring."""
    core = _core() | {"gearrattle"}
    modules = packages_distributions().items()
    return sorted(module for module, packages in modules if core.isdisjoint(map(DEPENDENCIES.plain, packages)))


def _command(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """A command in a process that sees no package but those of the core."""
    program = f"""
import sys
for name in {_left_out()!r}:
    sys.modules[name] = None
from gearrattle.cli import main
sys.exit(main({list(arguments)!r}))
"""
    call = [sys.executable, "-c", program]
    return subprocess.run(call, cwd=folder, capture_output=True, text=True, timeout=600, check=False)


def test_the_core_has_no_library_of_an_extra() -> None:
    extras = {DEPENDENCIES.plain(Requirement(row).name) for rows in EXTRAS.values() for row in rows}
    assert {"matplotlib", "zarr", "starlette"} <= extras
    assert extras.isdisjoint(_core())
    assert {"matplotlib", "zarr", "PIL"} <= set(_left_out())


@pytest.mark.slow
def test_the_core_alone_runs_an_example_to_its_page(tmp_path: Path) -> None:
    done = _command("run", CASE, "-o", "out", *SHORT, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "report.html").stat().st_size > 100_000
    assert list((tmp_path / "out" / "figures").glob("*.svg"))
    done = _command("criteria", "out/results.nc", "--json", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["verdict"]


@pytest.mark.slow
def test_the_core_alone_draws_maps(tmp_path: Path) -> None:
    """Orders of a run-up are pictures, which Pillow once wrote."""
    done = _command("run", str(EXAMPLES / "run_up.toml"), "-o", "out", *SHORT, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert any(b"data:image/png" in file.read_bytes() for file in (tmp_path / "out" / "figures").glob("*.svg"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "remedy"),
    [
        (["figures", CASE, "-o", "drawn"], FIGURES),
        (["study", str(EXAMPLES / "studies" / "backlash_and_drag.toml"), "-o", "map"], STUDIES),
        (["serve", "."], 'pip install "gearrattle[workbench]"'),
    ],
)
def test_what_needs_an_extra_is_refused_by_name(tmp_path: Path, command: list[str], remedy: str) -> None:
    done = _command(*command, folder=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert remedy in done.stderr
    assert "bug" not in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def without(monkeypatch: pytest.MonkeyPatch) -> Any:
    return lambda name: monkeypatch.setitem(sys.modules, name, None)


def test_figures_for_print_are_refused_before_they_are_drawn(without: Any, tmp_path: Path) -> None:
    modes = gr.modes(gr.example("case3"))
    without("matplotlib")
    with pytest.raises(NotInstalled, match=re.escape(FIGURES)):
        gr.figures(modes)
    loop = gr.torque_angle(gr.example("clutch_friction"), "damper")
    loop.save(tmp_path / "loop.svg")
    with pytest.raises(NotInstalled, match=re.escape(FIGURES)) as caught:
        loop.save(tmp_path / "loop.pdf")
    assert "loop.pdf" in caught.value.problems[0].value
    assert [path.name for path in tmp_path.iterdir()] == ["loop.svg"]


def test_a_study_is_refused_before_a_case_is_computed(
    without: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def computed(*_: object, **__: object) -> None:
        raise AssertionError("something is computed")

    without("zarr")
    monkeypatch.setattr(import_module("gearrattle.studies.study"), "prepare", computed)
    axes: dict[str, list[str]] = {"mesh.gear.backlash": ["0.05 mm", "0.1 mm"]}
    for output in (None, tmp_path / "map"):
        with pytest.raises(NotInstalled, match=re.escape(STUDIES)):
            gr.study(gr.example("case3"), axes, outputs=["verdict"], output=output)
    assert list(tmp_path.iterdir()) == []


def test_a_kept_study_is_not_called_damaged(without: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "map"
    axes = {"mesh.gear.backlash": ["0.05 mm", "0.1 mm"]}
    gr.study(gr.example("case3"), axes, outputs=["verdict"], workers=1, output=folder)
    without("zarr")
    with pytest.raises(NotInstalled, match=re.escape(STUDIES)):
        gr.open_study(folder)
    assert main(["study", str(EXAMPLES / "studies" / "tolerances.toml"), "-o", str(folder), "--resume"]) == 2
    assert STUDIES in capsys.readouterr().err
