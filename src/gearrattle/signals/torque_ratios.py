"""The torque that a loose gear needs over its drag torque, where the drag torque changes with the speed of a run.

    ratio(t) = J_loose (R_driver/R_loose) |theta_driver''(t)| / T_drag(Omega(t)),      its largest value

Where the motion is known between samples, the exact peak acceleration of every cycle lies between the ratios with the
largest and with the smallest drag torque of that cycle: the second bounds what the first leaves out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.signals.driveline_constants import LooseGear, loose_gears, torque_ratio
from gearrattle.signals.levels import extreme_errors
from gearrattle.signals.windows import steady
from gearrattle.trajectory import Array, Layout, Trajectory


class LargestRatio(NamedTuple):
    """The largest ratio over a time, and the bound of the true one above it."""

    value: float
    miss: float


def changes_drag(layout: Layout, gear: LooseGear) -> bool:
    """Return whether the drag torque of a loose gear changes during a run: a table over a speed that changes."""
    return layout.ramp is not None and gear.loose in layout.drag_tables


def _ratios(layout: Layout, gear: LooseGear, acceleration: Array, drag: Array) -> Array:
    """Return torque ratios: infinite without a drag torque, but 0 where none is needed."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(acceleration == 0.0, 0.0, torque_ratio(layout, gear, acceleration, drag))


def largest_of_samples(layout: Layout, gear: LooseGear, acceleration: Array, speed: Array) -> LargestRatio:
    """Return the largest ratio of samples.

    Parameters
    ----------
    acceleration
        (N,) theta_driver'' [rad/s^2].
    speed
        (N,) reference speed at the samples [rad/s].
    """
    ratio = _ratios(layout, gear, np.abs(acceleration), layout.drag_torque_at(gear.loose, speed))
    largest = float(np.max(ratio))
    if not np.isfinite(largest):
        return LargestRatio(largest, 0.0)
    return LargestRatio(largest, float(extreme_errors(ratio)[1]))


def largest_ratios(trajectory: Trajectory) -> dict[int, LargestRatio]:
    """Return the largest ratio over the steady part of every loose gear whose drag torque changes, by its index.

    ModelError as of ``steady``.
    """
    layout = trajectory.layout
    gears = [gear for gear in loose_gears(layout) if changes_drag(layout, gear)]
    if not gears or layout.ramp is None:
        return {}
    window = steady(trajectory)
    speed = layout.ramp.speed(window.closed(trajectory.time))
    accelerations = window.closed(trajectory.acceleration)
    ratios = {gear.loose: largest_of_samples(layout, gear, accelerations[:, gear.driver], speed) for gear in gears}
    peaks = _peaks_of_cycles(trajectory, gears, window.cycles)
    for gear in gears:
        if gear.driver in peaks:
            sampled = ratios[gear.loose]
            ratios[gear.loose] = _between(trajectory, gear, sampled.value, peaks[gear.driver], speed)
    return ratios


def _peaks_of_cycles(trajectory: Trajectory, gears: list[LooseGear], cycles: int) -> dict[int, Array]:
    """Return (cycles,) the exact largest |theta''| of every driver that is known between samples [rad/s^2]."""
    if trajectory.exact is None:
        return {}
    names = trajectory.layout.inertia_names
    known = trajectory.exact.signals(trajectory)
    drivers = [i for i in dict.fromkeys(gear.driver for gear in gears) if ("acceleration", names[i]) in known]
    signals = [("acceleration", names[i]) for i in drivers]
    ends = tuple(range(cycles + 1))
    peaks = trajectory.exact.statistics(trajectory, signals, with_moments=False, cycles=ends) if signals else None
    if peaks is None:
        return {}
    return dict(zip(drivers, np.maximum(peaks.high, -peaks.low).T, strict=True))


def _between(trajectory: Trajectory, gear: LooseGear, sampled: float, peaks: Array, speed: Array) -> LargestRatio:
    """Return the largest ratio by the exact peaks of cycles (c,) and the speed at the samples (N,), which bounds it."""
    layout = trajectory.layout
    per_cycle = trajectory.samples_per_cycle
    drag = np.abs(layout.drag_torque_at(gear.loose, speed))
    of_cycles = [drag[c * per_cycle : (c + 1) * per_cycle + 1] for c in range(len(peaks))]
    low = _ratios(layout, gear, peaks, np.array([part.max() for part in of_cycles]))
    high = _ratios(layout, gear, peaks, np.array([part.min() for part in of_cycles]))
    value = max(sampled, float(np.max(low)))
    return LargestRatio(value, max(0.0, float(np.max(high)) - value) if np.isfinite(value) else 0.0)
