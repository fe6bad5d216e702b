"""Make what metrics hear, of a simulated motion or of a recording.

Of a simulated motion it is the steady part [discard T, end]. Of a recording with a known speed it is its last whole
periods; without one, all of it. Both bounds are included: for a motion that repeats itself they are the same phase.

A motion in chunks is heard as what was gathered of them (``signals.chunks``); no chunk is kept.

Takes a Trajectory, chunks of one, or a Recording; gives a Heard.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.quantities.metric import Heard, Signal, asked_of
from gearrattle.recording import Channel, Recording
from gearrattle.signals import steady
from gearrattle.signals.chunks import Exactly, Tally, gather
from gearrattle.signals.crossing_sums import Sums
from gearrattle.signals.summaries import Summary
from gearrattle.trajectory import Array, Layout, Trajectory
from gearrattle.wording import counted

_WHOLE = 1e-6  # of a period: shorter remainders are rounding
_ROUNDED = 0.01  # of a sample interval: times that stray by less are rounded ones


def recording_of(trajectory: Trajectory) -> Recording:
    """Return the steady part of a simulated motion as a recording: all that sensors without noise could see of it.

    Angles, velocities and accelerations of bodies, deflections and forces of elements with a corner, forces of all
    meshes, torques of all elements. The log of crossings is not in it.

    Raises:
        ModelError: if no cycle remains after the discarded ones.
    """
    window, layout = steady(trajectory), trajectory.layout
    channels = [
        Channel(f"{quantity}.{name}", quantity, name, unit, window.closed(getattr(trajectory, quantity))[:, i])
        for quantity, unit in (("angle", "rad"), ("velocity", "rad/s"), ("acceleration", "rad/s^2"))
        for i, name in enumerate(layout.inertia_names)
    ]
    for k, (element, name) in enumerate(zip(layout.clearance.tolist(), layout.clearance_names, strict=True)):
        mesh = bool(layout.is_mesh[element])
        for quantity, unit in (("deflection", "m" if mesh else "rad"), ("force", "N" if mesh else "N m")):
            values = window.closed(getattr(trajectory, quantity))[:, k]
            channels.append(Channel(f"{quantity}.{name}", quantity, name, unit, values))
    for element, name in enumerate(layout.element_names):
        torque = window.closed(trajectory.element_torque)[:, element]
        channels.append(Channel(f"torque.{name}", "torque", name, "N m", torque))
        if layout.is_mesh[element] and name not in layout.clearance_names:
            channels.append(Channel(f"force.{name}", "force", name, "N", torque / layout.radii[element, 0]))
    return Recording(window.closed(trajectory.time), tuple(channels), trajectory.cost.algorithm, trajectory.notes)


def hear_motion(trajectory: Trajectory, engine_orders: Array, *, one_speed: bool = True) -> Heard:
    """Return what metrics hear of a simulated motion.

    Args:
        trajectory: of whole cycles.
        engine_orders: orders of the torques, ascending.
        one_speed: whether the reference speed stays; order analysis is for that.

    Raises:
        ModelError: if no cycle remains after the discarded ones.
    """
    window, recording = steady(trajectory), recording_of(trajectory)
    return Heard(
        source=trajectory.cost.algorithm,
        time=recording.time,
        signals={(each.quantity, each.subject): each.values for each in recording.channels},
        window=f"steady part, {window.cycles} of {counted(trajectory.cycles, 'cycle')}",
        omega=trajectory.layout.omega if one_speed else None,
        period=trajectory.layout.period,
        engine_orders=engine_orders,
        layout=trajectory.layout,
        motion=trajectory,
    )


@dataclass(frozen=True, eq=False)
class HeardInChunks(Heard):
    """What there is to measure of a motion that came in chunks.

    Attributes:
        tally: what was gathered of them.
    """

    tally: Tally | None = None

    @property
    def _gathered(self) -> Tally:
        assert self.tally is not None
        return self.tally

    @property
    def has_log(self) -> bool:
        """Whether there is an exact log of crossings: there was."""
        return True

    @cached_property
    def crossings(self) -> Sums:
        """What the crossings in the window add up to."""
        return self._gathered.crossings

    @property
    def taken(self) -> tuple[Array, float, float] | None:
        """(m,) work that elements took [J], over which time [s], and the share of it before the window; or None."""
        kept = self._gathered
        share = kept.discarded / (kept.discarded + kept.cycles)
        return None if kept.loss is None else (kept.loss, kept.time, share)

    def amplitudes(self, samples: Signal, trend: int) -> NDArray[np.complex128]:
        """Return (o,) complex amplitudes of a signal at ``orders``, beside a polynomial of time."""
        assert isinstance(samples, Summary)
        return self._gathered.amplitudes(self._gathered.products[:, samples.column], trend)

    def _velocities_at(self, subject: str) -> NDArray[np.complex128] | None:
        pair = self.signals.get(("angle", subject)), self.signals.get(("velocity", subject))
        angle, velocity = pair
        if isinstance(angle, Summary) and isinstance(velocity, Summary):
            found = self._gathered.velocities(angle.column, velocity.column)
            return np.asarray(found * (1j * self.orders * self.speed))
        return super()._velocities_at(subject)


def gather_motion(trajectory: Trajectory, engine_orders: Array, before: Tally | None) -> Tally:
    """Return what metrics keep of a chunk of a motion and of all chunks before it.

    Args:
        trajectory: the next chunk, of whole cycles.
        engine_orders: orders of the torques, ascending.
        before: None at the first.
    """
    orders = np.unique(np.array([*engine_orders.tolist(), *trajectory.layout.orders.tolist()], dtype=np.float64))
    if trajectory.discard < trajectory.cycles:
        signals = np.stack([each.values for each in recording_of(trajectory).channels], axis=1)
    else:
        signals = np.zeros((0, len(_channel_names(trajectory.layout))))
    return gather(trajectory, signals, orders, before, _exactly(trajectory))


def _exactly(trajectory: Trajectory) -> Exactly | None:
    """Return which signals of a chunk are known between samples, and their statistics; None for none."""
    if trajectory.exact is None or trajectory.discard == trajectory.cycles:
        return None
    names, known = _channel_names(trajectory.layout), asked_of(trajectory)
    marked = np.array([quantity != "velocity" for quantity, _ in known])
    statistics = trajectory.exact.statistics(trajectory, known, with_moments=marked) if known else None
    return None if statistics is None else ([names.index(signal) for signal in known], statistics)


def hear_chunks(tally: Tally, source: str, engine_orders: Array, *, one_speed: bool = True) -> Heard:
    """Return what metrics hear of all chunks that were gathered.

    Args:
        tally: from ``gather_motion``; some of it is not discarded.
        source: where the motion comes from, in words.
        engine_orders, one_speed: as in ``hear_motion``.
    """
    assert tally.moments is not None
    names = _channel_names(tally.layout)
    return HeardInChunks(
        source=source,
        time=np.array([tally.start, tally.end]),
        signals={name: tally.moments.summary(column) for column, name in enumerate(names)},
        window=f"steady part, {tally.cycles} of {counted(tally.cycles + tally.discarded, 'cycle')}, in chunks",
        omega=tally.layout.omega if one_speed else None,
        period=tally.layout.period,
        engine_orders=engine_orders,
        layout=tally.layout,
        tally=tally,
    )


def _channel_names(layout: Layout) -> list[tuple[str, str]]:
    """Return quantity and subject of every channel of ``recording_of``, in its order."""
    names = [(quantity, name) for quantity in ("angle", "velocity", "acceleration") for name in layout.inertia_names]
    names += [(quantity, name) for name in layout.clearance_names for quantity in ("deflection", "force")]
    for element, name in enumerate(layout.element_names):
        names.append(("torque", name))
        if layout.is_mesh[element] and name not in layout.clearance_names:
            names.append(("force", name))
    return names


def hear_recording(
    recording: Recording, layout: Layout | None, omega: float | None, engine_orders: Sequence[float] | Array
) -> Heard:
    """Return what metrics hear of a recording.

    Args:
        recording: uniform samples.
        layout: the driveline's name plate; None without a model.
        omega: reference speed [rad/s]; None takes the mean of a channel "speed", if there is one.
        engine_orders: orders of the engine's torque; may be empty.

    Raises:
        ModelError: samples that are not uniform, not finite, or fewer than three.
    """
    time, interval, noted = _uniform(recording)
    ill = [c.name for c in recording.channels if not np.all(np.isfinite(c.values))]
    if ill:
        rule = "must be finite at every sample"
        raise ModelError(Problem(recording.source, ", ".join(ill), rule, "cut the gaps out, or fill them"))
    speed = recording.find("speed")
    if omega is None and speed is not None:
        omega = float(np.mean(speed.values))
    orders = np.unique(np.asarray(engine_orders, dtype=np.float64))
    kept, words, notes = time.size, "the whole recording", (*recording.notes, *noted)
    period = _period(layout, omega, orders) if omega else None
    if period is not None:
        kept, words, told = _whole_periods(time, interval, period)
        notes = (*notes, *told)
    signals: dict[tuple[str, str], Array] = {}
    units: dict[tuple[str, str], str] = {}
    for each in recording.channels:
        subject = each.subject or each.name
        signals.setdefault((each.quantity, subject), each.values[-kept:])
        units.setdefault((each.quantity, subject), each.unit)
    engine = orders[orders > 0.0]
    return Heard(recording.source, time[-kept:], signals, words, omega, period, engine, layout, None, notes, units)


def _uniform(recording: Recording) -> tuple[Array, float, tuple[str, ...]]:
    """Return uniform times, their interval, and a note where the recorded ones are rounded.

    Raises:
        ModelError: fewer than three samples, or times that stray from a line by more than rounding.
    """
    time = recording.time
    if time.size < 3:
        raise ModelError(Problem(recording.source, counted(time.size, "sample"), "metrics need three samples at least"))
    even = np.linspace(time[0], time[-1], time.size)
    interval, stray = float(even[1] - even[0]), float(np.max(np.abs(time - even)))
    if stray > _ROUNDED * interval:
        remedy = "resample the recording, for example by rate in a mapping"
        found = f"times up to {stray / interval:.3g} sample intervals off a uniform grid"
        raise ModelError(Problem(recording.source, found, "metrics need uniform samples", remedy))
    if recording.interval is not None:
        return time, interval, ()
    return even, interval, (f"times stray by {stray / interval:.2g} of a sample interval and are taken as uniform",)


def _period(layout: Layout | None, omega: float, orders: Array) -> float:
    """The common period of the excitation: the name plate's at this speed; else one revolution, two for half orders."""
    if layout is not None:
        return layout.period * layout.omega / omega
    whole = bool(np.all(np.abs(orders - np.rint(orders)) < 1e-9))
    return (1.0 if whole else 2.0) * 2.0 * np.pi / omega


def _whole_periods(time: Array, interval: float, period: float) -> tuple[int, str, tuple[str, ...]]:
    """How many samples the last whole periods take, both bounds included; in words, and what is to be noted."""
    span = float(time[-1] - time[0])
    cycles = int(np.floor(span / period + _WHOLE))
    if cycles < 1:
        told = f"the recording is shorter ({span:.4g} s) than one period of the excitation ({period:.4g} s)"
        return time.size, "the whole recording", (told,)
    kept = min(time.size, round(cycles * period / interval) + 1)
    return kept, f"the last {cycles} whole periods of {span / period:.4g}", ()
