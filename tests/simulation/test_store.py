"""A stored motion: whatever ends the program, it goes on after the last whole chunk with the same bits."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from collections import OrderedDict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.simulation import chunk_store as stores
from tests import synthetic
from tests.architecture.places import EXAMPLES

FILE = EXAMPLES / "paper" / "case3.toml"
SETTINGS = {"cycles": 60, "samples_per_cycle": 8, "chunk": 9, "discard": 5}


@pytest.fixture(scope="module")
def model() -> gr.Model:
    return gr.load(FILE)


@pytest.fixture(scope="module")
def reference(model: gr.Model, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The store of a motion that nobody interrupted."""
    folder = tmp_path_factory.mktemp("whole") / "store"
    assert len(list(gr.stream(model, **SETTINGS, store=folder))) == 7
    return folder


def content(folder: Path) -> dict[str, object]:
    """Return all that is in a store, but for the time it took."""
    import h5netcdf

    actual: dict[str, object] = {}
    for path in sorted(folder.iterdir()):
        if path.name == ".lock":
            continue
        if path.suffix == ".npz":
            with np.load(path) as file:
                actual |= {f"{path.name}/{name}": file[name].tobytes() for name in file.files}
            continue
        with h5netcdf.File(path, "r") as file:
            for group, name in ((file, ""), (file.groups["events"], "events/")):
                actual |= {f"{path.name}/{name}{key}": np.asarray(group[key][...]).tolist() for key in group.variables}
            actual |= {f"{path.name}@{key}": str(value) for key, value in file.attrs.items() if key != "cost"}
    return actual


@pytest.mark.slow
def test_a_store_holds_every_chunk_and_its_state(reference: Path, model: gr.Model) -> None:
    names = [path.name for path in sorted(reference.iterdir())]
    assert names == [".lock", *(f"chunk-{i:06d}.nc" for i in range(1, 8)), "state.npz"]
    runs = list(gr.open_stream(reference))
    assert [run.trajectory.first_cycle for run in runs] == [0, 9, 18, 27, 36, 45, 54]
    whole = gr.simulate(model, cycles=60, samples_per_cycle=8, discard=5, audit=False)
    assert np.concatenate([r.trajectory.events.time for r in runs]).tobytes() == whole.trajectory.events.time.tobytes()
    assert gr.criteria(gr.open_stream(reference)).sentence == gr.criteria(whole).sentence


def test_the_same_motion_makes_the_same_store(reference: Path, model: gr.Model, tmp_path: Path) -> None:
    for _ in gr.stream(model, **SETTINGS, store=tmp_path / "again"):
        pass
    assert content(tmp_path / "again") == content(reference)


@pytest.mark.slow
@pytest.mark.parametrize("after", [*(pytest.param(after, marks=pytest.mark.long) for after in (0, 1)), 5])
def test_an_exception_keeps_whole_chunks_and_resume_goes_on(
    reference: Path, model: gr.Model, tmp_path: Path, after: int
) -> None:
    def stop(fraction: float) -> None:
        if fraction > (after + 0.1) * 9 / 60:
            raise gr.Cancelled

    folder = tmp_path / "store"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gearrattle.engine.solvers.exact._BUDGET", 200)
        with pytest.raises(gr.Cancelled):
            for _ in gr.stream(model, **SETTINGS, store=folder, progress=stop):
                pass
    assert len(list(folder.glob("chunk-*.nc"))) == after
    stream = gr.stream(model, **SETTINGS, store=folder, resume=True)
    assert stream.done == 9 * after
    verdict_of_rest = [run.trajectory.first_cycle for run in stream]
    assert verdict_of_rest == list(range(9 * after, 60, 9))
    assert content(folder) == content(reference)
    assert stream.verdict().to_dict() == gr.criteria(gr.open_stream(reference)).to_dict()


@pytest.mark.slow
@pytest.mark.parametrize(
    "train",
    [synthetic.MODEL, pytest.param(FILE.read_text(encoding="utf-8"), marks=pytest.mark.long)],
    ids=["synthetic", "case 3"],
)
def test_a_motion_resumed_after_every_discarded_cycle_adds_up_the_same(train: str, tmp_path: Path) -> None:
    """The flanks of the last contacts of discarded chunks decide what the first impact that counts is."""
    settings = {"cycles": 8, "samples_per_cycle": 8, "chunk": 1, "discard": 6}
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    assert len(list(gr.stream(gr.loads(train), **settings, store=whole))) == 8
    for after in range(6):
        stream = gr.stream(gr.loads(train), **settings, store=cut, resume=after > 0)
        next(stream)
        assert stream.close() == after + 1
    assert len(list(gr.stream(gr.loads(train), **settings, store=cut, resume=True))) == 2
    assert content(cut) == content(whole)


@pytest.mark.slow
def test_a_closed_stream_counts_no_chunk_that_another_thread_finishes_later(
    reference: Path, model: gr.Model, tmp_path: Path
) -> None:
    stream = gr.stream(model, **SETTINGS, store=tmp_path / "store")
    assert stream.close() == 0
    stream = gr.stream(model, **SETTINGS, store=tmp_path / "store")
    next(stream)
    assert stream.close() == 9
    with pytest.raises(gr.Cancelled):
        next(stream)
    assert len(list(gr.open_stream(tmp_path / "store"))) == 1
    assert len(list(gr.stream(model, **SETTINGS, store=tmp_path / "store", resume=True))) == 6
    assert content(tmp_path / "store") == content(reference)


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_a_killed_program_loses_the_chunk_under_way_only(reference: Path, model: gr.Model, tmp_path: Path) -> None:
    folder = tmp_path / "store"
    code = (
        "import time, gearrattle as gr\n"
        "from gearrattle.engine.solvers import exact\n"
        "exact._BUDGET = 200\n"
        f"settings = {SETTINGS!r}\n"
        f"for _ in gr.stream(gr.load({str(FILE)!r}), **settings, store={str(folder)!r},\n"
        "                   progress=lambda f: time.sleep(0.02)): pass"
    )
    with subprocess.Popen([sys.executable, "-c", code]) as process:
        while not (folder / "chunk-000003.nc").exists():
            assert process.poll() is None
            time.sleep(0.005)
        process.send_signal(signal.SIGKILL)
    (folder / ".gearrattle-left" / "content").mkdir(parents=True)
    (folder / ".gearrattle-left" / "content" / "chunk-000004.nc").write_bytes(b"half-written")
    (folder / ".gearrattle-left.part").write_bytes(b"half-written")
    (folder / "chunk-000005.nc").write_bytes(b"beyond the state: not counted")
    stream = gr.stream(model, **SETTINGS, store=folder, resume=True)
    assert stream.done in (18, 27, 36)
    assert not list(folder.glob(".gearrattle-*"))
    left = 7 - stream.done // 9
    assert len(list(stream)) == left
    assert content(folder) == content(reference)


def test_a_finished_store_has_nothing_left_to_do(reference: Path, model: gr.Model) -> None:
    before = content(reference)
    stream = gr.stream(model, **SETTINGS, store=reference, resume=True)
    assert list(stream) == []
    assert stream.verdict().window.cycles == 55
    assert content(reference) == before


def test_regions_are_found_again_in_whatever_order_they_were_met(
    reference: Path, model: gr.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stream = gr.stream(model, **SETTINGS, store=tmp_path)
    for _ in range(3):
        next(stream)
    monkeypatch.setattr("gearrattle.engine.solvers.region_slots._KEPT", OrderedDict())
    fresh = gr.load(FILE)  # another object: its regions are built anew
    for _ in gr.stream(fresh, **SETTINGS, store=tmp_path, resume=True, initial="steady"):
        pass
    assert content(tmp_path) == content(reference)


@pytest.mark.parametrize(
    ("change", "call", "words"),
    [
        ({}, {"resume": False}, r"holds 60 cycles of a run already \(resume"),
        ({"mesh.gear.backlash": 1.1e-4}, {}, "holds another motion, with backlash = 0.0001"),
        ({}, {"cycles": 61}, "found cycles = 61; holds another motion, with cycles = 60"),
        ({}, {"chunk": 10}, "found chunk = 10; holds another motion, with chunk = 9"),
        ({}, {"samples_per_cycle": 9}, "samples_per_cycle = 8"),
        ({}, {"audit": True}, "audit = false"),
        ({}, {"initial": "zero"}, 'initial = "steady"'),
    ],
)
def test_another_motion_is_refused_and_nothing_changed(
    reference: Path, model: gr.Model, change: dict[str, float], call: dict[str, object], words: str
) -> None:
    before = {path.name: path.stat().st_mtime_ns for path in reference.iterdir()}
    settings = {**SETTINGS, "resume": True, **call}
    with pytest.raises(gr.ModelError, match=words):
        gr.stream(model.with_(change), **settings, store=reference)  # type: ignore[arg-type]
    assert {path.name: path.stat().st_mtime_ns for path in reference.iterdir()} == before


def test_other_versions_are_refused(reference: Path, model: gr.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stores, "version_of", lambda _: "0.0.1")
    with pytest.raises(gr.ModelError, match=r"found gearrattle = \"0\.0\.1\"; holds another motion"):
        gr.stream(model, **SETTINGS, store=reference, resume=True)


@pytest.mark.parametrize("garbage", [b"", b"nothing like a state", b"PK\x03\x04 damaged"])
def test_a_damaged_state_is_one_clear_error(model: gr.Model, tmp_path: Path, garbage: bytes) -> None:
    (tmp_path / "state.npz").write_bytes(garbage)
    with pytest.raises(gr.ModelError, match="must be the state of a stored motion"):
        gr.stream(model, **SETTINGS, store=tmp_path, resume=True)


@pytest.mark.parametrize("gone", ["", "state.npz", "chunk-000001.nc"])
def test_a_store_that_was_removed_is_not_gone_on_with(model: gr.Model, tmp_path: Path, gone: str) -> None:
    """A second chunk was written into a new folder, without the first: nothing could read it."""
    folder = tmp_path / "store"
    stream = gr.stream(model, **SETTINGS, store=folder)
    next(stream)
    removed = folder / gone
    shutil.rmtree(removed) if removed.is_dir() else removed.unlink()
    left = sorted(tmp_path.rglob("*"))
    for _ in range(2):
        with pytest.raises(gr.ModelError, match=rf"{removed}: has been removed, after 9 cycles of the motion"):
            next(stream)
    assert stream.done == 9
    assert sorted(tmp_path.rglob("*")) == left


def test_a_store_removed_while_a_chunk_is_computed_stays_removed(
    model: gr.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "store"
    stream = gr.stream(model, **SETTINGS, store=folder)
    next(stream)
    keep = stores.Store.keep

    def removed_before(self: stores.Store, *arguments: Any) -> None:
        shutil.rmtree(folder)
        keep(self, *arguments)

    monkeypatch.setattr(stores.Store, "keep", removed_before)
    with pytest.raises(gr.ModelError, match="has been removed"):
        next(stream)
    assert not folder.exists()


def test_a_store_removed_while_it_is_read_says_so(reference: Path, tmp_path: Path) -> None:
    folder = tmp_path / "store"
    shutil.copytree(reference, folder)
    chunks = gr.open_stream(folder)
    next(chunks)
    shutil.rmtree(folder)
    with pytest.raises(gr.ModelError, match=rf"{folder}: has been removed: of 7 chunks, 1 can be read"):
        next(chunks)


def test_there_must_be_something_to_open(tmp_path: Path) -> None:
    with pytest.raises(gr.ModelError, match="no stored motion"):
        gr.open_stream(tmp_path)


def test_a_full_disk_loses_nothing_that_was_kept(model: gr.Model, reference: Path, tmp_path: Path) -> None:
    stream = gr.stream(model, **SETTINGS, store=tmp_path / "store")
    next(stream)

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stores.np, "savez", full)
        with pytest.raises(OSError, match="No space"):
            next(stream)
    assert stream.done == 9
    names = sorted(p.name for p in (tmp_path / "store").iterdir())
    assert names == [".lock", "chunk-000001.nc", "chunk-000002.nc", "state.npz"]
    for _ in stream:  # there is space again
        pass
    assert content(tmp_path / "store") == content(reference)


WRITER = """
import sys, gearrattle as gr
model = gr.load({file!r})
stream = gr.stream(model, **{settings!r}, store={folder!r}, resume={resume})
print("begun", flush=True)
sys.stdin.readline()
try:
    for run in stream:
        print("kept", flush=True)
        sys.stdin.readline()
except gr.ModelError as error:
    print(error, flush=True)
    sys.exit(2)
"""


def writer(folder: Path, *, resume: bool) -> subprocess.Popen[str]:
    """Start a process that writes a chunk each time it is told to."""
    code = WRITER.format(file=str(FILE), settings=SETTINGS, folder=str(folder), resume=resume)
    words = [sys.executable, "-c", code]
    return subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def answer(process: subprocess.Popen[str]) -> str:
    """Tell a writer to go on, and return what it says."""
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write("\n")
    process.stdin.flush()
    return process.stdout.readline()


@pytest.mark.long
def test_two_programs_never_write_into_one_folder(model: gr.Model, reference: Path, tmp_path: Path) -> None:
    folder = tmp_path / "store"
    first, second = writer(folder, resume=False), writer(folder, resume=False)
    assert first.stdout is not None
    assert second.stdout is not None
    assert first.stdout.readline() == second.stdout.readline() == "begun\n"
    assert answer(first) == "kept\n"
    assert f"another program writes into it (process {first.pid} " in answer(second)
    assert second.wait(20) == 2
    with pytest.raises(gr.ModelError, match="another program writes into it"):
        gr.stream(model, **SETTINGS, store=folder, resume=True)
    first.kill()  # the lock of a process that was killed is free
    first.wait(20)
    for _ in gr.stream(model, **SETTINGS, store=folder, resume=True):
        pass
    assert content(folder) == content(reference)


def test_a_later_stream_of_the_same_program_takes_the_folder_over(
    model: gr.Model, reference: Path, tmp_path: Path
) -> None:
    earlier = gr.stream(model, **SETTINGS, store=tmp_path)
    next(earlier)
    later = gr.stream(model, **SETTINGS, store=tmp_path, resume=True)
    with pytest.raises(gr.ModelError, match="another stream of this program"):
        next(earlier)
    for _ in later:
        pass
    assert content(tmp_path) == content(reference)


def test_chunks_of_another_motion_are_not_read_as_one(model: gr.Model, reference: Path, tmp_path: Path) -> None:
    other = model.with_({"torque.0.mean": 1.0})
    for folder, driveline in ((tmp_path / "a", model), (tmp_path / "b", other)):
        for _ in gr.stream(driveline, **SETTINGS, store=folder):
            pass
    (tmp_path / "b" / "chunk-000003.nc").replace(tmp_path / "a" / "chunk-000003.nc")
    with pytest.raises(gr.ModelError, match=r"chunk-000003.nc: is a chunk of another model"):
        list(gr.open_stream(tmp_path / "a"))
    (tmp_path / "a" / "chunk-000002.nc").replace(tmp_path / "a" / "chunk-000003.nc")
    (tmp_path / "a" / "chunk-000001.nc").replace(tmp_path / "a" / "chunk-000002.nc")
    with pytest.raises(gr.ModelError, match=r"chunk-000001.nc|must begin at cycle"):
        list(gr.open_stream(tmp_path / "a"))


SUMS = {
    "crossings": (
        "sides dwell count drive speed top_speed square left top_change push top_push lost kept moving held same other "
        "flank final open begun met since crossings calls mass touched"
    ),
    "last cycles": "above below high low off rms",
    "peaks": "miss peak",
    "spectra": "density gram last moments rest segments",
}
"""What ``gearrattle stream 4`` keeps of the criteria. If this changes, in name, shape or meaning, the version rises."""


def test_the_sums_that_a_store_keeps_are_those_of_its_version(reference: Path) -> None:
    with np.load(reference / "state.npz") as file:
        assert str(file["owner"]).startswith("gearrattle stream 4\n")
        gathered = {name.removeprefix("gathered/") for name in file.files if name.startswith("gathered/")}
        march = {name.removeprefix("march/") for name in file.files if name.startswith("march/")}
    assert gathered == {"grid", "span", *(f"{name}/{key}" for name, keys in SUMS.items() for key in keys.split())}
    assert march == {"bound", "carried", "clock", "counts", "cycle", "region", "sample", "side", "tried", "u", "y"}


def test_a_motion_of_an_earlier_version_opens_and_is_not_gone_on_with(
    reference: Path, model: gr.Model, tmp_path: Path
) -> None:
    folder = tmp_path / "store"
    shutil.copytree(reference, folder)
    with np.load(folder / "state.npz") as file:
        arrays = {name: file[name] for name in file.files if name != "gathered/peaks/peak"}
    earlier = str(arrays["owner"]).replace("gearrattle stream 4", "gearrattle stream 1")
    np.savez(folder / "state.npz", **{**arrays, "owner": np.array(earlier)})
    before = content(folder)
    assert len(list(gr.open_stream(folder))) == 7
    with pytest.raises(gr.ModelError) as caught:
        gr.stream(model, **{**SETTINGS, "cycles": 90}, store=folder, resume=True)
    message = str(caught.value)
    assert 'found "gearrattle stream 1"; was begun by an earlier version of gearrattle' in message
    assert "compute the motion again in another folder" in message
    assert content(folder) == before
