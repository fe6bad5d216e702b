"""Records as rigs make them: a pulse lost, several gaps, an encoder behind a filter, slow channels beside fast ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat
from scipy.signal import butter, lfilter

import gearrattle as gr
from gearrattle.errors import ModelError

RATE = 200_000.0
T = np.arange(200_000) / RATE
TEETH_PASSED = 60 * 25.0 * T  # 1500 rpm


def _read(folder: Path, time: np.ndarray, values: np.ndarray, row: dict[str, Any], **top: Any) -> gr.measured.Recording:
    savemat(folder / "record.mat", {"t": time, "x": values})
    table = {"name": "x", "quantity": "speed", **row}
    return gr.read({"file": str(folder / "record.mat"), "channel": [table], **top})


def _wheel(teeth: int, left_out: set[int]) -> np.ndarray:
    """Square pulses at 1500 rpm."""
    passed = teeth * 25.0 * T
    tooth = np.floor(passed + 1e-9).astype(int) % teeth + 1
    return ((passed % 1.0 < 0.5) & ~np.isin(tooth, list(left_out))).astype(float)


def _speed(folder: Path, values: np.ndarray, tacho: dict[str, Any]) -> tuple[np.ndarray, str]:
    actual = _read(folder, T, values, {"measured": "pulses", "tacho": tacho})
    return actual["x"].values * 30.0 / np.pi, " / ".join(actual.notes)


@pytest.mark.parametrize("fault", ["none", "lost", "extra"])
def test_one_pulse_of_a_full_wheel(fault: str, tmp_path: Path) -> None:
    """1500 rpm within what samples 5 us apart tell of edges 667 us apart: 2 x 0.75 %, as without the fault."""
    pulses = _wheel(60, set())
    if fault == "lost":
        pulses[np.floor(TEETH_PASSED) == 1001] = 0.0
    if fault == "extra":
        at = int(1001.7 / 1500.0 * RATE)
        pulses[at : at + 20] = 1.0
    speed, notes = _speed(tmp_path, pulses, {"pulses_per_turn": 60})
    np.testing.assert_allclose(speed, 1500.0, rtol=0.015)
    words = {"none": "", "lost": "x: 1 pulse lost, at 0.6673", "extra": "x: 1 pulse too many left out, at 0.66779"}
    assert words[fault] in notes
    assert ("pulse lost" in notes, "too many" in notes) == (fault == "lost", fault == "extra")


@pytest.mark.parametrize(
    ("teeth", "left_out", "missing"),
    [
        (60, {59, 60}, 2),
        (60, {59, 60}, [2]),
        (44, {1, 2, 23, 24}, [2, 2]),
        (36, {1, 2, 19, 20, 22, 23}, [2, 2, 2]),
        (36, {1, 2, 19, 20, 22, 23}, [[1, 2], [19, 20], [22, 23]]),
    ],
)
def test_wheels_with_gaps(teeth: int, left_out: set[int], missing: Any, tmp_path: Path) -> None:
    speed, notes = _speed(tmp_path, _wheel(teeth, left_out), {"pulses_per_turn": teeth, "missing": missing})
    np.testing.assert_allclose(speed, 1500.0, rtol=0.015)
    assert "pulse lost" not in notes


@pytest.mark.parametrize(
    ("missing", "words"),
    [
        ([[1, 3]], r"missing.0: found \[1, 3\]; must be the numbers of neighbouring teeth from 1 to 36"),
        ([[35, 36], [1]], r"missing.0: found \[35, 36\]; the next tooth is missing as well"),
        ([[36, 37]], r"missing.0: .*neighbouring teeth from 1 to 36"),
        ([2, [1, 2]], r"missing"),
        (True, r"missing: found true; must be a whole number"),
        ([30, 3], r"missing: .*whole number from 1 to 20"),
        ([17, 16], r"missing: .*must leave two teeth more on the wheel than there are gaps"),
    ],
)
def test_gaps_that_are_none(missing: Any, words: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=words):
        _speed(tmp_path, _wheel(36, set()), {"pulses_per_turn": 36, "missing": missing})


@pytest.mark.parametrize("how", ["filtered", "sampled in its fall"])
def test_an_encoder_whose_falls_take_several_samples(how: str, tmp_path: Path) -> None:
    """1500 rpm, 400 samples a turn; the angle behind the filter is late by its delay, 1.1 samples."""
    time = np.arange(20_000) / 10_000.0
    true = 360.0 * 25.0 * time
    encoder = np.mod(true, 360.0)
    if how == "filtered":
        encoder = lfilter(*butter(2, 0.4), encoder)
    else:
        encoder[400::400] = 180.0
    actual = _read(tmp_path, time, encoder, {"quantity": "shaft angle", "unit": "deg", "starts_over": "360 deg"})
    late = np.degrees(actual["x"].values) - true
    assert np.ptp(late[20:]) < 0.1
    assert any("49 falls of the encoder over several samples" in note for note in actual.notes)


def test_an_encoder_whose_falls_are_smeared_over_a_turn_is_refused(tmp_path: Path) -> None:
    time = np.arange(2000) / 1000.0
    encoder = lfilter(*butter(2, 0.4), np.mod(360.0 * 71.0 * time, 360.0))
    with pytest.raises(ModelError, match=r"channel.x.starts_over: .*falls.*record it unfiltered"):
        _read(tmp_path, time, encoder, {"quantity": "shaft angle", "unit": "deg", "starts_over": "360 deg"})


@pytest.mark.parametrize("part", [0.01, 0.1, 0.39, 0.4])
@pytest.mark.parametrize("samples", [4, 20, 61, 62, 75, 201, 1000])
@pytest.mark.parametrize("rate", [1.7, 6.0, 10.0, 13.7, 200.0])
def test_wherever_a_value_is_given_it_is_within_1e_4(part: float, samples: int, rate: float, tmp_path: Path) -> None:
    """Up to 0.4 of the lower rate, any phase, to the ends of what is given; a record too short for that is refused."""
    time = np.arange(samples) / 10.0
    frequency = part * min(rate, 10.0)
    beyond = 0.0 if rate == 10.0 else 30.0 / min(rate, 10.0)
    left = (time[-1] - 2.0 * beyond) * rate  # intervals of the new rate
    if 0.0 <= left < 2.0:
        return  # none, one or two samples, as the grid lies
    for phase in (0.0, 0.7, np.pi / 2.0, 2.5):
        values = np.sin(2.0 * np.pi * frequency * time + phase)
        row = {"unit": "rad/s"}
        if left < 0.0:
            with pytest.raises(ModelError, match=r"known within 1e-4 only .*ends = \"keep\"|leaves one sample"):
                _read(tmp_path, time, values, row, rate=f"{rate} Hz")
            continue
        actual = _read(tmp_path, time, values, row, rate=f"{rate} Hz")
        true = np.sin(2.0 * np.pi * frequency * actual.time + phase)
        np.testing.assert_allclose(actual["x"].values, true, rtol=0.0, atol=1e-4)
        assert actual.time.size >= left - 1.0
        assert any("s at each end left out" in note for note in actual.notes) == (rate != 10.0)


def test_a_channel_at_the_rate_stays_beside_a_slow_one(tmp_path: Path) -> None:
    """To the last bit, what lies near half the rate included; the slow one limits the time."""
    fast = np.random.default_rng(1).standard_normal(20_001)
    slow = np.sin(2.0 * np.pi * 0.39 * np.arange(201))
    groups = {"a": {"t": np.arange(20_001) / 1000.0, "f": fast}, "b": {"t": np.arange(201) / 10.0, "s": slow}}
    savemat(tmp_path / "r.mat", groups)
    rows = [
        {"name": "f", "source": "a.f", "quantity": "speed", "unit": "rad/s"},
        {"name": "s", "source": "b.s", "quantity": "speed", "unit": "rad/s"},
    ]
    actual = gr.read({"file": str(tmp_path / "r.mat"), "rate": "1 kHz", "channel": rows})
    np.testing.assert_array_equal(actual["f"].values, fast[3000:17_001])
    np.testing.assert_allclose(actual["s"].values, np.sin(2.0 * np.pi * 3.9 * actual.time), atol=1e-4)
    rows[1]["ends"] = "keep"
    kept = gr.read({"file": str(tmp_path / "r.mat"), "rate": "1 kHz", "channel": rows})
    np.testing.assert_array_equal(kept["f"].values, fast)
    assert any("3 s at its ends are kept" in note for note in kept.notes)


def test_what_lies_beyond_start_and_end_is_used(tmp_path: Path) -> None:
    """So nothing is left out, and the values at start and end are within 1e-4; a gap beyond does not disturb."""
    time = np.arange(2001) / 100.0
    values = np.sin(2.0 * np.pi * 39.0 * time)
    for broken in (False, True):
        values[700] = np.nan if broken else values[700]
        actual = _read(tmp_path, time, values, {"unit": "rad/s"}, rate="1 kHz", start="7.2 s", end="12 s")
        np.testing.assert_allclose(actual["x"].values, np.sin(2.0 * np.pi * 39.0 * actual.time), atol=1e-4)
        assert actual.time[0] == pytest.approx(7.5 if broken else 7.2)
        assert actual.time[-1] == pytest.approx(11.7 if broken else 12.0)
