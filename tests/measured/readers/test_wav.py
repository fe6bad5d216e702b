"""WAV whose header does not tell the length of the samples, and headers of every kind."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.measured.readers import read_raw

RATE = 8000
VALUES = np.round(20000.0 * np.sin(0.1 * np.arange(401)))
TRACKS = np.stack([VALUES, -VALUES], axis=1)


def wav(
    length: int | None = None,
    *,
    kind: bytes = b"RIFF",
    total: int | None = None,
    behind: bytes = b"",
    tracks: np.ndarray = TRACKS,  # type: ignore[type-arg]
    long: int | None = None,
) -> bytes:
    """Return a file of 16-bit samples, whose header tells lengths of its own."""
    order = ">" if kind == b"RIFX" else "<"
    data = tracks.astype(f"{order}i2").tobytes()
    count = tracks.shape[1]
    form = struct.pack(f"{order}HHIIHH", 1, count, RATE, RATE * 2 * count, 2 * count, 16)
    chunks = b"" if long is None else struct.pack("<4sIQQQI", b"ds64", 28, 0, long, 0, 0)
    chunks += struct.pack(f"{order}4sI", b"fmt ", len(form)) + form
    chunks += struct.pack(f"{order}4sI", b"data", len(data) if length is None else length) + data + behind
    return struct.pack(f"{order}4sI4s", kind, len(chunks) + 4 if total is None else total, b"WAVE") + chunks


def assert_is_the_record(path: Path) -> tuple[str, ...]:
    """Assert that a file holds both tracks; return its notes."""
    raw = read_raw(path)
    for column, stored in zip(raw.columns, TRACKS.T, strict=True):
        np.testing.assert_array_equal(column.values, stored / 2.0**15)
        np.testing.assert_array_equal(column.time, np.arange(401) / RATE)
    return raw.notes


@pytest.mark.parametrize("length", [0, 0xFFFFFFFF, 0x7FFFF000, 0x80000000, 0x7FFFFFFF - 36])
@pytest.mark.parametrize("total", [None, 0, 36, 0xFFFFFFFF])
@pytest.mark.parametrize("behind", [b"", b"\1", b"\1\2\3"])
def test_a_header_without_a_length_is_read_to_the_end(
    length: int, total: int | None, behind: bytes, tmp_path: Path
) -> None:
    """A recorder that was stopped, programs that write into a pipe; a part of a last sample is left out."""
    path = tmp_path / "x.wav"
    path.write_bytes(wav(length, total=total, behind=behind))
    (note,) = assert_is_the_record(path)
    assert f"its header says {length} bytes of samples" in note
    assert "read to the end of the file, 401 samples a track" in note
    rows = [{"name": "m", "source": "2", "quantity": "sound pressure", "unit": "Pa"}]
    assert gr.read({"file": str(path), "channel": rows}).notes == (note,)


@pytest.mark.parametrize("kind", [b"RIFX", b"RIFF"])
@pytest.mark.parametrize("behind", [b"", b"LIST\4\0\0\0INFO", b"\0", b"\0" * 512])
def test_a_header_that_tells_the_length_is_obeyed(kind: bytes, behind: bytes, tmp_path: Path) -> None:
    path = tmp_path / "x.wav"
    path.write_bytes(wav(kind=kind, behind=behind))
    assert assert_is_the_record(path) == ()


@pytest.mark.parametrize("kind", [b"RF64", b"BW64"])
@pytest.mark.parametrize(("long", "noted"), [(TRACKS.size * 2, False), (0, True), (2**64 - 1, True)])
def test_long_files(kind: bytes, long: int, noted: bool, tmp_path: Path) -> None:
    path = tmp_path / "x.wav"
    path.write_bytes(wav(0xFFFFFFFF, kind=kind, total=0xFFFFFFFF, long=long))
    assert bool(assert_is_the_record(path)) is noted


def test_a_header_that_tells_more_than_there_is(tmp_path: Path) -> None:
    path = tmp_path / "x.wav"
    path.write_bytes(wav()[:-100])
    with pytest.raises(ModelError, match=r"found 1504 bytes of samples; its header says 1604: the file is truncated"):
        gr.read(path)


def test_no_samples_is_told(tmp_path: Path) -> None:
    """A length of zero with another chunk behind it, or nothing."""
    path = tmp_path / "x.wav"
    empty = TRACKS[:0]
    for content in (wav(tracks=empty, behind=b"LIST\4\0\0\0INFO"), wav(tracks=empty), wav()[:36]):
        path.write_bytes(content)
        with pytest.raises(ModelError, match="no samples"):
            gr.read(path)


def test_a_form_that_is_missing_or_damaged(tmp_path: Path) -> None:
    path = tmp_path / "x.wav"
    path.write_bytes(wav().replace(b"fmt ", b"fmx "))
    with pytest.raises(ModelError, match="does not tell the form of its samples"):
        gr.read(path)
    content = bytearray(wav())
    content[22:24] = b"\0\0"  # tracks
    path.write_bytes(bytes(content))
    with pytest.raises(ModelError, match="does not tell the form of its samples"):
        gr.read(path)


def test_the_limit_is_of_what_is_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two bytes become eight, and the times take as much as a track."""
    path = tmp_path / "x.wav"
    path.write_bytes(wav())
    size = 8 * (TRACKS.size + len(TRACKS))
    monkeypatch.setenv("GEARRATTLE_READ_LIMIT", str(size))
    assert_is_the_record(path)
    monkeypatch.setenv("GEARRATTLE_READ_LIMIT", str(size - 1))
    with pytest.raises(ModelError, match="GB of memory"):
        gr.read(path)
