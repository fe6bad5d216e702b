"""Storage: a study kept behind an address is the one kept in a folder, whatever stops it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fsspec
import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.errors import Cancelled, ModelError, NotInstalled
from gearrattle.studies.storage import File, Folder, Remote, Storage, storage_of
from gearrattle.studies.study import prepare
from gearrattle.studies.study_store import Store
from tests.studies.drivelines import TOML, loudness, model

pytestmark = pytest.mark.slow

GAP, TORQUE = "coupling.joint.clearance", "torque.0.mean"
AXES: dict[str, Any] = {GAP: [0.005, 0.01, 0.02], TORQUE: {"from": 0.2, "to": 1.2, "count": 4}}
OUTPUTS = ("verdict", "regime", "impacts per cycle", "TR rms")


def where(kind: str, folder: Path) -> str:
    """An address of each kind; local:// is a folder through fsspec, which several processes see."""
    return {
        "folder": str(folder / "s"),
        "file": f"file://{folder}/s",
        "local": f"local://{folder}/s",
        "memory": f"memory://{folder.name}/s",
    }[kind]


@pytest.fixture(
    params=["folder", "memory", *(pytest.param(kind, marks=pytest.mark.long) for kind in ("file", "local"))]
)
def address(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    yield where(request.param, tmp_path)
    fsspec.filesystem("memory").store.clear()


@pytest.fixture
def storage(address: str) -> Storage:
    return storage_of(address)


@pytest.fixture(scope="module")
def whole() -> xr.Dataset:
    return gr.study(model(), AXES, OUTPUTS, workers=1, function=loudness)


def test_what_is_put_is_there_and_what_is_removed_is_not(storage: Storage) -> None:
    assert storage.is_empty()
    storage.make()
    assert storage.names("done") == []
    storage.put("done/a.json", b"1")
    storage.put("done/a.json", b"23")
    storage.write("done/b.json", b"4")
    assert storage.read("done/a.json") == b"23"
    assert sorted(storage.names("done")) == ["a.json", "b.json"]
    assert storage.exists("done/b.json")
    storage.remove("done/b.json")
    storage.remove("done/b.json")
    assert not storage.exists("done/b.json")
    with pytest.raises(FileNotFoundError):
        storage.read("done/b.json")
    assert not storage.is_empty()


def test_what_must_be_new_is_put_once(storage: Storage) -> None:
    storage.make()
    storage.put("study.json", b"mine", new=True)
    with pytest.raises(FileExistsError):
        storage.put("study.json", b"theirs", new=True)
    assert storage.read("study.json") == b"mine"
    assert storage.names("") == ["study.json"]  # nothing half-written stays


def test_a_file_in_storage_is_like_a_path(storage: Storage) -> None:
    storage.make()
    file = File(storage, "part")
    with pytest.raises(FileNotFoundError):
        file.unlink()
    file.write_bytes(b"abc")
    assert (file.exists(), file.read_bytes()) == (True, b"abc")
    file.unlink()
    file.unlink(missing_ok=True)
    assert not file.exists()


def test_a_folder_is_taken_whole(storage: Storage, tmp_path: Path) -> None:
    (tmp_path / "page" / "figures").mkdir(parents=True)
    (tmp_path / "page" / "report.html").write_text("page")
    (tmp_path / "page" / "figures" / "map.svg").write_text("map")
    storage.make()
    storage.take(tmp_path / "page")
    assert (storage.read("report.html"), storage.read("figures/map.svg")) == (b"page", b"map")


def test_a_study_is_the_same_wherever_it_is_kept(address: str, whole: xr.Dataset) -> None:
    assert gr.study(model(), AXES, OUTPUTS, output=address, workers=1, function=loudness).identical(whole)
    assert gr.open_study(address).equals(whole)
    with pytest.raises(ModelError, match="holds a study already"):
        gr.study(model(), AXES, OUTPUTS, output=address)
    with pytest.raises(ModelError, match="another study"):
        gr.study(model(), AXES, ["verdict"], output=address, resume=True)


def test_a_study_that_was_stopped_goes_on_to_the_same_bits(address: str, whole: xr.Dataset) -> None:
    def stop(share: float) -> None:
        if share >= 0.3:
            raise Cancelled("enough")

    with pytest.raises(Cancelled):
        gr.study(model(), AXES, OUTPUTS, output=address, workers=1, function=loudness, progress=stop)
    storage = storage_of(address)
    actual = prepare(model(), AXES, OUTPUTS, function=loudness)
    assert 0 < len(Store.open(storage, actual.plan, actual.outputs, resume=True).done()) < 12
    again = gr.study(model(), AXES, OUTPUTS, output=address, workers=1, function=loudness, resume=True)
    assert again.identical(whole)


def test_damage_is_noticed_and_computed_again(address: str, whole: xr.Dataset) -> None:
    gr.study(model(), AXES, OUTPUTS, output=address, workers=1, function=loudness)
    storage = storage_of(address)
    storage.write("results.zarr/TR rms/c/0/0/0", b"abc")
    storage.write("done/0000003.json", b"{")
    storage.remove("done/0000005.json")
    again = gr.study(model(), AXES, OUTPUTS, output=address, workers=1, function=loudness, resume=True)
    assert again.identical(whole)


def test_who_began_may_be_killed_before_the_arrays_are_made(address: str, whole: xr.Dataset) -> None:
    actual = prepare(model(), AXES, OUTPUTS, function=loudness)
    storage = storage_of(address)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Store, "_lay_out", lambda _: None)
        Store.open(storage, actual.plan, actual.outputs, resume=False)
    again = gr.study(model(), AXES, OUTPUTS, output=address, workers=1, function=loudness, resume=True)
    assert again.identical(whole)


def test_a_second_client_that_begins_at_the_same_time_is_refused(address: str) -> None:
    actual, storage = prepare(model(), AXES, OUTPUTS), storage_of(address)
    seen = storage.exists
    Store.open(storage, actual.plan, actual.outputs, resume=False)
    with pytest.MonkeyPatch.context() as patch:  # it looked before the other had begun
        patch.setattr(type(storage), "exists", lambda _, name: name != "study.json" and seen(name))
        patch.setattr(type(storage), "is_empty", lambda _: True)
        with pytest.raises(ModelError, match="holds a study already"):
            Store.open(storage, actual.plan, actual.outputs, resume=False)


def test_processes_keep_chunks_behind_an_address_themselves(tmp_path: Path, whole: xr.Dataset) -> None:
    address = where("local", tmp_path)
    assert gr.study(model(), AXES, OUTPUTS, output=address, workers=2, function=loudness).identical(whole)
    assert gr.open_study(tmp_path / "s").equals(whole)  # the same folder by its path


def test_threads_share_the_memory_of_the_process(tmp_path: Path, whole: xr.Dataset) -> None:
    address = where("memory", tmp_path)
    actual = gr.study(model(), AXES, OUTPUTS, output=address, workers=2, scheduler="threads", function=loudness)
    assert actual.identical(whole)
    with pytest.raises(ModelError, match="do not see the memory"):
        gr.study(model(), AXES, OUTPUTS, output=address + "2", workers=2)
    assert storage_of(address + "2").is_empty()


@pytest.mark.long
def test_killed_between_two_chunks_it_goes_on_from_an_address(tmp_path: Path) -> None:
    address = where("local", tmp_path)
    (tmp_path / "two.toml").write_text(TOML, encoding="utf-8")
    study = (
        'model = "two.toml"\noutputs = ["impacts per cycle"]\n[axis]\n"torque.0.mean" = {from=0.2, to=1.2, count=64}\n'
    )
    (tmp_path / "study.toml").write_text(study, encoding="utf-8")
    command = [sys.executable, "-m", "gearrattle", "study", "study.toml", "--workers", "1", "-o"]
    killed = subprocess.Popen([*command, address], cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 120.0
    while killed.poll() is None and not list((tmp_path / "s" / "done").glob("*.json")) and time.monotonic() < deadline:
        time.sleep(0.01)
    killed.kill()
    killed.wait()
    assert 0 < len(list((tmp_path / "s" / "done").glob("*.json"))) < 8
    subprocess.run([*command, address, "--resume"], cwd=tmp_path, check=True, capture_output=True)
    subprocess.run([*command, str(tmp_path / "plain")], cwd=tmp_path, check=True, capture_output=True)
    assert gr.open_study(address).identical(gr.open_study(tmp_path / "plain"))
    assert (tmp_path / "s" / "report.html").stat().st_size > 1000


@pytest.mark.parametrize(
    ("address", "error", "match"),
    [
        ("s4://bucket/study", ModelError, "no protocol s4://.*give a folder, or an address"),
        ("memory://", ModelError, "names no place"),
        (Path("s3://bucket/study"), ModelError, "a slash is lost"),
    ],
)
def test_addresses_that_lead_nowhere_are_refused_before_anything_runs(
    address: Any, error: type[Exception], match: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.modules["gearrattle.studies.study"], "prepare", lambda *_, **__: pytest.fail("prepared"))
    with pytest.raises(error, match=match):
        gr.study(model(), AXES, OUTPUTS, output=address)


def test_a_library_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "s3fs", None)
    with pytest.raises(NotInstalled, match="pip install s3fs"):
        storage_of("s3://bucket/study")
    monkeypatch.setitem(sys.modules, "fsspec", None)
    with pytest.raises(NotInstalled, match=r"gearrattle\[studies\]"):
        storage_of("s3://bucket/study")


def test_paths_and_addresses_are_told_apart(tmp_path: Path) -> None:
    assert storage_of(f"file://{tmp_path}/a%20b") == Folder(tmp_path / "a b")
    assert storage_of("out/map") == Folder(Path("out/map"))
    assert storage_of("s3:/odd") == Folder(Path("s3:/odd"))  # text is taken at its word
    assert storage_of("memory://a/") == Remote("memory://a")
    actual = storage_of("memory://a/")
    assert storage_of(actual) is actual


def test_whatever_a_store_raises_names_its_address() -> None:
    class Broken:
        def __getattr__(self, name: str) -> Any:
            raise RuntimeError("no credentials")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Remote, "_system", Broken())
        for call in (lambda p: p.read("a"), lambda p: p.put("a", b""), lambda p: p.names("a"), lambda p: p.exists("a")):
            with pytest.raises(OSError, match="memory://a: no credentials"):
                call(Remote("memory://a"))


def test_the_command_takes_an_address(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "two.toml").write_text(TOML, encoding="utf-8")
    study = 'model = "two.toml"\noutputs = ["verdict"]\n[axis]\n"torque.0.mean" = [0.3, 0.6]\n'
    (tmp_path / "study.toml").write_text(study, encoding="utf-8")
    address = f"local://{tmp_path / 'results'}"
    assert main(["study", str(tmp_path / "study.toml"), "-o", address]) == 0
    printed = capsys.readouterr().out
    assert f"results: {address}/results.zarr" in printed
    assert f"page: {address}/report.html" in printed
    assert storage_of(address).read("report.html").startswith(b"<!doctype html>")
    assert storage_of(address).names("figures")
    assert int(np.sum(gr.open_study(address)["outcome"])) == 2
    assert main(["study", str(tmp_path / "study.toml"), "-o", "s4://bucket/study"]) == 2
    assert "there is no protocol s4://" in capsys.readouterr().err
    assert main(["study", str(tmp_path / "study.toml"), "-o", "memory://study"]) == 2
    assert "memory" in capsys.readouterr().err
    assert set(os.listdir(tmp_path)) == {"study.toml", "two.toml", "results"}
