"""One rule for memory: what will a file take in double precision, with copies; asked before anything is unpacked."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import time
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

import gearrattle as gr
from gearrattle.errors import ModelError
from tests.measured.readers.test_mat_contents import element, head, version_5

LONG = 112_500_000  # samples that are 0.9 GB in double precision
LIMIT = 140_000_000
COUNT = 5_700_000  # samples: two channels and their times, 46 MB each, are just within the limit
T = np.arange(COUNT) * 1e-5


def declared(name: bytes, kind: int, width: int, count: int) -> bytes:
    """Return what a compressed vector begins with; the rest of it is not in the file."""
    body = head(6, (count, 1), name) + struct.pack("<2I", kind, count * width)
    packed = zlib.compress(struct.pack("<2I", 14, len(body) + count * width) + body)
    return struct.pack("<2I", 15, len(packed)) + packed


def declared_structure(count: int) -> bytes:
    """Return what a compressed structure of two vectors begins with."""
    body = element(6, struct.pack("<2I", 2, 0)) + element(5, struct.pack("<2i", 1, 1)) + element(1, b"rec")
    packed = zlib.compress(struct.pack("<2I", 14, 2 * 8 * count) + body)
    return struct.pack("<2I", 15, len(packed)) + packed


def hollow(path: Path, *pieces: tuple[bytes, int]) -> None:
    """Write bytes, each followed by so many zeros that take no room on the disk."""
    with open(path, "wb") as stream:
        for data, zeros in pieces:
            stream.write(data)
            stream.seek(zeros, 1)
        stream.truncate()


def two_packed_vectors(path: Path) -> None:
    path.write_bytes(version_5() + declared(b"t", 9, 8, LONG) + declared(b"n", 9, 8, LONG))


def packed_bytes(path: Path) -> None:
    """Whole numbers of one byte become eight times as many."""
    path.write_bytes(version_5() + declared(b"t", 2, 1, LONG) + declared(b"n", 2, 1, LONG))


def packed_structures(path: Path) -> None:
    path.write_bytes(version_5() + 2 * declared_structure(LONG // 3))


def plain_bytes(path: Path) -> None:
    parts = [head(9, (LONG, 1), name) + struct.pack("<2I", 2, LONG) for name in (b"t", b"n")]
    first = version_5()
    hollow(path, *((first * (k == 0) + struct.pack("<2I", 14, len(p) + LONG) + p, LONG) for k, p in enumerate(parts)))


def version_4(path: Path) -> None:
    hollow(path, *((struct.pack("<5i", 50, LONG, 1, 0, 2) + name, LONG) for name in (b"t\0", b"n\0")))


def hdf5_bytes(path: Path) -> None:
    with h5py.File(path, "w") as file:
        for name in ("time", "n"):
            file.create_dataset(name, (LONG,), "u1", chunks=(100_000,), compression="gzip")


def hdf5_chunk(path: Path) -> None:
    """The vectors are small; the chunk that they are unpacked from is not."""
    with h5py.File(path, "w") as file:
        file["time"] = np.arange(10.0)
        file.create_dataset("n", (10,), "f8", chunks=(LONG,), maxshape=(None,), compression="gzip")


@pytest.mark.parametrize(
    "make", [two_packed_vectors, packed_bytes, packed_structures, plain_bytes, version_4, hdf5_bytes, hdf5_chunk]
)
def test_what_takes_more_than_the_limit_is_refused_by_its_heads(make: Callable[[Path], None], tmp_path: Path) -> None:
    path = tmp_path / ("x.h5" if "hdf5" in make.__name__ else "x.mat")
    make(path)
    savemat(tmp_path / "small.mat", {"t": np.arange(3.0), "n": np.arange(3.0)})
    gr.read(tmp_path / "small.mat")  # all libraries are loaded
    begun = time.process_time()
    tracemalloc.start()
    try:
        with pytest.raises(ModelError, match="at most 1 GB of a file are read"):
            gr.read(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 10_000_000
    assert time.process_time() - begun < 2.0


def write_files(folder: Path) -> list[str]:
    """Write files of two channels and their times, each just within the limit."""
    packed = np.arange(COUNT, dtype="i4")
    values = {"n": T, "m": 2.0 * T}
    with h5py.File(folder / "plain.h5", "w") as file:
        file["time"] = T
        file["n"] = T
        file["n"].attrs["units"] = "rpm"
        file["time"].attrs["units"] = "ms"
        file["m"] = T.astype("f4")
        file["m"].attrs["scale_factor"] = 0.5
    with h5py.File(folder / "table.h5", "w") as file:
        how = {"chunks": (50_000, 2), "compression": "lzf"}
        file.create_dataset("time", data=T, chunks=(50_000,), compression="lzf")
        file.create_dataset("m", data=np.stack([T, T], 1).astype("f4"), **how)
    savemat(folder / "plain.mat", {"t": T, **values})
    savemat(folder / "packed.mat", {"t": packed, "m": np.zeros((COUNT, 2), "u1")}, do_compression=True)
    savemat(folder / "structure.mat", {"rec": {"t": packed, "m": np.zeros((2, COUNT), "u1")}}, do_compression=True)
    savemat(folder / "four.mat", {"t": T, "n": T.astype("f4"), "m": T}, format="4")
    scope = {"Tstart": 0.0, "Tinterval": 1e-5, "Length": float(COUNT)}
    savemat(folder / "scope.mat", {"A": T.astype("f4"), "B": T, **scope})
    return sorted(path.name for path in folder.iterdir())


PROGRAM = """
import gc, gearrattle, sys
def resident(key):
    return 1024 * int(open("/proc/self/status").read().split(key)[1].split()[0])
for path in sys.argv[1:]:
    gc.collect()  # the record before
    before = resident("VmRSS:")
    with open("/proc/self/clear_refs", "w") as stream:
        stream.write("5")
    record = gearrattle.read(path)
    print(path.rpartition("/")[2], len(record.names), resident("VmHWM:") - before)
    del record
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the largest resident size is read from /proc")
def test_the_largest_resident_size_is_that_which_is_asked_for(tmp_path: Path) -> None:
    """At most 1.2 times the limit for files just within it; two are read before, so that all libraries are loaded."""
    names = write_files(tmp_path)
    paths = [str(tmp_path / name) for name in ("plain.h5", "plain.mat", *names)]
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *paths],
        env={**os.environ, "GEARRATTLE_READ_LIMIT": str(LIMIT)},
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    rows = [line.split() for line in done.stdout.splitlines()][2:]
    assert [row[0] for row in rows] == names
    assert all(row[1] == "2" for row in rows)
    assert {row[0]: int(row[2]) for row in rows if int(row[2]) > 1.2 * LIMIT} == {}
    assert all(int(row[2]) > 0.9 * LIMIT for row in rows)  # the measurement sees the numbers


def test_one_of_many_channels_of_a_mat_file_needs_no_room_for_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "x.mat"
    numbers = {f"n{k}": np.full(1000, float(k)) for k in range(10)}
    monkeypatch.setenv("GEARRATTLE_READ_LIMIT", "17e3")
    for contents in ({"t": np.arange(1000.0), **numbers}, {"t": np.arange(1000.0), **numbers, "one": 1.0}):
        savemat(path, contents, do_compression=True)
        with pytest.raises(ModelError, match=r"would take 8\.8e-05 GB"):
            gr.read(path)
        record = gr.read({"file": str(path), "channel": [{"name": "n", "source": "n7", "quantity": "pulses"}]})
        assert record["n"].values[0] == 7.0
