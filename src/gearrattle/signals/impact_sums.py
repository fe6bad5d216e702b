"""Hardness of the impacts of every clearance, from the sums over crossings (``crossing_sums``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gearrattle.signals.crossing_sums import Sums, corners_of
from gearrattle.trajectory import Array, Layout


class Hardness(NamedTuple):
    """Hardness of the impacts of one clearance: magnitudes, NaN without impacts.

    Attributes
    ----------
    mean_speed, largest_speed
        of the approach velocity v [rad/s or m/s].
    mean_momentum, largest_momentum
        m_eff |v| [N m s or N s].
    mean_energy, largest_energy
        m_eff v^2 / 2 [J].
    mean_exchanged, largest_exchanged
        m_eff (|v| + |v'|), v' the rate at the end of the contact [N m s or N s].
    mean_impulse, largest_impulse
        contact impulse, static load included [N m s or N s]; NaN without force
        integrals.
    """

    mean_speed: Array
    largest_speed: Array
    mean_momentum: Array
    largest_momentum: Array
    mean_energy: Array
    largest_energy: Array
    mean_exchanged: Array
    largest_exchanged: Array
    mean_impulse: Array
    largest_impulse: Array


_OF_CLEARANCES = ("count", "speed", "top_speed", "square", "left", "top_change", "push", "top_push", "final", "mass")


@dataclass(frozen=True)
class ImpactSummary:
    """The impacts of one clearance.

    Attributes
    ----------
    censored
        whether the motion ends within a contact that counts.
    """

    count: int
    drive: int
    hardness: Hardness
    censored: bool


def summarise_impacts(sums: Sums, layout: Layout, clearance: int) -> ImpactSummary:
    """Return the statistics of one clearance; an open contact counts up to the end of the motion."""
    return ImpactSummary(
        count=int(sums["count"][clearance]),
        drive=int(sums["drive"][clearance]),
        hardness=measure_impacts(sums, layout, clearance),
        censored=bool(np.any(sums["open"][corners_of(layout, clearance)] > 0.0)),
    )


def measure_impacts(sums: Sums, layout: Layout, clearance: int) -> Hardness:
    """Return how hard one clearance's impacts are; the sums may be those of many motions along leading axes.

    Momenta and energies of an element without a free end do not exist: NaN.
    """
    # contacts that are still open count up to the end
    mine = corners_of(layout, clearance)
    of = {name: sums[name][..., clearance] for name in _OF_CLEARANCES}
    pending = np.zeros(np.shape(of["count"]))
    largest = of["top_push"]
    change = of["top_change"]
    for corner in range(mine.start, mine.stop):
        is_open = sums["open"][..., corner] > 0.0
        gathered = np.abs(of["final"] - sums["begun"][..., corner])
        pending = np.where(is_open, pending + gathered, pending)
        largest = np.where(is_open, np.maximum(largest, gathered), largest)
        change = np.where(is_open, np.maximum(change, sums["met"][..., corner]), change)
    # means and largest values of speed, momentum, energy, exchanged momentum and impulse
    mass = np.where(np.isfinite(of["mass"]), of["mass"], np.nan)
    count = of["count"]
    with np.errstate(invalid="ignore", divide="ignore"):
        values = (
            of["speed"] / count,
            of["top_speed"],
            mass * (of["speed"] / count),
            mass * of["top_speed"],
            0.5 * mass * (of["square"] / count),
            0.5 * mass * of["top_speed"] ** 2,
            mass * ((of["speed"] + of["left"]) / count),
            mass * change,
            (of["push"] + pending) / count,
            largest,
        )
    return Hardness(*(np.where(count > 0.0, value, np.nan) for value in values))
