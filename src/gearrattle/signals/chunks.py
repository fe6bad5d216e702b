"""What is kept of the chunks of a long motion: moments, extremes, products for orders, contacts and sides.

Its size does not grow with the number of chunks. Moments of two pieces merge as in P. Pebay (2008, Sandia report
SAND2008-6212, eqs. 2.1-2.9, after Chan, Golub, LeVeque 1979): no mean is taken away from a sum of squares. Orders rest
on the products of 1, the time, its square, sines and cosines with each other and with every signal, of which any least
squares with a polynomial beside the orders is solved in the end. A contact that a chunk leaves open is carried on as
the crossing that began it.

Takes consecutive Trajectories and signals on their grid; gives a Tally.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.signals.impacts import Impacts, find_impacts
from gearrattle.signals.levels import extremes_missed
from gearrattle.signals.orders import repeating_angles, resolved
from gearrattle.signals.regions import centre, dwell_times
from gearrattle.signals.summaries import Contacts, Sides, Summary, added, flank_before
from gearrattle.signals.windows import steady
from gearrattle.system.statistics import Statistics
from gearrattle.trajectory import Array, EventLog, IntArray, Layout, Trajectory

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
        low, high, miss = values.min(axis=0), values.max(axis=0), np.maximum(*extremes_missed(values))
        return cls(weight, mean, second, third, fourth, low, high, miss, values[0], values[-1])

    def corrected(self, columns: Sequence[int], exact: Statistics) -> Moments:
        """Return these with what is known exactly of some columns; moments that are NaN stay those of samples."""
        weight = self.weight
        known = {
            "mean": exact.mean, "second": weight * exact.second, "third": weight * exact.third,
            "fourth": weight * exact.fourth, "low": exact.low, "high": exact.high, "miss": np.zeros(len(columns)),
        }  # fmt: skip
        changed = {name: getattr(self, name).copy() for name in known}
        for name, values in known.items():
            changed[name][list(columns)] = np.where(np.isnan(values), changed[name][list(columns)], values)
        return replace(self, **changed)

    def plus(self, other: Moments) -> Moments:
        """Return those of both pieces, the other one after this."""
        a, b = self.weight, other.weight
        n, d = a + b, other.mean - self.mean
        second = self.second + other.second + d**2 * a * b / n
        third = self.third + other.third + d**3 * a * b * (a - b) / n**2
        third = third + 3.0 * d * (a * other.second - b * self.second) / n
        fourth = self.fourth + other.fourth + d**4 * a * b * (a**2 - a * b + b**2) / n**3
        fourth = fourth + 6.0 * d**2 * (a**2 * other.second + b**2 * self.second) / n**2
        fourth = fourth + 4.0 * d * (a * other.third - b * self.third) / n
        return Moments(
            n, self.mean + d * b / n, second, third, fourth, np.minimum(self.low, other.low),
            np.maximum(self.high, other.high), np.maximum(self.miss, other.miss), self.first, other.last,
        )  # fmt: skip

    def summary(self, column: int) -> Summary:
        """Return the summary of one signal."""
        second, fourth = (float(each[column]) / self.weight for each in (self.second, self.fourth))
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
class Tally:
    """What is kept of the chunks so far.

    Attributes:
        layout: the driveline's name plate.
        start, end: of the window so far [s]; start is infinite while all is discarded.
        cycles: of the window, discarded: before it.
        interval: between samples [s].
        orders: (o,) of the excitation.
        moments: of the signals; None while all is discarded.
        gram: (p, p) products of 1, s, s^2, sines and cosines, s = (time - start) / period.
        products: (p, q) of these with the signals.
        open: crossings that began contacts not yet ended.
        contacts: of every clearance, those that have ended.
        dwell: time in each region of every clearance [s].
        flanks: (K, 2) impacts on the same flank as the contact before, and on the other.
        before: (K,) flank of the last contact: 1 drive, -1 coast, 0 none yet.
        loss: (m,) work that elements took since the very begin [J]; None where a chunk was not audited.
        time: since the very begin [s].
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
    open: EventLog
    contacts: tuple[Contacts, ...]
    dwell: tuple[Array, ...]
    flanks: IntArray
    before: IntArray
    loss: Array | None
    time: float

    def contact(self, clearance: int) -> Contacts:
        """Return what the contacts of a clearance add up to, the open one included."""
        mine = (self.open.clearance == clearance) & (self.open.time >= self.start)
        began, speeds = self.open.time[mine], float(np.sum(np.abs(self.open.velocity[mine])))
        time = float(np.sum(self.end - began))
        return self.contacts[clearance].plus(Contacts(speeds=speeds, time=time, cut=bool(began.size)))

    def sides(self, clearance: int) -> Sides:
        """Return where a clearance spent its time, and how its impacts changed flanks."""
        first, times = int(self.layout.region_of_first_piece[clearance]), self.dwell[clearance]
        shares = {first + k: float(each) / (self.end - self.start) for k, each in enumerate(times)}
        return Sides(shares, int(self.flanks[clearance, 0]), int(self.flanks[clearance, 1]))

    def amplitudes(self, products: Array, trend: int) -> NDArray[np.complex128]:
        """(o,) complex amplitudes of a signal beside a polynomial of time; NaN where the samples do not show them.

        Args:
            products: (p,) of it with 1, s, s^2, sines and cosines.
            trend: degree of the polynomial, 2 at most.
        """
        found = np.full(self.orders.size, np.nan + 0j)
        shown = resolved(self.orders, self.layout.omega, self.interval)
        count = int(np.count_nonzero(shown))
        if not count or self.gram[0, 0] < 2 * count + 1 + trend:
            return found
        chosen = np.flatnonzero(np.concatenate([np.arange(_POWERS) <= trend, shown, shown]))
        gram, right = self.gram[np.ix_(chosen, chosen)], products[chosen]
        scale = 1.0 / np.sqrt(np.diag(gram))  # s grows with the motion, sines do not
        weights = scale * np.linalg.lstsq(gram * np.outer(scale, scale), scale * right, rcond=None)[0]
        sines, cosines = np.split(weights[1 + trend :], 2)
        found[shown] = sines + 1j * cosines
        return found

    def velocities(self, angle: int, velocity: int) -> NDArray[np.complex128]:
        """(o,) complex amplitudes of an angle whose line and parabola join it and its velocity end to end.

        Args:
            angle, velocity: their columns.
        """
        assert self.moments is not None
        m, span = self.moments, float(self.end - self.start)
        bend = 0.5 * float(m.last[velocity] - m.first[velocity]) * span
        rise = float(m.last[angle] - m.first[angle])
        along = self.layout.period / span  # of s, to go from 0 to 1
        line, parabola = self.gram[:, 1] * along, self.gram[:, 2] * along**2
        return self.amplitudes(self.products[:, angle] - (rise - bend) * line - bend * parabola, 0)


def gather(
    trajectory: Trajectory, signals: Array, orders: Array, before: Tally | None, exact: Exactly | None = None
) -> Tally:
    """Return the tally of a chunk and of all before it.

    Args:
        trajectory: the next chunk, of whole cycles.
        signals: (N + 1, q) on the grid of its steady part, both bounds included; (0, q) if all of it is discarded.
        orders: (o,) of the excitation.
        before: None at the first.
        exact: columns of the signals whose statistics are known between samples, and these.
    """
    kept = _begun(trajectory, signals.shape[1], orders) if before is None else before
    kept = replace(kept, time=kept.time + float(trajectory.time[-1] - trajectory.time[0]), loss=_lost(trajectory, kept))
    if trajectory.discard < trajectory.cycles:
        window = steady(trajectory)
        start = min(kept.start, window.start)
        kept = replace(kept, start=start, end=window.end, cycles=kept.cycles + window.cycles)
        kept = _sampled(kept, window.closed(trajectory.time), signals, exact)
        times = tuple(each + dwell_times(trajectory, k, window) for k, each in enumerate(kept.dwell))
        kept = replace(kept, dwell=times)
    kept = replace(kept, discarded=kept.discarded + trajectory.discard)
    return _logged(kept, trajectory)


def _begun(trajectory: Trajectory, signals: int, orders: Array) -> Tally:
    layout = trajectory.layout
    count, size = layout.clearance.size, _POWERS + 2 * orders.size
    nothing = {each.name: getattr(trajectory.events, each.name)[:0] for each in fields(EventLog)}
    begun = np.zeros(count, dtype=np.int64)
    for k, region in enumerate(trajectory.initial_region.tolist()):
        inner = centre(layout, k)
        begun[k] = 0 if region in inner else 1 if region > max(inner) else -1
    return Tally(
        layout, np.inf, 0.0, 0, 0, float(trajectory.time[-1] - trajectory.time[0]) / (trajectory.time.size - 1), orders,
        None, np.zeros((size, size)), np.zeros((size, signals)), EventLog(**nothing), (Contacts(),) * count,
        tuple(np.zeros(each.size) for each in layout.stiffness_of_piece), np.zeros((count, 2), dtype=np.int64), begun,
        np.zeros(layout.is_mesh.size), 0.0,
    )  # fmt: skip


def _lost(trajectory: Trajectory, kept: Tally) -> Array | None:
    audit = trajectory.energy
    return None if audit is None or kept.loss is None else np.asarray(kept.loss + audit.element_loss)


def _sampled(kept: Tally, time: Array, signals: Array, exact: Exactly | None) -> Tally:
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


def _waves(kept: Tally, time: Array) -> Array:
    """(N, 2 o) sines and cosines of the orders."""
    omega, periods = kept.layout.omega, max(1, round((time.size * kept.interval) / kept.layout.period))
    angle = repeating_angles(time, omega, kept.orders, periods)
    if angle is None:
        angle, periods = omega * np.multiply.outer(time, kept.orders), 1
    return np.tile(np.concatenate([np.sin(angle), np.cos(angle)], axis=1), (periods, 1))


def _logged(kept: Tally, trajectory: Trajectory) -> Tally:
    """Add crossings: contacts that have ended, changes of flank; keep what is open."""
    layout, new = kept.layout, trajectory.events
    log = EventLog(*(np.concatenate([getattr(kept.open, e.name), getattr(new, e.name)]) for e in fields(EventLog)))
    carried = len(kept.open)
    found = find_impacts(replace(trajectory, events=log))
    ended = tuple(sums.plus(_ended(found, k, kept.start)) for k, sums in enumerate(kept.contacts))
    flanks, last = kept.flanks.copy(), kept.before.copy()
    for k in range(layout.clearance.size):
        mine = (found.clearance == k) & (found.row >= carried)
        drive = np.asarray(found.drive[mine])
        if not drive.size:
            continue
        inner = centre(layout, k)
        begun = {0: min(inner), 1: max(inner) + 1, -1: min(inner) - 1}[int(last[k])]
        before, inside = flank_before(drive, begun, inner), found.time[mine] >= kept.start
        flanks[k] += [int(np.sum(inside & (drive == before))), int(np.sum(inside & (drive != before)))]
        last[k] = 1 if drive[-1] else -1
    rows = np.sort(found.row[found.censored])
    still = EventLog(*(getattr(log, each.name)[rows] for each in fields(EventLog)))
    return replace(kept, contacts=ended, flanks=flanks, before=last, open=still)


def _ended(found: Impacts, clearance: int, start: float) -> Contacts:
    """Return what the contacts of a clearance add up to that began in the window and have ended."""
    mine = (found.clearance == clearance) & (found.time >= start) & ~found.censored
    return added(found.velocity[mine], found.departure[mine], found.duration[mine], found.censored[mine])
