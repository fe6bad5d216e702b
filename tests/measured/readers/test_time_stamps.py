"""Dates and clock times as times of a record: seconds from the first, against the calendar of the standard library."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import ModelError

BEGIN = datetime(2026, 3, 1, 8, 15, 0, 250_000, tzinfo=UTC)
STEPS = np.array([0, 1, 2, 3, 59_750, 3_600_000]) / 1000.0
"""Seconds from the first: a minute and an hour are passed."""


def milliseconds(instant: datetime, form: str, mark: str = ".") -> str:
    """Return an instant with three digits of the second."""
    return instant.strftime(form) + f"{mark}{instant.microsecond // 1000:03d}"


def saved(tmp_path: Path, stamps: list[str], head: str = "Zeit;n [rpm]", separator: str = ";") -> Path:
    """Write a table of time stamps and a speed."""
    path = tmp_path / "rig.csv"
    rows = [f"{stamp}{separator}{100 + k}" for k, stamp in enumerate(stamps)]
    path.write_text("\n".join([head, *rows, ""]))
    return path


FORMS = {
    "iso": lambda at: milliseconds(at, "%Y-%m-%dT%H:%M:%S"),
    "iso with a blank": lambda at: milliseconds(at, "%Y-%m-%d %H:%M:%S"),
    "iso with a comma": lambda at: milliseconds(at, "%Y-%m-%d %H:%M:%S", ","),
    "iso of Greenwich": lambda at: milliseconds(at, "%Y-%m-%dT%H:%M:%S") + "Z",
    "iso with a zone": lambda at: milliseconds(at, "%Y-%m-%dT%H:%M:%S") + "+01:00",
    "slashes": lambda at: milliseconds(at, "%Y/%m/%d %H:%M:%S"),
    "German": lambda at: milliseconds(at, "%d.%m.%Y %H:%M:%S", ","),
    "of two digits": lambda at: milliseconds(at, "%d.%m.%y %H:%M:%S"),
    "American": lambda at: milliseconds(at, "%m/%d/%Y %I:%M:%S") + at.strftime(" %p"),
    "British": lambda at: milliseconds(at, "%d/%m/%Y %H:%M:%S"),
    "clock": lambda at: milliseconds(at, "%H:%M:%S"),
    "clock with a comma": lambda at: milliseconds(at, "%H:%M:%S", ","),
    "clock with a colon": lambda at: milliseconds(at, "%H:%M:%S", ":"),
    "clock of twelve hours": lambda at: milliseconds(at, "%I:%M:%S") + at.strftime(" %p"),
    "date and clock": lambda at: milliseconds(at, "%d.%m.%Y;%H:%M:%S", ","),
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    "begin", [BEGIN, BEGIN + timedelta(hours=15, minutes=30), BEGIN.replace(month=12, day=31, hour=23)]
)
def test_time_stamps_count_from_the_first(form: str, begin: datetime, tmp_path: Path) -> None:
    """Some records pass midnight, one of them New Year."""
    stamps = [FORMS[form](begin + timedelta(seconds=step)) for step in STEPS.tolist()]
    head = "Datum;Zeit;n [rpm]" if form == "date and clock" else "Zeit;n [rpm]"
    record = gr.read(saved(tmp_path, stamps, head))
    np.testing.assert_allclose(record.time, STEPS, rtol=0, atol=1e-12)
    np.testing.assert_allclose(record["n"].values * 30.0 / np.pi, 100.0 + np.arange(STEPS.size), rtol=1e-14)
    assert record.names == ("n",)
    first = stamps[0].replace(";", " ")
    assert f"Zeit: time stamps, taken as s from the first, {first}" in record.notes
    passes = "clock" in form and form != "date and clock" and (begin + timedelta(hours=1)).date() != begin.date()
    assert any("passes midnight 1 time;" in note for note in record.notes) is passes


def test_a_change_of_the_zone_is_no_jump(tmp_path: Path) -> None:
    """The clocks go back by an hour."""
    zones = [timezone(timedelta(hours=2)), timezone(timedelta(hours=1))]
    begin = datetime(2026, 10, 25, 2, 59, 59, tzinfo=zones[0])
    stamps = [(begin + timedelta(seconds=k)).astimezone(zones[k > 0]).isoformat() for k in range(4)]
    assert stamps[1] == "2026-10-25T02:00:00+01:00"
    np.testing.assert_allclose(gr.read(saved(tmp_path, stamps)).time, np.arange(4.0), atol=1e-12)


def test_nanoseconds_are_kept(tmp_path: Path) -> None:
    stamps = [f"2026-03-01T08:15:00.{k * 1001:09d}" for k in range(9)]
    record = gr.read(saved(tmp_path, stamps))
    np.testing.assert_allclose(record.time, np.arange(9) * 1.001e-6, rtol=1e-14)
    assert record.interval == pytest.approx(1.001e-6, rel=1e-12)


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("quote", ["", '"'])
def test_stamps_in_every_kind_of_table(separator: str, quote: str, tmp_path: Path) -> None:
    """In quotes the fraction may have a comma where commas part columns."""
    mark = "," if quote else "."
    number = "100,5" if quote else "100.5"
    rows = [f"{quote}08:15:00{mark}{k:03d}{quote}{separator}{quote}{number}{quote}" for k in range(4)]
    path = tmp_path / "rig.csv"
    path.write_text("\n".join([separator.join(["Zeit [hh:mm:ss]", "n [rpm]"]), *rows, ""]))
    record = gr.read(path)
    np.testing.assert_allclose(record.time, np.arange(4) * 1e-3, rtol=1e-14)
    np.testing.assert_allclose(record["n"].values * 30.0 / np.pi, 100.5, rtol=1e-14)


def test_decimal_commas_beside_stamps_with_points(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("Zeit;n [rpm]\n" + "".join(f"01.03.2026 08:15:00.{k:03d};100,{k}\n" for k in range(4)))
    record = gr.read(path)
    np.testing.assert_allclose(record.time, np.arange(4) * 1e-3, rtol=1e-14)
    np.testing.assert_allclose(record["n"].values * 30.0 / np.pi, 100.0 + 0.1 * np.arange(4), rtol=1e-14)


def test_times_in_s_beside_stamps_are_finer(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("Stamp;t [s];n [rpm]\n" + "".join(f"08:15:00;0.00{k};{k}\n" for k in range(4)))
    record = gr.read(path)
    assert record.names == ("n",)
    np.testing.assert_allclose(record.time, np.arange(4) * 1e-3, rtol=1e-14)


def test_a_mapping_names_the_stamps(tmp_path: Path) -> None:
    path = saved(tmp_path, [f"2026-03-01T08:15:0{k}" for k in range(5)], "when;n [rpm]")
    rows = [{"name": "n", "quantity": "speed"}]
    for time in ({}, {"time": "when"}, {"time": "when", "time_unit": "ms"}):
        np.testing.assert_allclose(gr.read({"file": str(path), "channel": rows, **time}).time, np.arange(5.0))


@pytest.mark.parametrize(
    ("stamps", "words"),
    [
        (["08:15:00", "08:15:01", "8.15"], r'rig.csv:4: Zeit: found "8.15"; must be a time stamp like the first'),
        (["08:15:00", "2026-03-01T08:15:01"], "rig.csv:3: Zeit: .*must be a time stamp like the first, 08:15:00"),
        (["08:15:02", "08:15:01", "08:15:03"], "times of n: found -1 s at sample 1; must ascend"),
        (["08:15:00", "", "08:15:02"], 'rig.csv:3: Zeit: found ""; must be a time stamp'),
    ],
)
def test_stamps_that_are_wrong_are_told_with_their_line(stamps: list[str], words: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=words):
        gr.read(saved(tmp_path, stamps))


def test_a_date_above_the_names_is_no_time_stamp(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("Start;2026-02-01;08:15:00\nt [s];n [rpm];M [Nm]\n0;1;2\n1;2;3\n")
    record = gr.read(path)
    assert record.names == ("n", "M")
    assert record.notes[0] == "line 1 above the names: left out"


def test_a_torque_of_a_model_may_have_time_stamps(tmp_path: Path) -> None:
    path = tmp_path / "torque.csv"
    path.write_text("Zeit;M [N*m]\n23:59:59,5;1,5\n00:00:00,0;2,5\n00:00:00,5;3,5\n00:00:01,0;4,5\n")
    (tmp_path / "model.toml").write_text(
        'schema = 1\nexcitation.speed = 1.0\n[[inertia]]\nname = "a"\nJ = 1.0\n'
        '[[coupling]]\nname = "k"\nbetween = ["a", "ground"]\nstiffness = 4.0\n'
        '[[torque]]\non = "a"\nsignal = { file = "torque.csv", time = "Zeit", value = "M" }\n'
    )
    signal = gr.load(tmp_path / "model.toml").torques[0].signal
    assert signal is not None
    np.testing.assert_array_equal(signal.time, [0.0, 0.5, 1.0, 1.5])
    np.testing.assert_array_equal(signal.value, [1.5, 2.5, 3.5, 4.5])
