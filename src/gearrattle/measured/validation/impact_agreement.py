"""Impacts per cycle: exactly from the run's crossings, and counted alike in both records where a channel allows it.

A measured record shows impacts only where it has the force or the deflection of a clearance, and only by a threshold
that is stated: a passing is counted where |x| rises to it after having fallen by a share of it. The simulated channel,
in the same band, is counted in the same way; its difference from the exact rate shows the missed impacts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.validation.block_bootstrap import Draws, factor
from gearrattle.measured.validation.cycles import Cycles
from gearrattle.measured.validation.validation_records import Impacts
from gearrattle.model.table import listed
from gearrattle.recording import Channel
from gearrattle.signals import find_impacts
from gearrattle.trajectory import Array, Trajectory

FALLEN_BACK = 0.1
"""Share of the threshold by which |x| must have fallen below it before it counts again."""


def passings(values: Array, threshold: float) -> Array:
    """(N,) number of rises of |x| to a threshold above zero, in each of consecutive cycles (N, S)."""
    size = np.abs(values).ravel()
    known = np.where(size >= threshold, 1, np.where(size < (1.0 - FALLEN_BACK) * threshold, 0, -1))
    at = np.maximum.accumulate(np.where(known >= 0, np.arange(known.size), 0))
    state = known[at]
    rises = np.flatnonzero((state[1:] == 1) & (state[:-1] == 0)) + 1
    return np.bincount(rises // values.shape[1], minlength=len(values)).astype(np.float64)


def _countable(channels: Sequence[Channel]) -> dict[str, tuple[int, str]]:
    """Return index and subject of the channels in which impacts can be counted, by name."""
    return {c.name: (i, c.subject) for i, c in enumerate(channels) if c.quantity in ("force", "deflection", "torque")}


def counted_of(
    names: Sequence[str], channels: Sequence[Channel], thresholds: Mapping[str, float]
) -> dict[str, tuple[int, float]]:
    """Return index of the measured channel and threshold, by clearance.

    A ModelError refuses a threshold for what is no clearance, for what was not measured, or not above zero.
    """
    countable = _countable(channels)
    counted: dict[str, tuple[int, float]] = {}
    for key, threshold in thresholds.items():
        which = [(i, subject) for name, (i, subject) in countable.items() if key in (name, subject)]
        if not which or which[0][1] not in names:
            known = listed([*names, *countable]) or "nothing"
            rule = f"is no clearance with a measured force or deflection; there are {known}"
            raise ModelError(Problem("thresholds", key, rule))
        if not (threshold > 0.0 and np.isfinite(threshold)):
            raise ModelError(Problem(f"thresholds: {key}", f"{threshold:g}", "must be a finite number above zero"))
        counted[which[0][1]] = which[0][0], threshold
    return counted


def compare_impacts(
    trajectory: Trajectory,
    cycles: tuple[Cycles, Cycles],
    draws: tuple[Draws, Draws],
    channels: Sequence[Channel],
    thresholds: Mapping[str, float],
) -> tuple[Impacts, ...]:
    """Return the impacts of every clearance; thresholds, by clearance or measured channel, are SI.

    ModelError as of ``counted_of``.
    """
    # exact impacts of the run, and the ends of the cycles
    names = trajectory.layout.clearance_names
    counted = counted_of(names, channels, thresholds)
    impacts = find_impacts(trajectory)
    simulated = cycles[1]
    edges = simulated.start + simulated.period * np.arange(simulated.count + 1)
    compared = []
    for k, name in enumerate(names):
        # exact rate and its standard error
        exact = np.histogram(impacts.of(k).time, edges)[0].astype(np.float64)
        error = float(draws[1].error(draws[1].means(exact))) if np.ptp(exact) else 0.0
        # a clearance that is not counted, and why
        if name not in counted:
            nan = float("nan")
            measurable = any(subject == name for _, subject in _countable(channels).values())
            why = "no threshold was stated" if measurable else "neither its force nor its deflection was measured"
            words = f"not counted in the measurement: {why}"
            compared.append(
                Impacts(
                    clearance=name,
                    exact=float(exact.mean()),
                    exact_error=error,
                    channel="",
                    threshold=nan,
                    measured=nan,
                    simulated=nan,
                    low=nan,
                    high=nan,
                    words=words,
                )
            )
            continue
        # passings of the threshold in both records, counted alike
        i, threshold = counted[name]
        one, other = (passings(cycle.whole[:, :, i], threshold) for cycle in cycles)
        # interval of the difference of the rates
        errors = draws[0].error(draws[0].means(one)), draws[1].error(draws[1].means(other))
        reach = float(factor(errors, (draws[0].freedom, draws[1].freedom)) * np.hypot(*errors))
        apart = float(one.mean() - other.mean())
        words = (
            f"passings of {threshold:g} {channels[i].unit} by |{channels[i].name}|, counted again after a fall of "
            f"{100.0 * FALLEN_BACK:g} %, in both"
        )
        rates = float(exact.mean()), error, channels[i].name, threshold, float(one.mean()), float(other.mean())
        compared.append(Impacts(name, *rates, apart - reach, apart + reach, words))
    return tuple(compared)
