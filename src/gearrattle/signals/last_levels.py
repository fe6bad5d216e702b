"""Peak-to-peak and rms accelerations over the last cycles; those from samples with their estimated error.

For an exact motion, extremes and means are taken between the samples too, with both limits at every crossing. A
recording, another algorithm and a body of prescribed motion have only samples; the error of their levels is estimated
from every second and every fourth sample, and of extremes from a parabola too (``signals.levels``).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from gearrattle.signals.levels import extreme_errors, rms, rms_error
from gearrattle.signals.windows import steady
from gearrattle.trajectory import Array, IntArray, Trajectory
from gearrattle.wording import counted

LAST_CYCLES = 8
"""Largest number of cycles that a level is taken over (Padmanabhan et al. 1995, eqs. (23)-(25))."""


_LEVELS = ("low", "high", "rms", "below", "above", "off")


class Level(NamedTuple):
    """A level of every inertia (n,) and its estimated error (n,) [rad/s^2]."""

    value: Array
    error: Array


def add_levels(trajectory: Trajectory, before: Mapping[str, Array] | None) -> dict[str, Array]:
    """Return levels of the accelerations in each of the last cycles, (cycles, n) [rad/s^2].

    low, high, rms; below, above: how far the motion may go beyond low and high between samples; off: the
    error of rms (under this name it stands in stores of long motions).
    """
    window = steady(trajectory)
    count = min(LAST_CYCLES, window.cycles)
    state = {name: np.zeros((count, len(trajectory.layout.inertia_names))) for name in _LEVELS}
    bodies = _put_exact(state, trajectory, window.cycles, count)
    others = np.setdiff1d(np.arange(len(trajectory.layout.inertia_names)), bodies)
    if others.size:
        _put_sampled(state, trajectory, others, count)
    if before is None:
        return state
    return {name: np.concatenate([before[name], new])[-LAST_CYCLES:] for name, new in state.items()}


def _put_sampled(state: dict[str, Array], trajectory: Trajectory, bodies: IntArray, count: int) -> None:
    """Write the levels of some bodies from their samples, with their errors."""
    per_cycle = trajectory.samples_per_cycle
    samples = steady(trajectory).closed(trajectory.acceleration)[-(count * per_cycle + 1) :, bodies]
    for c in range(count):
        part = samples[c * per_cycle : (c + 1) * per_cycle + 1]
        below, above = extreme_errors(part)
        levels = (part.min(axis=0), part.max(axis=0), rms(part), below, above, rms_error(part))
        for name, level in zip(_LEVELS, levels, strict=True):
            state[name][c, bodies] = level


def _put_exact(state: dict[str, Array], trajectory: Trajectory, cycles: int, count: int) -> list[int]:
    """Write the exact levels where they are known; return the bodies that have them."""
    if trajectory.exact is None:
        return []
    signals = [signal for signal in trajectory.exact.signals(trajectory) if signal[0] == "acceleration"]
    ends = tuple(range(cycles - count, cycles + 1))
    statistics = trajectory.exact.statistics(trajectory, signals, cycles=ends)
    if statistics is None:
        return []
    bodies = [trajectory.layout.inertia_names.index(name) for _, name in signals]
    level = np.hypot(np.sqrt(np.maximum(statistics.second, 0.0)), statistics.mean)
    for name, values in (("low", statistics.low), ("high", statistics.high), ("rms", level)):
        state[name][:, bodies] = values
    return bodies


def peak_to_peak_of(state: Mapping[str, Array]) -> Level:
    """Return the largest less the smallest acceleration of every inertia, and its error."""
    low = state["low"].min(axis=0)
    high = state["high"].max(axis=0)
    beyond = (state["high"] + state["above"]).max(axis=0) - (state["low"] - state["below"]).min(axis=0)
    return Level(high - low, np.maximum(beyond - (high - low), 0.0))


def rms_of(state: Mapping[str, Array]) -> Level:
    """Return the root mean square acceleration of every inertia, and its error."""
    return Level(_together(state["rms"]), _together(state["off"]))


def _together(levels: Array) -> Array:
    """(n,) root mean square over the cycles (cycles, n), scaled against overflow and underflow."""
    largest = levels.max(axis=0)
    scale = np.where((largest > 0.0) & np.isfinite(largest), largest, 1.0)
    return np.asarray(scale * np.sqrt(np.mean((levels / scale) ** 2, axis=0)))


def shortened(what: str, cycles: int) -> str:
    """Return a note if fewer cycles remain than a level is taken over, else an empty text."""
    if cycles >= LAST_CYCLES:
        return ""
    remain = f"{counted(cycles, 'cycle')} remain{'s' * (cycles == 1)}"
    return f"{what} over fewer than {counted(LAST_CYCLES, 'cycle')}: {remain} after the discarded ones"
