"""Which row above the numbers has the names, and entries in quotes."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import ModelError

NUMBERS = "0.000;100.0;1.5\n0.001;101.0;2.5\n0.002;102.0;3.5\n0.003;103.0;4.5\n"
ROWS = {
    "names": "t;n_engine;M",
    "types": "f8;f8;float64",
    "units": "s;rpm;Nm",
    "comments": "time of the recorder;speed of the engine;torque at the shaft",
}
ORDERS = [
    order
    for count in (2, 3, 4)
    for rows in itertools.combinations(ROWS, count)
    if "names" in rows
    for order in itertools.permutations(rows)
]


def saved(tmp_path: Path, text: str) -> Path:
    """Write a file."""
    path = tmp_path / "rig.csv"
    path.write_text(text, encoding="utf-8")
    return path


def assert_is_the_record(path: Path) -> gr.measured.Recording:
    """Assert that a file holds what ``NUMBERS`` says."""
    record = gr.read(path)
    np.testing.assert_allclose(record.time, np.arange(4) * 1e-3, rtol=1e-14)
    speed = record[record.names[0]].values
    by = np.pi / 30.0 if record[record.names[0]].quantity else 1.0
    np.testing.assert_allclose(speed / by, 100.0 + np.arange(4), rtol=1e-14)
    return record


@pytest.mark.parametrize("order", ORDERS, ids=["-".join(order) for order in ORDERS])
@pytest.mark.parametrize("separator", [";", "\t", ","])
def test_rows_of_names_types_units_and_comments_in_any_order(
    order: tuple[str, ...], separator: str, tmp_path: Path
) -> None:
    text = "\n".join([*(ROWS[row] for row in order), NUMBERS]).replace(";", separator)
    record = assert_is_the_record(saved(tmp_path, text))
    assert record.names == ("n_engine", "M")
    assert record["n_engine"].quantity == ("velocity" if "units" in order else "")
    assert record["M"].unit == ("N*m" if "units" in order else "1")
    left_out = [note for note in record.notes if "left out" in note]
    assert bool(left_out) == bool({"types", "comments"} & set(order))


@pytest.mark.parametrize(
    "head",
    [
        "t [s];n_engine [rpm];M [Nm]\nf8;f8;f8",
        "t [s];n_engine [rpm];M [Nm]\ntime;speed;torque",
        "time;speed;torque\nt [s];n_engine [rpm];M [Nm]",
        "Zeit;n_engine;M\n[s];[1/min];[Nm]\nREAL;REAL;REAL",
        "Datum;2026-02-01;\nFahrer;N. N.;\nt;n_engine;M\ns;rpm;Nm",
        "t;n_engine;M\ns;rpm;Nm\na remark of one entry",
        "t;n_engine;M\ns;rpm;Nm\n;;",
    ],
)
def test_heads_of_measuring_systems(head: str, tmp_path: Path) -> None:
    record = assert_is_the_record(saved(tmp_path, f"{head}\n{NUMBERS}"))
    assert record.names == ("n_engine", "M")
    assert (record["n_engine"].unit, record["M"].unit) == ("rad/s", "N*m")


def test_units_without_a_time_among_them(tmp_path: Path) -> None:
    path = saved(tmp_path, "n;M\nrpm;Nm\n100;1.5\n101;2.5\n102;3.5\n103;4.5\n")
    rows = [{"name": "n", "quantity": "speed"}, {"name": "M", "quantity": "torque"}]
    record = gr.read({"file": str(path), "sampled": "1 kHz", "channel": rows})
    np.testing.assert_allclose(record["n"].values * 30.0 / np.pi, 100.0 + np.arange(4), rtol=1e-14)


@pytest.mark.parametrize("head", ["f1;f2;f3\ns;rpm;Nm", "s;v;a\ns;rpm;Nm", "t;h;min\ns;rpm;Nm"])
def test_names_that_look_like_types_or_units(head: str, tmp_path: Path) -> None:
    first, *others = head.splitlines()[0].split(";")
    path = saved(tmp_path, f"{head}\n{NUMBERS}")
    rows = [{"name": name, "quantity": quantity} for name, quantity in zip(others, ("speed", "torque"), strict=True)]
    record = gr.read({"file": str(path), "time": first, "channel": rows})
    np.testing.assert_allclose(record[others[1]].values, [1.5, 2.5, 3.5, 4.5], rtol=1e-14)


def test_decimal_commas_in_quotes(tmp_path: Path) -> None:
    text = '"t [s]","n [rpm]"\n"0,000","100,0"\n"0,001","101,5"\n"0,002","-1,5e1"\n'
    record = gr.read(saved(tmp_path, text))
    np.testing.assert_allclose(record.time, [0.0, 0.001, 0.002], rtol=1e-15)
    np.testing.assert_allclose(record["n"].values * 30.0 / np.pi, [100.0, 101.5, -15.0], rtol=1e-14)
    assert "decimals are parted by a comma" in record.notes


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_name_may_hold_what_parts_columns(separator: str, tmp_path: Path) -> None:
    head = separator.join(["t [s]", f'"speed{separator} engine [rpm]"', '"torque ""hub"" [Nm]"', "word"])
    rows = [separator.join([f"{k}", f'"{100 + k}"', f"{k}.5", f'"{separator} on"']) for k in range(4)]
    path = saved(tmp_path, "\n".join([head, *rows, ""]))
    source = f"speed{separator} engine"
    channels = [
        {"name": "n", "source": source, "quantity": "speed"},
        {"name": "M", "source": 'torque "hub"', "quantity": "torque"},
    ]
    record = gr.read({"file": str(path), "channel": channels})
    np.testing.assert_allclose(record["n"].values * 30.0 / np.pi, 100.0 + np.arange(4), rtol=1e-14)
    np.testing.assert_allclose(record["M"].values, np.arange(4) + 0.5, rtol=1e-14)


def test_quotes_around_some_numbers_only(tmp_path: Path) -> None:
    record = gr.read(saved(tmp_path, 't [s], n [rpm], M [Nm]\n0, "100,0", 1\n1, "101,5", "2,5"\n2, 102, "0,125"\n'))
    np.testing.assert_allclose(record["n"].values * 30.0 / np.pi, [100.0, 101.5, 102.0], rtol=1e-14)
    np.testing.assert_array_equal(record["M"].values, [1.0, 2.5, 0.125])


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ('"0","1,234"\n"1","2,345"\n', r"rig.csv:2: found 1,234; has a comma that parts decimals or thousands"),
        ('"0","1,234.5"\n"1","2,345.5"\n', 'rig.csv:2: n: found "1,234.5"; must be a finite number'),
        ('"0.5","1,5"\n"1.5","2,5"\n', 'rig.csv:2: n: found "1,5"; must be a finite number'),
        ('"0,5","1,5"\n"1,5"\n', "rig.csv:3: found 1 entries; must have 2"),
    ],
)
def test_what_may_mean_two_numbers_is_refused(rows: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=words):
        gr.read(saved(tmp_path, f'"t [s]","n [rpm]"\n{rows}'))


def test_a_gap_in_quotes(tmp_path: Path) -> None:
    path = saved(
        tmp_path, '"t [s]","n [rpm]"\n' + "".join(f'"{k},5","{k},5"\n' for k in range(5)) + '"5,5",""\n"6,5","6,5"\n'
    )
    rows = [{"name": "n", "quantity": "speed", "gaps": "bridge"}]
    values = gr.read({"file": str(path), "channel": rows})["n"].values
    np.testing.assert_allclose(values * 30.0 / np.pi, np.arange(7) + 0.5, rtol=1e-14)


def test_a_torque_of_a_model_may_be_in_quotes(tmp_path: Path) -> None:
    saved(tmp_path, '"t [s]","M, shaft [N*m]"\n"0,0","1,5"\n"1,0","2,5"\n"2,0","3,5"\n"3,0","4,5"\n')
    (tmp_path / "model.toml").write_text(
        'schema = 1\nexcitation.speed = 1.0\n[[inertia]]\nname = "a"\nJ = 1.0\n'
        '[[coupling]]\nname = "k"\nbetween = ["a", "ground"]\nstiffness = 4.0\n'
        '[[torque]]\non = "a"\nsignal = { file = "rig.csv", time = "t", value = "M, shaft" }\n'
    )
    signal = gr.load(tmp_path / "model.toml").torques[0].signal
    assert signal is not None
    np.testing.assert_array_equal(signal.value, [1.5, 2.5, 3.5, 4.5])
