"""Contact ratio: its record, and the least-squares line of force on deflection that the routes share.

The stiffness contact ratio of Padmanabhan et al. 1995, sec. 6, replaces a clearance by one slope, Gamma times the
largest of its law. The paper's three routes lead to *two different quantities*, which have different names here:

    mean slope       E[f'(delta)] / max f'                          (the paper's time average of df/d(delta))
    equivalent gain  cov(f(delta), delta) / var(delta) / max f'     (spectra; describing functions)

They agree for a Gaussian delta (J. J. Bussgang 1952, MIT RLE Tech. Rep. 216) and for no other shape in general: a sine
of amplitude 2 b in a gap of half-width b has 0.667 and 0.391.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearrattle.engine.system.law import PiecewiseLaw
from gearrattle.trajectory import Array, Layout, Trajectory


@dataclass(frozen=True)
class ContactRatio:
    """One slope for every clearance, as a share of the largest slope of its law.

    Attributes
    ----------
    route
        "mean-slope", "spectral" or "describing".
    quantity
        "mean slope" or "equivalent gain"; the two agree for Gaussian motions only.
    value
        (K,) the ratio; NaN where the law has no slope or the deflection does not move.
    low, high
        (K,) 95 % confidence interval of the random error; the value itself where a route has none.
    """

    route: str
    quantity: str
    value: Array
    low: Array
    high: Array
    notes: tuple[str, ...] = ()


def without_error(route: str, quantity: str, value: Array, notes: tuple[str, ...] = ()) -> ContactRatio:
    """Return a ratio whose route has no random error."""
    return ContactRatio(route, quantity, value, value, value, notes)


def law_of(layout: Layout, clearance: int) -> PiecewiseLaw:
    """Return the law of one clearance from the layout, without its preload: f(0) = 0."""
    corners = layout.corners[clearance]
    slope = layout.stiffness_of_piece[clearance]
    offset = np.concatenate([[0.0], np.cumsum((slope[:-1] - slope[1:]) * corners)])
    offset -= offset[np.searchsorted(corners, 0.0, side="right")]
    first = int(layout.region_of_first_piece[clearance])
    return PiecewiseLaw(corners, slope, layout.damping_of_piece[clearance], offset, first)


def elastic(law: PiecewiseLaw, deflection: Array) -> Array:
    """Return f(delta), elementwise."""
    piece = np.searchsorted(law.corners, deflection, side="right")
    return np.asarray(law.stiffness[piece] * deflection + law.offset[piece])


def largest_slope(law: PiecewiseLaw) -> float:
    """Return the slope a ratio of 1 stands for; NaN if there is none."""
    return float(law.stiffness.max()) or float("nan")


def best_line(force: Array, deflection: Array) -> float:
    """Return the slope of the least-squares line of force on deflection: cov / var; NaN if nothing moves.

    Both are (N,) samples that stand for equal shares of time.
    """
    moved = deflection - deflection.mean()
    power = float(moved @ moved)
    moves = np.abs(moved).max() > 1e-12 * np.abs(deflection).max()
    return float(moved @ (force - force.mean())) / power if moves else float("nan")


def following(samples: Array) -> Array:
    """Return (S,) the sample after each of one period; the first follows the last."""
    return np.concatenate((samples[1:], samples[:1]))


def beyond(corners: Array, deflection: Array) -> Array:
    """Return (J, S) the share of each interval from sample to next that lies above each corner, on straight lines.

    The last interval leads back to the first sample. Unlike a count of samples it is continuous in the deflections.

    Parameters
    ----------
    corners
        (J,) ascending.
    deflection
        (S,) samples over one period.
    """
    after = following(deflection)
    high = np.maximum(deflection, after)
    width = np.abs(after - deflection)
    width = np.maximum(width, 1e-300)
    return np.asarray(np.clip((high - corners[:, None]) / width, 0.0, 1.0))


def slopes(law: PiecewiseLaw, deflection: Array) -> float:
    """Return the mean of f' over a periodic motion, (S,) samples of one period [N m/rad or N/m]."""
    return float(law.stiffness[0] + np.diff(law.stiffness) @ beyond(law.corners, deflection).mean(axis=1))


def clearances(trajectory: Trajectory) -> range:
    """Return the indices of all clearances."""
    return range(trajectory.layout.clearance.size)
