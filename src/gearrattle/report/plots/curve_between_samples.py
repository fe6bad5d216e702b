"""A deflection and its rate between the samples of a motion.

Between two samples without a crossing, the deflection is a polynomial of fifth degree with the same value, rate and
second derivative at both. At a crossing of its own corners, value and rate are known and the second derivative jumps:
so between a crossing and a sample the polynomial is of fourth degree, between two crossings of third degree. In this
way few samples are enough for a smooth curve.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.trajectory import Array

PIECES = 8
"""Number of chords from one sample or crossing to the next."""


class Knots(NamedTuple):
    """Values, rates and second derivatives of a deflection at ascending times; NaN for a derivative that jumps."""

    time: Array
    value: Array
    rate: Array
    second: Array


def with_crossings(samples: Knots, time: Array, value: Array, rate: Array) -> Knots:
    """Return samples with the crossings within their time in order."""
    inside = (time > samples.time[0]) & (time < samples.time[-1])
    crossings = Knots(time[inside], value[inside], rate[inside], np.full(int(inside.sum()), np.nan))
    every = Knots(*(np.concatenate(pair) for pair in zip(samples, crossings, strict=True)))
    order = np.argsort(every.time, kind="stable")
    return Knots(*(part[order] for part in every))


def between(knots: Knots) -> Array:
    """Return (N, 2) value and rate at all knots and between them, with ``PIECES`` chords from knot to knot."""
    h = np.diff(knots.time)
    h = np.where(h > 0.0, h, 1.0)
    p0 = knots.value[:-1]
    p1 = knots.value[1:]
    v0 = knots.rate[:-1] * h
    v1 = knots.rate[1:] * h
    # of the cubic
    first = 6.0 * (p1 - p0) - 4.0 * v0 - 2.0 * v1
    last = -6.0 * (p1 - p0) + 2.0 * v0 + 4.0 * v1
    a0 = knots.second[:-1] * h**2
    a1 = knots.second[1:] * h**2
    no_first = np.isnan(a0)
    no_last = np.isnan(a1)
    begin = np.where(no_first, np.where(no_last, first, 12.0 * (p1 - p0 - v0) - 6.0 * (v1 - v0) + a1), a0)
    end = np.where(no_last, np.where(no_first, last, a0 - 12.0 * (p1 - p0 - v0 - 0.5 * a0) + 6.0 * (v1 - v0 - a0)), a1)
    a0 = begin
    a1 = end
    rest = p1 - p0 - v0 - 0.5 * a0
    slope = v1 - v0 - a0
    bend = a1 - a0
    c3 = 10.0 * rest - 4.0 * slope + 0.5 * bend
    c4 = -15.0 * rest + 7.0 * slope - bend
    c5 = 6.0 * rest - 3.0 * slope + 0.5 * bend
    s = np.arange(PIECES)[:, None] / PIECES
    value = p0 + s * (v0 + s * (0.5 * a0 + s * (c3 + s * (c4 + s * c5))))
    rate = (v0 + s * (a0 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))) / h
    ways = np.stack([value.T.ravel(), rate.T.ravel()], axis=1)
    return np.concatenate([ways, [[knots.value[-1], knots.rate[-1]]]])
