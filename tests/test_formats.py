"""Every saved file names its format; one of a later version or of another kind is refused by one error."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr
import zarr
from scipy.io import loadmat, savemat

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.formats import FORMATS, check_format, format_name
from gearrattle.recording import Channel, Recording
from tests.architecture.places import DOCS, SOURCE, source_files

SHORT = {"cycles": 4, "discard": 1, "samples_per_cycle": 64}
OPTIONS = ["--cycles", "4", "--discard", "1", "--samples-per-cycle", "64"]
CASE = "examples/paper/case1.toml"


@pytest.fixture(scope="module")
def model() -> gr.Model:
    return gr.example("case1").with_({f"simulation.{key}": value for key, value in SHORT.items()})


@pytest.fixture(scope="module")
def files(model: gr.Model, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """One saved file of every kind that can be opened again."""
    folder = tmp_path_factory.mktemp("formats")
    run = gr.simulate(model)
    run.save(folder / "run.nc")
    for _ in gr.stream(model, chunk=2, store=folder / "stream"):
        pass
    stiffness = 1500.0
    gr.study(model, {"coupling.clutch.stiffness": [stiffness, 1600.0]}, workers=1, output=folder / "study")
    optimum = {"coupling.clutch.stiffness": (stiffness, 1600.0)}
    goal = {"crossings per cycle": "min"}
    gr.optimize(model, optimum, goal, population=8, generations=1, workers=1, output=folder / "optimization")
    wave = Channel("a", "acceleration", "hub", "rad/s^2", np.sin(0.1 * np.arange(64.0)))
    for ending in ("h5", "mat"):
        gr.write(Recording(np.arange(64.0), (wave,), "rig"), folder / f"recording.{ending}")
    saved = str(folder / "run.nc")
    _done(["orders", saved, "acceleration.hub", "--spectra", "-o", str(folder / "orders.nc")])
    _done(["spectra", saved, "--channel", "acceleration.hub", "-o", str(folder / "spectra")])
    _done(["screen", CASE, "--speeds", "600 rpm:900 rpm", "--count", "2", "-o", str(folder / "screening")])
    return {
        "run": folder / "run.nc",
        "stream": folder / "stream",
        "study": folder / "study",
        "optimization": folder / "optimization",
        "charts": folder / "spectra" / "figures" / "charts.npz",
        "result": folder / "screening" / "results.nc",
        "result.orders": folder / "orders.nc",
        "result.spectra": folder / "spectra" / "results.nc",
        "recording": folder / "recording.h5",
        "recording.mat": folder / "recording.mat",
    }


def _done(arguments: list[str]) -> None:
    assert main(arguments) == 0


def _renamed_hdf5(path: Path, name: str) -> None:
    with h5py.File(path, "r+") as file:
        file.attrs["format"] = name


def _renamed_stream(path: Path, name: str) -> None:
    with np.load(path / "state.npz") as kept:
        arrays = dict(kept)
    lines = str(arrays["owner"]).split("\n")
    np.savez(path / "state.npz", **{**arrays, "owner": np.array("\n".join([name, *lines[1:]]))})


def _renamed_charts(path: Path, name: str) -> None:
    with np.load(path) as kept:
        arrays = dict(kept)
    content = json.loads(arrays["charts"].tobytes())
    content["format"] = int(name.rsplit(maxsplit=1)[-1]) if name.startswith("number") else name
    np.savez(path, **{**arrays, "charts": np.frombuffer(json.dumps(content).encode(), np.uint8)})


def _renamed_study(path: Path, name: str) -> None:
    zarr.open_group(path / "results.zarr", mode="r+").attrs["format"] = name
    about = json.loads((path / "study.json").read_text())
    about["owner"]["format"] = name
    (path / "study.json").write_text(json.dumps(about))


def _renamed_mat(path: Path, name: str) -> None:
    variables = {key: value for key, value in loadmat(path).items() if not key.startswith("__")}
    savemat(path, {**variables, "gearrattle_format": name}, oned_as="column")


Renamed = Callable[[Path, str], None]
OPENED: dict[str, tuple[Renamed, Callable[[Path], Any]]] = {
    "run": (_renamed_hdf5, gr.open_run),
    "stream": (_renamed_stream, lambda path: list(gr.open_stream(path))),
    "study": (_renamed_study, gr.open_study),
    "optimization": (_renamed_study, gr.open_study),
    "charts": (_renamed_charts, lambda path: list(gr.figures(path))),
    "result": (_renamed_hdf5, lambda path: list(gr.figures(path))),
    "result.orders": (_renamed_hdf5, lambda path: list(gr.figures(path))),
    "result.spectra": (_renamed_hdf5, lambda path: list(gr.figures(path))),
    "recording": (_renamed_hdf5, gr.read),
    "recording.mat": (_renamed_mat, gr.read),
}


@pytest.mark.parametrize("kind", OPENED)
def test_what_is_written_opens_and_a_later_version_is_refused_with_the_remedy(
    kind: str, files: dict[str, Path]
) -> None:
    name = format_name(kind.partition(".")[0])
    rename, opened = OPENED[kind]
    opened(files[kind])
    rename(files[kind], f"{name}9")
    with pytest.raises(gr.ModelError, match=f'"{name}9"; was written by a later version.*"{name}" .upgrade') as refused:
        opened(files[kind])
    assert str(files[kind]) in str(refused.value)
    assert len(refused.value.problems) == 1
    rename(files[kind], name)
    opened(files[kind])


def test_a_run_of_a_later_version_is_refused_by_every_reader(files: dict[str, Path]) -> None:
    path = files["run"]
    _renamed_hdf5(path, "gearrattle run 19")
    for opened in (gr.read, gr.measured.look, gr.metrics, lambda file: list(gr.figures(file))):
        with pytest.raises(gr.ModelError):
            opened(path)
    assert main(["criteria", str(path)]) == main(["metrics", str(path)]) == main(["orders", str(path), "x"]) == 2
    _renamed_hdf5(path, format_name("run"))


def test_a_run_of_the_first_version_opens_with_its_friction(tmp_path: Path) -> None:
    run = gr.simulate(gr.load("examples/dual_mass_flywheel.toml"), cycles=3, discard=1, audit=False)
    run.save(tmp_path / "run.nc")
    with h5py.File(tmp_path / "run.nc", "r+") as file:
        file.move("auxiliaries", "companions")
    _renamed_hdf5(tmp_path / "run.nc", "gearrattle run 1")
    again = gr.open_run(tmp_path / "run.nc")
    assert run.trajectory.auxiliaries is not None
    xr.testing.assert_identical(again.data["slider_force"], run.data["slider_force"])


@pytest.mark.parametrize("version", [1, 9])
def test_a_study_of_another_version_is_not_resumed(version: int, files: dict[str, Path], model: gr.Model) -> None:
    _renamed_study(files["study"], f"gearrattle study {version}")
    axes = {"coupling.clutch.stiffness": [1500.0, 1600.0]}
    remedy = "compute the study again in another folder"
    with pytest.raises(gr.ModelError, match=rf'study.json: found "gearrattle study {version}".*{remedy}'):
        gr.study(model, axes, workers=1, output=files["study"], resume=True)
    _renamed_study(files["study"], format_name("study"))
    gr.study(model, axes, workers=1, output=files["study"], resume=True)


def test_files_written_before_formats_were_named_open(files: dict[str, Path]) -> None:
    with h5py.File(files["recording"], "r+") as file:
        del file.attrs["format"]
    OPENED["recording"][1](files["recording"])
    _renamed_hdf5(files["recording"], format_name("recording"))
    del zarr.open_group(files["study"] / "results.zarr", mode="r+").attrs["format"]
    assert "format" not in gr.open_study(files["study"]).attrs
    _renamed_charts(files["charts"], "number 1")
    assert list(gr.figures(files["charts"]))


def test_another_kind_no_format_and_an_earlier_version_are_told_apart() -> None:
    with pytest.raises(gr.ModelError, match='found "gearrattle study 2"; a file of the format "gearrattle run" is'):
        check_format("gearrattle study 2", "a.nc", "run")
    with pytest.raises(gr.ModelError, match=r"found no format of gearrattle.*\(simulate the model again\)"):
        check_format("", "a.nc", "run")
    with pytest.raises(gr.ModelError, match=r"earlier version.*\(compute the study again in another folder\)"):
        check_format("gearrattle study 1", "a", "study", "optimization")
    with pytest.raises(gr.ModelError, match=r'found "other 1"'):
        check_format("other 1", "a.nc", "recording")
    check_format("", "a.nc", "recording")


SUMMARIES: dict[str, list[str]] = {
    "run": ["run", CASE, *OPTIONS],
    "modes": ["modes", CASE],
    "comparison": ["compare", CASE, *OPTIONS, "-a", "exact", "--no-work-precision"],
    "validation": ["validate", CASE, "RECORD", "--cycles", "30", "--discard", "10"],
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", SUMMARIES)
def test_a_summary_begins_with_its_format_and_kind(kind: str, tmp_path: Path) -> None:
    words = SUMMARIES[kind]
    if "RECORD" in words:
        gr.simulate(gr.example("case1"), cycles=30, discard=10).save(tmp_path / "record.csv")
    arguments = [str(tmp_path / "record.csv") if word == "RECORD" else word for word in words]
    assert main([*arguments, "-o", str(tmp_path / "out")]) == 0
    content = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert list(content.items())[:2] == [("format", format_name("summary")), ("result", kind)]


def test_summaries_of_spectra_and_screenings_name_format_and_kind(files: dict[str, Path]) -> None:
    for kind, name in {"spectra": "result.spectra", "screening": "result"}.items():
        content = json.loads((files[name].parent / "summary.json").read_text(encoding="utf-8"))
        assert (content["format"], content["result"]) == (format_name("summary"), kind)


def test_maps_of_earlier_versions_are_refused_with_the_remedy(files: dict[str, Path]) -> None:
    for name in ("gearrattle orders 1", "gearrattle spectra 1", "gearrattle screening 1"):
        _renamed_hdf5(files["result.orders"], name)
        with pytest.raises(gr.ModelError, match=rf'"{name}"; a file of the format .*run the command or the call'):
            gr.figures(files["result.orders"])
    _renamed_hdf5(files["result.orders"], format_name("result"))


@pytest.mark.parametrize("ending", ["npz", "mat"])
def test_matrices_name_their_format(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"matrices.{ending}"
    assert main(["condense", CASE, "--up-to", "75 Hz", "-o", str(path)]) == 0
    kept: Any = np.load(path) if ending == "npz" else loadmat(path, squeeze_me=True)
    assert str(np.squeeze(kept["format"])) == format_name("matrices")


WRITERS = {
    "exchange/fmu.py": "fmu",
    "exchange/state_space.py": "state space",
    "design/kept_motions.py": "a motion, read by the search that wrote it alone",
    "simulation/chunk_store.py": "stream",
    "report/reduction_pages.py": "matrices",
    "report/plots/chart_files.py": "charts",
    "measured/readers/hdf5.py": "recording",
    "measured/readers/mat/__init__.py": "recording",
    "report/numbers.py": "result",
    "results.py": "run",
    "studies/bifurcation_study.py": "part of a chunk, read by the study that wrote it alone",
    "studies/pareto_front.py": "optimization",
    "studies/optimization.py": "optimization",
    "studies/schedulers/hand_over.py": "read by the workers of the study that wrote it alone",
    "studies/study_store.py": "study",
    "workbench/traces.py": "an index of a job's run, read by the workbench that wrote it alone",
}


def test_whoever_writes_a_file_in_a_format_of_ours_is_known() -> None:
    """A new writer gets a kind in ``FORMATS``, and its name here."""
    of_arrays = r"\.to_netcdf\(|\.to_zarr\(|savez|savemat\(|\.File\(path, \"w\""
    of_text = r"json\.dumps\(.*\n.*write_text|storage\.put\(ABOUT|json\.dumps\(\{name"
    texts = {path.relative_to(SOURCE).as_posix(): path.read_text(encoding="utf-8") for path in source_files()}
    assert {name for name, text in texts.items() if re.search(f"{of_arrays}|{of_text}", text)} == set(WRITERS)


def test_the_manual_lists_every_format() -> None:
    page = (DOCS / "reference" / "formats.md").read_text(encoding="utf-8")
    assert set(re.findall(r"`(gearrattle [a-z -]+ \d+)`", page)) == {format_name(kind) for kind in FORMATS}


@pytest.mark.parametrize(
    ("command", "text"),
    [
        (["run"], 'schema = 2\n[[inertia]]\nname = "x"\nnew_key = 3\n'),
        (["study"], 'schema = 2\nmodel = "nowhere.toml"\nnew_key = 3\n'),
        (["metrics"], 'schema = 2\nfile = "nowhere.csv"\nnew_key = 3\n[[channel]]\nname = "x"\n'),
        (["fit", CASE], "schema = 2\nnew_key = 3\n[[mode]]\nnumber = 1\n"),
    ],
)
def test_a_text_file_of_a_later_schema_is_refused_by_one_error(
    command: list[str], text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "later.toml"
    path.write_text(text, encoding="utf-8")
    free = ["--free", "coupling.clutch.stiffness"] if command[0] == "fit" else []
    assert main([*command, str(path), *free]) == 2
    message = capsys.readouterr().err
    assert "later.toml:1: schema: found 2; this version of gearrattle reads schema 1 only" in message
    assert "update it" in message
    assert "new_key" not in message
