"""Inputs of metrics made from a simulated motion, from its chunks, or from a recording.

The window is the steady part [discard T, end] of a simulated motion; the last whole periods of a recording with a known
speed; or the whole of a recording without one. Both ends of the window are included; in a periodic motion they have the
same phase. A motion in chunks is described by its sums (``signals.chunk_moments``, ``signals.crossing_sums``); chunks
are not kept.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.quantities.metric_inputs import Inputs, Signal, asked_of
from gearrattle.quantities.quantity import Sums
from gearrattle.recording import Channel, Recording, are_even
from gearrattle.signals import Window, parts_of, rings, steady
from gearrattle.signals.chunk_moments import Exactly, SignalSums, add_chunk
from gearrattle.signals.crossing_sums import Sums as CrossingSums
from gearrattle.signals.driveline_constants import LooseGear
from gearrattle.signals.summaries import Summary
from gearrattle.signals.torque_ratios import LargestRatio, changes_drag
from gearrattle.trajectory import AXES, CASING_FORCE, Array, Layout, Sideways, Trajectory
from gearrattle.wording import counted

_WHOLE = 1e-6  # share of a period: shorter remainders are rounding
_ROUNDED = 0.01  # share of a sample interval: times that differ by less from a uniform grid are rounded


def recording_of(trajectory: Trajectory) -> Recording:
    """Return the steady part of a simulated motion as a recording, as if by sensors without noise.

    Angles, velocities and accelerations of bodies, deflections and forces of elements with a corner, forces of all
    meshes, torques of all elements that turn bodies, displacements, forces of bearings on the bodies that they hold and
    on the casing; of the faces of a ring nothing. The log of crossings is not in it.

    ModelError if no cycle remains after the discarded ones.
    """
    window = steady(trajectory)
    layout = trajectory.layout
    channels = [
        Channel(f"{quantity}.{name}", quantity, name, unit, window.closed(getattr(trajectory, quantity))[:, i])
        for quantity, unit in (("angle", "rad"), ("velocity", "rad/s"), ("acceleration", "rad/s^2"))
        for i, name in enumerate(layout.inertia_names)
    ]
    for k in _single(layout):
        name = layout.clearance_names[k]
        mesh = bool(layout.is_mesh[layout.clearance[k]])
        for quantity, unit in (("deflection", "m" if mesh else "rad"), ("force", "N" if mesh else "N m")):
            values = window.closed(getattr(trajectory, quantity))[:, k]
            channels.append(Channel(f"{quantity}.{name}", quantity, name, unit, values))
    for element, name in enumerate(layout.element_names):
        if layout.is_bearing[element]:
            continue
        torque = window.closed(trajectory.element_torque)[:, element]
        channels.append(Channel(f"torque.{name}", "torque", name, "N m", torque))
        if layout.is_mesh[element] and name not in layout.clearance_names:
            channels.append(Channel(f"force.{name}", "force", name, "N", torque / layout.radii[element, 0]))
    if trajectory.sideways is not None:
        channels += _sideways_channels(layout, trajectory.sideways, window)
    return Recording(window.closed(trajectory.time), tuple(channels), trajectory.cost.algorithm, trajectory.notes)


def inputs_of_motion(trajectory: Trajectory, engine_orders: Array) -> Inputs:
    """Return the inputs of metrics for a simulated motion; ``engine_orders`` ascend.

    ModelError if all cycles are discarded.
    """
    window = steady(trajectory)
    recording = recording_of(trajectory)
    return Inputs(
        source=trajectory.cost.algorithm,
        time=recording.time,
        signals={(channel.quantity, channel.subject): channel.values for channel in recording.channels},
        window=f"steady part, {window.cycles} of {counted(trajectory.cycles, 'cycle')}",
        omega=trajectory.layout.omega if trajectory.layout.ramp is None else None,
        period=trajectory.layout.period,
        engine_orders=engine_orders,
        layout=parts_of(trajectory.layout),
        motion=trajectory,
    )


@dataclass(frozen=True, eq=False)
class ChunkInputs(Inputs):
    """Inputs of metrics for a motion in chunks."""

    sums: Sums | None = None

    @property
    def _states(self) -> Mapping[str, Any]:
        assert self.sums is not None
        return self.sums.states

    @property
    def has_log(self) -> bool:
        """Whether there is an exact log of crossings: there was one, and its sums are kept."""
        return True

    @cached_property
    def crossings(self) -> CrossingSums:
        """Sums over the crossings in the window."""
        crossings: CrossingSums = self._states["crossings"]
        return crossings

    @property
    def work(self) -> tuple[Array, float, float] | None:
        """(m,) work done on the elements [J], the time of this work [s], and its share before the window; or None."""
        state: SignalSums = self._states["signals"]
        share = state.discarded / (state.discarded + state.cycles)
        return None if state.loss is None else (state.loss, state.time, share)

    def largest_torque_ratio(self, gear: LooseGear) -> LargestRatio:
        """Return the largest torque ratio of a loose gear over all chunks."""
        if not changes_drag(self.known_layout, gear):
            return super().largest_torque_ratio(gear)
        peaks = self._states["peaks"]
        return LargestRatio(float(peaks["ratio"][gear.loose]), float(peaks["ratio_miss"][gear.loose]))

    def amplitudes(self, samples: Signal, trend: int) -> NDArray[np.complex128]:
        """Return (o,) complex amplitudes of a signal at ``orders``, fitted with a polynomial of time."""
        assert isinstance(samples, Summary)
        state: SignalSums = self._states["signals"]
        return state.amplitudes(state.products[:, samples.column], trend)

    def _velocities_at(self, subject: str) -> NDArray[np.complex128] | None:
        angle = self.signals.get(("angle", subject))
        velocity = self.signals.get(("velocity", subject))
        if isinstance(angle, Summary) and isinstance(velocity, Summary):
            state: SignalSums = self._states["signals"]
            amplitudes = state.velocities(angle.column, velocity.column)
            return np.asarray(amplitudes * (1j * self.orders * self.speed))
        return super()._velocities_at(subject)


def add_signals(trajectory: Trajectory, before: SignalSums | None, engine_orders: Array) -> SignalSums:
    """Return the state "signals" over a chunk and all chunks before it (None for the first); the orders ascend."""
    orders = np.unique(np.array([*engine_orders.tolist(), *trajectory.layout.orders.tolist()], dtype=np.float64))
    if trajectory.discard < trajectory.cycles:
        signals = np.stack([channel.values for channel in recording_of(trajectory).channels], axis=1)
    else:
        signals = np.zeros((0, len(_channel_names(trajectory.layout))))
    return add_chunk(trajectory, signals, orders, before, _exactly(trajectory))


def _exactly(trajectory: Trajectory) -> Exactly | None:
    """Return the signals of a chunk that are known between samples, with their statistics; None if none is."""
    if trajectory.exact is None or trajectory.discard == trajectory.cycles:
        return None
    names = _channel_names(trajectory.layout)
    known = asked_of(trajectory)
    marked = np.array([quantity != "velocity" for quantity, _ in known])
    statistics = trajectory.exact.statistics(trajectory, known, with_moments=marked) if known else None
    return None if statistics is None else ([names.index(signal) for signal in known], statistics)


def inputs_of_chunks(sums: Sums, engine_orders: Array) -> Inputs:
    """Return the inputs of metrics for a motion in chunks.

    The sums include "crossings" and "signals"; at least one cycle of the chunks is not discarded.
    """
    state: SignalSums = sums.states["signals"]
    assert state.moments is not None
    names = _channel_names(state.layout)
    return ChunkInputs(
        source=sums.steady.algorithm,
        time=np.array([state.start, state.end]),
        signals={name: state.moments.summary(column) for column, name in enumerate(names)},
        window=f"steady part, {state.cycles} of {counted(state.cycles + state.discarded, 'cycle')}, in chunks",
        omega=state.layout.omega if state.layout.ramp is None else None,
        period=state.layout.period,
        engine_orders=engine_orders,
        layout=parts_of(state.layout),
        sums=sums,
    )


@dataclass(frozen=True, eq=False)
class CrossingInputs(Inputs):
    """Inputs of metrics that need no samples: only the sums over the crossings of a simulated motion."""

    @property
    def has_log(self) -> bool:
        """Whether there is an exact log of crossings: there was one, and its sums are kept."""
        return True

    @cached_property
    def crossings(self) -> CrossingSums:
        """Sums over the crossings in the window."""
        assert self.known_crossings is not None
        return self.known_crossings


def inputs_of_crossings(crossings: CrossingSums, layout: Layout, span: tuple[float, float]) -> Inputs:
    """Return the inputs of metrics that need no samples; deflections are present but empty.

    ``span`` is the time of the first and last sample of the steady part [s].
    """
    return CrossingInputs(
        source="exact",
        time=np.array(span),
        signals={("deflection", layout.clearance_names[k]): np.zeros(0) for k in _single(layout)},
        window="steady part",
        omega=layout.omega if layout.ramp is None else None,
        period=layout.period,
        engine_orders=np.zeros(0),
        layout=parts_of(layout),
        known_crossings=crossings,
    )


def _channel_names(layout: Layout) -> list[tuple[str, str]]:
    """Return quantity and subject of every channel of ``recording_of``, in its order."""
    names = [(quantity, name) for quantity in ("angle", "velocity", "acceleration") for name in layout.inertia_names]
    names += [(quantity, layout.clearance_names[k]) for k in _single(layout) for quantity in ("deflection", "force")]
    for element, name in enumerate(layout.element_names):
        if layout.is_bearing[element]:
            continue
        names.append(("torque", name))
        if layout.is_mesh[element] and name not in layout.clearance_names:
            names.append(("force", name))
    names += [("displacement", name) for name in layout.direction_names]
    names += [("force", name) for name in layout.bearing_names]
    return [*names, *((CASING_FORCE, axis) for axis in AXES if layout.bearing_names)]


def _single(layout: Layout) -> list[int]:
    """Return the clearances that are no faces of a ring: the bearing has forces and displacements."""
    faces = {k for ring in rings(layout) for k in ring.clearances}
    return [k for k in range(layout.clearance.size) if k not in faces]


def _sideways_channels(layout: Layout, sideways: Sideways, window: Window) -> list[Channel]:
    """Displacements of bodies, forces of bearings on them, and the force on the casing."""
    displacement = window.closed(sideways.displacement)
    force = window.closed(sideways.bearing_force)
    casing = window.closed(sideways.casing_force) if layout.bearing_names else np.zeros((0, 0))
    return [
        *(
            Channel(f"displacement.{name}", "displacement", name, "m", values)
            for name, values in zip(layout.direction_names, displacement.T, strict=True)
        ),
        *(
            Channel(f"bearing_force.{name}", "force", name, "N", values)
            for name, values in zip(layout.bearing_names, force.T, strict=True)
        ),
        *(
            Channel(f"{CASING_FORCE}.{axis}", CASING_FORCE, axis, "N", values)
            for axis, values in zip(AXES, casing.T, strict=False)
        ),
    ]


def inputs_of_recording(
    recording: Recording, layout: Layout | None, omega: float | None, engine_orders: Sequence[float] | Array
) -> Inputs:
    """Return the inputs of metrics for a recording.

    Parameters
    ----------
    omega
        reference speed [rad/s]; None takes the mean of a channel "speed", if the recording has one.

    Raises
    ------
    ModelError
        samples are not uniform, not finite, or fewer than three.
    """
    # uniform, finite samples
    time, interval, noted = _uniform(recording)
    ill = [c.name for c in recording.channels if not np.all(np.isfinite(c.values))]
    if ill:
        rule = "must be finite at every sample"
        raise ModelError(Problem(recording.source, ", ".join(ill), rule, "cut the gaps out, or fill them"))
    # reference speed: the argument, or the mean of its channel
    speed = recording.find("speed")
    speeds = None
    if omega is None and speed is not None:
        omega = float(np.mean(speed.values))
        speeds = speed.values
    orders = np.unique(np.asarray(engine_orders, dtype=np.float64))
    # window: the last whole periods
    kept = time.size
    words = "the whole recording"
    notes = (*recording.notes, *noted)
    period = _period(layout, omega, orders) if omega else None
    if period is not None:
        kept, words, remarks = _whole_periods(time, interval, period)
        notes = (*notes, *remarks)
    # signals by quantity and subject
    signals: dict[tuple[str, str], Array] = {}
    units: dict[tuple[str, str], str] = {}
    for channel in recording.channels:
        subject = channel.subject or channel.name
        signals.setdefault((channel.quantity, subject), channel.values[-kept:])
        units.setdefault((channel.quantity, subject), channel.unit)
    engine = orders[orders > 0.0]
    return Inputs(
        source=recording.source,
        time=time[-kept:],
        signals=signals,
        window=words,
        omega=omega,
        period=period,
        engine_orders=engine,
        layout=layout,
        notes=notes,
        units=units,
        speeds=None if speeds is None else speeds[-kept:],
    )


def _uniform(recording: Recording) -> tuple[Array, float, tuple[str, ...]]:
    """Return uniform times, their interval, and a note if the recorded times are rounded.

    ModelError for fewer than three samples, or for times that are not uniform within rounding.
    """
    time = recording.time
    if time.size < 3:
        raise ModelError(Problem(recording.source, counted(time.size, "sample"), "metrics need three samples at least"))
    even = np.linspace(time[0], time[-1], time.size)
    interval = float(even[1] - even[0])
    stray = float(np.max(np.abs(time - even)))
    if stray > _ROUNDED * interval:
        remedy = "resample the recording, for example by rate in a mapping"
        problem = f"times up to {stray / interval:.3g} sample intervals off a uniform grid"
        raise ModelError(Problem(recording.source, problem, "metrics need uniform samples", remedy))
    if are_even(time, interval):
        return time, interval, ()
    return even, interval, (f"times stray by {stray / interval:.2g} of a sample interval and are taken as uniform",)


def _period(layout: Layout | None, omega: float, orders: Array) -> float:
    """The common period of the excitation: from the layout at this speed; else one revolution, two for half orders."""
    if layout is not None:
        return layout.period * layout.omega / omega
    whole = bool(np.all(np.abs(orders - np.rint(orders)) < 1e-9))
    return (1.0 if whole else 2.0) * 2.0 * np.pi / omega


def _whole_periods(time: Array, interval: float, period: float) -> tuple[int, str, tuple[str, ...]]:
    """Number of samples in the last whole periods, both ends included; the window in words; notes."""
    span = float(time[-1] - time[0])
    cycles = int(np.floor(span / period + _WHOLE))
    if cycles < 1:
        remark = f"the recording is shorter ({span:.4g} s) than one period of the excitation ({period:.4g} s)"
        return time.size, "the whole recording", (remark,)
    kept = min(time.size, round(cycles * period / interval) + 1)
    return kept, f"the last {cycles} whole periods of {span / period:.4g}", ()
