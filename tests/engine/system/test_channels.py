"""Piecewise polynomials on intervals of their own: shifting, cutting, integrating and joining them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from gearrattle.engine.system.piecewise_channels import Channel, distinct, joined, shifted


def random_channel(seed: int, end: float = 3.0, degree: int = 3) -> Channel:
    rng = np.random.default_rng(seed)
    knots = np.sort(np.concatenate([[0.0, end], rng.uniform(0.0, end, 6)]))
    return Channel(knots, rng.normal(size=(7, degree + 1)))


def test_values_are_those_of_the_polynomials() -> None:
    channel = random_channel(0)
    for g, (begin, end) in enumerate(zip(channel.knots[:-1], channel.knots[1:], strict=True)):
        time = np.linspace(begin, end, 5)[:-1]
        polynomial = Polynomial(channel.coefficients[g])
        for derivative in range(3):
            assert channel.at(time, derivative) == pytest.approx(polynomial.deriv(derivative)(time - begin), rel=1e-13)


def test_shifted_polynomials_are_the_same() -> None:
    rng = np.random.default_rng(1)
    coefficients, by = rng.normal(size=(20, 6)), rng.uniform(0.0, 2.0, 20)
    moved, at = shifted(coefficients, by), 0.7
    for a, b, d in zip(coefficients, moved, by, strict=True):
        assert Polynomial(b)(at) == pytest.approx(Polynomial(a)(at + d), rel=1e-12)


def test_a_part_counts_from_its_own_begin() -> None:
    channel = random_channel(2)
    part, time = channel.between(0.4, 2.5), np.linspace(0.0, 2.0, 50)
    assert part.knots[0] == 0.0
    assert part.at(time) == pytest.approx(channel.at(time + 0.4), rel=1e-11, abs=1e-13)


def test_an_integral_is_continuous_and_has_the_channel_as_its_derivative() -> None:
    channel = random_channel(3)
    integral, time = channel.integral(0.25), np.linspace(0.0, 3.0, 60)[:-1]
    assert integral.at(time, 1) == pytest.approx(channel.at(time), rel=1e-13)
    assert integral.at(np.zeros(1))[0] == 0.25
    for knot in integral.knots[1:-1]:
        before, after = integral.at(np.array([np.nextafter(knot, 0.0), knot]))
        assert before == pytest.approx(after, abs=1e-13)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    pieces = [
        0.5 * (b - a) * weights @ channel.at(0.5 * (a + b) + 0.5 * (b - a) * nodes)
        for a, b in zip(channel.knots[:-1], channel.knots[1:], strict=True)
    ]
    assert integral.at(channel.knots[-1:])[0] == pytest.approx(0.25 + sum(pieces), rel=1e-13)


def test_joined_channels_keep_their_values() -> None:
    first, second = random_channel(4, degree=2), random_channel(5, end=2.0, degree=5)
    torque, error = np.eye(2), np.zeros((1, 2))
    actual, time = joined([first, second], torque, error), np.linspace(0.0, 2.0, 200)[:-1]
    assert actual.knots[-1] == 2.0
    assert (actual.channels, actual.degree) == (2, 5)
    assert actual.at(time)[:, 0] == pytest.approx(first.at(time), rel=1e-10, abs=1e-12)
    assert actual.at(time)[:, 1] == pytest.approx(second.at(time), rel=1e-10, abs=1e-12)


def test_knots_that_differ_by_rounding_are_one() -> None:
    knots = np.linspace(0.0, 1.0, 11)
    nearly = knots.copy()
    nearly[1:-1] = np.nextafter(knots[1:-1], 2.0)
    one, two = (Channel(k, np.ones((10, 1))) for k in (knots, nearly))
    assert len(joined([one, two], np.eye(2), np.zeros((0, 2))).knots) == 11


def test_near_knots_leave_some_of_their_chain() -> None:
    """Knots, each within 1e-13 of the one before, are thinned and not lost; both ends stay."""
    chain = 0.5 + 0.9e-13 * np.arange(1000)
    times = np.concatenate([[0.0, 1e-15], chain, [1.0 - 1e-15, 1.0]])
    kept = distinct(times)
    assert (kept[0], kept[-1]) == (0.0, 1.0)
    assert np.diff(kept).min() > 1e-13
    assert max(np.abs(kept - time).min() for time in times) <= 1e-13
    assert len(kept) == 502
