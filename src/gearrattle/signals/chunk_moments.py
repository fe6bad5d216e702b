"""Sums over the chunks of a long motion: moments, extremes, products for orders.

Its size does not grow with the number of chunks. Moments of two pieces merge as in P. Pebay (2008, Sandia report
SAND2008-6212, eqs. 2.1-2.9, after Chan, Golub, LeVeque 1979): no mean is taken away from a sum of squares. Orders rest
on the products of 1, the time, its square, sines and cosines with each other and with every signal, of which any least
squares with a polynomial beside the orders is solved in the end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.exact_statistics import Statistics
from gearrattle.signals.levels import extremes_missed
from gearrattle.signals.orders import repeating_angles, resolved
from gearrattle.signals.summaries import Summary
from gearrattle.signals.windows import steady
from gearrattle.trajectory import Array, Layout, Trajectory

_POWERS = 3  # 1, time, its square
Exactly = tuple[Sequence[int], Statistics]


@dataclass(frozen=True)
class Moments:
    """Of q signals: weight in sample intervals; mean, sums of central powers, extremes and by how much they may be
    passed between samples (``missed``), both end samples, (q,)."""

    weight: float
    mean: Array
    second: Array
    third: Array
    fourth: Array
    low: Array
    high: Array
    miss: Array
    first: Array
    last: Array

    @classmethod
    def of(cls, values: Array) -> Moments:
        """Return those of (N + 1, q) samples by the trapezoidal rule."""
        weight = float(len(values) - 1)
        mean = np.asarray(np.trapezoid(values, axis=0) / weight)
        away = values - mean
        square = away**2
        second, third, fourth = (np.asarray(np.trapezoid(p, axis=0)) for p in (square, square * away, square**2))
        return cls(
            weight=weight,
            mean=mean,
            second=second,
            third=third,
            fourth=fourth,
            low=values.min(axis=0),
            high=values.max(axis=0),
            miss=np.maximum(*extremes_missed(values)),
            first=values[0],
            last=values[-1],
        )

    def corrected(self, columns: Sequence[int], exact: Statistics) -> Moments:
        """Return these with what is known exactly of some columns; moments that are NaN stay those of samples."""
        weight = self.weight
        known = {
            "mean": exact.mean,
            "second": weight * exact.second,
            "third": weight * exact.third,
            "fourth": weight * exact.fourth,
            "low": exact.low,
            "high": exact.high,
            "miss": np.zeros(len(columns)),
        }
        changed = {name: getattr(self, name).copy() for name in known}
        for name, values in known.items():
            changed[name][list(columns)] = np.where(np.isnan(values), changed[name][list(columns)], values)
        return replace(self, **changed)

    def plus(self, other: Moments) -> Moments:
        """Return those of both pieces, the other one after this."""
        a = self.weight
        b = other.weight
        n = a + b
        d = other.mean - self.mean
        second = self.second + other.second + d**2 * a * b / n
        third = self.third + other.third + d**3 * a * b * (a - b) / n**2
        third = third + 3.0 * d * (a * other.second - b * self.second) / n
        fourth = self.fourth + other.fourth + d**4 * a * b * (a**2 - a * b + b**2) / n**3
        fourth = fourth + 6.0 * d**2 * (a**2 * other.second + b**2 * self.second) / n**2
        fourth = fourth + 4.0 * d * (a * other.third - b * self.third) / n
        return Moments(
            weight=n,
            mean=self.mean + d * b / n,
            second=second,
            third=third,
            fourth=fourth,
            low=np.minimum(self.low, other.low),
            high=np.maximum(self.high, other.high),
            miss=np.maximum(self.miss, other.miss),
            first=self.first,
            last=other.last,
        )

    def summary(self, column: int) -> Summary:
        """Return the summary of one signal."""
        second, fourth = (float(power[column]) / self.weight for power in (self.second, self.fourth))
        return Summary(
            float(self.mean[column]),
            second,
            fourth,
            float(self.low[column]),
            float(self.high[column]),
            float(self.miss[column]),
            column,
        )


@dataclass(frozen=True)
class SignalSums:
    """Sums over the signals of the chunks so far.

    Attributes
    ----------
    start, end
        of the window so far [s]; start is infinite while all is discarded.
    interval
        between samples [s].
    orders
        (o,) of the excitation.
    moments
        of the signals; None while all is discarded.
    gram
        (p, p) products of 1, s, s^2, sines and cosines, s = (time - start) / period.
    products
        (p, q) of these with the signals.
    loss
        (m,) work that elements took since the very begin [J]; None where a chunk was not audited.
    time
        since the very begin [s].
    """

    layout: Layout
    start: float
    end: float
    cycles: int
    discarded: int
    interval: float
    orders: Array
    moments: Moments | None
    gram: Array
    products: Array
    loss: Array | None
    time: float

    def amplitudes(self, products: Array, trend: int) -> NDArray[np.complex128]:
        """(o,) complex amplitudes of a signal, fitted with a polynomial of time; NaN where samples do not show them.

        Parameters
        ----------
        products
            (p,) of it with 1, s, s^2, sines and cosines.
        trend
            degree of the polynomial, 2 at most.
        """
        amplitudes = np.full(self.orders.size, np.nan + 0j)
        shown = resolved(self.orders, self.layout.omega, self.interval)
        count = int(np.count_nonzero(shown))
        if not count or self.gram[0, 0] < 2 * count + 1 + trend:
            return amplitudes
        chosen = np.flatnonzero(np.concatenate([np.arange(_POWERS) <= trend, shown, shown]))
        gram = self.gram[np.ix_(chosen, chosen)]
        right = products[chosen]
        scale = 1.0 / np.sqrt(np.diag(gram))  # s grows with the motion, sines do not
        weights = scale * np.linalg.lstsq(gram * np.outer(scale, scale), scale * right, rcond=None)[0]
        sines, cosines = np.split(weights[1 + trend :], 2)
        amplitudes[shown] = sines + 1j * cosines
        return amplitudes

    def velocities(self, angle: int, velocity: int) -> NDArray[np.complex128]:
        """(o,) complex amplitudes of an angle whose line and parabola join it and its velocity end to end."""
        assert self.moments is not None
        m = self.moments
        span = float(self.end - self.start)
        bend = 0.5 * float(m.last[velocity] - m.first[velocity]) * span
        rise = float(m.last[angle] - m.first[angle])
        along = self.layout.period / span  # of s, to go from 0 to 1
        line = self.gram[:, 1] * along
        parabola = self.gram[:, 2] * along**2
        return self.amplitudes(self.products[:, angle] - (rise - bend) * line - bend * parabola, 0)


def add_chunk(
    trajectory: Trajectory, signals: Array, orders: Array, before: SignalSums | None, exact: Exactly | None = None
) -> SignalSums:
    """Return the sums over a chunk and all before it.

    Parameters
    ----------
    signals
        (N + 1, q) on the grid of its steady part, both bounds included; (0, q) if all of it is discarded.
    orders
        (o,) of the excitation.
    exact
        columns of the signals whose statistics are known between samples, and these.
    """
    window = steady(trajectory) if trajectory.discard < trajectory.cycles else None
    kept = _start(trajectory, signals.shape[1], orders) if before is None else before
    kept = replace(kept, discarded=kept.discarded + trajectory.discard)
    kept = replace(kept, time=kept.time + float(trajectory.time[-1] - trajectory.time[0]), loss=_lost(trajectory, kept))
    if window is not None:
        start = min(kept.start, window.start)
        kept = replace(kept, start=start, end=window.end, cycles=kept.cycles + window.cycles)
        kept = _sampled(kept, window.closed(trajectory.time), signals, exact)
    return kept


def _start(trajectory: Trajectory, signals: int, orders: Array) -> SignalSums:
    size = _POWERS + 2 * orders.size
    return SignalSums(
        layout=trajectory.layout,
        start=np.inf,
        end=0.0,
        cycles=0,
        discarded=0,
        interval=float(trajectory.time[-1] - trajectory.time[0]) / (trajectory.time.size - 1),
        orders=orders,
        moments=None,
        gram=np.zeros((size, size)),
        products=np.zeros((size, signals)),
        loss=np.zeros(trajectory.layout.is_mesh.size),
        time=0.0,
    )


def _lost(trajectory: Trajectory, kept: SignalSums) -> Array | None:
    audit = trajectory.energy
    return None if audit is None or kept.loss is None else np.asarray(kept.loss + audit.element_loss)


def _sampled(kept: SignalSums, time: Array, signals: Array, exact: Exactly | None) -> SignalSums:
    """Add samples: moments by both bounds, products by each sample once."""
    moments = Moments.of(signals)
    if exact is not None:
        moments = moments.corrected(*exact)
    s = (time[:-1] - kept.start) / kept.layout.period
    columns = np.concatenate([s[:, None] ** np.arange(_POWERS), _waves(kept, time[:-1])], axis=1)
    return replace(
        kept,
        moments=moments if kept.moments is None else kept.moments.plus(moments),
        gram=kept.gram + columns.T @ columns,
        products=kept.products + columns.T @ signals[:-1],
    )


def _waves(kept: SignalSums, time: Array) -> Array:
    """(N, 2 o) sines and cosines of the orders."""
    omega = kept.layout.omega
    periods = max(1, round((time.size * kept.interval) / kept.layout.period))
    angle = repeating_angles(time, omega, kept.orders, periods)
    if angle is None:
        angle = omega * np.multiply.outer(time, kept.orders)
        periods = 1
    return np.tile(np.concatenate([np.sin(angle), np.cos(angle)], axis=1), (periods, 1))
