"""Four questions to every reader: what is my axis, what is its unit, which values count, are they scaled?

A cell of the table is one case: a file, and what must come of it. The answers in words stand beside the readers.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat, wavfile

import gearrattle as gr
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
