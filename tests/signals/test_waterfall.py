"""Spectra side by side: lines, powers, steps of speed, lines of order."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.signals.cross_spectra import cut
from gearrattle.signals.spectra_over_speed import Waterfall, by_steps, over_orders, waterfall

RATE = 1000.0


@pytest.mark.parametrize(("window", "off", "bound"), [("hann", 0.0, 1e-12), ("flattop", 0.5, 2e-3)])
def test_a_line_reads_its_amplitude_in_every_row(window: str, off: float, bound: float) -> None:
    hertz = (40.0 + off) * RATE / 500.0
    x = 3.0 * np.sin(2.0 * np.pi * hertz * np.arange(5000) / RATE + 0.4)
    rows = waterfall(x, RATE, cut(5000, 500, 0.5, window), None, density=False, highest=200.0)
    assert rows.values.shape == (19, 101)
    assert rows.values[:, 40] == pytest.approx(3.0, rel=bound)
    assert rows.time[:2] == pytest.approx([0.25, 0.5])
    assert np.isnan(rows.speed).all()


def test_densities_of_rows_hold_their_power() -> None:
    x = np.random.default_rng(9).standard_normal(4000)
    rows = waterfall(x, RATE, cut(4000, 400, 0.0, "boxcar"), None, density=True, highest=RATE)
    powers = [np.var(part) for part in np.split(x, 10)]
    assert rows.values.sum(axis=1) * rows.axis[1] == pytest.approx(powers, rel=1e-12)


def test_steps_of_speed_gather_mean_squares_whatever_the_order() -> None:
    speed = np.array([10.1, 19.8, 9.9, 30.0])
    values = np.array([[3.0], [1.0], [4.0], [2.0]])
    rows = Waterfall(np.array([5.0]), values, np.arange(4.0), speed, np.ones(4, np.int64))
    actual = by_steps(rows, 10.0, squared=False)
    assert actual.speed == pytest.approx([10.0, 19.8, 30.0])
    assert actual.values[:, 0] == pytest.approx([np.sqrt(12.5), 1.0, 2.0])
    assert actual.counts.tolist() == [2, 1, 1]
    assert by_steps(rows, 10.0, squared=True).values[0, 0] == pytest.approx(3.5)


def test_an_order_stands_upright_when_read_over_orders() -> None:
    time = np.arange(60_000) / RATE
    turns = 5.0 * time + 0.5 * 0.1 * time**2
    rows = waterfall(
        2.0 * np.sin(2.0 * np.pi * 6.0 * turns),
        RATE,
        cut(time.size, 1024, 0.5, "flattop"),
        2.0 * np.pi * (5.0 + 0.1 * time),
        density=False,
        highest=0.5 * RATE,
    )
    actual = over_orders(rows, np.array([4.0, 6.0, 60.0]))
    assert actual.values[:, 1] == pytest.approx(2.0, rel=0.02)
    assert actual.values[:, 0].max() < 1e-3
    assert np.isnan(actual.values[-1, 2]) and np.isfinite(actual.values[0, 2])  # noqa: PT018  60 x 11 Hz, 60 x 5 Hz
