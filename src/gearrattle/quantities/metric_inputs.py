"""Inputs of metrics, the same for simulated motions and for recordings.

A metric does not depend on the source of a motion. Its inputs are uniform samples by quantity and subject over one
window; the reference speed and the orders of the engine, if known; the layout of the driveline, if there is a model;
and the motion with its exact log of crossings, if it was simulated. If an input is missing that a metric ``needs``, the
row of the metric has no value and a note with the reason.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.signals import amplitudes_from, harmonics, loose_gears, order_sums, resolved
from gearrattle.signals.crossing_sums import Contacts, Sides, Sums, contacts_of, sides_of, sums_of
from gearrattle.signals.driveline_constants import LooseGear, torque_ratio
from gearrattle.signals.levels import thinned
from gearrattle.signals.summaries import Summary, summary_of
from gearrattle.signals.torque_ratios import LargestRatio, changes_drag, largest_of_samples, largest_ratios
from gearrattle.trajectory import AXES, CASING_FORCE, Array, Layout, Trajectory

SAMPLES = "the samples of the window"
EXACT = "the window; of a simulated motion between its samples too"
LOG = "the log of crossings over the window"
WHOLE = "needs the samples of the whole motion at once, and these came in chunks"
_LONG = 0.1  # share of the time in contacts, above which they are too long to count as impacts
FINE = 1e-3  # share of a peak: smaller sampling errors are not noted
Signal = Array | Summary
"""Samples (N + 1,), or their sums over chunks."""
_DERIVATIVES = {"angle": 0, "velocity": 1, "acceleration": 2}


@dataclass(frozen=True, eq=False)
class Inputs:
    """Inputs of metrics.

    Attributes
    ----------
    time
        (N + 1,) uniform sample times over the window, both bounds included [s].
    signals
        (N + 1,) samples by quantity and subject (``gearrattle.recording.QUANTITIES``), SI; or the summaries from their
        sums over chunks.
    window
        the part of the source that the samples cover, in words.
    omega
        reference speed [rad/s]; None if it is unknown or changes.
    period
        common period of the excitation [s]; None without a speed.
    engine_orders
        ascending orders of the engine's torque; empty where unknown.
    motion
        the simulated motion with its log of crossings; None for a measurement.
    units
        of a recording's signals, by quantity and subject; empty if they follow from the layout.
    wanted
        names of the quantities to compute; None for all. A metric may skip the others if they take long.
    speeds
        (N + 1,) reference speed at the samples of a recording [rad/s]; None if it was not recorded.
    """

    source: str
    time: Array
    signals: Mapping[tuple[str, str], Signal]
    window: str
    omega: float | None
    period: float | None
    engine_orders: Array
    layout: Layout | None = None
    motion: Trajectory | None = None
    notes: tuple[str, ...] = ()
    units: Mapping[tuple[str, str], str] = field(default_factory=dict)
    wanted: frozenset[str] | None = None
    speeds: Array | None = None
    known_crossings: Sums | None = None

    def wants(self, quantity: str) -> bool:
        """Whether a quantity is to be computed."""
        return self.wanted is None or quantity in self.wanted

    @property
    def interval(self) -> float:
        """Time between two samples [s]."""
        return float(self.time[-1] - self.time[0]) / (self.time.size - 1)

    @property
    def duration(self) -> float:
        """Length of the window [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def known_layout(self) -> Layout:
        """The layout, for metrics that need one."""
        assert self.layout is not None
        return self.layout

    @property
    def has_log(self) -> bool:
        """Whether there is an exact log of crossings."""
        return self.motion is not None

    @cached_property
    def crossings(self) -> Sums:
        """Sums over the crossings in the window, for metrics that need the log."""
        assert self.motion is not None
        return sums_of(self.motion) if self.known_crossings is None else self.known_crossings

    def contacts(self, clearance: int) -> Contacts:
        """Return the sums over the contacts of a clearance in the window, for metrics that need the log."""
        return contacts_of(self.crossings, self.known_layout, clearance, float(self.time[-1]))

    def sides(self, clearance: int) -> Sides:
        """Return shares of time and kinds of impacts of a clearance by side, for metrics that need the log."""
        return sides_of(self.crossings, self.known_layout, clearance, self.duration)

    @property
    def work(self) -> tuple[Array, float, float] | None:
        """(m,) work done on the elements [J], the time of this work [s], and its share before the window; or None."""
        motion = self.motion
        if motion is None or motion.energy is None:
            return None
        time = float(motion.time[-1] - motion.time[0])
        return motion.energy.element_loss, time, motion.discard / motion.cycles

    @property
    def speed(self) -> float:
        """The reference speed [rad/s], for metrics that need one."""
        assert self.omega is not None
        return self.omega

    @cached_property
    def orders(self) -> Array:
        """All orders of the excitation: the orders of the engine and of the layout."""
        known = [] if self.layout is None else self.layout.orders.tolist()
        return np.unique(np.array([*self.engine_orders.tolist(), *known], dtype=np.float64))

    def summary(self, quantity: str, subject: str) -> Summary:
        """Return mean, moments and extremes of a signal over the window, from the exact motion if it is known.

        Mean and moments of an exact velocity are NaN, because no metric needs them.
        """
        if quantity not in self._exact:
            self._exact[quantity] = {} if self.motion is None else exact_summaries(self.motion, quantity)
        if subject in self._exact[quantity]:
            return self._exact[quantity][subject]
        signal = self.signals[quantity, subject]
        return summary_of(signal) if isinstance(signal, np.ndarray) else signal

    def largest_torque_ratio(self, gear: LooseGear) -> LargestRatio:
        """Return the torque that a loose gear needs over its drag torque, for metrics that know its driver.

        If the drag torque depends on the speed, every sample has its own drag torque; NaN if the speed is unknown.
        """
        layout = self.known_layout
        driver = layout.inertia_names[gear.driver]
        if changes_drag(layout, gear) and self.motion is not None:
            return self._largest_ratios[gear.loose]
        if gear.loose in layout.drag_tables and self.motion is None:
            acceleration = np.asarray(self.signals["acceleration", driver])
            known = math.nan if self.omega is None else self.omega
            speeds = np.full(acceleration.size, known) if self.speeds is None else self.speeds
            return largest_of_samples(layout, gear, acceleration, speeds)
        summary = self.summary("acceleration", driver)
        return LargestRatio(torque_ratio(layout, gear, summary.peak), torque_ratio(layout, gear, summary.miss))

    @cached_property
    def _largest_ratios(self) -> dict[int, LargestRatio]:
        """Largest torque ratios of the loose gears whose drag torque changes during a simulated motion."""
        assert self.motion is not None
        return largest_ratios(self.motion)

    def is_exact(self, quantity: str, subject: str) -> bool:
        """Whether the summary of a signal is exact, the motion between samples included."""
        self.summary(quantity, subject)
        return subject in self._exact[quantity]

    @cached_property
    def thinned(self) -> tuple[Inputs, ...]:
        """Inputs with every second and every fourth sample, to estimate sampling errors; none for chunks."""
        return tuple(
            replace(self, time=self.time[::step], signals={k: np.asarray(x)[::step] for k, x in self.signals.items()})
            for step in (2, 4)
            if self.time.size > 8 and (self.time.size - 1) % step == 0
        )

    def summary_error(self, quantity: str, subject: str, level: Callable[[Summary], float]) -> float:
        """Return the sampling error of a level of a signal, estimated from ``thinned``; 0 if the level is exact."""
        if self.is_exact(quantity, subject):
            return 0.0
        signal = self.signals[quantity, subject]
        parts = thinned(signal[:-1]) if isinstance(signal, np.ndarray) else []
        levels = [level(summary_of(closed(some))) for some in parts]
        whole = level(self.summary(quantity, subject))
        return max((abs(other - whole) for other in levels), default=math.nan)

    def velocity_errors(self, subject: str) -> Array:
        """Return (o,) the sampling error of ``velocities_at``, from every second and every fourth sample [rad/s]."""
        fine = self.velocities_at(subject)
        coarse = [inputs.velocities_at(subject) for inputs in self.thinned]
        apart = [np.abs(fine - other) for other in coarse if fine is not None and other is not None]
        return np.max(apart, axis=0) if apart else np.full(self.orders.size, np.nan)

    @cached_property
    def _exact(self) -> dict[str, dict[str, Summary]]:
        """Summaries of the exact motion computed so far, by quantity and subject."""
        return {}

    def exceeded(self, quantity: str, subject: str, share: float) -> float | None:
        """Return the level that a signal's modulus exceeds for a share of the time; None if only samples are known."""
        motion = self.motion
        if motion is None or motion.exact is None or (quantity, subject) not in motion.exact.signals(motion):
            return None
        levels = motion.exact.exceeded(motion, [(quantity, subject)], share)
        return None if levels is None else float(levels[0])

    def reach(self, plane: tuple[tuple[str, str], tuple[str, str]]) -> tuple[float, float]:
        """Return the largest distance from its mean of the vector that two signals are, and its sampling error.

        NaN where only sums over chunks are known.
        """
        first, second = plane
        centre = (self.summary(*first).mean, self.summary(*second).mean)
        motion = self.motion
        exact = None if motion is None or motion.exact is None else motion.exact.reach(motion, plane, centre)
        if exact is not None:
            return exact, 0.0
        x, y = self.signals[first], self.signals[second]
        if not (isinstance(x, np.ndarray) and isinstance(y, np.ndarray)):
            return math.nan, math.nan
        away = np.hypot(x - centre[0], y - centre[1])[:-1]
        largest = float(away.max())
        return largest, max((largest - float(some.max()) for some in thinned(away)), default=math.nan)

    def of(self, quantity: str) -> dict[str, Signal]:
        """Return the signals of a quantity by subject, in the order of the source."""
        return {subject: values for (kind, subject), values in self.signals.items() if kind == quantity}

    def lacks(self, need: str) -> str:
        """Return the reason why a need is not met; empty if it is met."""
        return "" if _NEEDS[need][0](self) else _NEEDS[need][1]

    def velocities_at(self, subject: str) -> NDArray[np.complex128] | None:
        """Return (o,) complex amplitudes of a body's velocity at ``orders`` [rad/s]; None without a suitable signal.

        They are the amplitudes of an angle, a velocity or an acceleration times a power of i o Omega, which is exact at
        one order. The smoothest signal is best, because its aliases at the orders are smallest: impacts are spikes in
        an acceleration, steps in a velocity and kinks in an angle. Drift is removed: if angle and velocity are both
        inputs, such that both are equal at begin and end, otherwise by least squares.
        """
        if subject not in self._kept:
            self._kept[subject] = self._velocities_at(subject)
        return self._kept[subject]

    @cached_property
    def _kept(self) -> dict[str, NDArray[np.complex128] | None]:
        return {}

    def _velocities_at(self, subject: str) -> NDArray[np.complex128] | None:
        known = {quantity: self.signals.get((quantity, subject)) for quantity in _DERIVATIVES}
        if known["velocity"] is None:
            known["velocity"] = self.signals.get(("speed", subject))  # the mean does not matter at the orders
        angle = known["angle"]
        velocity = known["velocity"]
        if isinstance(angle, np.ndarray) and isinstance(velocity, np.ndarray):
            along = np.linspace(0.0, 1.0, angle.size)
            bend = 0.5 * (velocity[-1] - velocity[0]) * self.duration * (along - 1.0)
            joined = angle - (angle[-1] - angle[0] + bend) * along
            return self.amplitudes(joined, 0) * (1j * self.orders * self.speed)
        for quantity, signal in known.items():
            if signal is not None:
                power = 1 - _DERIVATIVES[quantity]
                return np.asarray(self.amplitudes(signal, 1 + power) * (1j * self.orders * self.speed) ** power)
        return None

    def amplitudes(self, samples: Signal, trend: int) -> NDArray[np.complex128]:
        """Return (o,) complex amplitudes of a signal at ``orders``, fitted with a polynomial of time."""
        assert isinstance(samples, np.ndarray)
        if trend:
            return harmonics(samples[:-1], self.time[:-1], self.speed, self.orders, trend=trend)
        amplitudes = np.full(self.orders.size, np.nan + 0j)
        shown = resolved(self.orders, self.speed, self.interval)
        if shown.any():
            periods = 1 if self.period is None else max(1, round(self.duration / self.period))
            # a large mean would reduce the accuracy
            away = samples[:-1, None] - np.mean(samples[:-1])
            time = self.time[:-1]
            sums = order_sums(away, time, self.speed, self.orders[shown], periods=periods)
            amplitudes[shown] = amplitudes_from(*sums)[:, 0]
        return amplitudes

    def movers(self) -> list[str]:
        """Return the subjects with an angle, velocity, speed or acceleration, without repetitions."""
        present = dict.fromkeys(subject for quantity, subject in self.signals if quantity in (*_DERIVATIVES, "speed"))
        known = () if self.layout is None else self.layout.inertia_names
        return [name for name in dict.fromkeys([*known, *present]) if name in present]


def closed(samples: Array) -> Array:
    """Return samples (N,) of whole periods with the first sample appended."""
    return np.append(samples, samples[:1])


def asked_of(motion: Trajectory) -> list[tuple[str, str]]:
    """Return quantity and subject of the signals that metrics need between samples, if the motion has exact values.

    All velocities, forces of meshes and bearings, on the casing, accelerations of loose gears and their drivers.
    """
    if motion.exact is None:
        return []
    layout = motion.layout
    names = layout.inertia_names
    gears = loose_gears(layout)
    asked = {("velocity", name) for name in names}
    asked |= {("force", layout.element_names[k]) for k in np.flatnonzero(layout.is_mesh & ~layout.is_bearing)}
    asked |= {("force", name) for name in layout.bearing_names}
    asked |= {(CASING_FORCE, axis) for axis in AXES}
    asked |= {("acceleration", names[i]) for gear in gears for i in (gear.loose, gear.driver)}
    return [signal for signal in motion.exact.signals(motion) if signal in asked]


def exact_summaries(motion: Trajectory, quantity: str) -> dict[str, Summary]:
    """Return exact summaries of a quantity for metrics, by subject; empty if the motion has no exact values.

    The quantity is "velocity", whose mean and moments are NaN, "acceleration", "force" or "casing_force".
    """
    signals = [signal for signal in asked_of(motion) if signal[0] == quantity]
    if motion.exact is None or not signals:
        return {}
    statistics = motion.exact.statistics(motion, signals, with_moments=quantity != "velocity")
    if statistics is None:
        return {}
    columns = zip(statistics.mean, statistics.second, statistics.fourth, statistics.low, statistics.high, strict=True)
    return {
        subject: Summary(float(mean), float(second), float(fourth), float(low), float(high))
        for (_, subject), (mean, second, fourth, low, high) in zip(signals, columns, strict=True)
    }


_NEEDS: dict[str, tuple[Any, str]] = {
    "driveline": (lambda h: h.layout is not None, "needs inertias, radii and drag torques: give a model"),
    "loose gears": (
        lambda h: h.layout is not None and bool(loose_gears(h.layout)),
        "needs a loose gear: a drag torque on a body whose only stiffness is its mesh, in a model that is given",
    ),
    "contacts": (
        lambda h: h.layout is not None and bool({*h.layout.clearance_names} & {*h.of("deflection")}),
        "needs the deflection of a clearance, and a model that knows its corners",
    ),
    "gaps": (
        lambda h: h.has_log and bool(h.known_layout.clearance.size),
        "needs a clearance and the log of its crossings, which a simulated motion has",
    ),
    "energy": (
        lambda h: h.work is not None,
        "needs the energy audit of a simulated motion (audit=True)",
    ),
    "orders": (
        lambda h: h.omega is not None and h.orders.size > 0,
        "needs one reference speed and the orders of the excitation: give a model, or speed and orders",
    ),
    "engine orders": (
        lambda h: h.omega is not None and h.engine_orders.size > 0,
        "needs one reference speed and the engine's orders: give a model, or speed and orders",
    ),
    "acceleration": (lambda h: bool(h.of("acceleration")), "needs accelerations"),
    "motions": (lambda h: bool(h.movers()), "needs angles, velocities or accelerations of bodies"),
    "velocity": (lambda h: bool(h.of("velocity") or h.of("speed")), "needs velocities, or a speed"),
    "force": (lambda h: bool(h.of("force")), "needs forces of elements"),
}


def sampled(name: str, summary: Summary, peak: float) -> str:
    """Note how far a peak may be above the largest sample; empty if it is exact or accurate to 0.1 %."""
    if not summary.miss > FINE * abs(peak):
        return ""
    return f"{name}: a peak of samples, which may lie about {100.0 * summary.miss / abs(peak):.2g} % higher"


def order_word(order: float) -> str:
    """Name an order in a quantity."""
    return f"order {order:g}"


def about(name: str, contacts: Contacts, duration: float) -> str:
    """Note what a sum over contacts of one clearance leaves out; empty if all contacts are short and have ended.

    ``duration`` is the length of the window [s].
    """
    remarks = ["the motion ends within a contact, which counts as not rebounding"] * contacts.cut
    share = contacts.time / duration
    if share > _LONG:
        remarks.append(f"contacts take {100.0 * share:.3g} % of the time: other elements push meanwhile, uncounted")
    return f"{name}: {'; '.join(remarks)}" if remarks else ""
