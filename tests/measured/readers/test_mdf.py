"""ASAM MDF: what the axis of a group is, in which unit, and which values count."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.errors import ModelError
from gearrattle.measured.readers import read_raw
from gearrattle.recording import Recording

asammdf = pytest.importorskip("asammdf")

T = np.arange(400) * 1e-3
X = np.sin(40.0 * T)
Y = np.cos(30.0 * T) + 2.0


def _do_nothing(_file: Any) -> None:
    """Leave a file as it is."""


def written(path: Path, change: Callable[[Any], None] = _do_nothing, version: str = "4.10", groups: int = 1) -> Path:
    """Write groups of a speed and a torque, changed before they are saved."""
    with asammdf.MDF(version=version) as file:
        for group in range(groups):
            signals = [
                asammdf.Signal(X, T + group, name=f"n{group}", unit="rpm"),
                asammdf.Signal(Y, T + group, name=f"T{group}", unit="Nm"),
            ]
            file.append(signals, common_timebase=True)
        change(file)
        return Path(file.save(path, overwrite=True))


def master(**values: Any) -> Callable[[Any], None]:
    """Return a change of the master channel of the first group."""

    def change(file: Any) -> None:
        for name, value in values.items():
            setattr(file.groups[0].channels[0], name, value)

    return change


no_master = master(channel_type=0, sync_type=0)


def columns_of(path: Path) -> dict[str, Any]:
    """Return the columns of a file by their names."""
    return {column.name: column for column in read_raw(path).columns}


@pytest.mark.parametrize("version", ["4.10", "4.20", "3.30"])
@pytest.mark.parametrize(("unit", "factor"), [("ms", 1e-3), ("s", 1.0), ("us", 1e-6), ("", 1.0)])
def test_the_unit_of_the_master_is_obeyed(unit: str, factor: float, version: str, tmp_path: Path) -> None:
    def change(file: Any) -> None:
        channel = file.groups[0].channels[0]
        if version.startswith("4"):
            channel.unit = unit
        else:
            channel.conversion.unit = unit

    record = gr.read(written(tmp_path / "x.mf4", change, version))
    np.testing.assert_allclose(record.time, factor * T, rtol=1e-14)


@pytest.mark.parametrize(("kind", "unit", "words"), [(2, "rad", "over an angle"), (3, "m", "over a distance")])
def test_a_master_that_is_no_time_is_told(kind: int, unit: str, words: str, tmp_path: Path) -> None:
    path = written(tmp_path / "x.mf4", master(sync_type=kind, unit=unit, name="phi"))
    with pytest.raises(
        ModelError, match=rf"group 0: found master channel phi \[{unit}\]; is sampled {words}, not over"
    ):
        gr.read(path)
    with pytest.raises(ModelError, match=words):
        gr.read({"file": str(path), "channel": [{"name": "n0", "quantity": "speed"}]})
    two_groups = written(tmp_path / "y.mf4", master(sync_type=kind, unit=unit), groups=2)
    record = gr.read(two_groups)
    assert record.names == ("n1", "T1")
    assert any(note.startswith(f"group 0 left out: is sampled {words}") for note in record.notes)


def test_a_master_of_time_in_another_unit_than_time_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "x.mf4", master(unit="deg"))
    with pytest.raises(ModelError, match=r'group 0: time: found "deg"; has times whose unit is none of time'):
        gr.read(path)


def test_of_two_masters_that_of_time_counts(tmp_path: Path) -> None:
    """The library takes the last one."""

    def change(file: Any) -> None:
        channel = file.groups[0].channels[2]
        channel.channel_type = 2
        channel.sync_type = 2
        channel.unit = "rad"

    record = gr.read(written(tmp_path / "x.mf4", change))
    assert record.names == ("n0", "T0")
    np.testing.assert_allclose(record.time, T, rtol=1e-14)


def test_a_group_without_a_master_is_told_its_rate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path / "x.mf4", no_master)
    with pytest.raises(ModelError, match=r'group 0: has no master channel.*sampled = "10 kHz"'):
        gr.read(path)
    rows = [{"name": "n0", "quantity": "speed"}]
    with pytest.raises(ModelError, match=r'sampled = "10 kHz"'):
        gr.read({"file": str(path), "channel": rows})
    np.testing.assert_allclose(gr.read({"file": str(path), "sampled": "2 kHz", "channel": rows}).time, T / 2.0)
    assert main(["look", str(path)]) == 2
    assert "sampled" in capsys.readouterr().err
    assert main(["look", str(path), "--sampled", "2 kHz"]) == 0
    capsys.readouterr()
    named = gr.read({"file": str(path), "time": "time", "channel": rows})
    np.testing.assert_allclose(named.time, T, rtol=1e-14)
    with pytest.raises(ModelError, match='has no channel "tme" for its times'):
        gr.read({"file": str(path), "time": "tme", "channel": rows})


def test_a_rate_that_has_no_use_is_noted(tmp_path: Path) -> None:
    path = written(tmp_path / "x.mf4", groups=2)
    rows = [{"name": "n0", "quantity": "speed"}]
    record = gr.read({"file": str(path), "sampled": "2 kHz", "channel": rows})
    np.testing.assert_allclose(record.time, T, rtol=1e-14)
    assert any(note.startswith("sampled has no use") for note in record.notes)
    written(path, no_master, groups=2)
    contents = gr.measured.look(path, sampled=500.0).table.set_index("channel")
    assert contents.loc["n0", "rate"] == pytest.approx(500.0)
    assert contents.loc["n1", "rate"] == pytest.approx(1000.0)


def test_values_marked_invalid_are_gaps(tmp_path: Path) -> None:
    """All of a channel by its flag, or one by one by the bits of the records."""

    def change(file: Any) -> None:
        file.groups[0].channels[1].flags |= 1

    path = written(tmp_path / "x.mf4", change)
    columns = columns_of(path)
    assert np.isnan(columns["n0"].values).all()
    np.testing.assert_array_equal(columns["T0"].values, Y)
    with pytest.raises(ModelError, match="n0: found nan at sample 0"):
        gr.read(path)
    with pytest.raises(ModelError, match="found 0 numbers among 400 samples"):
        gr.read({"file": str(path), "channel": [{"name": "n0", "quantity": "speed", "gaps": "bridge"}]})


def test_times_marked_invalid_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "x.mf4", master(flags=1))
    with pytest.raises(ModelError, match="times of n0: found nan at sample 0; must be finite numbers"):
        gr.read(path)


@pytest.mark.parametrize("count", [0, 1])
@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("name", ["m", "n"])
def test_a_group_without_samples_does_not_hide_the_others(name: str, first: bool, count: int, tmp_path: Path) -> None:
    path = tmp_path / "x.mf4"
    short = [asammdf.Signal(np.ones(count), np.ones(count), name=name, unit="Nm")]
    full = [asammdf.Signal(X, T, name="n", unit="rpm")]
    with asammdf.MDF(version="4.10") as file:
        for signals in (short, full) if first else (full, short):
            file.append(signals)
        file.save(path)
    record = gr.read(path)
    called = "n" if name == "m" else f"n[{int(first)}]"
    assert record.names == (called,)
    np.testing.assert_allclose(record[called].values, X * np.pi / 30.0, atol=1e-15)
    assert any(note.startswith("fewer than two samples, left out: ") for note in record.notes)
    assert gr.read({"file": str(path), "channel": [{"name": "w", "source": called, "quantity": "speed"}]}).names == (
        "w",
    )


def test_a_file_of_ours_has_times_and_no_notes(tmp_path: Path) -> None:
    channel = gr.measured.Channel("n", "speed", "hub", "rad/s", X)
    gr.write(Recording(T, (channel,), "rig"), tmp_path / "x.mf4")
    assert gr.read(tmp_path / "x.mf4").notes == ()


@pytest.mark.parametrize("names", [("n", "m"), ("n", "n")])
def test_the_size_is_asked_of_channels_of_every_name(
    names: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also of those that have the number of their group behind their name."""
    path = tmp_path / "x.mf4"
    with asammdf.MDF(version="4.10") as file:
        for name in names:
            file.append([asammdf.Signal(X, T, name=name, unit="rpm")])
        file.save(path)
    monkeypatch.setenv("GEARRATTLE_READ_LIMIT", "3000")
    source = "n" if names[0] != names[1] else "n[0]"
    with pytest.raises(ModelError, match="GB of memory"):
        gr.read({"file": str(path), "channel": [{"name": "w", "source": source, "quantity": "speed"}]})
