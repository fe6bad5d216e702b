"""Statistics of a motion against those of exact ones, beyond the predictability horizon.

Beyond the predictability horizon two correct motions differ sample by sample, but not in their statistics. Twenty-one
exact motions, begun within a thousandth of a half-gap of the same start (``peers``), show how far correct motions
differ. A motion's statistic is called *different* if it lies farther from theirs than any of theirs from the others,
which chance gives one motion in twenty-two (``signals.ensembles``). Nothing is assumed about the process: impacts come
in bursts, and levels wander.

Three kinds of difference do not count, however certain they are; such statistics are *equal*:

* one that the motion's own error explains (``floor``), where that error is known: motions that repeat themselves have
  no scatter, and accurate ones differ in the last digits of their tolerance;
* one of less than ``NEGLIGIBLE`` (spectra: ``NEGLIGIBLE_DB``);
* one of less than ``NEGLIGIBLE`` of the loudest cycle of the whole motion, start-up included: when a motion has come to
  rest, only rounding and tolerance are left.

With many items some are called different by chance; their expected number is given.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from gearrattle.comparison.comparison_record import Record
from gearrattle.comparison.error_floor import Floor
from gearrattle.comparison.motion_statistics import Portrait
from gearrattle.signals import (
    density_distances,
    distribution_distances,
    explained_distance,
    number_distances,
    rank,
)
from gearrattle.trajectory import Array

Verdict = Literal["equal", "same within sampling error", "different", "undecided"]
EQUAL: Verdict = "equal"
SAME: Verdict = "same within sampling error"
SIGNIFICANT = 0.05
NEGLIGIBLE = 1e-3
NEGLIGIBLE_DB = 0.01  # 0.12 % in amplitude
FEWEST_IMPULSES = 8
_ROUNDING = 1e-9  # of a bound: the bound and its value are summed in different orders


@dataclass(frozen=True)
class Item(Record):
    """One statistic of a motion among exact ones.

    Attributes
    ----------
    candidate, reference
        its value, and the mean of the exact motions' [unit]; NaN where it has
        none of its own.
    low, high
        all exact motions lie between them.
    floor
        differences of the measure from the reference below it are explained by the motion's own error.
    p_value
        how often chance puts a correct motion at least so far out; NaN where unknown.
    verdict
        "equal" (nothing that counts), "same within sampling error", "different" or "undecided" (too little to
        tell).
    by_chance
        how often a correct motion is called different; 0 where exact motions do not scatter.
    """

    quantity: str
    subject: str
    candidate: float
    reference: float
    unit: str
    measure: str
    value: float
    low: float
    high: float
    floor: float
    p_value: float
    verdict: Verdict
    by_chance: float


@dataclass(frozen=True)
class StatisticalComparison(Record):
    """All statistics of a motion among exact ones.

    Attributes
    ----------
    start, end
        of the cycles compared [s].
    items
        in the order levels, spectra, rates, impulses, transmissibilities.
    decided
        of how many items is known whether they differ.
    different_by_chance
        how many would be of a correct motion, on average.
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
        return next(item for item in self.items if (item.quantity, item.subject) == (quantity, subject))


def compare_statistics(
    candidate: Portrait, exact: Sequence[Portrait], floor: Floor | None = None, *, units: str = "SI"
) -> StatisticalComparison:
    """Return the statistics of a motion with those of exact ones, and which of them differ.

    Parameters
    ----------
    exact
        exact motions of the same driveline over the same cycles, two or more; fewer than twenty decide nothing.
    floor
        what the motion's error against one of them explains; None where that is not known.
    units
        "SI", or "dimensionless" for a model without units: then units of SI read "1".
    """
    # units of the statistics
    everyone = (candidate, *exact)
    layout = candidate.layout
    clearances = layout.clearance_names
    inertias = layout.inertia_names
    metres = [layout.is_mesh[element] for element in layout.clearance]
    rad = ["m" if is_length else "rad" for is_length in metres]
    impulse = ["N s" if is_length else "N m s" for is_length in metres]
    ones = ["1"] * len(inertias)
    shaking = ["rad/s^2"] * len(inertias)
    if units != "SI":
        rad = ["1"] * len(metres)
        impulse = ["1"] * len(metres)
        shaking = ones
    # differences that do not count: a part of the loudest cycle
    moved = NEGLIGIBLE * np.max([motion.largest_deflection for motion in exact], axis=0)
    shaken = NEGLIGIBLE * np.max([motion.largest_acceleration for motion in exact], axis=0)
    tr_rms, tr_peak = _referred(shaken, exact, layout.reference)

    def numbers(quantity: str, field: str, names: Sequence[str], units: Sequence[str], least: Array) -> Iterator[Item]:
        for i, name in enumerate(names):
            if quantity.startswith("TR") and i == layout.reference:
                continue  # its own is 1
            values = np.array([getattr(motion, field)[i] for motion in everyone])
            explained = None if floor is None else (getattr(floor.reference, field)[i], getattr(floor, field)[i])
            yield _number(quantity, (name, units[i]), values, float(least[i]), explained)

    # levels, spectra, impact rates, impulses, transmissibilities
    densities = np.array([motion.density for motion in everyone])
    items = (
        *numbers("rms deflection", "deflection", clearances, rad, moved),
        *numbers("rms acceleration", "acceleration", inertias, shaking, shaken),
        *_densities(inertias, densities, shaken / np.sqrt(candidate.resolution), floor),
        *numbers("impact rate", "rate", clearances, ["1/cycle"] * len(clearances), np.zeros(len(clearances))),
        *_impulses(clearances, impulse, everyone, floor),
        *numbers("TR rms", "tr_rms", inertias, ones, tr_rms),
        *numbers("TR peak", "tr_peak", inertias, ones, tr_peak),
    )
    # how many differ, and how many would by chance
    different = sum(item.verdict == "different" for item in items)
    decided = sum(item.verdict != "undecided" for item in items)
    by_chance = sum(item.by_chance for item in items)
    return StatisticalComparison(
        candidate.start, candidate.end, candidate.cycles, len(exact), items, decided, different, by_chance
    )


def _referred(least: Array, exact: Sequence[Portrait], reference: int) -> tuple[Array, Array]:
    """(n,) what is negligible in TR rms and in TR peak: ``least`` over the reference's rms, mean included and without.

    Infinite where that one rests: a ratio to rest says nothing.
    """
    with_mean = float(np.mean([motion.acceleration[reference] for motion in exact]))
    power = float(np.mean([np.sum(motion.density[reference]) * motion.resolution for motion in exact]))
    bases = with_mean, float(np.sqrt(power))
    rms, swing = (least / base if base > least[reference] else np.full(least.size, np.inf) for base in bases)
    return rms, swing


def _judged(distances: Array, *, large: bool, scatter: bool) -> tuple[float, Verdict, float]:
    """Return p, the verdict on the first motion, and the probability that chance calls a motion different."""
    if distances.size * SIGNIFICANT <= 1.0 or np.isnan(distances).any():
        return float("nan"), "undecided", 0.0
    p = rank(distances)
    chance = 1.0 / distances.size if scatter else 0.0
    if not large:
        return p, EQUAL, chance
    return p, "different" if p < SIGNIFICANT else SAME, chance


def _number(
    quantity: str, subject: tuple[str, str], values: Array, least: float, explained: tuple[float, float] | None
) -> Item:
    """A statistic that is a number: the first one's over the mean of the others.

    Parameters
    ----------
    values
        (m,) of all motions.
    least
        if the squares of both are no farther apart than its square, they are not different.
    explained
        value of the reference, and how far the motion's own error may move it; None where not known.
    """
    # distances from exact motions, and whether they are large enough to count
    mine = float(values[0])
    others = values[1:]
    mean = float(np.mean(others))
    distances = number_distances(values)
    reference, bound = (float("nan"), 0.0) if explained is None else map(float, explained)
    large = (
        distances[0] > NEGLIGIBLE * abs(mean)
        and distances[0] * (abs(mine) + abs(mean)) > least**2
        and not abs(mine - reference) <= bound * (1.0 + _ROUNDING)
    )
    # the verdict by rank, and the measure: a ratio to the mean of exact motions
    spread = float(np.ptp(others)) if np.isfinite(others).all() else 0.0
    p, verdict, by_chance = _judged(distances, large=bool(large), scatter=spread > max(NEGLIGIBLE * abs(mean), bound))
    scale = mean if mean != 0.0 else float("nan")
    low = float(np.min(others)) / scale
    high = float(np.max(others)) / scale
    measure = "ratio to the mean of exact motions"
    floor = max(NEGLIGIBLE, bound / abs(scale))
    return Item(
        quantity=quantity,
        subject=subject[0],
        candidate=mine,
        reference=mean,
        unit=subject[1],
        measure=measure,
        value=mine / scale,
        low=low,
        high=high,
        floor=floor,
        p_value=p,
        verdict=verdict,
        by_chance=by_chance,
    )


def _densities(names: Sequence[str], densities: Array, least: Array, floor: Floor | None) -> Iterator[Item]:
    """(m, n, f); ``least`` (n,): apart by no more than its square, over all bins, they are not different."""
    # distances of the densities, and the part that the motion's own error explains
    nan = float("nan")
    chance = 2.0 / len(densities)
    for i, name in enumerate(names):
        far, share = density_distances(densities[:, i], None if floor is None else floor.density[i])
        apart = np.sum(np.abs(densities[0, i] - np.mean(densities[1:, i], axis=0)))
        distance = nan
        bound = 0.0
        if floor is not None:
            distance, bound = explained_distance(densities[:, i], floor.reference.density[i], floor.density[i])
        # is the distance large enough to count, and do exact motions scatter
        large = far[0] > NEGLIGIBLE_DB and apart > least[i] ** 2 and not distance <= bound * (1.0 + _ROUNDING)
        scatter = bool(np.max(far[1:]) > max(NEGLIGIBLE_DB, bound))
        # both measures of a spectrum
        for quantity, measure, distances, smallest in (
            (
                "PSD outside bands",
                f"share of bins above or below all exact motions', {chance:.2g} by chance [1]",
                share,
                nan,
            ),
            (
                "PSD distance",
                "rms over the bins of 10 lg of the ratio to the mean of exact motions' [dB]",
                far,
                max(NEGLIGIBLE_DB, bound),
            ),
        ):
            p, verdict, by_chance = _judged(distances, large=bool(large), scatter=scatter)
            value = float(distances[0])
            high = float(np.max(distances[1:]))
            yield Item(
                quantity=quantity,
                subject=name,
                candidate=nan,
                reference=nan,
                unit="",
                measure=measure,
                value=value,
                low=0.0,
                high=high,
                floor=smallest,
                p_value=p,
                verdict=verdict,
                by_chance=by_chance,
            )


def _impulses(
    names: Sequence[str], units: Sequence[str], everyone: Sequence[Portrait], floor: Floor | None
) -> Iterator[Item]:
    # medians of the impulses
    for k, (name, unit) in enumerate(zip(names, units, strict=True)):
        samples = [motion.impulses[k] for motion in everyone]
        medians = [float(np.median(sample)) if sample.size else float("nan") for sample in samples]
        # distances of the distributions beyond a shift that does not count
        distances = np.full(len(samples), np.nan)
        shift = float("nan")
        if min(sample.size for sample in samples) >= FEWEST_IMPULSES:
            shift = NEGLIGIBLE * float(np.sqrt(np.mean(np.concatenate(samples[1:]) ** 2)))
            shift = shift if floor is None else max(shift, float(floor.impulse[k]))
            distances = distribution_distances(samples, shift)
        # the verdict by rank
        p, verdict, by_chance = _judged(distances, large=bool(distances[0] > 0.0), scatter=bool(np.any(distances[1:])))
        yield Item(
            quantity="contact impulse distribution",
            subject=name,
            candidate=medians[0],
            reference=float(np.mean(medians[1:])),
            unit=unit,
            measure=f"largest distance of the distributions beyond a shift of {shift:.3g} {unit} [1]",
            value=float(distances[0]),
            low=0.0,
            high=float(np.max(distances[1:])),
            floor=0.0,
            p_value=p,
            verdict=verdict,
            by_chance=by_chance,
        )
