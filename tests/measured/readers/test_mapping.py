"""A mapping: what it makes of a record, and what it says of its own faults."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat, wavfile

import gearrattle as gr
from gearrattle.errors import ModelError

RATE = 20_000.0
T = np.arange(40_000) / RATE
TURN = 2.0 * np.pi
HEAD = 'schema = 1\nfile = "record.mat"\n'


def _speed(t: np.ndarray) -> np.ndarray:
    return TURN * (20.0 + 0.4 * np.sin(TURN * 40.0 * t))


def _angle(t: np.ndarray) -> np.ndarray:
    return TURN * 20.0 * t + 0.4 / 40.0 * (1.0 - np.cos(TURN * 40.0 * t))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A record of a shaft: speed in rpm, a torque in V, an encoder in deg that starts over, pulses, gaps."""
    broken = np.sin(T)
    broken[100:103] = np.nan
    savemat(
        tmp_path / "record.mat",
        {
            "t": T,
            "n": _speed(T) * 60 / TURN,
            "U": 2.0 + 0.5 * np.sin(TURN * 40.0 * T),
            "broken": broken,
            "encoder": np.degrees(np.mod(_angle(T), TURN)),
            "tacho": 5.0 * np.sin(60.0 * _angle(T)),
        },
    )
    return tmp_path


def _read(folder: Path, text: str) -> gr.measured.Recording:
    (folder / "measurement.toml").write_text(HEAD + text, encoding="utf-8")
    return gr.read(folder / "measurement.toml")


def test_names_units_scales_and_a_filter(folder: Path) -> None:
    """20 N m a volt, 40 N m at 2 V taken off; the filter's gain at 40 Hz is its closed form."""
    text = """
[[channel]]
name = "n_engine"
source = "n"
quantity = "velocity"
of = "flywheel"
unit = "rpm"
detrend = "mean"
filter = { kind = "lowpass", cutoff = "80 Hz", order = 2 }

[[channel]]
name = "U"
quantity = "torque"
of = "hub"
unit = "N*m"
scale = 20.0
offset = -40.0
"""
    actual = _read(folder, text)
    assert [(c.name, c.quantity, c.subject, c.unit) for c in actual.channels] == [
        ("n_engine", "velocity", "flywheel", "rad/s"),
        ("U", "torque", "hub", "N*m"),
    ]
    np.testing.assert_allclose(actual["U"].values, 10.0 * np.sin(TURN * 40.0 * T), atol=1e-12)
    gain = 1.0 / (1.0 + (np.tan(np.pi * 40.0 / RATE) / np.tan(np.pi * 80.0 / RATE)) ** 4)
    swing = gain * 0.4 * TURN * np.sin(TURN * 40.0 * T)
    middle = slice(4000, -4000)
    np.testing.assert_allclose(actual["n_engine"].values[middle], swing[middle], atol=1e-6)
    assert actual.source == "record.mat"


def test_speed_to_angle_and_back_and_an_encoder(folder: Path) -> None:
    text = """
[[channel]]
name = "phi"
source = "n"
quantity = "shaft angle"
measured = "speed"
unit = "rpm"

[[channel]]
name = "wheel"
source = "encoder"
quantity = "shaft angle"
unit = "deg"
starts_over = "360 deg"

[[channel]]
name = "rate"
source = "encoder"
quantity = "speed"
measured = "shaft angle"
unit = "deg"
starts_over = "360 deg"
"""
    actual = _read(folder, text)
    np.testing.assert_allclose(actual["phi"].values, _angle(T), atol=1e-9)
    np.testing.assert_allclose(actual["wheel"].values, _angle(T), atol=1e-9)
    np.testing.assert_allclose(actual["rate"].values[5:-5], _speed(T)[5:-5], rtol=1e-7)
    assert any("phi: integrated from a speed; 0 at its first sample" in note for note in actual.notes)


def test_pulses_at_another_rate_beside_a_torque(folder: Path) -> None:
    text = """rate = "3 kHz"
start = "0.5 s"
end = "1.5 s"

[[channel]]
name = "speed"
source = "tacho"
quantity = "speed"
measured = "pulses"
tacho = { pulses_per_turn = 60, threshold = 0.0, hysteresis = 0.5 }

[[channel]]
name = "U"
quantity = "torque"
unit = "N*m"
"""
    actual = _read(folder, text)
    assert actual.interval == pytest.approx(1.0 / 3000.0, rel=1e-12)
    assert 0.5 <= actual.time[0] < 0.5 + 1.0 / 1200.0 + 1e-4
    assert actual.time[-1] <= 1.5
    middle = slice(60, -60)
    np.testing.assert_allclose(actual["speed"].values[middle], _speed(actual.time)[middle], rtol=2e-3)
    np.testing.assert_allclose(
        actual["U"].values[middle], (2.0 + 0.5 * np.sin(TURN * 40.0 * actual.time))[middle], atol=1e-4
    )


@pytest.mark.parametrize("by", ["correlation", "order-phase"])
def test_a_second_file_is_set_by_a_motion_that_both_have(by: str, folder: Path) -> None:
    """The second clock is 12.3 ms late; 40 Hz has a period of 25 ms, so its phase tells it as well."""
    late = 0.0123
    wander = 30.0 * np.sin(TURN * 0.7 * T) if by == "correlation" else 0.0
    savemat(folder / "record.mat", {"t": T, "n": _speed(T) * 60 / TURN + wander})
    t = np.arange(16_000) / 8000.0 - late
    wander = 30.0 * np.sin(TURN * 0.7 * t) if by == "correlation" else 0.0
    wavfile.write(folder / "second.wav", 8000, np.stack([_speed(t) * 60 / TURN + wander, np.sin(TURN * 5.0 * t)], 1))
    how = '"correlation", most = "0.1 s"' if by == "correlation" else '"order-phase", frequency = "40 Hz"'
    text = f"""rate = "2 kHz"

[[channel]]
name = "n"
quantity = "speed"
unit = "rpm"

[[channel]]
name = "n2"
source = "1"
file = "second.wav"
quantity = "speed"
unit = "rpm"
align = {{ with = "n", by = {how} }}

[[channel]]
name = "mic"
source = "2"
file = "second.wav"
quantity = "sound pressure"
unit = "Pa"
"""
    actual = _read(folder, text)
    middle = slice(200, -200)
    np.testing.assert_allclose(actual["n2"].values[middle], actual["n"].values[middle], atol=0.02)
    np.testing.assert_allclose(actual["mic"].values[middle], np.sin(TURN * 5.0 * actual.time)[middle], atol=1e-3)
    (note,) = [note for note in actual.notes if "added to its times" in note]
    assert float(note.split("second.wav: ")[1].split(" s")[0]) == pytest.approx(-late, abs=2e-5)


def test_signals_that_do_not_agree_are_not_aligned(folder: Path) -> None:
    wavfile.write(folder / "second.wav", 8000, np.random.default_rng(1).standard_normal(16_000))
    rows = [
        {"name": "n", "quantity": "speed", "unit": "rpm"},
        {
            "name": "x",
            "source": "1",
            "file": str(folder / "second.wav"),
            "quantity": "speed",
            "unit": "rpm",
            "align": {"with": "n"},
        },
    ]
    with pytest.raises(ModelError, match=r"channel\.x\.align.*do not agree at any delay.*0\.5"):
        gr.read({"file": str(folder / "record.mat"), "rate": "1 kHz", "channel": rows})


def test_gaps_are_refused_or_bridged(folder: Path) -> None:
    row = '\n[[channel]]\nname = "broken"\nquantity = "angle"\nunit = "rad"\n'
    with pytest.raises(ModelError, match=r'measurement.toml:4: channel.broken: found nan at 0.005 s.*gaps = "bridge"'):
        _read(folder, row)
    actual = _read(folder, row + 'gaps = "bridge"\n')
    np.testing.assert_allclose(actual["broken"].values, np.sin(T), atol=1e-8)
    bridged = "3 samples without a number; straight lines bridge what is missing, 0.0002 s at most"
    assert any(bridged in note for note in actual.notes)


LOW = 'filter = { kind = "lowpass", cutoff = '
BAND = 'filter = { kind = "bandpass", cutoff = '
ROW = '\n[[channel]]\nname = "n"\nquantity = "velocity"\nunit = "rpm"\n'


PULSES = """
[[channel]]
name = "n"
quantity = "speed"
measured = "pulses"
tacho = { pulses_per_turn = 60, threshold = 1e6 }
"""


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (ROW + 'colour = "red"\n', r"measurement.toml:\d+: channel.0.colour: found \"red\"; unknown key"),
        (ROW.replace("rpm", "N*m"), r"channel.0.unit: found \"N\*m\"; must be an angular velocity"),
        (ROW.replace("rpm", "xyzzy"), r"channel.0.unit: .*known unit"),
        (ROW.replace("velocity", "velocty"), r'did you mean "velocity"'),
        (ROW.replace('"n"', '"N2"'), r"channel.N2.name: .*no column of .*record.mat has this name"),
        (ROW + 'source = "encodr"\n', r'channel.n.source.*did you mean "encoder"'),
        (ROW.replace('unit = "rpm"\n', ""), r"channel.n.unit: .*needs its unit of angular velocity"),
        (ROW + ROW, r"channel.1.name: found \"n\"; another channel has this name"),
        ("", r"needs at least one \[\[channel\]\]"),
        ('rate = "0 Hz"\n' + ROW, r"rate: .*greater than zero"),
        ('rate = "10 rpm"\n' + ROW, r"rate: .*Hz or kHz"),
        ('time = "time"\n' + ROW, r'time: found "time"; no column has this name'),
        ('time_unit = "rpm"\n' + ROW, r"record.mat: t: found \"rpm\"; must be a time"),
        ('time = "t"\nsampled = "1 kHz"\n' + ROW, r"sampled: .*for a file without times"),
        ('start = "5 s"\n' + ROW, r"leave nothing of the record, which goes from 0 s to 1.99995 s"),
        ('format = "matlab"\n' + ROW, r"measurement.toml:3: format: found \"matlab\"; must be one of"),
        ('format = "wav"\n' + ROW, r"record.mat: .*cannot be read as wav"),
        (ROW + 'measured = "torque"\n', r"a torque does not become a velocity"),
        (ROW + 'measured = "pulses"\n', r"pulses need tacho"),
        (ROW + "tacho = { pulses_per_turn = 60 }\n", r"tacho: .*belongs to pulses"),
        (ROW + 'starts_over = "1 turn"\n', r"starts_over: .*belongs to a measured angle"),
        (ROW + BAND + '"1 kHz" }\n', r"filter.cutoff: .*a bandpass has two frequencies"),
        (ROW + BAND + '["2 kHz", "1 kHz"] }\n', r"must ascend: the lower edge"),
        (ROW + LOW + '"10 kHz" }\n', r"filter.cutoff: found 10000 Hz; must lie below half"),
        ('rate = "100 Hz"\n' + ROW + LOW + '"60 Hz" }\n', r"half the sampling rate, 50 Hz"),
        (ROW + 'align = { with = "n" }\n', r"align: .*belongs to a channel of a second file"),
        (ROW + 'file = "gone.wav"\n', r"gone.wav: no such file"),
        (ROW + 'file = "x.wav"\nalign = { with = "m" }\n', r"align.with: found \"m\"; no channel has this name"),
        (ROW + 'file = "x.wav"\nalign = { with = "n" }\n', r"must be a channel of the measurement's own file"),
        (ROW + 'file = "x.wav"\nalign = { with = "n", by = "order-phase" }\n', r"order-phase needs the frequency"),
        (PULSES, r"channel.n.tacho: found 0 pulses at the threshold 1e\+06; needs 4 pulses or more"),
        ("schema = 2\n", r"not valid TOML: cannot overwrite"),
        ("[[channel]\n", r"measurement.toml:\d: not valid TOML"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(text: str, words: str, folder: Path) -> None:
    with pytest.raises(ModelError, match=words):
        _read(folder, text)


def test_all_faults_of_a_mapping_are_told_at_once(folder: Path) -> None:
    with pytest.raises(ModelError) as caught:
        _read(folder, ROW.replace("rpm", "N*m") + ROW.replace('"n"', '"m"').replace("velocity", "spped"))
    assert len(caught.value.problems) == 2


def test_different_times_need_a_rate(folder: Path) -> None:
    savemat(folder / "record.mat", {"a": {"t": T, "n": T}, "b": {"t": T[::2], "m": T[::2]}})
    rows: list[dict[str, Any]] = [
        {"name": "n", "source": "a.n", "quantity": "speed", "unit": "rad/s"},
        {"name": "m", "source": "b.m", "quantity": "speed", "unit": "rad/s"},
    ]
    with pytest.raises(ModelError, match=r"n and m; have different times.*rate = "):
        gr.read({"file": str(folder / "record.mat"), "channel": rows})
    actual = gr.read({"file": str(folder / "record.mat"), "rate": "1 kHz", "channel": rows})
    np.testing.assert_allclose(actual["n"].values, actual["m"].values, atol=1e-3)


def test_uneven_samples_need_a_rate_to_be_filtered(folder: Path) -> None:
    uneven = T[::40] + 2e-4 * np.sin(np.arange(1000.0))
    savemat(folder / "record.mat", {"t": uneven, "n": np.sin(TURN * 5.0 * uneven)})
    text = ROW.replace("rpm", "rad/s") + 'filter = { kind = "lowpass", cutoff = "50 Hz" }\n'
    with pytest.raises(ModelError, match=r"filter: a filter needs uniform samples.*rate"):
        _read(folder, text)
    actual = _read(folder, 'rate = "400 Hz"\n' + text)
    np.testing.assert_allclose(actual["n"].values[50:-50], np.sin(TURN * 5.0 * actual.time)[50:-50], atol=1e-3)
    assert any("not sampled uniformly; a cubic spline" in note for note in actual.notes)


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        ([1, 9], r'm.gaps: found nan at 0.9 s \(sample 9\), in the last row; .*cut the record: end = "0.8 s"'),
        ([0, 2], r'm.gaps: found nan at 0 s \(sample 0\), in the first row; .*cut the record: start = "0.1 s"'),
        ([0, 5, 9], r'0 s .*in the first row and nan at 0.9 s .*in the last row; .*start = "0.1 s", end = "0.8 s"'),
        (list(range(1, 9)), "found 2 numbers among 10 samples; a channel needs 4 numbers"),
    ],
)
def test_the_gap_that_cannot_be_bridged_is_named(bad: list[int], words: str, tmp_path: Path) -> None:
    """A gap between numbers is not blamed; the cuts that are advised make it readable."""
    rows = [f"{0.1 * k:.1f},{'' if k in bad else k}" for k in range(10)]
    (tmp_path / "m.csv").write_text("\n".join(["t [s],m [Nm]", *rows, ""]))
    row = {"name": "m", "quantity": "torque", "gaps": "bridge"}
    tables = {"file": str(tmp_path / "m.csv"), "channel": [row]}
    with pytest.raises(ModelError, match=words) as caught:
        gr.read(tables)
    cuts = dict(re.findall(r'(start|end) = "([^"]*)"', str(caught.value)))
    if cuts:
        record = gr.read({**tables, **cuts})
        np.testing.assert_allclose(record["m"].values, 10.0 * record.time, atol=1e-12)


@pytest.mark.parametrize(
    ("measured", "quantity"),
    [("speed", "velocity"), ("velocity", "speed"), ("angle", "shaft angle"), ("shaft angle", "angle")],
)
def test_a_speed_and_a_velocity_are_one_thing(measured: str, quantity: str, folder: Path) -> None:
    unit = "rpm" if measured in ("speed", "velocity") else "deg"
    row = f'\n[[channel]]\nname = "n"\nunit = "{unit}"\nmeasured = "{measured}"\nquantity = "{quantity}"\n'
    same = f'\n[[channel]]\nname = "n"\nunit = "{unit}"\nquantity = "{quantity}"\n'
    record = _read(folder, row)
    assert record["n"].quantity == quantity
    np.testing.assert_array_equal(record["n"].values, _read(folder, same)["n"].values)


def test_a_speed_is_differentiated_to_an_acceleration(folder: Path) -> None:
    row = '\n[[channel]]\nname = "n"\nunit = "rpm"\nmeasured = "speed"\nquantity = "acceleration"\n'
    record = _read(folder, row)
    expected = TURN * 0.4 * TURN * 40.0 * np.cos(TURN * 40.0 * T)
    np.testing.assert_allclose(record["n"].values[9:-9], expected[9:-9], atol=2e-3)
    with pytest.raises(ModelError, match="an acceleration does not become a speed"):
        _read(folder, '\n[[channel]]\nname = "n"\nmeasured = "acceleration"\nquantity = "speed"\n')
