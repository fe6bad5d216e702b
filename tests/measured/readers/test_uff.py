"""Universal files by the letter of the format: what stands along the abscissa, and how many numbers count."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.measured.readers import read_raw

COUNT = 401
VALUES = np.sin(0.1 * np.arange(COUNT))
TIME_S = f"{17:10d}{0:5d}{0:5d}{0:5d} {'Time':20s} {'s':20s}"
NONE = f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'NONE':20s}"


def axis(kind: int, label: str, unit: str) -> str:
    """Return a record of data characteristics."""
    return f"{kind:10d}{0:5d}{0:5d}{0:5d} {label:20s} {unit:20s}"


def head(
    abscissa: str = TIME_S,
    *,
    function: int = 1,
    step: float = 1e-3,
    first: float = 0.0,
    kind: int = 2,
    even: int = 1,
    count: int = COUNT,
    ordinate: str = axis(0, "NONE", "rpm"),
    denominator: str = NONE,
    name: str = "n",
) -> list[str]:
    """Return the eleven lines of header."""
    return [
        name, "NONE", "NONE", "NONE", "NONE",
        f"{function:5d}{0:10d}{0:5d}{0:10d} {'hub':10s}{1:10d}{6:4d} {'NONE':10s}{0:10d}{0:4d}",
        f"{kind:10d}{count:10d}{even:10d}{first:13.5E}{step:13.5E}{0:13.5E}",
        abscissa, ordinate, denominator, NONE,
    ]  # fmt: skip


def as_text(lines: list[str], values: Any = VALUES, fill: str = "") -> bytes:
    """Return a dataset 58, six numbers a line, the last line filled up."""
    words = [f"{value:13.5E}" for value in values]
    while fill and len(words) % 6:
        words.append(fill.rjust(13))
    rows = ["".join(words[at : at + 6]) for at in range(0, len(words), 6)]
    return "\n".join(["    -1", "    58", *lines, *rows, "    -1", ""]).encode()


def as_bytes(lines: list[str], values: Any = VALUES, closing: bytes = b"\n    -1\n", order: str = "<") -> bytes:
    """Return a dataset 58b."""
    data = np.asarray(values, f"{order}f4").tobytes()
    mark = 1 if order == "<" else 2
    first = f"    58b{mark:6d}{2:6d}{11:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    return "\n".join(["    -1", first, *lines, ""]).encode() + data + closing


@pytest.mark.parametrize(
    ("unit", "factor"),
    [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("µs", 1e-6), ("min", 60.0), ("sec", 1.0), ("NONE", 1.0)],
)
@pytest.mark.parametrize("kind", [17, 0])
def test_the_unit_of_the_abscissa_is_obeyed(unit: str, factor: float, kind: int, tmp_path: Path) -> None:
    """Its type says that it is a time, or its unit or its label does."""
    path = tmp_path / "x.uff"
    text = as_text(head(axis(kind, "Time", unit), step=0.25, first=2.0))
    path.write_bytes(text.decode().encode("latin-1"))
    record = gr.read(path)
    np.testing.assert_allclose(record.time, factor * (2.0 + 0.25 * np.arange(COUNT)), rtol=1e-14)
    np.testing.assert_allclose(record["n"].values, VALUES * np.pi / 30.0, atol=1e-6)
    assert record.notes == ("n: taken for a velocity by its unit, rpm",)


@pytest.mark.parametrize("line", ["17 0 0 0 Time ms", "        17    0    0    0  Time                 ms"])
def test_a_record_whose_columns_are_shifted(line: str, tmp_path: Path) -> None:
    path = tmp_path / "x.uff"
    path.write_bytes(as_text(head(line, step=1.0)))
    assert gr.read(path).interval == pytest.approx(1e-3, rel=1e-12)


def test_times_that_are_written_out_have_a_unit_too(tmp_path: Path) -> None:
    path = tmp_path / "x.uff"
    times = np.array([0.0, 1.0, 3.0, 4.0])
    values = np.array([5.0, 6.0, 7.0, 9.0])
    pairs = np.stack([times, values], 1).reshape(-1)
    path.write_bytes(as_text(head(axis(17, "Time", "ms"), even=0, count=4), pairs))
    record = gr.read(path)
    np.testing.assert_allclose(record.time, 1e-3 * times, rtol=1e-15)
    np.testing.assert_allclose(record["n"].values, values * np.pi / 30.0, rtol=1e-15)


@pytest.mark.parametrize("function", [0, 1, 4])
@pytest.mark.parametrize(
    ("abscissa", "words"),
    [
        (axis(18, "Frequency", "Hz"), r"its abscissa is Frequency \[Hz\], a frequency"),
        (axis(19, "RPM", "rpm"), r"its abscissa is RPM \[rpm\], a speed"),
        (axis(20, "Order", "-"), "an order"),
        (axis(8, "Position", "mm"), "of specific data type 8"),
        (axis(17, "Frequency", "Hz"), "no unit of time"),
        (axis(0, "Angle", "deg"), "no unit of time"),
    ],
)
def test_what_is_no_time_is_not_taken_for_one(abscissa: str, words: str, function: int, tmp_path: Path) -> None:
    """Beside a time history it is left out with a note; alone it is refused."""
    path = tmp_path / "x.uff"
    other = as_text(head(abscissa, function=function, name="other"))
    path.write_bytes(other)
    with pytest.raises(ModelError, match=rf"holds no time history.*{words}"):
        gr.read(path)
    path.write_bytes(other + as_text(head()))
    record = gr.read(path)
    assert record.names == ("n",)
    assert record.notes[0].startswith("dataset 1 left out")


def test_functions_of_time_lags_are_no_histories(tmp_path: Path) -> None:
    path = tmp_path / "x.uff"
    path.write_bytes(as_text(head(function=7)))
    with pytest.raises(ModelError, match="auto-correlation"):
        gr.read(path)


def test_an_abscissa_of_which_nothing_is_said_is_noted(tmp_path: Path) -> None:
    path = tmp_path / "x.uff"
    path.write_bytes(as_text(head(NONE)))
    record = gr.read(path)
    assert record.interval == pytest.approx(1e-3)
    assert any("does not say what its abscissa is" in note for note in record.notes)


def test_the_unit_of_a_ratio_is_a_ratio(tmp_path: Path) -> None:
    path = tmp_path / "x.uff"
    path.write_bytes(as_text(head(ordinate=axis(12, "NONE", "m/s^2"), denominator=axis(13, "NONE", "N"))))
    channel = gr.read(path)["n"]
    assert (channel.quantity, channel.unit) == ("", "(m/s^2)/(N)")


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("closing", [b"    -1\n", b"\n    -1\n", b"\r\n    -1\r\n", b"\n\n    -1", b"\n", b""])
def test_a_line_break_may_stand_behind_the_bytes(closing: bytes, order: str, tmp_path: Path) -> None:
    path = tmp_path / "x.uff"
    path.write_bytes(as_bytes(head(), closing=closing, order=order))
    (column,) = read_raw(path).columns
    np.testing.assert_array_equal(column.values, VALUES.astype(np.float32).astype(np.float64))
    if b"-1" not in closing:
        return
    path.write_bytes(as_bytes(head(), closing=closing.rstrip() + b"\n", order=order) + as_text(head(name="m")))
    assert gr.read(path).names == ("n", "m")


@pytest.mark.parametrize("fill", ["0.00000e+00", "1.00000E+00", ""])
def test_the_header_counts_the_numbers(fill: str, tmp_path: Path) -> None:
    """A last line that is filled up holds more."""
    path = tmp_path / "x.uff"
    path.write_bytes(as_text(head(), fill=fill))
    (column,) = read_raw(path).columns
    np.testing.assert_allclose(column.values, VALUES, atol=5e-6)
    said = [note for note in read_raw(path).notes if "behind the 401" in note]
    assert said == (["n: 1 number behind the 401 that the header tells: left out"] if fill else [])


def test_more_lines_than_the_header_counts_are_damage(tmp_path: Path) -> None:
    path = tmp_path / "x.uff"
    path.write_bytes(as_text(head(count=390)))
    with pytest.raises(ModelError, match="its header tells 390 numbers"):
        gr.read(path)


def test_numbers_without_a_blank_between_them(tmp_path: Path) -> None:
    path = tmp_path / "x.uff"
    values = np.array([-1.5e-100, -2.5e-100, 3e10, 4.0, 5.0, 6.0, 7.0])
    words = ["-1.50000E-100", "-2.50000E-100", "  3.00000E+10", *(f"{v:13.5E}" for v in values[3:])]
    text = as_text(head(count=7), []).decode().removesuffix("    -1\n")
    path.write_text(text + "".join(words[:6]) + "\n" + words[6] + "\n    -1\n")
    (column,) = read_raw(path).columns
    np.testing.assert_allclose(column.values, values, rtol=1e-12)


def test_a_dataset_of_one_sample_does_not_hide_the_others(tmp_path: Path) -> None:
    path = tmp_path / "x.uff"
    path.write_bytes(as_text(head(count=1, name="one"), VALUES[:1]) + as_text(head()))
    record = gr.read(path)
    assert record.names == ("n",)
    assert record.notes[0] == "dataset 1 left out: it has 1 sample"
