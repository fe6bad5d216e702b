"""Root mean square and peak to peak against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.signals import peak_to_peak, rms


def test_rms_of_sines_and_mean() -> None:
    time = np.linspace(0.0, 3.0, 3 * 32 + 1)
    signal = 2.0 + 3.0 * np.sin(2 * np.pi * time + 0.4) + 0.5 * np.cos(14 * np.pi * time)
    assert rms(signal) == pytest.approx(np.sqrt(4.0 + 4.5 + 0.125), rel=1e-14)


def test_rms_is_the_trapezoidal_integral() -> None:
    assert rms(np.array([0.0, 1.0, 2.0])) == pytest.approx(np.sqrt(0.5 * (0.0 + 4.0) / 2 + 0.5), rel=1e-15)


def test_columns_are_measured_one_by_one() -> None:
    signal = np.array([[1.0, 0.0, -2.0], [1.0, 0.0, 2.0], [1.0, 0.0, -2.0]])
    assert rms(signal).tolist() == [1.0, 0.0, 2.0]
    assert peak_to_peak(signal).tolist() == [0.0, 0.0, 4.0]


@pytest.mark.parametrize("scale", [1e-200, 1e200])
def test_no_scale_overflows_or_vanishes(scale: float) -> None:
    assert rms(np.full(5, 3.0) * scale) == pytest.approx(3.0 * scale, rel=1e-15)


def test_a_signal_that_is_not_finite_stays_so() -> None:
    assert np.isnan(rms(np.array([1.0, np.nan, 1.0])))
