"""CSV as measuring systems write it: decimal commas, Latin-1, rows of units, lines above the names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import ModelError

TIME = np.array([0.0, 0.001, 0.002, 0.003])
SPEED = np.array([800.0, 801.5, 803.0, -12.5])
ANGLE = np.array([0.25, 0.5, 0.75, 1e-3])


def table(separator: str, decimal: str, head: str) -> str:
    """Return a table of time, speed and angle below a head."""
    rows = (
        separator.join(f"{value:.9g}".replace(".", decimal) for value in row)
        for row in zip(TIME, SPEED, ANGLE, strict=True)
    )
    return "\n".join([head, *rows, ""])


def assert_is_the_record(path: Path) -> gr.measured.Recording:
    """Assert that a file says what ``table`` wrote."""
    record = gr.read(path)
    np.testing.assert_allclose(record.time, TIME, rtol=1e-15)
    np.testing.assert_allclose(record["n"].values, SPEED * np.pi / 30.0, rtol=1e-14)
    np.testing.assert_allclose(record["phi"].values, np.radians(ANGLE), rtol=1e-14)
    return record


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16"])
@pytest.mark.parametrize(("separator", "decimal"), [(";", ","), (";", "."), ("\t", ","), (",", ".")])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_separator_decimal_and_encoding_are_told_by_content(
    separator: str, decimal: str, encoding: str, end: str, tmp_path: Path
) -> None:
    path = tmp_path / "rig.csv"
    text = table(separator, decimal, separator.join(["t [s]", "n [1/min]", "phi [°]"]))
    path.write_bytes(text.replace("\n", end).encode(encoding))
    notes = assert_is_the_record(path).notes
    assert ("decimals are parted by a comma" in notes) == (decimal == ",")
    assert any("Windows-1252" in note for note in notes) == (encoding == "latin-1")


@pytest.mark.parametrize(
    "head",
    [
        "t;n;phi\ns;1/min;°",
        "t;n;phi\n[s];[1/min];[°]",
        '"t";"n";"phi"\n"s";"U/min";"deg"',
        "Prüfstand 5\nDatum;2026-02-01\nt;n;phi\ns;1/min;°",
        "Prüfstand 5;;\nOperator;N. N.;\nt (s);n (1/min);phi (°)",
        "# comment\n\nt [s];n [rpm];phi [deg]",
    ],
)
def test_names_and_units_stand_above_the_numbers(head: str, tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_bytes(table(";", ",", head).encode("latin-1"))
    assert_is_the_record(path)


def test_a_number_in_parentheses_belongs_to_the_name(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("t [s], x(2)\n0, 1\n1, 2\n")
    assert gr.read(path).names == ("x(2)",)


def test_a_comma_after_rows_of_whole_numbers_is_found(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    rows = [f"{k};{k}" for k in range(500)] + ["500;0,5"]
    path.write_text("\n".join(["t [s];n [rpm]", *rows]))
    assert gr.read(path)["n"].values[-1] == pytest.approx(0.5 * np.pi / 30.0, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("t [s];n [rpm]\n0;1,5\n1;2.5\n", 'rig.csv:3: n: found "2.5"; must be a finite number .part decimals'),
        ("t [s];n [rpm]\n0;1.5\n1;2,5\n", 'rig.csv:3: n: found "2,5"; must be a finite number .part decimals'),
        ("t [s];n [rpm]\n0;1.500,5\n1;1.600,5\n", 'rig.csv:2: n: found "1.500,5"'),
        ("t [s], n [rpm]\n0,0, 1,5\n0,1, 2,5\n", "found 4 entries; must have 2|4 column names"),
        ("0;1\n1;2\n", "column names must stand above"),
        ("t;t;n\ns;s;rpm\n0;1;2\n", "columns 1 and 2 have this name"),
        ("t [s];n [rpm]\n0;1\n1;abc\n", 'rig.csv:3: n: found "abc"'),
    ],
)
def test_what_is_wrong_is_told_with_its_line(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text(text)
    with pytest.raises(ModelError, match=words):
        gr.read(path)


def test_an_empty_entry_is_a_gap(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("t [s];n [rpm]\n0;1\n1;\n2;3\n3;4,5\n4;5\n")
    with pytest.raises(ModelError, match=r'n: found nan at sample 1.*gaps = "bridge"'):
        gr.read(path)
    rows = [{"name": "n", "quantity": "velocity", "gaps": "bridge"}]
    bridged = gr.read({"file": str(path), "channel": rows})["n"].values
    np.testing.assert_allclose(bridged * 30.0 / np.pi, [1.0, 2.0, 3.0, 4.5, 5.0], rtol=1e-14)


def test_a_torque_of_a_model_may_have_decimal_commas(tmp_path: Path) -> None:
    (tmp_path / "torque.csv").write_bytes("Zeit;M\ns;N*m\n0;1,5\n1;2,5\n2;3,5\n3;4,5\n".encode("latin-1"))
    (tmp_path / "model.toml").write_text(
        'schema = 1\nexcitation.speed = 1.0\n[[inertia]]\nname = "a"\nJ = 1.0\n'
        '[[coupling]]\nname = "k"\nbetween = ["a", "ground"]\nstiffness = 4.0\n'
        '[[torque]]\non = "a"\nsignal = { file = "torque.csv", time = "Zeit", value = "M" }\n'
    )
    signal = gr.load(tmp_path / "model.toml").torques[0].signal
    assert signal is not None
    np.testing.assert_array_equal(signal.value, [1.5, 2.5, 3.5, 4.5])


def test_our_own_csv_says_quantity_subject_and_unit(tmp_path: Path) -> None:
    model = gr.load(Path(__file__).parents[3] / "examples" / "paper" / "case3.toml")
    run = gr.simulate(model, cycles=10, discard=2, samples_per_cycle=64, audit=False)
    run.save(tmp_path / "run.csv")
    record = gr.read(tmp_path / "run.csv")
    for quantity, unit in (("angle", "rad"), ("velocity", "rad/s"), ("acceleration", "rad/s^2")):
        channel = record.find(quantity, "flywheel")
        assert channel is not None
        assert channel.unit == unit
        np.testing.assert_array_equal(channel.values, run.data[quantity].sel(inertia="flywheel").values)
    deflection = record.find("deflection", "gear")
    assert deflection is not None
    assert deflection.unit == "rad or m"
    assert any(note.startswith("deflection.gear: in SI, taken to be rad or m") for note in record.notes)


@pytest.mark.parametrize("name", ["=1+1", "+cmd", "-2", "@SUM(A1)", "plain"])
def test_a_spreadsheet_takes_no_name_for_a_formula(name: str, tmp_path: Path) -> None:
    channel = gr.measured.Channel(name, "velocity", "", "rad/s", np.array([1.0, 2.0]))
    gr.write(gr.measured.Recording(np.array([0.0, 1.0]), (channel,), "rig"), tmp_path / "rig.csv")
    head = next(line for line in (tmp_path / "rig.csv").read_text().splitlines() if not line.startswith("#"))
    assert all(cell.strip()[0] not in "=+-@" for cell in head.split(","))
    assert gr.read(tmp_path / "rig.csv").names == (name,)
