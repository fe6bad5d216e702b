"""Files of a few kB, or of holes, that unpack to gigabytes or claim them: refused within seconds, at a small peak."""

from __future__ import annotations

import struct
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import netcdf_file

import gearrattle as gr
from gearrattle.errors import ModelError
from tests.measured.readers.test_memory import (
    LONG,
    hdf5_bytes,
    hdf5_chunk,
    hollow,
    packed_structures,
    two_packed_vectors,
)
from tests.measured.readers.test_uff import as_bytes, as_text, head

MOST = 300_000_000
"""Bytes that are resident at most while a bomb is refused; the libraries take half of it."""
SECONDS = 5.0
"""Processor time at most."""


def wav(path: Path, length: int, size: int, tracks: int = 1) -> None:
    form = struct.pack("<HHIIHH", 1, tracks, 8000, 16_000 * tracks, 2 * tracks, 16)
    chunks = struct.pack("<4sI", b"fmt ", 16) + form + struct.pack("<4sI", b"data", length)
    hollow(path, (struct.pack("<4sI4s", b"RIFF", 0xFFFFFFFF, b"WAVE") + chunks, size))


def wav_of_4_gb(path: Path) -> None:
    wav(path, 4_000_000_000, 4_000_000_000)


def wav_without_a_length(path: Path) -> None:
    wav(path, 0xFFFFFFFF, 450_000_000)


def uff_text_that_claims(path: Path) -> None:
    path.write_bytes(as_text(head(count=1_000_000_000)))


def uff_bytes_that_claim(path: Path) -> None:
    path.write_bytes(as_bytes(head(count=1_000_000_000)))


def uff_bytes(path: Path) -> None:
    first = f"    58b{1:6d}{2:6d}{11:12d}{960_000_000:12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    text = "\n".join(["    -1", first, *head(count=240_000_000), ""]).encode()
    hollow(path, (text, 960_000_000), (b"\n    -1\n", 0))


def csv_of_one_line(path: Path) -> None:
    hollow(path, (b"t [s], n [rpm]\n" + b"0.5,1\n" * 12_000, 500_000_000))


def csv_of_a_million_columns(path: Path) -> None:
    names = ",".join(f"a{k}" for k in range(1_000_000))
    row = ",".join(["1"] * 1_000_000)
    path.write_text(f"{names}\n{row}\n{row}\n")


def csv_of_many_columns(path: Path) -> None:
    names = ",".join(f"{k:x}" for k in range(150_000))
    row = ",".join(["1"] * 150_000)
    path.write_text(f"{names}\n{row}\n{row}\n")


def run(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "gearrattle run 2"
        for name in ("time", "angle"):
            file.create_dataset(name, (2 * LONG,), "u1", chunks=(100_000,), compression="gzip")


def mdf(path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    times = np.arange(3_000_000) * 1e-5
    signals = [asammdf.Signal(np.zeros(times.size, "u1"), times, name=f"n{k}") for k in range(50)]
    with asammdf.MDF(version="4.10") as file:
        file.append(signals, common_timebase=True)
        file.save(path, overwrite=True, compression=2)


def tdms_that_claims(path: Path) -> None:
    """A channel of 1e9 samples of a byte each, which would take eight."""
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject("rig", "n", np.zeros(4, "i1"), {"wf_increment": 1e-3})])
    content = path.read_bytes()
    one = content.replace((4).to_bytes(8, "little"), (10**9).to_bytes(8, "little"))
    zeros = 10**9 - 4
    length = len(one) + zeros - 28  # bytes of a segment behind its lead-in
    hollow(path, (one[:12] + length.to_bytes(8, "little") + one[20:], zeros))


def workbook(path: Path, sheet: bytes) -> None:
    """Write a workbook whose sheet is this text."""
    openpyxl = pytest.importorskip("openpyxl")
    openpyxl.Workbook().save(path)
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    parts["xl/worksheets/sheet1.xml"] = sheet
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)


SPACE = b'<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'


def workbook_of_a_long_sheet(path: Path) -> None:
    workbook(path, SPACE + b"<row><c><v>1</v></c></row>" * 40_000_000)


def workbook_of_wide_rows(path: Path) -> None:
    """The last cell of every row alone, of which there are 20 000."""
    rows = "".join(f'<row r="{k}"><c r="XFD{k}"><v>1</v></c></row>' for k in range(1, 20_000))
    workbook(path, SPACE + rows.encode() + b"</sheetData></worksheet>")


def lvm_of_long_rows(path: Path) -> None:
    head = b"LabVIEW Measurement\n***End_of_Header***\nSamples\t1\n***End_of_Header***\nX_Value"
    path.write_bytes(head + b"\tn" * 5000 + b"\n" + b"1\n" * 10_000)


def netcdf3_that_claims(path: Path) -> None:
    with netcdf_file(path, "w", version=2) as file:
        file.createDimension("time", 5)
        for name in ("time", "n"):
            file.createVariable(name, "b", ("time",))[:] = np.arange(5)
    content = path.read_bytes().replace(b"time" + (5).to_bytes(4, "big"), b"time" + (10**9).to_bytes(4, "big"))
    hollow(path, (content, 2_500_000_000))


BOMBS: dict[str, Callable[[Path], None]] = {
    "zlib.mat": two_packed_vectors,
    "structures.mat": packed_structures,
    "chunks.h5": hdf5_bytes,
    "chunk.h5": hdf5_chunk,
    "foreign.nc": hdf5_bytes,
    "run.nc": run,
    "dz.mf4": mdf,
    "claims.tdms": tdms_that_claims,
    "long.xlsx": workbook_of_a_long_sheet,
    "wide.xlsx": workbook_of_wide_rows,
    "rows.lvm": lvm_of_long_rows,
    "claims.nc3": netcdf3_that_claims,
    "long.wav": wav_of_4_gb,
    "open.wav": wav_without_a_length,
    "text.uff": uff_text_that_claims,
    "claims.uff": uff_bytes_that_claim,
    "bytes.uff": uff_bytes,
    "line.csv": csv_of_one_line,
    "million.csv": csv_of_a_million_columns,
    "columns.csv": csv_of_many_columns,
}
PROGRAM = """
import sys, time
import gearrattle as gr
from gearrattle.cli import main
path, mapping = sys.argv[1:]
calls = [lambda: gr.read(path), lambda: gr.measured.look(path), lambda: gr.open_run(path), lambda: gr.read(mapping)]
for call in calls:
    begun = time.process_time()
    try:
        call()
    except gr.ModelError:
        print("refused", time.process_time() - begun)
    else:
        print("read", 0.0)
for words in (["criteria", path], ["metrics", path]):
    begun = time.process_time()
    print("refused" if main(words) == 2 else "not", time.process_time() - begun)
print("peak", open("/proc/self/status").read().split("VmHWM:")[1].split()[0])
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the largest resident size is read from /proc")
@pytest.mark.parametrize("name", BOMBS)
def test_a_bomb_is_refused_quickly_and_small(name: str, tmp_path: Path) -> None:
    """Whoever opens it: ``read``, ``look``, ``open_run``, a mapping, and two commands."""
    path = tmp_path / name
    BOMBS[name](path)
    channel = "".join(f'[[channel]]\nname = "{k}"\nquantity = "pulses"\n' for k in ("n", "t", "1"))
    (tmp_path / "m.toml").write_text(f'schema = 1\nfile = "{name}"\n{channel}')
    words = [sys.executable, "-c", PROGRAM, str(path), str(tmp_path / "m.toml")]
    done = subprocess.run(words, capture_output=True, text=True, check=True, timeout=120)
    *rows, (_, peak) = (line.split() for line in done.stdout.splitlines())
    assert [row[0] for row in rows] == ["refused"] * 6
    assert max(float(row[1]) for row in rows) < SECONDS
    assert 1024 * int(peak) < MOST


def test_times_of_very_different_steps_are_refused_before_a_grid_of_the_shortest(tmp_path: Path) -> None:
    """Five rows would become 1e12 samples of a spline."""
    (tmp_path / "x.csv").write_text("t [s], n [rpm]\n0,1\n1e-12,2\n2e-12,3\n3e-12,1\n1,2\n")
    text = 'schema = 1\nfile = "x.csv"\nrate = "10 Hz"\n[[channel]]\nname = "n"\nquantity = "velocity"\n'
    (tmp_path / "m.toml").write_text(text)
    with pytest.raises(ModelError, match=r"m\.toml.*rate: found steps of very different lengths; would take 2\.4e"):
        gr.read(tmp_path / "m.toml")


def test_netcdf_5_is_called_by_its_name(tmp_path: Path) -> None:
    path = tmp_path / "x.nc"
    path.write_bytes(b"CDF\x05" + bytes(100))
    with pytest.raises(ModelError, match="netCDF of version 5 is not read; netCDF 3 and netCDF-4 are"):
        gr.read(path)


def test_netcdf_3_is_no_damaged_result(tmp_path: Path) -> None:
    path = tmp_path / "x.nc"
    with netcdf_file(path, "w") as file:
        file.createDimension("time", 5)
        file.createVariable("time", "d", ("time",))[:] = np.arange(5.0)
    for reads in (gr.open_run, gr.figures):
        with pytest.raises(ModelError, match="is netCDF 3; results are saved as netCDF-4"):
            reads(path)


def test_a_wav_of_many_tracks_is_read_within_seconds(tmp_path: Path) -> None:
    """Names of channels are looked up, not searched: 32 767 of them took 8 s."""
    path = tmp_path / "x.wav"
    wav(path, 131_068, 131_068, tracks=32_767)
    begun = time.process_time()
    assert len(gr.read(path).channels) == 32_767
    assert time.process_time() - begun < 4.0
