"""Beyond the predictability horizon two correct motions differ sample by sample, but not in their statistics.

How far may these be apart? The exact solution is asked: twenty-one exact motions, begun within a thousandth of a
half-gap of the same start (``peers``), show what a correct motion may come to. A motion's statistic is called
*different* if it lies farther from theirs than any of theirs from the others, which chance gives one motion in
twenty-two (``signals.ensembles``). Nothing is assumed about the process: impacts come in bursts, and levels wander.

Nothing is called different, however certain, if it is by less than ``NEGLIGIBLE`` (spectra: ``NEGLIGIBLE_DB``): motions
that repeat themselves have no scatter. Nor if it is by less than ``NEGLIGIBLE`` of the loudest cycle of the whole
motion, start-up included: what is left when a motion has come to rest is rounding and tolerance. With many items some
are called different by chance; how many is told.

Takes Portraits; gives a StatisticalComparison.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from gearrattle.comparison.portrait import Portrait
from gearrattle.comparison.record import Record
from gearrattle.signals import density_distances, distribution_distances, number_distances, rank
from gearrattle.trajectory import Array

Verdict = Literal["same within sampling error", "different", "undecided"]
SAME: Verdict = "same within sampling error"
SIGNIFICANT = 0.05
NEGLIGIBLE = 1e-3
NEGLIGIBLE_DB = 0.01  # 0.12 % in amplitude
FEWEST_IMPULSES = 8


@dataclass(frozen=True)
class Item(Record):
    """One statistic of a motion among exact ones.

    Attributes:
        quantity: which, in words.
        subject: of which inertia or clearance.
        given, reference: its value, and the mean of the exact motions' [unit]; NaN where it has no value of its own.
        unit: of these two.
        measure: what is tested, in words with its unit.
        value: that measure.
        low, high: all exact motions lie between them.
        p_value: how often chance puts a correct motion at least so far out; NaN where unknown.
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
    """All statistics of a motion among exact ones.

    Attributes:
        start, end: of the cycles compared [s].
        cycles: how many.
        motions: number of exact motions.
        items: in the order levels, spectra, rates, impulses, transmissibilities.
        decided: of how many items is known whether they differ.
        different: how many are called different.
        different_by_chance: how many of the decided ones would be of a correct motion, on average.
    """

    start: float
    end: float
    cycles: int
    motions: int
    items: tuple[Item, ...]
    decided: int
    different: int
    different_by_chance: float

    def of(self, quantity: str, subject: str) -> Item:
        """Return one item, by quantity and name of the inertia or clearance."""
        return next(each for each in self.items if (each.quantity, each.subject) == (quantity, subject))


def compare_statistics(given: Portrait, exact: Sequence[Portrait]) -> StatisticalComparison:
    """Return the statistics of a motion beside those of exact ones, and which of them differ.

    Args:
        given: the motion in question.
        exact: exact motions of the same driveline over the same cycles, two or more; fewer than twenty decide nothing.
    """
    everyone = (given, *exact)
    plate = given.layout
    metres = [plate.is_mesh[element] for element in plate.clearance]
    rad, impulse = (["m" if each else "rad" for each in metres], ["N s" if each else "N m s" for each in metres])
    clearances, inertias = plate.clearance_names, plate.inertia_names
    accelerations = np.array([each.acceleration for each in everyone])
    moved = NEGLIGIBLE * np.max([each.largest_deflection for each in exact], axis=0)
    shaken = NEGLIGIBLE * np.max([each.largest_acceleration for each in exact], axis=0)
    rms, swing = _referred(shaken, exact, plate.reference)
    items = (
        *_numbers("rms deflection", clearances, rad, np.array([each.deflection for each in everyone]), moved),
        *_numbers("rms acceleration", inertias, ["rad/s^2"] * len(inertias), accelerations, shaken),
        *_densities(inertias, np.array([each.density for each in everyone]), shaken / np.sqrt(given.resolution)),
        *_numbers("impact rate", clearances, ["1/cycle"] * len(clearances), np.array([each.rate for each in everyone])),
        *_impulses(clearances, impulse, everyone),
        *_ratios("TR rms", plate.reference, inertias, np.array([each.tr_rms for each in everyone]), rms),
        *_ratios("TR peak", plate.reference, inertias, np.array([each.tr_peak for each in everyone]), swing),
    )  # fmt: skip
    different = sum(item.verdict == "different" for item in items)
    decided = sum(item.verdict != "undecided" for item in items)
    by_chance = decided / len(everyone)
    return StatisticalComparison(given.start, given.end, given.cycles, len(exact), items, decided, different, by_chance)


def _referred(least: Array, exact: Sequence[Portrait], reference: int) -> tuple[Array, Array]:
    """(n,) what is negligible in TR rms and in TR peak: ``least`` over the reference's rms, mean included and without.

    Infinite where that one rests: a ratio to rest says nothing.
    """
    with_mean = float(np.mean([each.acceleration[reference] for each in exact]))
    power = float(np.mean([np.sum(each.density[reference]) * each.resolution for each in exact]))
    bases = with_mean, float(np.sqrt(power))
    rms, swing = (least / base if base > least[reference] else np.full(least.size, np.inf) for base in bases)
    return rms, swing


def _judged(distances: Array, *, large: bool) -> tuple[float, Verdict]:
    """p and verdict of the first."""
    if distances.size * SIGNIFICANT <= 1.0 or np.isnan(distances).any():
        return float("nan"), "undecided"
    p = rank(distances)
    return p, "different" if p < SIGNIFICANT and large else SAME


def _numbers(
    quantity: str, names: Sequence[str], units: Sequence[str], values: Array, least: Array | None = None
) -> Iterator[Item]:
    """Statistics (m, k) that are numbers: the first one's over the mean of the others.

    ``least`` (k,): if the squares of both are no farther apart than its square, they are not different.
    """
    least = np.zeros(len(names)) if least is None else least
    for name, unit, column, floor in zip(names, units, values.T, least, strict=True):
        mine, others = float(column[0]), column[1:]
        mean = float(np.mean(others))
        distances = number_distances(column)
        large = distances[0] > NEGLIGIBLE * abs(mean) and distances[0] * (abs(mine) + abs(mean)) > floor**2
        p, verdict = _judged(distances, large=bool(large))
        scale = mean if mean != 0.0 else float("nan")
        low, high = float(np.min(others)) / scale, float(np.max(others)) / scale
        measure = "ratio to the mean of exact motions"
        yield Item(quantity, name, mine, mean, unit, measure, mine / scale, low, high, p, verdict)


def _ratios(quantity: str, reference: int, names: Sequence[str], values: Array, least: Array) -> Iterator[Item]:
    """Transmissibilities: numbers, but for the reference inertia's own."""
    others = [i for i in range(len(names)) if i != reference]
    yield from _numbers(quantity, [names[i] for i in others], ["1"] * len(others), values[:, others], least[others])


def _densities(names: Sequence[str], densities: Array, least: Array) -> Iterator[Item]:
    """(m, n, f); ``least`` (n,): apart by no more than its square, over all bins, they are not different."""
    nan = float("nan")
    for i, name in enumerate(names):
        far, share = density_distances(densities[:, i])
        apart = np.sum(np.abs(densities[0, i] - np.mean(densities[1:, i], axis=0)))
        large = bool(far[0] > NEGLIGIBLE_DB and apart > least[i] ** 2)
        chance = 2.0 / len(densities)
        for quantity, measure, distances in (
            (
                "PSD outside bands",
                f"share of bins above or below all exact motions', {chance:.2g} by chance [1]",
                share,
            ),
            ("PSD distance", "rms over the bins of 10 lg of the ratio to the mean of exact motions' [dB]", far),
        ):
            p, verdict = _judged(distances, large=large)
            value, high = float(distances[0]), float(np.max(distances[1:]))
            yield Item(quantity, name, nan, nan, "", measure, value, 0.0, high, p, verdict)


def _impulses(names: Sequence[str], units: Sequence[str], everyone: Sequence[Portrait]) -> Iterator[Item]:
    for k, (name, unit) in enumerate(zip(names, units, strict=True)):
        samples = [each.impulses[k] for each in everyone]
        medians = [float(np.median(sample)) if sample.size else float("nan") for sample in samples]
        distances = np.full(len(samples), np.nan)
        if min(sample.size for sample in samples) >= FEWEST_IMPULSES:
            tolerance = NEGLIGIBLE * float(np.sqrt(np.mean(np.concatenate(samples[1:]) ** 2)))
            distances = distribution_distances(samples, tolerance)
        p, verdict = _judged(distances, large=True)
        yield Item(
            quantity="impulse distribution",
            subject=name,
            given=medians[0],
            reference=float(np.mean(medians[1:])),
            unit=unit,
            measure=f"largest distance of the distributions beyond a shift of {NEGLIGIBLE:g} of the rms [1]",
            value=float(distances[0]),
            low=0.0,
            high=float(np.max(distances[1:])),
            p_value=p,
            verdict=verdict,
        )
