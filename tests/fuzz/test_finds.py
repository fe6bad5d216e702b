"""What ``make fuzz`` has found: damaged files that ended as internal errors."""

from __future__ import annotations

import io
import struct
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.files import opened_hdf5
from gearrattle.report.plots.chart_files import read_charts
from gearrattle.report.sound.transfer_path import sound_path
from tests.fuzz.saved import save_stream
from tests.fuzz.targets import TARGETS, recording


def wav(channels: int = 1, align: int = 2, parts: tuple[bytes, ...] = (b"fmt ", b"data")) -> bytes:
    body = struct.pack("<4sIHHIIHH", b"fmt ", 16, 1, channels, 8000, 16000, align, 16) if b"fmt " in parts else b""
    body += struct.pack("<4sI", b"data", 8) + bytes(8) if b"data" in parts else b""
    return struct.pack("<4sI4s", b"RIFF", 4 + len(body), b"WAVE") + body


@pytest.mark.parametrize(
    "content",
    [
        wav(channels=0),
        wav(align=0),
        wav(parts=()),
        wav(parts=(b"fmt ",)),
        wav(parts=(b"data",)),
        wav()[:30],
        wav()[:18],
    ],
)
def test_a_damaged_header_of_a_wav_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "x.wav"
    path.write_bytes(content)
    with pytest.raises(ModelError, match=r"x\.wav"):
        sound_path(path, 48e3)
    with pytest.raises(ModelError, match=r"x\.wav"):
        gr.read(path)


@pytest.mark.parametrize("name", ["stored charts, npz", "stream, state.npz"])
def test_an_archive_whose_parts_are_damaged_is_refused(name: str, tmp_path: Path) -> None:
    target = TARGETS[name]
    stream = io.BytesIO()
    np.savez(stream, charts=np.arange(9), owner=np.array("x"), counts=np.array([1, 1]))
    path = tmp_path / target.file
    path.parent.mkdir(exist_ok=True)
    for whole in (stream.getvalue(), stream.getvalue().replace(b"NUMPY", b"MUMPY"), stream.getvalue()[:-30]):
        path.write_bytes(whole.replace(b"{'descr'", b"{'desc\x00'"))
        with pytest.raises(ModelError, match=path.name):
            read_charts(path) if path.name == "charts.npz" else gr.open_stream(path.parent)


def study(folder: Path) -> Path:
    TARGETS["study folder, study.json"].around(folder)
    return folder / "kept"


def test_a_damaged_study_folder_is_refused_by_one_error(tmp_path: Path) -> None:
    kept = study(tmp_path)
    group = kept / "results.zarr" / "zarr.json"
    whole = group.read_text()
    for text in ("", "{}", "[]", "\udcff", whole[:-9], whole.replace('"zarr_format": 3', '"zarr_format": {}'), "null"):
        group.write_bytes(text.encode("utf-8", "surrogateescape"))
        with pytest.raises(ModelError, match=r"must be the folder of a study|before it computed|\.zarr holds another"):
            gr.open_study(kept)


def test_a_study_that_claims_a_terabyte_is_refused(tmp_path: Path) -> None:
    kept = study(tmp_path)
    for array in (kept / "results.zarr").glob("*/zarr.json"):
        array.write_text(array.read_text().replace('"shape": [\n    2', '"shape": [\n    100000000000'))
    with pytest.raises(ModelError, match="GB of a file are read"):
        gr.open_study(kept)


def test_a_study_that_has_lost_an_array_is_refused(tmp_path: Path) -> None:
    kept = study(tmp_path)
    (kept / "results.zarr" / "verdict" / "zarr.json").unlink()
    with pytest.raises(ModelError, match="must be the folder of a study"):
        gr.open_study(kept)


def test_a_list_as_kind_of_a_filter_is_refused(tmp_path: Path) -> None:
    mapping = TARGETS["mapping file"]
    mapping.around(tmp_path)
    (text,) = mapping.seeds(tmp_path)
    (tmp_path / "m.toml").write_bytes(text.replace(b'kind = "lowpass"', b"kind = []"))
    with pytest.raises(ModelError, match=r"filter\.kind"):
        gr.read(tmp_path / "m.toml")


@pytest.mark.parametrize("rate", ["9223372036854775807", '"1e12 Hz"', "1e30"])
def test_a_rate_that_fills_the_memory_is_refused(rate: str, tmp_path: Path) -> None:
    mapping = TARGETS["mapping file"]
    mapping.around(tmp_path)
    (text,) = mapping.seeds(tmp_path)
    (tmp_path / "m.toml").write_bytes(text.replace(b'rate = "80 Hz"', f"rate = {rate}".encode()))
    with pytest.raises(ModelError, match=r"rate: .* GB of memory"):
        gr.read(tmp_path / "m.toml")


@pytest.mark.parametrize("text", ["", "[]", "1", "null", '"x"', "{"])
def test_a_damaged_marker_of_a_chunk_is_as_none(text: str, tmp_path: Path) -> None:
    kept = study(tmp_path)
    for marker in (kept / "done").glob("*.json"):
        marker.write_text(text)
    assert gr.open_study(kept).attrs["failures"] == []


def with_objects(path: Path, change: bytes, at: int) -> None:
    """Write a change into the size of an object of the only global heap of a file."""
    content = bytearray(path.read_bytes())
    heap = content.index(b"GCOL")
    first = heap + 16 + at
    content[first : first + len(change)] = change
    path.write_bytes(content)


@pytest.mark.parametrize("size", [2**64 - 16, 2**64 - 9, 2**63])
def test_a_global_heap_that_the_library_would_read_for_ever_is_refused(size: int, tmp_path: Path) -> None:
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as file:
        file["x"] = np.arange(4.0)
        file["x"].attrs["units"] = "rad/s"
        file["time"] = np.arange(4.0)
    assert [channel.name for channel in gr.read(path).channels] == ["x"]
    whole = path.read_bytes()
    with_objects(path, struct.pack("<Q", size), at=8)
    for read in (gr.read, gr.open_run):
        with pytest.raises(ModelError, match="an object of a global heap has an impossible size"):
            read(path)
    path.write_bytes(whole)
    with_objects(path, struct.pack("<HHIQ", 0, 0, 0, 0), at=0)  # free space of no size
    with pytest.raises(ModelError, match="an object of a global heap has an impossible size"):
        gr.read(path)


def test_a_heap_behind_a_large_dataset_is_looked_at(tmp_path: Path) -> None:
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as file:
        file["x"] = file["time"] = np.arange(1e5)
        file.flush()
        file["x"].attrs["units"] = "rad/s"
    assert gr.read(path).time.size == 100_000
    assert path.read_bytes().index(b"GCOL") > 1_000_000
    with_objects(path, struct.pack("<Q", 2**64 - 16), at=8)
    with pytest.raises(ModelError, match="an object of a global heap has an impossible size"):
        gr.read(path)


def test_text_and_numbers_that_look_like_addresses_of_heaps_are_read(tmp_path: Path) -> None:
    """The bytes of a heap's address stand in strings after other strings, and among whole numbers."""
    path, words = tmp_path / "x.h5", ["x" * length for length in range(1, 40)]
    with h5py.File(path, "w") as file:
        file["words"] = np.array([*words, "GCOL and more"], dtype=h5py.string_dtype())
        near = np.array([value for begin in range(0, 8192, 8) for value in (-1, begin, 5)])
        file["numbers"] = near
        file.create_dataset("chunked", data=near, chunks=(60,))
    with opened_hdf5(path) as file:
        assert [text.decode() for text in file["words"][:]][-1] == "GCOL and more"


def test_heaps_within_heaps_are_refused_at_once(tmp_path: Path) -> None:
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as file:
        file["x"] = np.arange(4.0)
    heap = struct.pack("<4sB3xQ", b"GCOL", 1, 2**40)
    path.write_bytes(path.read_bytes() + (heap + struct.pack("<HHIQ", 1, 0, 0, 16)) * 20_000)
    begun = time.process_time()
    with pytest.raises(ModelError, match="an object of a global heap has an impossible size"):
        gr.read(path)
    assert time.process_time() - begun < 2.0


@pytest.mark.parametrize("counts", ["11 -1000", "11 99999999", "99999999999 8", "-5 8"])
def test_impossible_sizes_of_a_binary_universal_file_are_refused(counts: str, tmp_path: Path) -> None:
    path = tmp_path / "x.uff"
    gr.write(recording(), path)
    content = path.read_bytes()
    lines, size = content.split(b"\n")[1].split()[3:5]
    path.write_bytes(
        content.replace(lines, counts.split(maxsplit=1)[0].encode(), 1).replace(size, counts.split()[1].encode(), 1)
    )
    begun = time.process_time()
    with pytest.raises(ModelError, match="ends inside a dataset"):
        gr.read(path)
    assert time.process_time() - begun < 2.0


@pytest.mark.parametrize("position", ["attribute", "dataset", "member"])
def test_an_impossible_type_of_variable_length_is_refused(position: str, tmp_path: Path) -> None:
    path = tmp_path / "x.h5"
    text = h5py.string_dtype()
    with h5py.File(path, "w") as file:
        file["x"] = file["time"] = np.arange(4.0)
        if position == "attribute":
            file["x"].attrs["units"] = "rad/s"
        else:
            kind = text if position == "dataset" else np.dtype([("label", text)])
            file.create_dataset("label", (1,), kind)
    assert gr.read(path).channels[0].name == "x"
    content = path.read_bytes()
    string = b"\x19\x01\x01\x00\x10\x00\x00\x00"  # version 1 of class 9, a string in UTF-8, 16 bytes
    assert content.count(string) == 1
    path.write_bytes(content.replace(string, b"\x19\x03" + string[2:]))
    with pytest.raises(ModelError, match="an impossible type of variable length"):
        gr.read(path)


def test_a_channel_beyond_its_records_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("asammdf")
    path = tmp_path / "x.mf4"
    gr.write(recording(), path)
    content = bytearray(path.read_bytes())
    block = content.rindex(b"##CN")
    (links,) = struct.unpack_from("<Q", content, block + 16)
    struct.pack_into("<I", content, block + 24 + 8 * links + 4, 8_454_160)  # the byte of a record where it begins
    path.write_bytes(content)
    with pytest.raises(ModelError, match="a channel lies beyond the records of its group"):
        gr.read(path)


@pytest.mark.parametrize("kind", ["data group", "channel group", "channel", "file history", "parts of a channel"])
def test_a_list_that_leads_back_into_itself_is_refused(kind: str, tmp_path: Path) -> None:
    """The library follows it for ever."""
    pytest.importorskip("asammdf")
    path = tmp_path / "x.mf4"
    gr.write(recording(), path)
    content = bytearray(path.read_bytes())
    marks = {"data group": b"##DG", "channel group": b"##CG", "file history": b"##FH"}
    block = content.index(marks.get(kind, b"##CN"))
    if kind == "parts of a channel":
        struct.pack_into("<Q", content, block + 32, len(content))
        content += b"##CA" + struct.pack("<4xQQQ", 32, 1, len(content))
    else:
        struct.pack_into("<Q", content, block + 24, block)
    path.write_bytes(content)
    with pytest.raises(ModelError, match=rf"a list of blocks \({kind}\) leads back into itself"):
        gr.read(path)


@pytest.mark.parametrize(
    ("row", "message"), [("0.1_5, 2", 'x.csv:3: t: found "0.1_5"'), ("0.2", "x.csv:3: found 1 entries")]
)
def test_a_row_that_only_python_takes_for_numbers_is_refused(row: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text(f"t [s], n [rpm]\n0, 1\n{row}\n0.3\n", encoding="utf-8")
    with pytest.raises(ModelError, match=message):
        gr.read(path)


def test_a_string_of_an_unknown_encoding_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.nc"
    with h5py.File(path, "w") as file:
        file["x"] = file["time"] = np.arange(4.0)
        file["label"] = np.array([b"abcd"], "S4")
    content = path.read_bytes()
    string = b"\x13\x01\x00\x00\x04\x00\x00\x00"  # version 1 of class 3, padded with NUL, in ASCII, 4 bytes
    assert content.count(string) == 1
    path.write_bytes(content.replace(string, b"\x13\x21" + string[2:]))
    for read in (gr.read, gr.open_run):
        with pytest.raises(ModelError, match=r"x\.nc"):
            read(path)


@pytest.mark.parametrize("position", ["attribute", "dataset"])
def test_a_string_longer_than_its_file_is_refused_before_memory_is_taken(position: str, tmp_path: Path) -> None:
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as file:
        file["x"] = file["time"] = np.arange(4.0)
        if position == "attribute":
            file["x"].attrs["units"] = "rad/s"
        else:
            file["label"] = ["rad/s"]
    content = bytearray(path.read_bytes())
    reference = struct.pack("<IQI", 5, content.index(b"GCOL"), 1)
    assert content.count(reference) == 1
    struct.pack_into("<I", content, content.index(reference), 2**32 - 16)
    path.write_bytes(content)
    for read in (gr.read, gr.open_run):
        with pytest.raises(ModelError, match="a string is longer than the file"):
            read(path)


def test_records_larger_than_memory_are_refused(tmp_path: Path) -> None:
    pytest.importorskip("asammdf")
    path = tmp_path / "x.mf4"
    gr.write(recording(), path)
    content = bytearray(path.read_bytes())
    record = struct.pack("<II", 24, 0)  # bytes of a record, and those that tell what is invalid
    assert content.count(record) == 1
    struct.pack_into("<I", content, content.index(record), 4_278_190_104)
    path.write_bytes(content)
    with pytest.raises(ModelError, match=r"a record of 4278190104 bytes, where the data of its group are 960"):
        gr.read(path)


@pytest.mark.parametrize("cycles", [0, 40])
def test_a_record_longer_than_the_data_of_its_group_is_refused_at_once(cycles: int, tmp_path: Path) -> None:
    """Also in a group that says to hold none: the library makes room for one record, 1.3 GB in a file of 2 kB."""
    pytest.importorskip("asammdf")
    resource = pytest.importorskip("resource")
    path = tmp_path / "x.mf4"
    gr.write(recording(), path)
    content = bytearray(path.read_bytes())
    struct.pack_into("<I", content, content.index(struct.pack("<II", 24, 0)), 1_313_022_755)
    count = content.index(struct.pack("<Q", 40), content.index(b"##CG"))
    struct.pack_into("<Q", content, count, cycles)
    path.write_bytes(content)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    begun = time.process_time()
    with pytest.raises(ModelError, match=r"a record of 1313022755 bytes, where the data of its group are \d+"):
        gr.read(path)
    assert time.process_time() - begun < 2.0
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000  # kilobytes


@pytest.mark.parametrize("rate", [1, 23, 96_000_001, 0x7FFFFFFF])
def test_an_impulse_response_of_a_rate_far_from_what_is_heard_is_refused(rate: int, tmp_path: Path) -> None:
    path = tmp_path / "response.wav"
    body = struct.pack("<4sIHHIIHH", b"fmt ", 16, 1, 1, rate, 2 * rate, 2, 16)
    body += struct.pack("<4sI8h", b"data", 16, *range(8))
    path.write_bytes(struct.pack("<4sI4s", b"RIFF", 4 + len(body), b"WAVE") + body)
    with pytest.raises(ModelError, match=r"must have 24 to 9\.6e\+07 samples a second to be heard at 48000 Hz"):
        sound_path(path, 48e3)


@pytest.mark.parametrize("step", [1e-320, 1e-12, 1.0, 1e300])
def test_an_impulse_response_of_times_far_from_what_is_heard_is_refused(step: float, tmp_path: Path) -> None:
    path = tmp_path / "response.csv"
    lines = "\n".join(f"{i * step!r},{i}" for i in range(4))
    path.write_text(f"time [s],response [Pa/(N*s)]\n{lines}\n", encoding="utf-8")
    with pytest.raises(ModelError):
        sound_path(path, 48e3)


def test_an_impulse_response_that_lasts_for_hours_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "response.csv"
    lines = "\n".join(f"{i / 32!r},{i}" for i in range(32 * 601))
    path.write_text(f"time [s],response [Pa/(N*s)]\n{lines}\n", encoding="utf-8")
    with pytest.raises(ModelError, match=r"found 601 s; may last 600 s to be heard"):
        sound_path(path, 48e3)


def test_an_impulse_response_of_one_sample_is_read_or_refused(tmp_path: Path) -> None:
    path = tmp_path / "response.wav"
    body = struct.pack("<4sIHHIIHH", b"fmt ", 16, 1, 1, 48_000, 96_000, 2, 16) + struct.pack("<4sIh", b"data", 2, 5)
    path.write_bytes(struct.pack("<4sI4s", b"RIFF", 4 + len(body), b"WAVE") + body)
    with pytest.raises(ModelError):
        sound_path(path, 48e3)


@pytest.mark.parametrize("suffix", [".mat", ".wav"])
@pytest.mark.parametrize("kind", [-100, -999, -(2**31)])
def test_a_matlab_4_number_of_a_type_below_zero_is_no_head(kind: int, suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"x{suffix}"
    path.write_bytes(struct.pack("<5i", kind, 1, 1, 0, 2) + b"t\0" + bytes(8))
    with pytest.raises(ModelError, match=path.name):
        gr.read(path)


@pytest.mark.parametrize("time", [np.nan, np.inf, -1e300])
def test_a_chunk_whose_times_are_none_is_refused(time: float, tmp_path: Path) -> None:
    save_stream(tmp_path)
    with h5py.File(tmp_path / "kept" / "chunk-000001.nc", "r+") as file:
        file["time"][3] = time
    with pytest.raises(ModelError, match="time"):
        gr.criteria(gr.open_stream(tmp_path / "kept"))


def test_what_the_library_of_mdf_tells_of_a_damaged_channel_is_not_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("asammdf")
    path = tmp_path / "x.mf4"
    gr.write(recording(), path)
    content = bytearray(path.read_bytes())
    (name,) = struct.unpack_from("<Q", content, content.index(b"##CN") + 24 + 16)
    (size,) = struct.unpack_from("<Q", content, name + 8)
    content[name + 24 : name + size] = bytes(size - 24)
    path.write_bytes(content)
    with pytest.raises(ModelError, match="cannot be read"):
        gr.read(path)
    assert capsys.readouterr() == ("", "")


def test_a_copy_of_an_mdf_that_is_not_finalised_is_not_left_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("asammdf")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    path = tmp_path / "x.mf4"
    gr.write(recording(), path)
    content = bytearray(path.read_bytes())
    struct.pack_into("<H", content, 60, 4)  # what is left to be done, in flags
    path.write_bytes(content[:89])
    with pytest.raises(ModelError, match=r"x\.mf4"):
        gr.read(path)
    assert list((tmp_path / "temporary").iterdir()) == []
    path.write_bytes(content)
    assert "its samples were counted anew" in gr.read(path).notes[0]
    assert list((tmp_path / "temporary").iterdir()) == []


def test_an_impossible_value_for_what_was_not_written_is_refused(tmp_path: Path) -> None:
    """The library ends the process when it is asked for that value."""
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as file:
        file["time"] = np.arange(20.0)
        file.create_dataset("x", data=np.arange(20.0), chunks=(5,))
    assert [channel.name for channel in gr.read(path).channels] == ["x"]
    content = path.read_bytes()
    message = b"\x02\x03\x02\x01" + bytes(4)  # version 2: when it is written, that it is defined, and its size
    assert content.count(message) == 1
    path.write_bytes(content.replace(message, message[:4] + struct.pack("<i", -33024)))
    for read in (gr.read, gr.open_run):
        with pytest.raises(ModelError, match="an impossible value in place of numbers that were not written"):
            read(path)


def test_bytes_that_tell_what_is_invalid_count_as_bytes_of_a_record(tmp_path: Path) -> None:
    pytest.importorskip("asammdf")
    path = tmp_path / "x.mf4"
    gr.write(recording(), path)
    content = bytearray(path.read_bytes())
    struct.pack_into("<I", content, content.index(struct.pack("<II", 24, 0)) + 4, 0xFF000000)
    path.write_bytes(content)
    with pytest.raises(ModelError, match=r"GB of memory|bytes, where the data of its group"):
        gr.read(path)
