"""MAT files as instruments and MATLAB write them: objects beside vectors, recorders' structures, version 4."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.measured.readers import format_of, read_raw

T = np.arange(400) * 5e-4
X, Y = np.sin(40.0 * T), np.cos(30.0 * T) + 2.0


def element(kind: int, data: bytes) -> bytes:
    """Return an element of version 5, filled up to eight bytes."""
    return struct.pack("<2I", kind, len(data)) + data + bytes(-len(data) % 8)


def head(flags: int, shape: tuple[int, ...], name: bytes) -> bytes:
    """Return what a matrix begins with."""
    return (
        element(6, struct.pack("<2I", flags, 0)) + element(5, struct.pack(f"<{len(shape)}i", *shape)) + element(1, name)
    )


def vector(name: bytes, values: np.ndarray[Any, Any]) -> bytes:
    """Return a matrix of double precision."""
    return element(14, head(6, (values.size, 1), name) + element(9, values.astype("<f8").tobytes()))


def opaque(name: bytes, kind: bytes) -> bytes:
    """Return an object of MATLAB: flags, name, system of objects, class, and where its content is."""
    content = element(14, head(13, (6, 1), b"") + element(6, struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1)))
    return element(
        14, element(6, struct.pack("<2I", 17, 0)) + element(1, name) + element(1, b"MCOS") + element(1, kind) + content
    )


def version_5(*elements: bytes, packed: bool = False) -> bytes:
    """Return a file."""
    body = [element(15, zlib.compress(one))[: 8 + len(zlib.compress(one))] for one in elements] if packed else elements
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + b"".join(body)


def version_4(name: str, values: np.ndarray[Any, Any], kind: int, form: str) -> bytes:
    """Return a variable of version 4, a column."""
    order = ">" if kind >= 1000 else "<"
    about = struct.pack(f"{order}5i", kind, values.size, 1, 0, len(name) + 1)
    return about + name.encode() + b"\0" + values.astype(order + form).tobytes()


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("name", [b"t2", b"tt", b"tts", b"tabl", b"table", b"log_1", b"a_long_name_of_a_timetable"])
@pytest.mark.parametrize("kind", [b"timetable", b"datetime", b"string"])
def test_vectors_beside_an_object(name: bytes, kind: bytes, packed: bool, tmp_path: Path) -> None:
    """Names of every length, before and behind the vectors, and the nameless variable that holds their content."""
    path = tmp_path / "x.mat"
    content = element(14, head(9, (1, 64), b"") + element(2, bytes(64)))
    path.write_bytes(
        version_5(
            opaque(name, kind), vector(b"t", T), vector(b"n", X), opaque(name + b"_", kind), content, packed=packed
        )
    )
    raw = read_raw(path)
    (column,) = raw.columns
    np.testing.assert_array_equal(column.values, X)
    np.testing.assert_array_equal(column.time, T)
    assert raw.notes[0] == (
        f"{name.decode()} is an object of MATLAB ({kind.decode()}) and is left out: save what it holds as plain vectors"
    )


def test_a_file_of_objects_alone_names_them(tmp_path: Path) -> None:
    path = tmp_path / "x.mat"
    path.write_bytes(version_5(opaque(b"tt", b"timetable")))
    with pytest.raises(
        ModelError, match=r"found tt; holds no vectors of real numbers \(save time and signals as plain"
    ):
        gr.read(path)


@pytest.mark.parametrize("order", [0, 1000])
@pytest.mark.parametrize(("kind", "form"), [(0, "f8"), (10, "f4"), (20, "i4"), (30, "i2"), (40, "u2"), (50, "u1")])
@pytest.mark.parametrize("ending", [".mat", ".bin"])
def test_version_4_whatever_its_first_variable_is(
    kind: int, form: str, order: int, ending: str, tmp_path: Path
) -> None:
    path = tmp_path / f"x{ending}"
    numbers = np.arange(T.size) % 200
    path.write_bytes(version_4("n", numbers, order + kind, form) + version_4("t", T, order, "f8"))
    assert format_of(path) == "mat"
    (column,) = read_raw(path).columns
    np.testing.assert_array_equal(column.values, numbers)
    np.testing.assert_array_equal(column.time, T)


@pytest.mark.parametrize("form", ["f8", "f4"])
def test_version_4_with_first_time_interval_and_length(form: str, tmp_path: Path) -> None:
    """As an oscilloscope writes it: 400 samples at 2 kHz."""
    path = tmp_path / "x.mat"
    kind = {"f8": 0, "f4": 10}[form]
    numbers = {"Tstart": -0.05, "Tinterval": 5e-4, "Length": 400.0}
    clock = b"".join(version_4(name, np.array([x]), kind, form) for name, x in numbers.items())
    path.write_bytes(version_4("A", X, 10, "f4") + version_4("B", Y, 10, "f4") + clock)
    raw = read_raw(path)
    assert [c.name for c in raw.columns] == ["A", "B"]
    for column, values in zip(raw.columns, (X, Y), strict=True):
        np.testing.assert_array_equal(column.values, values.astype("f4"))
        assert column.time is not None
        np.testing.assert_allclose(column.time, -0.05 + np.arange(400) / 2000.0, rtol=0.0, atol=1e-15)
    assert raw.notes == ("times from Tstart and Tinterval: 0.0005 s apart, from -0.05 s",)
    assert gr.read(path).interval == pytest.approx(5e-4, rel=1e-12)
    rows = [{"name": "u", "source": "B", "quantity": "pulses"}]
    assert gr.read({"file": str(path), "channel": rows}).time[0] == -0.05


@pytest.mark.parametrize("packed", [False, True])
def test_first_time_and_interval_in_version_5(packed: bool, tmp_path: Path) -> None:
    """A vector of another length than is told has no times; an interval of zero is refused."""
    path = tmp_path / "x.mat"
    clock = {"Tstart": 0.25, "Tinterval": 0.01, "Length": 400.0}
    savemat(path, {"A": X, **clock}, do_compression=packed)
    assert gr.read(path).time[-1] == pytest.approx(0.25 + 3.99, rel=1e-15)
    savemat(path, {"scope": {"A": X, **clock}}, do_compression=packed)
    assert gr.read(path).time[-1] == pytest.approx(0.25 + 3.99, rel=1e-15)
    savemat(path, {"A": X, **clock, "Length": 399.0}, do_compression=packed)
    with pytest.raises(ModelError, match='no column of as many times belongs to "A"'):
        gr.read(path)
    savemat(path, {"A": X, **clock, "Tinterval": 0.0}, do_compression=packed)
    with pytest.raises(ModelError, match=r"Tinterval: found 0 from 0\.25; Tstart and Tinterval must be times"):
        gr.read(path)


def recorder(**about: Any) -> dict[str, Any]:
    """Return what a recorder saves: one X, and Y an array of structures."""
    series = np.empty((1, 2), dtype=[("Name", object), ("Unit", object), ("Data", object)])
    series[0, 0] = ("n_engine", "rpm", X)
    series[0, 1] = ("T shaft", "N*m", Y)
    return {"rec": {"X": {"Data": T, **about}, "Y": series}}


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("about", [{}, {"Name": "time", "Unit": "s"}, {"Name": "Time"}])
def test_structures_of_a_recorder(packed: bool, about: dict[str, str], tmp_path: Path) -> None:
    path = tmp_path / "x.mat"
    savemat(path, recorder(**about), do_compression=packed)
    raw = read_raw(path)
    assert [(c.name, c.unit) for c in raw.columns] == [("n_engine", "rpm"), ("T shaft", "N*m")]
    for column, values in zip(raw.columns, (X, Y), strict=True):
        np.testing.assert_array_equal(column.values, values)
        np.testing.assert_array_equal(column.time, T)
    assert raw.notes == ("rec.X.Data is taken for the times of the signals beside it",)
    mapped = gr.read({"file": str(path), "channel": [{"name": "T", "source": "T shaft", "quantity": "torque"}]})
    np.testing.assert_array_equal(mapped["T"].values, Y)


def test_an_axis_of_a_recorder_that_is_no_time(tmp_path: Path) -> None:
    path = tmp_path / "x.mat"
    savemat(path, recorder(Unit="ms"))
    np.testing.assert_allclose(read_raw(path).columns[0].time, 1e-3 * T, rtol=1e-15)
    savemat(path, recorder(Name="crank angle"))
    with pytest.raises(ModelError, match="no column of as many times"):
        gr.read(path)
    savemat(path, recorder(Unit="deg"))
    with pytest.raises(ModelError, match=r'rec\.X\.Data: found "deg"'):
        gr.read(path)


def test_two_axes_of_a_recorder(tmp_path: Path) -> None:
    """XIndex says which of two axes of one length holds; names that occur twice tell nothing, so the path stands."""
    path = tmp_path / "x.mat"
    axes = np.empty((1, 2), dtype=[("Data", object)])
    axes[0, 0], axes[0, 1] = (T,), (T + 5.0,)
    series = np.empty((1, 2), dtype=[("Name", object), ("Data", object), ("XIndex", object)])
    series[0, 0], series[0, 1] = ("n", X, 2.0), ("n", Y, 1.0)
    savemat(path, {"rec": {"X": axes, "Y": series}})
    columns = {c.name: c for c in read_raw(path).columns}
    assert set(columns) == {"rec.Y(1).Data", "rec.Y(2).Data"}
    np.testing.assert_array_equal(columns["rec.Y(1).Data"].time, T + 5.0)
    np.testing.assert_array_equal(columns["rec.Y(2).Data"].time, T)


@pytest.mark.parametrize("kind", ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8"])
@pytest.mark.parametrize("shape", [(5000, 3), (3, 5000), (5000, 1), (1, 5000)])
@pytest.mark.parametrize("packed", [False, True])
def test_every_type_and_shape_of_numbers(
    kind: str, shape: tuple[int, int], packed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Tables along either side, read in pieces that do not divide them."""
    monkeypatch.setattr("gearrattle.measured.readers.mat.variables.PIECE", 700)
    numbers = np.random.default_rng(3).integers(0, 120, shape).astype(kind)
    path = tmp_path / "x.mat"
    savemat(path, {"t": np.arange(5000.0), "m": numbers}, do_compression=packed)
    tall = numbers if shape[0] > shape[1] else numbers.T
    columns = read_raw(path).columns
    assert [c.name for c in columns] == (["m"] if 1 in shape else ["m[0]", "m[1]", "m[2]"])
    for column, values in zip(columns, tall.T, strict=True):
        np.testing.assert_array_equal(column.values, values.astype(float))
