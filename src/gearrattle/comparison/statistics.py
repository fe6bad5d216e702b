"""Beyond the predictability horizon two correct motions differ sample by sample, but not in their statistics.

Each *item* is one such statistic of both motions, the range that sampling error alone keeps it in (95 of 100 cases),
and a verdict. Compared over whole cycles: rms of deflections and accelerations and rates of impacts by batches of
cycles (impacts are neither independent nor Poisson), spectra of accelerations and distributions of impulses by
exchanging blocks of cycles. Formulas and sources: ``signals.batches``, ``densities``, ``distributions``, ``exchange``.

An item is called different if sampling error alone would give its value in fewer than 5 of 100 cases, and if it differs
by more than ``NEGLIGIBLE`` (spectra: ``NEGLIGIBLE_DB``): a periodic motion repeats itself, so any difference in it is
certain, however small. With many items some are called different by chance; how many to expect is told.

Takes two Trajectories; gives a StatisticalComparison.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from gearrattle.comparison.pair import cycles_beyond, same_grid
from gearrattle.comparison.record import Record
from gearrattle.signals import (
    Exchange,
    Window,
    batch_mean,
    density_distance,
    difference,
    distribution_distance,
    find_impacts,
    segment_densities,
)
from gearrattle.signals.batches import Mean, batches_of, wanders
from gearrattle.trajectory import Array, IntArray, Trajectory

Verdict = Literal["same within sampling error", "different", "undecided"]
SAME: Verdict = "same within sampling error"
SIGNIFICANT = 0.05
NEGLIGIBLE = 1e-3
NEGLIGIBLE_DB = 0.01  # 0.12 % in amplitude
FEWEST_IMPULSES = 8


@dataclass(frozen=True)
class Item(Record):
    """One statistic of two motions.

    Attributes:
        quantity: which, in words.
        subject: of which inertia or clearance.
        given, reference: its value for either [unit]; NaN where it exists only for the two together.
        unit: of these two.
        measure: what of the two is tested, in words with its unit.
        value: that measure.
        low, high: sampling error alone keeps it between them in 95 of 100 cases; NaN where unknown.
        p_value: how often sampling error alone gives so large a difference; NaN where unknown.
        verdict: "same within sampling error", "different" or "undecided" (too little to tell).
    """

    quantity: str
    subject: str
    given: float
    reference: float
    unit: str
    measure: str
    value: float
    low: float
    high: float
    p_value: float
    verdict: Verdict


@dataclass(frozen=True)
class StatisticalComparison(Record):
    """All statistics of two motions.

    Attributes:
        start, end: of the cycles compared [s].
        cycles: how many.
        items: in the order levels, spectra, rates, impulses.
        different: how many are called different.
        different_by_chance: how many of the decided ones would be if the two motions differed by chance alone.
        wandering: inertias and clearances whose level drifts over the cycles compared, in either motion; nothing of
            theirs is called different: the run is too short to tell.
    """

    start: float
    end: float
    cycles: int
    items: tuple[Item, ...]
    different: int
    different_by_chance: float
    wandering: tuple[str, ...] = ()

    def of(self, quantity: str, subject: str) -> Item:
        """Return one item, by quantity and name of the inertia or clearance."""
        return next(each for each in self.items if (each.quantity, each.subject) == (quantity, subject))


def compare_statistics(given: Trajectory, reference: Trajectory, start: float | None = None) -> StatisticalComparison:
    """Return the statistics of two motions beyond a time, and which of them differ.

    Args:
        given, reference: on the same output grid.
        start: compare the whole cycles that begin at or after it [s], such as the predictability horizon; None: the
            steady part. Discarded cycles never count.

    Raises:
        ModelError: other driveline, other grid, or no whole cycle left.
    """
    same_grid(given, reference)
    window = cycles_beyond(reference, start)
    items: tuple[Item, ...] = (
        *_levels(given, reference, window),
        *_spectra(given, reference, window),
        *_rates(given, reference, window),
        *_impulses(given, reference, window),
    )
    wandering = _wandering(given, reference, window)
    items = tuple(
        replace(item, verdict="undecided") if item.verdict == "different" and item.subject in wandering else item
        for item in items
    )
    decided = sum(item.verdict != "undecided" for item in items)
    different = sum(item.verdict == "different" for item in items)
    return StatisticalComparison(
        window.start, window.end, window.cycles, items, different, SIGNIFICANT * decided, wandering
    )


def _verdict(p_value: float, *, large: bool = True) -> Verdict:
    if np.isnan(p_value):
        return "undecided"
    return "different" if p_value < SIGNIFICANT and large else SAME


def _levels(given: Trajectory, reference: Trajectory, window: Window) -> Iterator[Item]:
    plate = reference.layout
    for k, name in enumerate(plate.clearance_names):
        unit = "m" if plate.is_mesh[plate.clearance[k]] else "rad"
        mine, theirs = (_squares(each.deflection[:, k], window) for each in (given, reference))
        yield _level("rms deflection", name, unit, mine, theirs)
    for i, name in enumerate(plate.inertia_names):
        mine, theirs = (_squares(each.acceleration[:, i], window) for each in (given, reference))
        yield _level("rms acceleration", name, "rad/s^2", mine, theirs)


def _wandering(given: Trajectory, reference: Trajectory, window: Window) -> tuple[str, ...]:
    """Names of the inertias and clearances whose level wanders in either motion."""
    plate = reference.layout
    found = []
    for names, quantity in ((plate.clearance_names, "deflection"), (plate.inertia_names, "acceleration")):
        for k, name in enumerate(names):
            signals = (window.periodic(getattr(each, quantity)[:, k]) for each in (given, reference))
            if any(wanders(np.mean(s.reshape(window.cycles, -1) ** 2, axis=1)) for s in signals):
                found.append(name)
    return tuple(found)


def _squares(signal: Array, window: Window) -> Mean:
    """Mean square by cycle."""
    return batch_mean(np.mean(window.periodic(signal).reshape(window.cycles, -1) ** 2, axis=1))


def _level(quantity: str, subject: str, unit: str, given: Mean, reference: Mean) -> Item:
    """Ratio of two rms values; its logarithm has half the relative error of the mean squares."""
    mine, theirs = float(np.sqrt(given.value)), float(np.sqrt(reference.value))
    if mine == theirs == 0.0:
        return Item(quantity, subject, 0.0, 0.0, unit, "ratio given/reference", 1.0, 1.0, 1.0, 1.0, SAME)
    if mine == 0.0 or theirs == 0.0:
        ratio = mine / theirs if theirs else float("inf")
        return Item(quantity, subject, mine, theirs, unit, "ratio given/reference", ratio, 1.0, 1.0, 0.0, "different")
    logs = [Mean(0.5 * np.log(each.value), 0.5 * each.error / each.value, each.batches) for each in (given, reference)]
    found = difference(*logs)
    low, high = float(np.exp(-found.reach)), float(np.exp(found.reach))
    verdict = _verdict(found.p_value, large=abs(found.value) > NEGLIGIBLE)
    measure, ratio = "ratio given/reference", mine / theirs
    return Item(quantity, subject, mine, theirs, unit, measure, ratio, low, high, found.p_value, verdict)


def _spectra(given: Trajectory, reference: Trajectory, window: Window) -> Iterator[Item]:
    plate, samples = reference.layout, reference.samples_per_cycle
    for i, name in enumerate(plate.inertia_names):
        signals = (window.periodic(each.acceleration)[:, i] for each in (given, reference))
        found = density_distance(*(segment_densities(signal, plate.period, samples) for signal in signals))
        large = found.distance.value > NEGLIGIBLE_DB
        share = "share of the bins outside their 95 % band, 0.05 for Gaussian noise [1]"
        yield _spectral("PSD outside bands", name, share, found.outside, large)
        far = f"rms over {found.bins} bins of 10 lg(given/reference), {found.expected:.2g} for Gaussian noise [dB]"
        yield _spectral("PSD distance", name, far, found.distance, large)


def _spectral(quantity: str, subject: str, measure: str, found: Exchange, large: bool) -> Item:
    none, verdict = float("nan"), _verdict(found.p_value, large=large)
    return Item(quantity, subject, none, none, "", measure, found.value, 0.0, found.high, found.p_value, verdict)


def _rates(given: Trajectory, reference: Trajectory, window: Window) -> Iterator[Item]:
    for k, name in enumerate(reference.layout.clearance_names):
        mine, theirs = (batch_mean(_counts(each, k, window)) for each in (given, reference))
        found = difference(mine, theirs)
        large = abs(found.value) > NEGLIGIBLE * max(mine.value, theirs.value)
        yield Item(
            quantity="impact rate",
            subject=name,
            given=mine.value,
            reference=theirs.value,
            unit="1/cycle",
            measure="difference given - reference [1/cycle]",
            value=found.value,
            low=-found.reach,
            high=found.reach,
            p_value=found.p_value,
            verdict=_verdict(found.p_value, large=large),
        )


def _counts(trajectory: Trajectory, clearance: int, window: Window) -> Array:
    """(cycles,) impacts in each cycle."""
    time = find_impacts(trajectory).of(clearance).within(window).time
    return np.bincount(_cycle(time, window), minlength=window.cycles).astype(np.float64)


def _cycle(time: Array, window: Window) -> IntArray:
    """(I,) the cycle of the window in which each time lies, from 0; the very end belongs to the last."""
    cycle = np.floor((time - window.start) / window.duration * window.cycles).astype(np.int64)
    return np.asarray(np.clip(cycle, 0, window.cycles - 1), dtype=np.int64)


def _impulses(given: Trajectory, reference: Trajectory, window: Window) -> Iterator[Item]:
    plate, blocks = reference.layout, batches_of(window.cycles)
    block_of_cycle = np.repeat(
        np.arange(blocks), [part.size for part in np.array_split(np.arange(window.cycles), blocks)]
    )
    for k, name in enumerate(plate.clearance_names):
        (mine, when), (theirs, then) = (_pushes(each, k, window) for each in (given, reference))
        value = high = p_value = float("nan")
        large = False
        if min(mine.size, theirs.size) >= FEWEST_IMPULSES:
            tolerance = NEGLIGIBLE * float(np.sqrt(np.mean(theirs**2)))
            found = distribution_distance(
                mine, theirs, block_of_cycle[when], block_of_cycle[then], blocks=blocks, tolerance=tolerance
            )
            value, high, p_value = found.value, found.blocks.high, found.blocks.p_value
            large = found.beyond_tolerance > high
        yield Item(
            quantity="impulse distribution",
            subject=name,
            given=_median(mine),
            reference=_median(theirs),
            unit="N s" if plate.is_mesh[plate.clearance[k]] else "N m s",
            measure="largest distance of the distributions [1]",
            value=value,
            low=0.0,
            high=high,
            p_value=p_value,
            verdict=_verdict(p_value, large=large),
        )


def _median(values: Array) -> float:
    return float(np.median(values)) if values.size else float("nan")


def _pushes(trajectory: Trajectory, clearance: int, window: Window) -> tuple[Array, IntArray]:
    """(I,) impulses that are known whole, and the cycle in which each began."""
    impacts = find_impacts(trajectory).of(clearance).within(window)
    known = ~impacts.censored & np.isfinite(impacts.impulse)
    return impacts.impulse[known], _cycle(impacts.time[known], window)
