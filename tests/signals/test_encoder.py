"""An encoder that starts over: clean, filtered, sampled in its fall; against the angle that it follows."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, lfilter, lfilter_zi, sosfiltfilt

from gearrattle.signals.encoder import FallError, unwrapped

TURN = 360.0


def _angle(samples_a_turn: float, samples: int = 4000, swing: float = 0.1) -> np.ndarray:
    """Turns at a mean speed with an order 2 on it, a tenth of the speed."""
    turns = np.arange(samples) / samples_a_turn
    return TURN * (turns + swing / (4.0 * np.pi) * np.sin(4.0 * np.pi * turns)) + 11.0


def _filtered(encoder: np.ndarray) -> np.ndarray:
    """A second-order low pass at 0.4 of half the rate, at rest at the first sample."""
    b, a = butter(2, 0.4)
    return lfilter(b, a, encoder, zi=lfilter_zi(b, a) * encoder[0])[0]


def _whole(difference: np.ndarray) -> np.ndarray:
    """Take whole turns away: an angle is known but for these."""
    return difference - TURN * np.round(np.median(difference) / TURN)


def test_clean_falls_stay_as_they_were() -> None:
    time = np.linspace(0.0, 3.0, 500)
    true = 9.0 * np.sin(time) * time
    for span in (2.0 * np.pi, 0.5):
        result = unwrapped(np.mod(true, span), span)
        np.testing.assert_allclose(result.values, true, atol=1e-12)
        assert (result.falls, result.replaced) == (0, 0)


@pytest.mark.parametrize("per_turn", [5.0, 7.3, 12.0, 20.0, 100.0, 1000.0])
@pytest.mark.parametrize("swing", [0.0, 0.1])
def test_clean_falls_of_many_and_few_samples(per_turn: float, swing: float) -> None:
    true = _angle(per_turn, swing=swing) + 0.05 * np.random.default_rng(3).standard_normal(4000)
    result = unwrapped(np.mod(true, TURN), TURN)
    assert result.falls == 0
    np.testing.assert_allclose(_whole(result.values - true), 0.0, atol=1e-9)


@pytest.mark.parametrize("per_turn", [45.0, 60.5, 120.0, 400.0, 1500.0])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_filter_over_the_falls(per_turn: float, way: float) -> None:
    """The angle behind the filter, which is the filtered angle, within 1 degree, or 0.05 from 100 samples a turn on."""
    true = way * _angle(per_turn)
    b, a = butter(2, 0.4)
    behind = lfilter(b, a, true - true[0]) + true[0]
    result = unwrapped(_filtered(np.mod(true, TURN)), TURN)
    error = _whole(result.values - behind)[12:-12]
    assert np.abs(error).max() < (0.05 if per_turn > 100.0 else 1.0)
    assert result.falls == pytest.approx(4000 / per_turn, abs=1.5)


def test_a_filter_without_phase_over_the_falls() -> None:
    true = _angle(200.0)
    result = unwrapped(sosfiltfilt(butter(2, 0.4, output="sos"), np.mod(true, TURN)), TURN)
    assert np.abs(_whole(result.values - true)[30:-30]).max() < 0.1


@pytest.mark.parametrize("per_turn", [37.0, 120.0, 1500.0])
def test_samples_in_the_falls(per_turn: float) -> None:
    """One sample in each fall, anywhere between the ends; one within 3 % of the turn of the truth may stay."""
    rng = np.random.default_rng(5)
    true = _angle(per_turn)
    encoder = np.mod(true, TURN)
    for fall in np.flatnonzero(np.diff(encoder) < -0.5 * TURN):
        encoder[fall + int(rng.integers(2))] = rng.uniform(0.0, TURN)
    result = unwrapped(encoder, TURN)
    assert np.abs(_whole(result.values - true)[2:-2]).max() < 0.03 * TURN


@pytest.mark.parametrize("per_turn", [6.3, 9.0, 14.0, 22.0, 30.0])
def test_a_filter_that_leaves_too_little_is_refused(per_turn: float) -> None:
    with pytest.raises(FallError, match="falls"):
        unwrapped(_filtered(np.mod(_angle(per_turn), TURN)), TURN)


def test_an_encoder_of_another_span_is_refused() -> None:
    """Falls of 300 where 360 are said, each over two samples."""
    encoder = np.mod(_angle(100.0), 300.0)
    encoder[np.flatnonzero(np.diff(encoder) < -150.0)] = 150.0
    with pytest.raises(FallError, match=r"it falls by 0\.8"):
        unwrapped(encoder, TURN)


def test_a_spike_is_no_fall() -> None:
    true = _angle(400.0)
    encoder = np.mod(true, TURN)
    encoder[250] += 40.0
    result = unwrapped(encoder, TURN)
    assert result.falls == 0
    np.testing.assert_allclose(np.delete(result.values - true, 250), result.values[0] - true[0], atol=1e-9)
