"""Packed numbers, gaps and time axes of HDF5 and netCDF, by hand and by other libraries."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.measured.readers import Raw, Request, read_raw

NAN = float("nan")
UNITS = {"units": "rpm"}


def written(path: Path, stored: Any, attributes: dict[str, Any], time: dict[str, Any] | None = None, **how: Any) -> Raw:
    """Write n and its times, 10 Hz, and read them."""
    with h5py.File(path, "w") as file:
        n = file.create_dataset("n", data=np.asarray(stored), **how)
        times = file.create_dataset("time", data=np.arange(n.shape[0]) * 0.1)
        for item, about in ((n, {**UNITS, **attributes}), (times, time or {"units": "s"})):
            for key, value in about.items():
                item.attrs[key] = value
    return read_raw(path)


@pytest.mark.parametrize(
    ("stored", "attributes", "expected"),
    [
        (
            np.array([0, 50, -32768], "i2"),
            {"scale_factor": 0.01, "add_offset": 100.0, "_FillValue": np.int16(-32768)},
            [100.0, 100.5, NAN],
        ),
        (np.array([1.0, -9999.0, 3.0]), {"missing_value": -9999.0}, [1.0, NAN, 3.0]),
        (np.array([1.0, -9999.0, 3.0]), {"_FillValue": -9999.0}, [1.0, NAN, 3.0]),
        (np.array([1.0, -9999.9, 3.0], "f4"), {"_FillValue": -9999.9}, [1.0, NAN, 3.0]),
        (np.array([1, -1, -2, 3], "i2"), {"missing_value": np.array([-1, -2], "i2")}, [1.0, NAN, NAN, 3.0]),
        (np.array([1, 2, 3, 4], "i2"), {"valid_range": np.array([2, 3], "i2")}, [NAN, 2.0, 3.0, NAN]),
        (np.array([1, 2, 3, 4], "i2"), {"valid_min": np.int16(2)}, [NAN, 2.0, 3.0, 4.0]),
        (np.array([1, 2, 3, 4], "i2"), {"valid_max": np.int16(2)}, [1.0, 2.0, NAN, NAN]),
        (  # the range of stored numbers, since it has their type
            np.array([1, 2, 3, 4], "i2"),
            {"scale_factor": 10.0, "valid_range": np.array([2, 3], "i2")},
            [NAN, 20.0, 30.0, NAN],
        ),
        (  # the range of values, since it has the type of the factor
            np.array([1, 2, 3, 4], "i2"),
            {"scale_factor": 10.0, "valid_range": np.array([15.0, 35.0])},
            [NAN, 20.0, 30.0, NAN],
        ),
        (np.array([1, -1, -2], "i1"), {"_Unsigned": "true", "scale_factor": 2.0}, [2.0, 510.0, 508.0]),
        (np.array([1, -1, 3], "i1"), {"_Unsigned": "true", "_FillValue": np.int8(-1)}, [1.0, NAN, 3.0]),
        (np.array([1.0, 2.0, NAN]), {"scale_factor": np.array([2.0])}, [2.0, 4.0, NAN]),
        (np.array([1.0, 2.0, 3.0]), {"scale_factor": "0.5", "add_offset": np.bytes_("1")}, [1.5, 2.0, 2.5]),
        (np.array([1, 2, 3], ">u8"), {"scale_factor": 0.1}, [0.1, 0.2, 3 * 0.1]),
    ],
)
def test_attributes_of_packed_numbers(
    stored: np.ndarray[Any, Any], attributes: dict[str, Any], expected: list[float], tmp_path: Path
) -> None:
    (column,) = written(tmp_path / "x.h5", stored, attributes).columns
    np.testing.assert_array_equal(column.values, expected)


def test_a_note_says_what_is_scaled(tmp_path: Path) -> None:
    raw = written(tmp_path / "x.h5", np.arange(3, dtype="i2"), {"scale_factor": 0.5})
    assert raw.notes == ("scaled by scale_factor and add_offset of the file: n",)
    assert written(tmp_path / "x.h5", np.arange(3, dtype="i2"), {}).notes == ()


def test_a_gap_is_refused_or_bridged(tmp_path: Path) -> None:
    path = tmp_path / "x.h5"
    written(path, np.array([0, 10, -1, 30, 40, 50], "i2"), {"scale_factor": 0.1, "_FillValue": np.int16(-1)})
    with pytest.raises(ModelError, match="n: found nan at sample 2; samples must be finite numbers"):
        gr.read(path)
    record = gr.read({"file": str(path), "channel": [{"name": "n", "quantity": "speed", "gaps": "bridge"}]})
    np.testing.assert_allclose(record["n"].values, np.arange(6.0) * np.pi / 30.0, rtol=1e-14, atol=1e-300)


@pytest.mark.parametrize(("key", "value"), [("scale_factor", 0.0), ("scale_factor", "x"), ("add_offset", NAN)])
def test_a_factor_that_cannot_be_read_is_refused(key: str, value: Any, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=rf"x\.h5: n: {key}: .*must be a finite number"):
        written(tmp_path / "x.h5", np.arange(3, dtype="i2"), {key: value})


@pytest.mark.parametrize(
    ("unit", "factor"),
    [("s", 1.0), ("ms", 1e-3), ("seconds", 1.0), ("seconds since 2026-03-01 08:15:00", 1.0),
     ("milliseconds since 2026-03-01", 1e-3), ("hours since 1970-01-01T00:00:00Z", 3600.0)],
)  # fmt: skip
def test_units_of_the_times(unit: str, factor: float, tmp_path: Path) -> None:
    (column,) = written(tmp_path / "x.h5", np.arange(5.0), {}, {"units": unit}).columns
    np.testing.assert_allclose(column.time, np.arange(5) * 0.1 * factor, rtol=1e-15)


def test_packed_times(tmp_path: Path) -> None:
    raw = written(tmp_path / "x.h5", np.arange(5.0), {}, {"units": "ms", "scale_factor": 20.0, "add_offset": 4.0})
    np.testing.assert_allclose(raw.columns[0].time, np.arange(5) * 2e-3 + 4e-3, rtol=1e-15)


def test_times_in_whole_nanoseconds_since_1970_keep_their_digits(tmp_path: Path) -> None:
    """A double in these units is 256 ns coarse; two axes keep their distance."""
    path = tmp_path / "x.h5"
    first = 1_772_352_900_000_000_001
    unit = "nanoseconds since 1970-01-01"
    with h5py.File(path, "w") as file:
        for group, begin in (("a", first), ("b", first + 1_000_000_007)):
            file[f"{group}/time"] = begin + np.arange(50, dtype="i8") * 22_676
            file[f"{group}/time"].attrs["units"] = unit
            file[f"{group}/n"] = np.arange(50.0)
    raw = read_raw(path)
    for column, begin in zip(raw.columns, (0, 1_000_000_007), strict=True):
        np.testing.assert_array_equal(column.time, (begin + np.arange(50) * 22_676.0) * 1e-9)
    assert raw.notes == (f"times count from {first} {unit}",)


@pytest.mark.parametrize(
    ("name", "about", "is_time"),
    [
        ("time", {}, True),
        ("time_axis", {}, True),
        ("x", {"units": "ms"}, True),
        ("x", {"axis": "T"}, True),
        ("x", {"standard_name": "time"}, True),
        ("x", {}, False),
        ("frequency", {}, False),
        ("frequency", {"units": "Hz"}, False),
        ("angle", {"units": "deg"}, False),
    ],
)
def test_a_dimension_scale_is_the_axis_if_it_is_of_times(
    name: str, about: dict[str, str], is_time: bool, tmp_path: Path
) -> None:
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as file:
        file["n"], file[name] = np.arange(5.0), np.arange(5.0) * 0.1
        file[name].make_scale(name)
        file["n"].dims[0].attach_scale(file[name])
        file[name].attrs.update(about)
    if is_time:
        (column,) = read_raw(path).columns
        factor = 1e-3 if about.get("units") == "ms" else 1.0
        np.testing.assert_allclose(column.time, np.arange(5) * 0.1 * factor, rtol=1e-15)
        return
    with pytest.raises(ModelError, match="no column of as many times"):
        read_raw(path)
    (column,) = read_raw(path, Request(time=name, time_unit="s")).columns
    np.testing.assert_array_equal(column.time, np.arange(5) * 0.1)


def test_a_delay_beside_the_times_is_a_signal(tmp_path: Path) -> None:
    """Also one that ascends; and a temperature called t."""
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as file:
        for name, unit, values in (
            ("delay", "ms", np.arange(5.0)),
            ("t", "degC", np.full(5, 20.0)),
            ("time", "s", np.arange(5) * 0.1),
            ("n", "rpm", np.arange(5.0)),
        ):
            file[name] = values
            file[name].attrs["units"] = unit
    columns = {c.name: c for c in read_raw(path).columns}
    assert set(columns) == {"delay", "t", "n"}
    for column in columns.values():
        np.testing.assert_array_equal(column.time, np.arange(5) * 0.1)


def test_without_a_name_the_times_are_what_ascends(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("delay [ms], clock [ms], n [rpm]\n5, 0, 1\n4, 10, 2\n5, 20, 3\n")
    record = gr.read(path)
    assert record.names == ("delay", "n")
    np.testing.assert_allclose(record.time, [0.0, 0.01, 0.02], rtol=1e-15)


def test_netcdf_of_xarray(tmp_path: Path) -> None:
    """Whole numbers with a factor, a gap and times since a date, as xarray packs them."""
    path = tmp_path / "x.nc"
    begin = np.datetime64("2026-03-01T08:15:00.250", "ns")
    times = begin + np.arange(500) * np.timedelta64(500_000, "ns")
    speed = 1500.0 + np.round(np.sin(np.arange(500.0)), 2)
    speed[7] = np.nan
    packing = {"dtype": "int16", "scale_factor": 0.01, "add_offset": 1500.0, "_FillValue": -32768}
    data = xr.Dataset({"n": ("time", speed, {"units": "rpm"})}, {"time": times})
    units = ("microseconds since 2026-03-01T08:15:00.250", "seconds since 2026-03-01")
    for encoding in ({}, {"units": units[0]}, {"units": units[1], "dtype": "float64"}):
        data.to_netcdf(path, engine="h5netcdf", encoding={"n": packing, "time": encoding})
        (column,) = read_raw(path).columns
        assert column.time is not None
        np.testing.assert_allclose(column.values, speed, rtol=1e-15)
        np.testing.assert_allclose(np.diff(column.time), 5e-4, atol=2e-11)  # of 30 000 s, in doubles


def test_what_netcdf_never_wrote_is_a_gap(tmp_path: Path) -> None:
    """Its own fill value, and a dimension without a variable, which is stored as a scale of zeros."""
    path = tmp_path / "x.nc"
    with h5py.File(path, "w") as file:
        file["time"] = np.arange(5) * 0.1
        file.create_dataset("n", (5,), "f8", fillvalue=9.969209968386869e36)[:3] = [1.0, 2.0, 3.0]
        scale = file.create_dataset("samples", (5,), "f4")
        scale.make_scale("This is a netCDF dimension but not a netCDF variable.         5")
        file["n"].dims[0].attach_scale(scale)
    (column,) = read_raw(path).columns
    np.testing.assert_array_equal(column.values, [1.0, 2.0, 3.0, NAN, NAN])
    np.testing.assert_array_equal(column.time, np.arange(5) * 0.1)


@pytest.mark.parametrize("kind", ["i1", "u1", ">i2", "u2", "i4", "u4", "i8", "u8", "f2", "f4", ">f8"])
@pytest.mark.parametrize("shape", [(5000,), (5000, 3), (3, 5000), (1, 5000), (5000, 1)])
@pytest.mark.parametrize("how", [{}, {"chunks": True, "compression": "gzip"}])
def test_every_type_and_shape_of_numbers(
    kind: str, shape: tuple[int, ...], how: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In pieces that do not divide them, chunks that do not fit the pieces."""
    for module in ("hdf5", "packing"):
        monkeypatch.setattr(f"gearrattle.measured.readers.{module}.PIECE", 700)
    numbers = np.random.default_rng(3).integers(0, 120, shape).astype(kind)
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["time"] = np.arange(5000.0)
        file.create_dataset("m", data=numbers, **how)
        file["m"].attrs["scale_factor"] = 0.25
    table = numbers.reshape(5000, -1) if shape[0] != 3 else numbers.T
    columns = read_raw(tmp_path / "x.h5").columns
    assert len(columns) == table.shape[1]
    for column, values in zip(columns, table.T, strict=True):
        np.testing.assert_array_equal(column.values, 0.25 * values.astype(float))


def test_numbers_with_names_are_read(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["time"] = np.arange(3.0)
        file.create_dataset("gear", data=[1, 2, 2], dtype=h5py.enum_dtype({"first": 1, "second": 2}, "i1"))
    (column,) = read_raw(tmp_path / "x.h5").columns
    np.testing.assert_array_equal(column.values, [1.0, 2.0, 2.0])


def test_only_what_is_asked_for_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A limit for two of eleven vectors is enough for one channel and its times."""
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as file:
        file["time"] = np.arange(1000.0)
        for k in range(10):
            file[f"n{k}"] = np.full(1000, float(k))
    monkeypatch.setenv("GEARRATTLE_READ_LIMIT", "17e3")
    with pytest.raises(ModelError, match=r"would take 8\.8e-05 GB"):
        gr.read(path)
    record = gr.read({"file": str(path), "channel": [{"name": "n", "source": "n7", "quantity": "pulses"}]})
    assert record["n"].values[0] == 7.0
