"""Make what metrics hear, of a simulated motion or of a recording.

Of a simulated motion it is the steady part [discard T, end]. Of a recording with a known speed it is its last whole
periods; without one, all of it. Both bounds are included: for a motion that repeats itself they are the same phase.

Takes a Trajectory or a Recording; gives a Heard.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.metrics.base import Heard
from gearrattle.recording import Channel, Recording
from gearrattle.signals import steady
from gearrattle.trajectory import Array, Layout, Trajectory

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
        window=f"steady part, {window.cycles} of {trajectory.cycles} cycles",
        omega=trajectory.layout.omega if one_speed else None,
        period=trajectory.layout.period,
        engine_orders=engine_orders,
        layout=trajectory.layout,
        motion=trajectory,
    )


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
    for each in recording.channels:
        signals.setdefault((each.quantity, each.subject or each.name), each.values[-kept:])
    return Heard(
        recording.source, time[-kept:], signals, words, omega, period, orders[orders > 0.0], layout, None, notes
    )


def _uniform(recording: Recording) -> tuple[Array, float, tuple[str, ...]]:
    """Return uniform times, their interval, and a note where the recorded ones are rounded.

    Raises:
        ModelError: fewer than three samples, or times that stray from a line by more than rounding.
    """
    time = recording.time
    if time.size < 3:
        raise ModelError(Problem(recording.source, f"{time.size} samples", "metrics need three samples at least"))
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
