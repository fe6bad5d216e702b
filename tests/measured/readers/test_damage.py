"""Every kind of damage is one ``ModelError`` with the file's name and something to do; no library's traceback."""

from __future__ import annotations

import gc
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

import gearrattle as gr
from gearrattle.errors import ModelError, NotInstalled
from gearrattle.recording import Channel, Recording
from tests.measured.readers.rig import rig
from tests.measured.readers.test_round_trips import SUFFIXES


def _refused(path: Path) -> str:
    """Return the message of the refusal."""
    with pytest.raises(ModelError) as caught:
        gr.read(path)
    (problem, *_) = caught.value.problems
    assert str(path) in problem.place
    assert problem.rule
    return str(caught.value)


@pytest.mark.slow
@pytest.mark.parametrize("name", SUFFIXES)
@pytest.mark.parametrize("share", [0.02, 0.3, 0.6, 0.95])
def test_a_truncated_file(name: str, share: float, tmp_path: Path) -> None:
    """Cut anywhere: refused, or in a text between two lines read as far as it goes."""
    path = tmp_path / f"record{SUFFIXES[name]}"
    gr.write(rig(), path)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    if name != "csv":
        _refused(path)
        return
    try:
        actual = gr.read(path)
    except ModelError:
        return
    count = actual.time.size - 1  # the last line may end within a number
    np.testing.assert_array_equal(actual["n_engine"].values[:count], rig()["n_engine"].values[:count])


@pytest.mark.slow
@pytest.mark.parametrize("name", SUFFIXES)
def test_a_file_whose_middle_is_overwritten(name: str, tmp_path: Path) -> None:
    """Bytes of no meaning: an answer or a refusal, never another exception."""
    path = tmp_path / f"record{SUFFIXES[name]}"
    gr.write(rig(), path)
    whole = path.read_bytes()
    random = np.random.default_rng(3)
    refused = 0
    for _ in range(10):
        broken = bytearray(whole)
        for _ in range(int(random.integers(1, 60))):
            broken[int(random.integers(0, min(len(whole), int(random.choice([600, 10**9])))))] = int(
                random.integers(256)
            )
        path.write_bytes(bytes(broken))
        try:
            actual = gr.read(path)
        except ModelError:
            refused += 1
        else:
            assert np.all(np.diff(actual.time) > 0.0)
            assert all(np.isfinite(channel.values).all() for channel in actual.channels)
    assert refused > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", SUFFIXES)
def test_another_format_is_asked_for(name: str, tmp_path: Path) -> None:
    path = tmp_path / "record.bin"
    gr.write(rig(), path, format=name)
    for other in {*SUFFIXES, "run"} - {name}:
        with pytest.raises(ModelError, match=str(path)):
            gr.read(path, format=other)


def test_no_file_a_folder_an_empty_file_and_no_format(tmp_path: Path) -> None:
    (tmp_path / "record.mat").write_bytes(b"")
    assert "the file is empty" in _refused(tmp_path / "record.mat")
    assert 'no such file (did you mean "record.mat"?)' in _refused(tmp_path / "recrd.mat")
    assert "must be a file" in _refused(tmp_path)
    (tmp_path / "x.mf4").write_bytes(bytes(range(200, 256)) * 10)
    assert "it ends like mdf4: damaged" in _refused(tmp_path / "x.mf4")
    (tmp_path / "x.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    assert "its content is none of" in _refused(tmp_path / "x.png")
    with pytest.raises(ModelError, match=r"format: found \"wave\"; must be one of"):
        gr.read(tmp_path / "record.mat", format="wave")


def test_nothing_but_words(tmp_path: Path) -> None:
    savemat(tmp_path / "x.mat", {"word": "abc"})
    assert "holds no vectors" in _refused(tmp_path / "x.mat")
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["word"] = "abc"
    assert "holds no vectors" in _refused(tmp_path / "x.h5")
    (tmp_path / "x.uff").write_text("    -1\n   151\nmodel\n    -1\n")
    assert "holds no time history" in _refused(tmp_path / "x.uff")
    (tmp_path / "x.csv").write_text("t [s], n [rpm]\n")
    assert _refused(tmp_path / "x.csv")


def test_times_that_do_not_ascend_or_are_no_numbers(tmp_path: Path) -> None:
    time = np.array([0.0, 1.0, 1.0, 2.0])
    savemat(tmp_path / "x.mat", {"t": time, "n": time})
    text = _refused(tmp_path / "x.mat")
    assert "times of n: found 1 s at sample 2; must ascend; sample 1 is at 1 s" in text
    savemat(tmp_path / "x.mat", {"t": np.array([0.0, np.nan, 2.0]), "n": np.ones(3)})
    assert "found nan at sample 1; must be finite numbers" in _refused(tmp_path / "x.mat")


def test_samples_that_are_no_numbers(tmp_path: Path) -> None:
    n = np.ones(9)
    n[4] = np.nan
    savemat(tmp_path / "x.mat", {"t": np.arange(9.0), "n": n})
    assert "x.mat: n: found nan at sample 4; samples must be finite numbers" in _refused(tmp_path / "x.mat")
    (tmp_path / "x.csv").write_text("t [s], n [rpm]\n0, 1\n1, nan\n2, 3\n")
    assert "n: found nan at sample 1" in _refused(tmp_path / "x.csv")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("t [s], n [rpm]\n0, 1\n1, 2, 3\n", "x.csv:3: found 3 entries; must have 2"),
        ("t [s], n [rpm]\n0, 1\n1, x\n2, 2\n", 'x.csv:3: n: found "x"'),
        ("t [s], n [rpm]\n0, 1\n1, \n2, 2\n", "x.csv: n: found nan at sample 1"),
        ("t [s], n [rpm], n [rpm]\n0, 1, 2\n", "columns 2 and 3 have this name"),
        ("n [rpm], T [N*m]\n1, 2\n3, 4\n", "no column of as many times"),
        ("t [rpm], n [rpm]\n1, 2\n3, 4\n", "x.csv: t"),
    ],
)
def test_csv(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text(text)
    assert words in _refused(path)


def test_uff_headers(tmp_path: Path) -> None:
    path = tmp_path / "x.uff"
    gr.write(Recording(np.arange(9.0), (Channel("n", "speed", "", "rad/s", np.ones(9)),), "x"), path)
    good = path.read_bytes()
    path.write_bytes(good.replace(b"         4         9         1", b"         4        10         1"))
    assert "dataset 1: found 72 bytes; its header tells 10 samples" in _refused(path)
    path.write_bytes(good.replace(b"         4         9         1", b"         4       abc         1"))
    assert "record 7" in _refused(path)
    path.write_bytes(good.replace(b"58b     1     2", b"58b     1     1"))
    assert "must be of IEEE 754" in _refused(path)


def _unfinished(path: Path, work: int) -> None:
    """Write a recording as a stopped recorder leaves it: no count of samples, no length of the data, flags of work."""
    gr.write(rig(), path)
    content = bytearray(path.read_bytes())
    content[:8] = b"UnFinMF "
    content[60:62] = work.to_bytes(2, "little")
    count = content.index(b"##CG") + 24 + 6 * 8 + 8
    content[count : count + 8] = bytes(8)
    length = content.index(b"##DT") + 8
    content[length : length + 8] = (24).to_bytes(8, "little")
    path.write_bytes(content)


def test_an_unfinished_mdf_is_finished_in_a_copy(tmp_path: Path) -> None:
    path = tmp_path / "x.mf4"
    _unfinished(path, 0x01 | 0x04)
    before = path.read_bytes()
    recording = gr.read(path)
    assert "its samples were counted anew, in a copy" in recording.notes[0]
    for one, other in zip(recording.channels, rig().channels, strict=True):
        np.testing.assert_array_equal(one.values, other.values)
    assert path.read_bytes() == before


def test_an_unfinished_mdf_that_the_library_cannot_finish(tmp_path: Path) -> None:
    """Without blocks, with other work, or with a list of data blocks that goes on, on which the library never ends."""
    path = tmp_path / "x.mf4"
    path.write_bytes(b"UnFinMF 4.10    " + bytes(200))
    assert "its writer was interrupted" in _refused(path)
    _unfinished(path, 0x01 | 0x40)
    assert "its writer was interrupted" in _refused(path)
    _unfinished(path, 0x01 | 0x04)
    content = bytearray(path.read_bytes())
    group = content.index(b"##DG")
    first = len(content)
    second = first + 40
    content[group + 40 : group + 48] = first.to_bytes(8, "little")
    content += (
        b"##DL"
        + bytes(4)
        + (40).to_bytes(8, "little")
        + (2).to_bytes(8, "little")
        + second.to_bytes(8, "little")
        + bytes(8)
    )
    content += b"##DL" + bytes(4) + (40).to_bytes(8, "little") + (2).to_bytes(8, "little") + bytes(16)
    path.write_bytes(content)
    assert "its writer was interrupted" in _refused(path)


def test_a_refusal_of_an_mdf_takes_no_longer_in_a_large_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only the youngest objects are looked through for what the library leaves, and it complains of nothing."""
    path = tmp_path / "x.mf4"
    gr.write(rig(), path)
    path.write_bytes(path.read_bytes()[:1300])
    complaints: list[object] = []
    monkeypatch.setattr("sys.unraisablehook", complaints.append)
    _refused(path)  # the library is imported
    gc.collect()  # nothing else makes the old objects due
    _refused(path)  # the library is imported
    gc.collect()  # nothing else makes the old objects due
    generations: list[int] = []

    def note(phase: str, info: dict[str, int]) -> None:
        if phase == "start":
            generations.append(info["generation"])

    gc.callbacks.append(note)
    try:
        message = _refused(path)
    finally:
        gc.callbacks.remove(note)
    assert "damaged" in message
    assert 0 in generations
    assert 2 not in generations
    gc.collect()
    assert complaints == []


@pytest.mark.parametrize(("name", "library"), [("mdf4", "asammdf"), ("tdms", "nptdms"), ("xlsx", "openpyxl")])
def test_a_format_without_its_library(name: str, library: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / f"x{SUFFIXES[name]}"
    gr.write(rig(), path)
    monkeypatch.setitem(__import__("sys").modules, library, None)
    with pytest.raises(NotInstalled, match=r"gearrattle\[measured\]"):
        gr.read(path)


def test_two_channels_of_one_name_are_refused_in_every_format(tmp_path: Path) -> None:
    """A universal file has no names of its own: two datasets at one node and direction are called alike."""
    channel = Channel("n", "speed", "", "rad/s", np.ones(4))
    with pytest.raises(ModelError, match="channels 1 and 2 have this name"):
        Recording(np.arange(4.0), (channel, channel), "rig")
    path = tmp_path / "x.uff"
    gr.write(Recording(np.arange(4.0), (channel,), "rig"), path)
    path.write_bytes(2 * path.read_bytes())
    assert "columns 1 and 2 of the file have this name" in _refused(path)


@pytest.mark.parametrize("end", [";", ";;"])
def test_separators_at_the_end_of_every_line_are_no_columns(end: str, tmp_path: Path) -> None:
    rows = "".join(f"{k};{2 * k}{end}\n" for k in range(5))
    (tmp_path / "x.csv").write_text(f"t [s];n [rpm]{end}\n{rows}")
    assert gr.read(tmp_path / "x.csv").names == ("n",)
