"""Four questions to every reader: what is my axis, what is its unit, which values count, are they scaled?

A cell of the table is one case: a file, and what must come of it. The answers in words stand beside the readers.
"""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import netcdf_file, savemat, wavfile

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.measured.readers import ANSWERS, READERS, Column, read_raw
from gearrattle.measured.readers.reader_answers import Answers
from tests.architecture.places import DOCS
from tests.fuzz.targets import SMALL

T = np.arange(5) * 0.01
X = np.array([3.0, 1.0, 4.0, 1.0, 5.0])
GAP = np.array([3.0, 1.0, np.nan, 1.0, 5.0])
Case = Callable[[Path], tuple[Column, Any, Any]]
CASES: dict[tuple[str, str], Case] = {}


def case(reader: str, question: str) -> Callable[[Case], Case]:
    """Enter a case: it returns a column that was read, and the times and values that it must have."""

    def enter(function: Case) -> Case:
        assert (reader, question) not in CASES
        CASES[reader, question] = function
        return function

    return enter


def named(path: Path, name: str) -> Column:
    """Read a file, and return one column."""
    return next(column for column in read_raw(path).columns if column.name == name)


def hdf5(path: Path, n: dict[str, Any], time: dict[str, Any], stored: Any = X) -> Column:
    """Write n and its times with attributes, and read n."""
    with h5py.File(path, "w") as file:
        for name, values, about in (("n", stored, n), ("time", T, time)):
            file[name] = values
            file[name].attrs.update(about)
    return named(path, "n")


@case("hdf5", "axis")
def hdf5_axis(path: Path) -> tuple[Column, Any, Any]:
    with h5py.File(path, "w") as file:
        file["n"], file["angle"], file["clock"] = X, 10.0 * T, T
        for name, unit in (("angle", "deg"), ("clock", "s")):
            file[name].make_scale(name)
            file[name].attrs["units"] = unit
    return named(path, "n"), T, X


@case("hdf5", "unit")
def hdf5_unit(path: Path) -> tuple[Column, Any, Any]:
    return hdf5(path, {}, {"units": "milliseconds since 2026-03-01"}), 1e-3 * T, X


@case("hdf5", "counts")
def hdf5_counts(path: Path) -> tuple[Column, Any, Any]:
    return hdf5(path, {"_FillValue": 4.0}, {}), T, GAP


@case("hdf5", "scaled")
def hdf5_scaled(path: Path) -> tuple[Column, Any, Any]:
    return hdf5(path, {"scale_factor": 0.5, "add_offset": 2.0}, {}), T, 0.5 * X + 2.0


@case("mat", "axis")
def mat_axis(path: Path) -> tuple[Column, Any, Any]:
    savemat(path, {"A": X, "Tstart": -1.0, "Tinterval": 0.01, "Length": 5.0})
    return named(path, "A"), T - 1.0, X


@case("mat", "unit")
def mat_unit(path: Path) -> tuple[Column, Any, Any]:
    savemat(path, {"rec": {"X": {"Data": T, "Unit": "ms"}, "Y": {"Data": X, "Name": "n"}}})
    return named(path, "n"), 1e-3 * T, X


@case("mat", "counts")
def mat_counts(path: Path) -> tuple[Column, Any, Any]:
    savemat(path, {"t": T, "n": GAP})
    return named(path, "n"), T, GAP


@case("mat", "scaled")
def mat_scaled(path: Path) -> tuple[Column, Any, Any]:
    savemat(path, {"t": T, "n": X.astype("i2")})
    return named(path, "n"), T, X


def netcdf3(path: Path, values: Any, unit: str = "s", clock: str = "time", **about: Any) -> Column:
    """Write n over a dimension with the variable of its times, and another vector that ascends; read n."""
    with netcdf_file(path, "w") as file:
        file.createDimension(clock, T.size)
        for name, numbers, attributes in (
            ("n", np.asarray(values), about),
            (clock, T, {"units": unit}),
            ("s", 3 * T, {"units": "s"}),
        ):
            variable = file.createVariable(name, numbers.dtype.newbyteorder(">"), (clock,))
            variable[:] = numbers
            for key, value in attributes.items():
                setattr(variable, key, value)
    return named(path, "n")


@case("netcdf3", "axis")
def netcdf3_axis(path: Path) -> tuple[Column, Any, Any]:
    return netcdf3(path, X), T, X


@case("netcdf3", "unit")
def netcdf3_unit(path: Path) -> tuple[Column, Any, Any]:
    return netcdf3(path, X, unit="milliseconds since 2026-03-01"), 1e-3 * T, X


@case("netcdf3", "counts")
def netcdf3_counts(path: Path) -> tuple[Column, Any, Any]:
    return netcdf3(path, np.where(np.isnan(GAP), 9.969209968386869e36, GAP)), T, GAP


@case("netcdf3", "scaled")
def netcdf3_scaled(path: Path) -> tuple[Column, Any, Any]:
    return netcdf3(path, X.astype("i2"), scale_factor=0.5, add_offset=2.0), T, 0.5 * X + 2.0


def tdms(path: Path, values: Any, times: Any = None, **about: Any) -> Column:
    """Write n with its properties, and with a channel of times where there is one; read n."""
    nptdms = pytest.importorskip("nptdms")
    objects = [nptdms.ChannelObject("rig", "n", np.asarray(values), about)]
    if times is not None:
        objects.append(nptdms.ChannelObject("rig", "t", times, {"unit_string": "ms"}))
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(objects)
    return named(path, "n")


@case("tdms", "axis")
def tdms_axis(path: Path) -> tuple[Column, Any, Any]:
    return tdms(path, X, 1e6 * T, wf_increment=0.01, wf_start_offset=0.25), 0.25 + T, X


@case("tdms", "unit")
def tdms_unit(path: Path) -> tuple[Column, Any, Any]:
    return tdms(path, X, T), 1e-3 * T, X


@case("tdms", "counts")
def tdms_counts(path: Path) -> tuple[Column, Any, Any]:
    return tdms(path, GAP, wf_increment=0.01), T, GAP


@case("tdms", "scaled")
def tdms_scaled(path: Path) -> tuple[Column, Any, Any]:
    linear = {
        "NI_Number_Of_Scales": 1,
        "NI_Scale[0]_Scale_Type": "Linear",
        "NI_Scale[0]_Linear_Slope": 0.5,
        "NI_Scale[0]_Linear_Y_Intercept": -3.0,
        "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
    }
    return tdms(path, X.astype("i2"), wf_increment=0.01, **linear), T, 0.5 * X - 3.0


def xlsx(path: Path, rows: list[list[Any]]) -> Column:
    """Write a sheet, and read n."""
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in rows:
        book.active.append(row)
    book.save(path)
    return named(path, "n")


@case("xlsx", "axis")
def xlsx_axis(path: Path) -> tuple[Column, Any, Any]:
    stamps = [datetime.datetime(2026, 3, 1, 8, 15, 0, 10_000 * k) for k in range(5)]
    rows = [list(pair) for pair in zip(stamps, X.tolist(), strict=True)]
    return xlsx(path, [["rig 3"], [], ["clock", "n"], *rows]), T, X


@case("xlsx", "unit")
def xlsx_unit(path: Path) -> tuple[Column, Any, Any]:
    rows = [list(pair) for pair in zip(T.tolist(), X.tolist(), strict=True)]
    return xlsx(path, [["clock", "n"], ["ms", "rpm"], *rows]), 1e-3 * T, X


@case("xlsx", "counts")
def xlsx_counts(path: Path) -> tuple[Column, Any, Any]:
    rows = [list(pair) for pair in zip(T.tolist(), [3, 1, "#N/A", 1, 5], strict=True)]
    return xlsx(path, [["t [s]", "n [rpm]"], *rows]), T, GAP


@case("xlsx", "scaled")
def xlsx_scaled(path: Path) -> tuple[Column, Any, Any]:
    rows = [list(pair) for pair in zip(T.tolist(), X.tolist(), strict=True)]
    return xlsx(path, [["t [s]", "n [krpm]"], *rows]), T, X


def lvm(
    path: Path, rows: list[str], columns: str = "One", *, x: str = "Time", samples: int = 5, interval: str = ""
) -> Column:
    """Write a segment of one channel with decimal commas, and read n."""
    head = ["LabVIEW Measurement\t", "Separator\tTab", "Decimal_Separator\t,", f"X_Columns\t{columns}"]
    about = ["Channels\t1\t", f"Samples\t{samples}\t", "Y_Unit_Label\trpm\t", f"X_Dimension\t{x}\t"]
    about += ["X0\t0,25\t", f"Delta_X\t{interval}\t"] if interval else []
    end = "***End_of_Header***\t"
    path.write_text("\n".join([*head, end, "\t", *about, end, "X_Value\tn\tComment", *rows, ""]))
    return named(path, "n")


def lvm_rows(times: Any, values: Any) -> list[str]:
    """Return rows of times and values, empty where there is none."""
    entries = [
        ["" if np.isnan(number) else repr(float(number)).replace(".", ",") for number in row] for row in (times, values)
    ]
    return ["\t".join(pair) + "\t" for pair in zip(*entries, strict=True)]


@case("lvm", "axis")
def lvm_axis(path: Path) -> tuple[Column, Any, Any]:
    return lvm(path, lvm_rows(np.full(5, np.nan), X), "No", interval="0,01"), 0.25 + T, X


@case("lvm", "unit")
def lvm_unit(path: Path) -> tuple[Column, Any, Any]:
    lvm(path, lvm_rows(T, X))
    with pytest.raises(ModelError, match="is sampled over Frequency, not over time"):
        lvm(path.with_name("y.lvm"), lvm_rows(T, X), x="Frequency")
    return named(path, "n"), T, X


@case("lvm", "counts")
def lvm_counts(path: Path) -> tuple[Column, Any, Any]:
    return lvm(path, lvm_rows(T, GAP), samples=4), T[:4], GAP[:4]


@case("lvm", "scaled")
def lvm_scaled(path: Path) -> tuple[Column, Any, Any]:
    return lvm(path, lvm_rows(T, 1e3 * X)), T, 1e3 * X


def mdf(path: Path, values: Any, unit: str = "s", **about: Any) -> Column:
    """Write one signal with asammdf, its times in a unit, and read it."""
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(values, T, name="n", unit="rpm", **about)])
        file.groups[0].channels[0].unit = unit
        file.save(path, overwrite=True)
    return named(path, "n")


@case("mdf4", "axis")
def mdf_axis(path: Path) -> tuple[Column, Any, Any]:
    return mdf(path, X), T, X


@case("mdf4", "unit")
def mdf_unit(path: Path) -> tuple[Column, Any, Any]:
    return mdf(path, X, unit="ms"), 1e-3 * T, X


@case("mdf4", "counts")
def mdf_counts(path: Path) -> tuple[Column, Any, Any]:
    return mdf(path, X, invalidation_bits=np.isnan(GAP)), T, GAP


@case("mdf4", "scaled")
def mdf_scaled(path: Path) -> tuple[Column, Any, Any]:
    return mdf(path, X.astype("i2"), conversion={"a": 0.5, "b": -3.0}), T, 0.5 * X - 3.0


@case("wav", "axis")
def wav_axis(path: Path) -> tuple[Column, Any, Any]:
    wavfile.write(path, 100, X)
    return named(path, "1"), T, X


@case("wav", "unit")
def wav_unit(path: Path) -> tuple[Column, Any, Any]:
    wavfile.write(path, 8000, X)
    return named(path, "1"), np.arange(5) / 8000.0, X


@case("wav", "counts")
def wav_counts(path: Path) -> tuple[Column, Any, Any]:
    wavfile.write(path, 100, GAP)
    return named(path, "1"), T, GAP


@case("wav", "scaled")
def wav_scaled(path: Path) -> tuple[Column, Any, Any]:
    wavfile.write(path, 100, X.astype("i2"))
    return named(path, "1"), T, X / 2.0**15


def uff(path: Path, rows: str, unit: str = "s") -> Column:
    """Write a dataset 58 as text, five samples 0.01 apart in a unit of time, and read it."""
    axis = f"{{:10d}}{0:5d}{0:5d}{0:5d} {{:20s}} {{:20s}}"
    lines = ["    -1", "    58", "n", *["NONE"] * 4]
    lines.append(f"{1:5d}{0:10d}{0:5d}{0:10d} {'hub':10s}{1:10d}{6:4d} {'NONE':10s}{0:10d}{0:4d}")
    lines.append(f"{4:10d}{5:10d}{1:10d}{0.25:13.5E}{0.01:13.5E}{0.0:13.5E}")
    lines += [axis.format(17, "Time", unit), axis.format(0, "NONE", "rpm"), *[axis.format(0, "NONE", "NONE")] * 2]
    path.write_text("\n".join([*lines, rows, "    -1", ""]))
    return named(path, "n")


@case("uff", "axis")
def uff_axis(path: Path) -> tuple[Column, Any, Any]:
    return uff(path, "".join(f"{x:20.12E}" for x in X)), T + 0.25, X


@case("uff", "unit")
def uff_unit(path: Path) -> tuple[Column, Any, Any]:
    return uff(path, "".join(f"{x:20.12E}" for x in X), unit="ms"), 1e-3 * (T + 0.25), X


@case("uff", "counts")
def uff_counts(path: Path) -> tuple[Column, Any, Any]:
    return uff(path, "".join(f"{x:20.12E}" for x in X[:4]) + f"\n{X[4]:20.12E}"), T + 0.25, X


@case("uff", "scaled")
def uff_scaled(path: Path) -> tuple[Column, Any, Any]:
    return uff(path, "".join(f"{1e3 * x:20.12E}" for x in X)), T + 0.25, 1e3 * X


def csv(path: Path, head: str, entries: list[str]) -> Column:
    """Write two columns, and read n."""
    path.write_text(head + "".join(f"\n{t!r},{entry}" for t, entry in zip(T.tolist(), entries, strict=True)) + "\n")
    return named(path, "n")


@case("csv", "axis")
def csv_axis(path: Path) -> tuple[Column, Any, Any]:
    return csv(path, "time,n [ms]", [repr(x) for x in X.tolist()]), T, X


@case("csv", "unit")
def csv_unit(path: Path) -> tuple[Column, Any, Any]:
    return csv(path, "clock [ms],n [rpm]", [repr(x) for x in X.tolist()]), 1e-3 * T, X


@case("csv", "counts")
def csv_counts(path: Path) -> tuple[Column, Any, Any]:
    return csv(path, "t [s],n [rpm]", ["3", "1", "", "1", "5"]), T, GAP


@case("csv", "scaled")
def csv_scaled(path: Path) -> tuple[Column, Any, Any]:
    return csv(path, "t [s],n [krpm]", [repr(x) for x in X.tolist()]), T, X


@pytest.mark.parametrize("question", Answers._fields)
@pytest.mark.parametrize("reader", [name for name in READERS if name != "run"])
def test_every_answer(reader: str, question: str, tmp_path: Path) -> None:
    column, times, values = CASES[reader, question](tmp_path / f"x{READERS[reader].SUFFIXES[0]}")
    assert column.time is not None
    np.testing.assert_allclose(column.time, times, rtol=1e-14, atol=1e-17)
    np.testing.assert_allclose(column.values, values, rtol=1e-15)


def test_the_answers_of_a_saved_run(tmp_path: Path) -> None:
    """All four at once: its own variables as they stand."""
    run = gr.simulate(gr.loads(SMALL), cycles=2, audit=False)
    run.save(tmp_path / "run.nc")
    column = named(tmp_path / "run.nc", f"velocity.{run.data['inertia'].values[0]}")
    assert (column.unit, READERS["run"].SUFFIXES) == ("rad/s", (".nc",))
    np.testing.assert_array_equal(column.time, run.data["time"].values)
    np.testing.assert_array_equal(column.values, run.data["velocity"].values[:, 0])


def test_every_reader_answers_the_four_questions() -> None:
    assert list(ANSWERS) == list(READERS)
    assert all(all(answers) for answers in ANSWERS.values())


def test_the_manual_has_the_answers() -> None:
    """A row a reader; the message shows what must stand there."""
    text = (DOCS / "howto" / "measured-data.md").read_text(encoding="utf-8")
    rows = "\n".join(f"| {name} | {' | '.join(answers)} |" for name, answers in ANSWERS.items())
    head = "| format | axis | unit of the axis | values that count | scaling |\n|---|---|---|---|---|\n"
    (table,) = re.findall(re.escape(head) + r"((?:\|.*\n)+)", text)
    assert table == rows + "\n"
