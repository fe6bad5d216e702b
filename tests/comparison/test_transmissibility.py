"""Transmissibilities of sines, and distances in trees, loops and through ground."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.comparison import compare_transmissibility
from gearrattle.comparison.transmissibility_comparison import elements_from
from tests import synthetic
from tests.signals import handmade


def motion(loose, orders=(1.0, 3.0)):
    """A driver that shakes at orders 1 and 3, and a loose gear with the given amplitudes there."""
    waves = [[handmade.sine(a, k) for a, k in zip(entry, (1.0, 3.0), strict=True)] for entry in ((2.0, 1.0), loose)]
    sums = [lambda t, pair=pair: pair[0](t) + pair[1](t) for pair in waves]
    return handmade.trajectory(handmade.layout(orders=np.array(orders)), accelerations=sums, cycles=10)


def test_levels_bands_and_their_errors():
    reference, values = motion((1.0, 4.0)), motion((1.1, 2.0))
    actual = compare_transmissibility(values, reference)
    assert actual.reference.rms[1] == pytest.approx(np.sqrt(17.0 / 5.0))
    assert actual.rms_error[1] == pytest.approx(np.sqrt((1.21 + 4.0) / 17.0) - 1.0)
    assert actual.rms_error[0] == 0.0
    np.testing.assert_allclose(actual.reference.band[[0, 2], 1], [0.5, 4.0], rtol=1e-9)
    np.testing.assert_allclose(actual.band_error[[0, 2], 1], [0.1, -0.5], rtol=1e-9)
    np.testing.assert_allclose(actual.frequency, [1.0, 2.0, 3.0, 4.0, 5.0], rtol=1e-12)


def test_bands_follow_the_lowest_excited_order():
    actual = compare_transmissibility(motion((1.0, 4.0), (3.0,)), motion((2.0, 2.0), (3.0,)))
    assert actual.frequency[0] == pytest.approx(3.0)
    assert actual.band_error[0, 1] == pytest.approx(1.0, rel=1e-6)


def test_errors_are_ordered_from_the_driving_point_outward():
    motion = synthetic.trajectory()
    actual = compare_transmissibility(motion, motion)
    assert actual.distance.tolist() == [0, 1, 2, 3]
    assert actual.by_distance() == dict.fromkeys(range(4), (0.0, 0.0))


@pytest.mark.parametrize(
    ("between", "start", "expected"),
    [
        ([[0, 1], [1, 2], [2, 3]], 3, [3, 2, 1, 0]),
        ([[0, 1], [0, 2], [0, 3]], 1, [1, 0, 2, 2]),
        ([[0, 1], [1, 2], [2, 3], [3, 0]], 0, [0, 1, 2, 1]),
        ([[0, -1], [1, -1], [2, 3]], 0, [0, -1, -1, -1]),
        ([[2, 3], [1, 0]], 3, [-1, -1, 1, 0]),
    ],
    ids=["chain", "star", "ring", "ground", "two parts"],
)
def test_distances(between, start, expected):
    radii = np.ones((len(between), 2))
    plate = handmade.layout(inertia_names=("a", "b", "c", "d"), between=np.array(between), radii=radii)
    assert elements_from(plate, start).tolist() == expected


def test_inertias_out_of_reach_come_last():
    plate = handmade.layout(between=np.array([[0, -1], [1, -1]]))
    still = handmade.trajectory(plate, accelerations=(handmade.still, handmade.sine(1.0)))
    actual = compare_transmissibility(still, still)
    assert actual.outward.tolist() == [0, 1]
    assert list(actual.by_distance()) == [0, -1]
    assert np.all(np.isnan(actual.rms_error))
