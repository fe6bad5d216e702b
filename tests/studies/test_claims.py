"""A study's folder: written by one program at a time, of one study alone, and read without trusting it."""

from __future__ import annotations

import json
import os
import shutil
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.studies.case_batches import FEWEST
from gearrattle.studies.schedulers.hand_over import handed_over, work
from gearrattle.studies.stored_studies import OUTCOME
from gearrattle.studies.study import prepare
from gearrattle.writing import Lock
from tests.studies.drivelines import model

AXES: dict[str, Any] = {"torque.0.mean": [0.2, 0.4, 0.6, 0.8]}
OUTPUTS = ("TR rms", "impacts per cycle")
OPTIMUM: dict[str, Any] = {"population": 4, "generations": 1, "workers": 1}


def study(folder: Path, **more: Any) -> xr.Dataset:
    return gr.study(model(), AXES, OUTPUTS, output=folder, workers=1, **more)


def optimum(folder: Path, **more: Any) -> xr.Dataset:
    ranges = {"coupling.joint.stiffness": (500.0, 1000.0)}
    return gr.optimize(model(), ranges, {"wheel: TR rms": "min"}, output=folder, **OPTIMUM, **more)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, xr.Dataset]:
    folder = tmp_path_factory.mktemp("studies") / "whole"
    return folder, study(folder)


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[Any, Path]:
    """By what began them: folders of a study and of an optimisation that have ended."""
    folder = tmp_path_factory.mktemp("begun")
    for begin in (study, optimum):
        begin(folder / begin.__name__)
    return {begin: folder / begin.__name__ for begin in (study, optimum)}


@pytest.fixture
def ended(begin: Any, folders: dict[Any, Path], tmp_path: Path) -> Path:
    """A copy of the folder that ``begin`` wrote."""
    return Path(shutil.copytree(folders[begin], tmp_path / "s"))


def held_by_another(folder: Path) -> int:
    """Lock a folder as another program would."""
    fcntl = pytest.importorskip("fcntl")
    folder.mkdir(exist_ok=True)
    handle = os.open(folder / Lock.NAME, os.O_RDWR | os.O_CREAT)
    fcntl.flock(handle, fcntl.LOCK_EX)
    os.ftruncate(handle, 0)
    os.write(handle, b"process 12345 on somewhere")
    return handle


@pytest.mark.parametrize("begin", [study, optimum])
@pytest.mark.parametrize("begun", [False, True])
def test_two_programs_never_write_into_one_folder(begin: Any, begun: bool, tmp_path: Path) -> None:
    if begun:
        begin(tmp_path / "s")
    handle = held_by_another(tmp_path / "s")
    before = sorted(path.name for path in (tmp_path / "s").iterdir())
    with pytest.raises(ModelError, match=r"another program writes into it \(process 12345 on somewhere\)"):
        begin(tmp_path / "s", resume=begun)
    assert sorted(path.name for path in (tmp_path / "s").iterdir()) == before
    os.close(handle)
    begin(tmp_path / "s", resume=begun)


def test_a_later_study_of_the_same_program_takes_the_folder_over(
    tmp_path: Path, whole: tuple[Path, xr.Dataset]
) -> None:
    waiting, go_on = threading.Event(), threading.Event()
    errors: list[BaseException] = []

    def hold(share: float) -> None:
        waiting.set()
        go_on.wait(60.0)

    def first() -> None:
        try:
            study(tmp_path / "s", progress=hold)
        except ModelError as error:
            errors.append(error)

    thread = threading.Thread(target=first)
    thread.start()
    assert waiting.wait(60.0)
    again = study(tmp_path / "s", resume=True)
    go_on.set()
    thread.join(60.0)
    assert again.identical(whole[1])
    assert "another study of this program" in str(errors[0])


def test_a_folder_where_somebody_was_killed_at_once_is_as_good_as_empty(
    tmp_path: Path, whole: tuple[Path, xr.Dataset]
) -> None:
    folder = tmp_path / "s"
    folder.mkdir()
    (folder / Lock.NAME).write_text("process 12345 on somewhere")
    (folder / ".gearrattle-left.part").write_text("{")
    assert study(folder).identical(whole[1])
    assert not list(folder.rglob(".gearrattle-*"))


def test_what_killed_programs_leave_is_removed_by_the_next_start(tmp_path: Path) -> None:
    study(tmp_path / "s")
    names = (".handed-0", ".gearrattle-0.part", "done/.gearrattle-1.part", "results.zarr/TR rms/c/0/0.1f.partial")
    for name in names:
        (tmp_path / "s" / name).write_bytes(b"half")
    study(tmp_path / "s", resume=True)
    assert [name for name in names if (tmp_path / "s" / name).exists()] == []


def test_what_killed_workers_leave_is_removed_at_the_end(tmp_path: Path) -> None:
    """Killed while it sees whether it may write, while it writes a marker, and after that."""
    folder = tmp_path / "s"
    names = (".touched-0", "done/.gearrattle-1.part")

    def leave(share: float) -> None:
        for name in names:
            (folder / name).write_bytes(b"")

    study(folder, progress=leave)
    assert [name for name in names if (folder / name).exists()] == []
    store = prepare(model(), AXES, OUTPUTS).open(folder, resume=True)
    store.begin(0, "attempt")
    with handed_over(store) as handed:
        work(handed, 0, "another attempt", alone=False)
    assert list((folder / "done").glob("*.begun")) == []


DAMAGED = ["", "{", "[]", '{"owner": 3}', '{"owner": {}}', "[" * 100_000]


@pytest.mark.parametrize("text", DAMAGED)
@pytest.mark.parametrize("begin", [study, optimum])
def test_a_damaged_study_file_is_one_error(begin: Any, text: str, ended: Path) -> None:
    (ended / "study.json").write_text(text)
    with pytest.raises(ModelError, match=r"study\.json|holds another study"):
        begin(ended, resume=True)


@pytest.mark.parametrize("begin", [study])
def test_a_size_of_chunks_that_is_no_number_is_another_study(begin: Any, ended: Path) -> None:
    content = json.loads((ended / "study.json").read_text())
    (ended / "study.json").write_text(json.dumps({**content, "chunk_size": "x"}))
    with pytest.raises(ModelError, match=r"study\.json|holds another study"):
        begin(ended, resume=True)


def test_results_of_another_study_are_refused(tmp_path: Path) -> None:
    study(tmp_path / "a")
    gr.study(model().with_({"inertia.wheel.J": 0.03}), AXES, OUTPUTS, output=tmp_path / "b", workers=1)
    (tmp_path / "a" / "results.zarr").rename(tmp_path / "mine")
    (tmp_path / "b" / "results.zarr").rename(tmp_path / "a" / "results.zarr")
    with pytest.raises(ModelError, match=r"holds another study than study\.json says"):
        gr.open_study(tmp_path / "a")
    with pytest.raises(ModelError, match=r"holds another study than study\.json says"):
        study(tmp_path / "a", resume=True)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes in folders")
@pytest.mark.parametrize("name", ["study.json", "results.zarr/TR rms/c/0/0", "results.zarr/zarr.json"])
@pytest.mark.parametrize("kind", ["pipe", "link"])
def test_only_regular_files_of_the_folder_are_read(name: str, kind: str, tmp_path: Path) -> None:
    if (name, kind) == ("study.json", "link"):
        pytest.skip("it is read by its name, and nothing of it is shown")
    study(tmp_path / "s")
    path = tmp_path / "s" / name
    path.unlink()
    if kind == "pipe":
        os.mkfifo(path)
    else:
        (tmp_path / "secret").write_text("secret")
        path.symlink_to(tmp_path / "secret")
    with pytest.raises(ModelError, match=r"no regular file|is a pipe|lies outside|study\.json"):
        gr.open_study(tmp_path / "s")
    with pytest.raises(ModelError, match=r"no regular file|is a pipe|lies outside|study\.json"):
        study(tmp_path / "s", resume=True)


def test_a_study_larger_than_what_may_be_read_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study(tmp_path / "s")
    path = tmp_path / "s" / "results.zarr" / "TR rms" / "zarr.json"
    about = json.loads(path.read_text())
    about["shape"] = [1 << 40, *about["shape"][1:]]
    path.write_text(json.dumps(about))
    with pytest.raises(ModelError, match=r"GB of memory|must be the folder"):
        gr.open_study(tmp_path / "s")


@pytest.mark.parametrize("damage", ["lost", "empty", "zeros", "no marker"])
def test_results_that_a_power_cut_took_are_shown_as_missing(damage: str, tmp_path: Path) -> None:
    """Of a study of several chunks, one of which is damaged."""

    def chunks(**more: Any) -> xr.Dataset:
        means = np.linspace(0.1, 0.4, 3 * FEWEST).tolist()
        return gr.study(model(), {"torque.0.mean": means}, OUTPUTS, output=tmp_path / "s", workers=1, **more)

    whole = chunks()
    path = sorted((tmp_path / "s" / "results.zarr" / "TR rms" / "c").rglob("0"))[-1]
    chunk = 1 if not path.is_file() else int(path.parent.name)
    path = path if path.is_file() else path / "0"
    if damage == "lost":
        path.unlink()
    elif damage == "no marker":
        (tmp_path / "s" / "done" / f"{chunk:07d}.json").unlink()
    else:
        path.write_bytes(b"" if damage == "empty" else bytes(path.stat().st_size))
    if damage in ("empty", "zeros"):  # the codec notices
        with pytest.raises(ModelError, match="must be the folder of a study"):
            gr.open_study(tmp_path / "s")
    else:
        actual = gr.open_study(tmp_path / "s")
        missing = actual[OUTCOME].values == 0
        assert 1 <= missing.sum() < actual[OUTCOME].size
        np.testing.assert_array_equal(actual["TR rms"].values[~missing], whole["TR rms"].values[~missing])
        assert np.isnan(actual["TR rms"].values[missing]).all()
    assert chunks(resume=True).identical(whole)


def test_an_optimisation_that_cannot_write_its_results_keeps_the_old_ones(tmp_path: Path) -> None:
    first = optimum(tmp_path / "s")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(xr.Dataset, "to_zarr", lambda *_, **__: (_ for _ in ()).throw(OSError(28, "No space left")))
        with pytest.raises(OSError, match="No space left"):
            optimum(tmp_path / "s", resume=True)
    assert gr.open_study(tmp_path / "s").equals(first)
    assert not list((tmp_path / "s").rglob(".gearrattle-*"))


def test_a_study_that_was_stopped_while_it_began_says_so(tmp_path: Path, whole: tuple[Path, xr.Dataset]) -> None:
    study(tmp_path / "s")
    path = tmp_path / "s" / "results.zarr" / "zarr.json"
    about = json.loads(path.read_text())
    del about["attributes"]["order"]
    path.write_text(json.dumps(about))
    with pytest.raises(ModelError, match="stopped before it computed"):
        gr.open_study(tmp_path / "s")
    assert study(tmp_path / "s", resume=True).identical(whole[1])
