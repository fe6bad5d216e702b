"""``look``: channels of a measured file, and a mapping that reads it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.errors import ModelError
from tests.measured.readers.rig import rig
from tests.measured.readers.test_round_trips import SUFFIXES


@pytest.mark.parametrize("name", SUFFIXES)
def test_the_mapping_reads_the_file_of_every_format(name: str, tmp_path: Path) -> None:
    path = tmp_path / f"record{SUFFIXES[name]}"
    gr.write(rig(), path)
    contents = gr.measured.look(path)
    assert len(contents.table) == len(rig().channels)
    assert contents.table["rate"].to_numpy() == pytest.approx(1.0 / rig().interval, rel=1e-9)  # type: ignore[operator]
    mapping = tmp_path / "measurement.toml"
    mapping.write_text(contents.mapping(tmp_path), encoding="utf-8")
    known = contents.table[(contents.table.quantity != "") & (contents.table.unit != "")]
    if known.empty:  # WAV says no unit
        assert mapping.read_text(encoding="utf-8").count("# [[channel]]") == len(contents.table)
        return
    record, direct = gr.read(mapping), gr.read(path)
    assert len(record.channels) == len(known)
    for channel, source in zip(record.channels, known.channel, strict=True):
        np.testing.assert_array_equal(channel.values, direct[source].values)


def test_several_rates_are_brought_to_the_highest(tmp_path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    path = tmp_path / "rig.mf4"
    fast, slow = np.arange(4000) / 2000.0, np.arange(200) / 100.0
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(np.sin(20.0 * fast), fast, name="n", unit="rpm")])
        file.append([asammdf.Signal(np.cos(3.0 * slow), slow, name="T oil", unit="Nm")])
        file.save(path)
    with pytest.raises(ModelError, match=r"different times.*gearrattle look"):
        gr.read(path)
    contents = gr.measured.look(path)
    assert contents.table["rate"].to_numpy() == pytest.approx([2000.0, 100.0], rel=1e-12)
    (tmp_path / "m.toml").write_text(contents.mapping(tmp_path), encoding="utf-8")
    record = gr.read(tmp_path / "m.toml")
    assert record.names == ("n", "T_oil")
    assert record.interval == pytest.approx(1 / 2000.0, rel=1e-12)
    inside = (record.time > 0.4) & (record.time < 1.6)
    np.testing.assert_allclose(record["T_oil"].values[inside], np.cos(3.0 * record.time[inside]), atol=2e-4)


def test_names_that_are_no_labels_get_one_each(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("t [s];M 1 [Nm];M_1 [Nm];° [Nm]\n0;1;2;3\n1;2;3;4\n2;3;4;5\n3;4;5;6\n", encoding="utf-8")
    (tmp_path / "m.toml").write_text(gr.measured.look(path).mapping(tmp_path), encoding="utf-8")
    assert gr.read(tmp_path / "m.toml").names == ("M_1", "M_1_2", "channel")


def test_a_file_without_times_is_told_its_rate(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("M [Nm];n [rpm]\n1;2\n2;3\n3;4\n4;5\n")
    with pytest.raises(ModelError, match="sampled"):
        gr.measured.look(path)
    contents = gr.measured.look(path, sampled=50.0)
    (tmp_path / "m.toml").write_text(contents.mapping(tmp_path))
    np.testing.assert_allclose(gr.read(tmp_path / "m.toml").time, [0.0, 0.02, 0.04, 0.06], rtol=1e-15)


def test_the_command_prints_the_table_and_keeps_an_old_mapping(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, mapping = tmp_path / "rig.csv", tmp_path / "m.toml"
    path.write_text("t [s];n [rpm];U [V]\n0;1;\n0,5;2;7\n1;4;8\n")
    assert main(["look", str(path), "-o", str(mapping)]) == 0
    printed = capsys.readouterr()
    assert "speed" in printed.out
    assert "decimals are parted by a comma" in printed.err
    before = mapping.read_text()
    assert main(["look", str(path), "-o", str(mapping)]) == 2
    assert "already exists" in capsys.readouterr().err
    assert mapping.read_text() == before
    assert main(["look", str(path), "--json"]) == 0
    channels = json.loads(capsys.readouterr().out)["channels"]
    assert [(c["channel"], c["rate"], c["not_numbers"]) for c in channels] == [("n", 2.0, 0), ("U", 2.0, 1)]
    assert channels[1]["first"] == [None, 7.0, 8.0]


MAPPING = """
schema = 1
file = "rig.csv"
time = "clock"
time_unit = "ms"
[[channel]]
name = "speed"
source = "n"
quantity = "speed"
unit = "rpm"
"""


def test_of_a_mapping_the_file_that_it_names_is_looked_at(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With the times that the mapping tells; what is written from it tells them as well."""
    (tmp_path / "rig.csv").write_text("clock;n\n0;1\n2;2\n4;4\n6;5\n")
    mapping = tmp_path / "m.toml"
    mapping.write_text(MAPPING)
    contents = gr.measured.look(mapping)
    assert list(contents.table["channel"]) == ["n"]
    assert contents.table["rate"].to_numpy() == pytest.approx([500.0])
    assert contents.source.endswith("rig.csv")
    assert contents.notes[0].startswith(f"{mapping} is a mapping: the file that it names is looked at")
    assert 'time_unit = "ms"' in contents.mapping(tmp_path)
    assert main(["look", str(mapping)]) == 0
    assert "is a mapping" in capsys.readouterr().err
    before = mapping.read_text()
    assert main(["look", str(mapping), "-o", str(mapping)]) == 2
    assert mapping.read_text() == before


def test_another_toml_is_no_mapping(tmp_path: Path) -> None:
    (tmp_path / "model.toml").write_text(gr.example("case3").to_toml())
    with pytest.raises(ModelError, match="found a model file; a mapping file is needed"):
        gr.measured.look(tmp_path / "model.toml")
