"""Files written by the formats' own libraries, not by ours."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat, wavfile

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.measured.readers import read_raw

T = np.arange(400) * 1e-3
X, Y = np.sin(40.0 * T), np.cos(30.0 * T) + 2.0


def channel(name: str, quantity: str = "velocity", unit: str = "rpm", **more: Any) -> dict[str, Any]:
    """Return a row of a mapping."""
    return {"name": name, "quantity": quantity, "unit": unit, **more}


def test_mat_vectors_matrices_and_structures(tmp_path: Path) -> None:
    path = tmp_path / "x.mat"
    savemat(
        path,
        {"t": T[:, None], "n": X, "both": np.stack([X, Y], 1), "rig": {"inner": {"T": Y}}, "word": "abc", "one": 3.0},
    )
    raw = read_raw(path)
    assert {c.name for c in raw.columns} == {"n", "both[0]", "both[1]", "rig.inner.T"}
    assert raw.notes == ("left out, because they are no signals: word, one",)
    rows = [channel("n"), channel("T", "torque", "kN*m", source="rig.inner.T", of="hub")]
    actual = gr.read({"file": str(path), "channel": rows})
    np.testing.assert_allclose(actual["n"].values, X * np.pi / 30.0, rtol=1e-15)
    np.testing.assert_allclose(actual["T"].values, 1e3 * Y, rtol=1e-15)
    np.testing.assert_array_equal(actual.time, T)


def test_mat_without_times_is_told_its_rate(tmp_path: Path) -> None:
    path = tmp_path / "x.mat"
    savemat(path, {"n": X})
    with pytest.raises(ModelError, match=r'no column of as many times.*sampled = "10 kHz"'):
        gr.read({"file": str(path), "channel": [channel("n")]})
    actual = gr.read({"file": str(path), "sampled": "1 kHz", "channel": [channel("n")]})
    np.testing.assert_allclose(actual.time, T, rtol=1e-15)


def test_mat_of_version_4(tmp_path: Path) -> None:
    path = tmp_path / "x.mat"
    savemat(path, {"t": T, "n": X}, format="4")
    np.testing.assert_array_equal(read_raw(path).columns[0].values, X)


def test_mat_7_3_and_hdf5_by_group_scale_and_name(tmp_path: Path) -> None:
    """MATLAB puts a user block before the signature; each group may have its own times."""
    path = tmp_path / "x.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for group, step in (("fast", 1), ("slow", 4)):
            file[f"{group}/time"] = T[::step][None, :]
            file[f"{group}/n"] = X[::step][None, :]
            file[f"{group}/n"].attrs["MATLAB_class"] = np.bytes_("double")
            file[f"{group}/n"].attrs["unit"] = "rpm"
    with open(path, "r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(512, b" "))
    raw = read_raw(path)
    assert raw.format == "hdf5"
    by_name = {c.name: c for c in raw.columns}
    np.testing.assert_array_equal(by_name["slow/n"].time, T[::4])
    np.testing.assert_array_equal(by_name["fast/n"].time, T)
    assert by_name["slow/n"].unit == "rpm"
    with pytest.raises(ModelError, match=r"different times.*a mapping that brings them to one rate"):
        gr.read(path)


def test_a_table_of_named_columns_in_hdf5(tmp_path: Path) -> None:
    """As PyTables and recorders write it; units one by one, columns of texts left out, whole numbers kept exact."""
    path = tmp_path / "x.h5"
    table = np.zeros(T.size, dtype=[("t", "f8"), ("n", "f4"), ("count", "i8"), ("word", "S4")])
    table["t"] = 1e3 * T
    table["n"] = X
    table["count"] = np.arange(T.size) + 2**40
    with h5py.File(path, "w") as file:
        file.create_dataset("log/rig", data=table, chunks=(64,), compression="gzip").attrs["units"] = [
            "ms",
            "rpm",
            "",
            "",
        ]
    by_name = {column.name: column for column in read_raw(path).columns}
    assert set(by_name) == {"log/rig/n", "log/rig/count"}
    assert by_name["log/rig/n"].unit == "rpm"
    np.testing.assert_array_equal(by_name["log/rig/n"].values, X.astype("f4"))
    np.testing.assert_array_equal(by_name["log/rig/count"].values, table["count"])
    np.testing.assert_allclose(by_name["log/rig/n"].time, T, rtol=1e-15)


def test_the_rate_of_an_hdf5_file(tmp_path: Path) -> None:
    """That of the signal, of its group or of the file, the nearest one; times that are stored come first."""
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as file:
        file.attrs["fs"] = 1000
        file["slow/n"] = X[::4]
        file["slow"].attrs["sampling_rate"] = 250.0
        file["slow/fast"] = X
        file["slow/fast"].attrs["Fs"] = np.array([2000.0])
        file["n"] = X[:100]
        file["timed/n"] = X[:50]
        file["timed/t"] = 3.0 * T[:50]
    raw = read_raw(path)
    by_name = {column.name: column for column in raw.columns}
    for name, times in (("slow/n", T[::4]), ("slow/fast", 0.5 * T), ("n", T[:100]), ("timed/n", 3.0 * T[:50])):
        np.testing.assert_allclose(by_name[name].time, times, rtol=1e-15)
    assert raw.notes == ("times by the sampling rate of the file: n, slow/fast, slow/n",)
    with h5py.File(path, "a") as file:
        file["slow"].attrs["sampling_rate"] = "fast"
    with pytest.raises(ModelError, match=r"/slow: sampling_rate: .*one positive number, in Hz"):
        gr.read(path)


def test_tdms_of_groups_with_equal_names(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    path = tmp_path / "x.tdms"
    waveform = {"wf_increment": 1e-3, "unit_string": "rpm"}
    rows = [("one", "n", X, waveform), ("two", "n", Y, waveform), ("two", "word", ["a", "b"], {})]
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject(*row) for row in rows])
        writer.write_segment([nptdms.ChannelObject(*row) for row in rows[:1]])
    raw = read_raw(path)
    by_name = {column.name: column for column in raw.columns}
    assert set(by_name) == {"one/n", "two/n"}
    assert raw.notes == ("left out, because they are no signals: word",)
    np.testing.assert_array_equal(by_name["one/n"].values, np.concatenate([X, X]))
    np.testing.assert_allclose(by_name["one/n"].time, np.arange(800) * 1e-3, rtol=1e-15)
    mapping = {"file": str(path), "channel": [channel("n", source="two/n")]}
    np.testing.assert_allclose(gr.read(mapping)["n"].values, Y * np.pi / 30.0, rtol=1e-15)


def test_a_workbook_of_several_sheets(tmp_path: Path) -> None:
    """A cover without a table is left out; columns are named by sheet; messages name sheet and row."""
    openpyxl = pytest.importorskip("openpyxl")
    path = tmp_path / "x.xlsx"
    book = openpyxl.Workbook()
    book.active.title = "cover"
    book.active["B2"] = 'rig "3", 2026'
    for title, values in (("rig", X), ("road", Y)):
        sheet = book.create_sheet(title)
        sheet.append(["t [s]", "n [rpm]"])
        for row in zip(T.tolist(), values.tolist(), strict=True):
            sheet.append(row)
    book.save(path)
    raw = read_raw(path)
    assert {column.name for column in raw.columns} == {"rig/n", "road/n"}
    assert raw.notes == ("sheets without a table of numbers, left out: cover",)
    mapping = {"file": str(path), "channel": [channel("n", source="road/n")]}
    np.testing.assert_allclose(gr.read(mapping)["n"].values, Y * np.pi / 30.0, rtol=1e-14)
    book["road"]["B7"] = "broken"
    del book["rig"]
    book.save(path)
    with pytest.raises(ModelError, match=r'x\.xlsx: road:7: n: found "broken"'):
        gr.read(path)


def test_a_workbook_whose_formulas_have_no_values(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in [["t [s]", "n [rpm]"], ["=1*1", "=2*2"], ["=2*1", "=3*2"]]:
        book.active.append(row)
    book.save(tmp_path / "x.xlsx")
    with pytest.raises(ModelError, match="values of formulas are stored where Excel has saved"):
        gr.read(tmp_path / "x.xlsx")


@pytest.mark.parametrize(
    ("columns", "heading"), [("Multi", "X_Value\tn\tX_Value\tT\tComment"), ("One", "X_Value\tn\tT\tComment")]
)
@pytest.mark.parametrize("separator", ["\t", ","])
def test_lvm_with_stored_times_in_segments(columns: str, heading: str, separator: str, tmp_path: Path) -> None:
    """Two segments that begin at X = 0, a second apart by their clock times, around a special block."""
    path = tmp_path / "x.lvm"
    end = "***End_of_Header***"
    name = {"\t": "Tab", ",": "Comma"}[separator]
    text = [f"LabVIEW Measurement\nSeparator\t{name}\nDecimal_Separator\t.\nX_Columns\t{columns}\n{end}\n"]
    multi = columns == "Multi"
    for clock, shift in (("12:00:00.5", 0.0), ("12:00:01.5", 10.0)):
        units = "Y_Unit_Label\trpm\t\tNm" if multi else "Y_Unit_Label\trpm\tNm"
        stamps = f"Date\t2026/03/01\t2026/03/01\nTime\t{clock}\t{clock}"
        samples = "Samples\t3\t\t2" if multi else "Samples\t3\t2"
        text.append(f"\nChannels\t2\n{samples}\n{stamps}\n{units}\n{end}\n{heading}\n")
        for k in range(3):
            first = f"{0.25 * k}\t{shift + k}"
            second = f"{shift - k}" if k < 2 else ""
            text.append(f"{first}\t{0.5 * k if k < 2 else ''}\t{second}\thello\n" if multi else f"{first}\t{second}\n")
        text.append("***Start_Special***\nNoise\t3\n***End_Special***\n")
    path.write_text("".join(text).replace("\t", separator))
    raw = read_raw(path)
    by_name = {column.name: column for column in raw.columns}
    np.testing.assert_allclose(by_name["n"].time, [0.0, 0.25, 0.5, 1.0, 1.25, 1.5])
    np.testing.assert_array_equal(by_name["n"].values, [0.0, 1.0, 2.0, 10.0, 11.0, 12.0])
    step = 0.5 if multi else 0.25
    np.testing.assert_allclose(by_name["T"].time, [0.0, step, 1.0, 1.0 + step])
    np.testing.assert_array_equal(by_name["T"].values, [0.0, -1.0, 10.0, 9.0])
    assert (by_name["n"].unit, by_name["T"].unit) == ("rpm", "Nm")
    assert raw.notes == ("times of 2 segments count from 2026/03/01 12:00:00.5, by their dates and clock times",)


def test_lvm_with_a_word_in_place_of_a_number(tmp_path: Path) -> None:
    path = tmp_path / "x.lvm"
    head = "LabVIEW Measurement\nSeparator\tTab\n***End_of_Header***\nChannels\t1\nSamples\t2\n***End_of_Header***\n"
    path.write_text(f"{head}X_Value\tn\n0.0\t1\n0.1\tbroken\n")
    with pytest.raises(ModelError, match=r'x\.lvm:9: n: found "broken"; must be a number'):
        gr.read(path)


def test_two_groups_of_equal_length_keep_their_own_times(tmp_path: Path) -> None:
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as file:
        for group, shift in (("a", 0.0), ("b", 5.0)):
            file[f"{group}/t"] = T + shift
            file[f"{group}/n"] = X
    first = {c.name: c.time[0] for c in read_raw(path).columns if c.time is not None}
    assert first == {"a/n": 0.0, "b/n": 5.0}


@pytest.mark.parametrize("kind", ["int16", "int32", "uint8", "float32", "float64"])
def test_wav_of_scipy(kind: str, tmp_path: Path) -> None:
    """Whole numbers are parts of full scale."""
    path = tmp_path / "x.wav"
    full = {"int16": 2.0**15, "int32": 2.0**31, "uint8": 2.0**7}.get(kind, 1.0)
    stored = 0.9 * np.stack([X, X[::-1]], 1) * full + (128.0 if kind == "uint8" else 0.0)
    wavfile.write(path, 8000, stored.astype(kind))
    raw = read_raw(path)
    assert [c.name for c in raw.columns] == ["1", "2"]
    np.testing.assert_allclose(raw.columns[0].values, 0.9 * X, atol=1.01 / full if full > 1.0 else 1e-7)
    assert raw.columns[0].time is not None
    assert raw.columns[0].time[8] == 1e-3


def test_wav_of_libsndfile_in_24_bits(tmp_path: Path) -> None:
    soundfile = pytest.importorskip("soundfile")
    path = tmp_path / "x.wav"
    soundfile.write(path, 0.5 * X, 44100, subtype="PCM_24")
    actual = gr.read({"file": str(path), "channel": [channel("mic", "sound pressure", "Pa", source="1", scale=20.0)]})
    np.testing.assert_allclose(actual["mic"].values, 10.0 * X, atol=20.0 * 2.0**-23)
    assert actual.interval == pytest.approx(1.0 / 44100.0, rel=1e-12)


def test_mdf_of_asammdf_with_two_groups(tmp_path: Path) -> None:
    """Different times, a raw value with a linear conversion, an invalid sample, a text."""
    asammdf = pytest.importorskip("asammdf")
    path = tmp_path / "x.mf4"
    raw = asammdf.Signal(np.arange(100, dtype="i2"), T[:100], name="T", unit="Nm", conversion={"a": 0.5, "b": -3.0})
    invalid = np.zeros(400, dtype=bool)
    invalid[7] = True
    speed = asammdf.Signal(X, T, name="n", unit="1/min", invalidation_bits=invalid)
    word = asammdf.Signal(np.array([b"on"] * 400), T, name="state", encoding="utf-8")
    with asammdf.MDF(version="4.10") as file:
        file.append([raw])
        file.append([speed, word])
        file.save(path, compression=2)
    columns = {c.name: c for c in read_raw(path).columns}
    np.testing.assert_array_equal(columns["T"].values, 0.5 * np.arange(100) - 3.0)
    assert (columns["T"].unit, columns["n"].unit, set(columns)) == ("Nm", "1/min", {"T", "n"})
    assert np.flatnonzero(np.isnan(columns["n"].values)).tolist() == [7]
    rows = [
        {"name": "T", "quantity": "torque", "ends": "keep"},
        {"name": "n", "quantity": "speed", "gaps": "bridge", "ends": "keep"},
    ]
    actual = gr.read({"file": str(path), "rate": "500 Hz", "channel": rows})
    assert actual.time[-1] == pytest.approx(0.098)  # where the shorter group ends, 0.099, by the grid
    assert actual["T"].values[10] == pytest.approx(0.5 * 20 - 3.0, rel=1e-6)
    assert any("1 sample without a number" in note for note in actual.notes)
    assert logging.getLogger("asammdf").level == logging.CRITICAL


def _set_58(kind: int, values: Any, **more: Any) -> dict[str, Any]:
    return {
        "type": 58, "func_type": 1, "rsp_node": 4, "rsp_dir": 2, "ref_node": 1, "ref_dir": 1, "data": values, "x": T,
        "id1": "n_engine", "rsp_ent_name": "hub", "ref_ent_name": "rig", "abscissa_spacing": 1, "ord_data_type": kind,
        "abscissa_min": 0.0, "abscissa_inc": 1e-3, "abscissa_spec_data_type": 17, "ordinate_axis_units_lab": "rpm",
        "orddenom_spec_data_type": 0, "ordinate_spec_data_type": 11, "z_axis_axis_units_lab": "NONE",
        **more,
    }  # fmt: skip


@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize(("kind", "error"), [(2, 1e-6), (4, 1e-12)])
def test_uff_of_pyuff(binary: int, kind: int, error: float, tmp_path: Path) -> None:
    """Text and bytes, single and double; a spectrum beside the history is left out."""
    pyuff = pytest.importorskip("pyuff")
    path = tmp_path / "x.uff"
    spectrum = _set_58(6, X + 1j * Y, func_type=4, abscissa_spec_data_type=18, binary=0, id1="frf")
    pyuff.UFF(str(path)).write_sets([_set_58(kind, X, binary=binary), spectrum], "add")
    raw = read_raw(path)
    (column,) = raw.columns
    assert (column.name, column.unit) == ("n_engine", "rpm")
    np.testing.assert_allclose(column.values, X, atol=error)
    np.testing.assert_allclose(column.time, T, atol=1e-9)
    rule = "function of type 4, not of time: its abscissa is not named, a frequency"
    assert raw.notes == (f"dataset 2 left out: {rule}",)


def test_uff_of_uneven_times(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff")
    path = tmp_path / "x.uff"
    uneven = T + 2e-4 * np.sin(50.0 * T)
    pyuff.UFF(str(path)).write_sets(_set_58(2, X, binary=0, x=uneven, abscissa_spacing=0), "add")
    (column,) = read_raw(path).columns
    np.testing.assert_allclose(column.time, uneven, atol=1e-6)
    np.testing.assert_allclose(column.values, X, atol=1e-6)


@pytest.mark.parametrize(("order", "mark"), [("<", 1), (">", 2)])
@pytest.mark.parametrize(("kind", "form"), [(2, "f4,f4"), (4, "f4,f8")])
def test_uff_of_uneven_times_in_bytes_of_either_order(
    order: str, mark: int, kind: int, form: str, tmp_path: Path
) -> None:
    """By the letter of the format, as pyuff 2.5 miscounts these bytes: pairs of a short time and a value."""
    path = tmp_path / "x.uff"
    pairs = np.empty(T.size, ",".join(order + part for part in form.split(",")))
    pairs["f0"], pairs["f1"] = T, X
    data = pairs.tobytes()
    axis = f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'rpm':20s}"
    lines = [
        "    -1",
        f"    58b{mark:6d}{2:6d}{11:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}",
        *["n"] * 1, *["NONE"] * 4,
        f"{1:5d}{0:10d}{0:5d}{0:10d} {'hub':10s}{1:10d}{6:4d} {'NONE':10s}{0:10d}{0:4d}",
        f"{kind:10d}{T.size:10d}{0:10d}{0:13.5E}{0:13.5E}{0:13.5E}",
        f"{17:10d}{0:5d}{0:5d}{0:5d} {'Time':20s} {'s':20s}", axis, axis, axis,
    ]  # fmt: skip
    path.write_bytes("\r\n".join(lines).encode() + b"\r\n" + data + b"    -1\r\n")
    (column,) = read_raw(path).columns
    np.testing.assert_array_equal(column.time, pairs["f0"].astype(float))
    np.testing.assert_array_equal(column.values, pairs["f1"].astype(float))


def test_pyuff_reads_what_is_written(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff")
    from tests.measured.readers.rig import rig

    before = rig()
    gr.write(before, tmp_path / "x.uff")
    sets = pyuff.UFF(str(tmp_path / "x.uff")).read_sets()
    assert [s["id1"].strip() for s in sets] == list(before.names)
    for actual, channel in zip(sets, before.channels, strict=True):
        np.testing.assert_array_equal(actual["data"], channel.values)
        assert actual["ordinate_axis_units_lab"].strip() == channel.unit
        np.testing.assert_allclose(actual["x"], before.time, atol=1e-5 * (before.time[-1] - 0.25))


def test_two_histories_of_one_name_are_told_apart_by_their_nodes(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff")
    path = tmp_path / "x.uff"
    pyuff.UFF(str(path)).write_sets([_set_58(4, X, binary=1), _set_58(4, Y, binary=1, rsp_node=5)], "add")
    assert [c.name for c in read_raw(path).columns] == ["n_engine @ hub:4:2", "n_engine @ hub:5:2"]


def test_csv_with_words_beside_the_numbers(tmp_path: Path) -> None:
    """A mapping reads the columns that it names; a column of words does not matter."""
    path = tmp_path / "x.csv"
    path.write_text("# rig 3\nt [ms]; gear; n [1/min]\n" + "".join(f"{k}; second; {k * k}\n" for k in range(9)))
    actual = gr.read({"file": str(path), "channel": [{"name": "n", "quantity": "speed"}]})
    np.testing.assert_allclose(actual.time, np.arange(9) * 1e-3)
    np.testing.assert_allclose(actual["n"].values, np.arange(9.0) ** 2 * np.pi / 30.0)
    with pytest.raises(ModelError, match=r'x.csv:3: gear: found "second"'):
        gr.read(path)
