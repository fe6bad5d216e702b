"""True error, sample by sample, inside the predictability horizon.

    e_k(t) = |delta_k - delta_k,ref| / b_k,   b_k the largest |corner| of clearance k (a half-gap),

or, where its only corner is at 0, the largest |delta_k,ref| of the window; and for velocities |v_i - v_i,ref| over the
rms value of v_i,ref about its mean, so that a steady drift does not flatter. The paper's algorithms are compared by
eye and by coherence (Padmanabhan et al. 1995, sec. 9); with an exact reference the error itself can be said, but only
while a difference in the sixteenth digit has not grown to the size of the motion.

A driveline without clearances has no half-gap to measure by: its error is that of the velocities, over the largest rms
value of any.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.comparison.comparison_record import Record
from gearrattle.comparison.pair_checks import same_grid, samples_until
from gearrattle.trajectory import Array, Trajectory

PASSED = (1e-6, 1e-3, 1e-1)


@dataclass(frozen=True)
class PointwiseError(Record):
    """The largest errors inside a window, and the times at which errors pass thresholds.

    Attributes
    ----------
    horizon
        end of the window [s], at most that of the motion.
    deflection_scale
        (K,) what deflections are measured by [rad or m].
    deflection
        (K,) largest error of the deflection [scales]; infinite where the reference never moves.
    velocity_scale
        (n,) rms of the reference's velocity about its mean, in the window [rad/s].
    velocity
        (n,) largest error of the velocity [scales].
    thresholds
        errors in deflection [scales], ascending.
    passed
        (thresholds,) time at which the worst error first exceeds each, over the whole motion [s]; infinite
        where it never does.
    worst
        the largest error inside the window: of any deflection, or of any velocity without clearances.
    """

    horizon: float
    samples: int
    clearances: tuple[str, ...]
    inertias: tuple[str, ...]
    deflection_scale: Array
    deflection: Array
    velocity_scale: Array
    velocity: Array
    thresholds: tuple[float, ...]
    passed: Array
    worst: float
    unit: str


def pointwise(
    candidate: Trajectory,
    reference: Trajectory,
    horizon: float | None = None,
    *,
    thresholds: tuple[float, ...] = PASSED,
) -> PointwiseError:
    """Return the error of one motion against another inside [0, horizon].

    Parameters
    ----------
    horizon
        end of the window [s], such as the reference's predictability horizon; None: the whole motion.
    thresholds
        errors; the time at which each is first exceeded is given [scales], ascending.

    Raises
    ------
    ModelError
        other driveline or other grid.
    """
    # scales of deflections and velocities
    same_grid(candidate, reference)
    samples = samples_until(reference, horizon)
    scale = deflection_scale(reference, samples)
    history = error_history(candidate, reference, scale)
    velocity = reference.velocity[:samples]
    level = np.std(velocity, axis=0)
    level = np.where(level > 1e-14 * np.max(np.abs(velocity), axis=0), level, 0.0)  # a constant is rounded, not moving
    # largest errors in the window, and the times at which thresholds are passed
    worst = worst_history(candidate, reference, samples)
    return PointwiseError(
        horizon=float(reference.time[samples - 1]),
        samples=samples,
        clearances=reference.layout.clearance_names,
        inertias=reference.layout.inertia_names,
        deflection_scale=scale,
        deflection=np.max(history[:samples], axis=0),
        velocity_scale=level,
        velocity=np.max(_relative(candidate.velocity[:samples] - velocity, level), axis=0),
        thresholds=thresholds,
        passed=np.array([_first(reference.time, worst > threshold) for threshold in thresholds]),
        worst=float(np.max(worst[:samples])),
        unit="half-gaps" if reference.layout.clearance.size else "of the rms velocity",
    )


def worst_history(candidate: Trajectory, reference: Trajectory, samples: int) -> Array:
    """Return (Nt,) the worst error at every sample of one grid, of deflections or, without clearances, velocities."""
    if reference.layout.clearance.size:
        history = error_history(candidate, reference, deflection_scale(reference, samples))
    else:
        velocity = reference.velocity[:samples]
        level = float(np.max(np.std(velocity, axis=0)))
        steady = float(np.max(np.abs(velocity)))
        scale = level if level > 1e-14 * steady else steady
        history = _relative(candidate.velocity - reference.velocity, np.full(velocity.shape[1], scale))
    return np.asarray(np.max(history, axis=1))


def deflection_scale(reference: Trajectory, samples: int) -> Array:
    """Return (K,) each clearance's largest |corner|, or its largest deflection where the corner is at 0 [rad or m]."""
    corners = np.array([np.max(np.abs(corner)) for corner in reference.layout.corners])
    largest = np.max(np.abs(reference.deflection[:samples]), axis=0)
    return np.asarray(np.where(corners > 0.0, corners, largest), dtype=np.float64)


def error_history(candidate: Trajectory, reference: Trajectory, scale: Array) -> Array:
    """Return (Nt, K) the error of every deflection at every sample, in units of ``scale`` (K,)."""
    return _relative(candidate.deflection - reference.deflection, scale)


def envelope(time: Array, worst: Array, dense: float = math.inf, points: int = 400) -> tuple[Array, Array]:
    """Return some times, and the worst error since the time before.

    Parameters
    ----------
    time
        (Nt,) [s].
    worst
        (Nt,) errors.
    dense
        half of the times lie before it [s]: where errors grow.
    """
    early = int(np.searchsorted(time, dense))
    edges = [np.linspace(*span, min(points, span[1] - span[0]) + 1) for span in ((0, early), (early, time.size))]
    edge = np.unique(np.concatenate(edges).astype(np.int64))
    return time[edge[1:] - 1], np.maximum.reduceat(worst, edge[:-1])


def _relative(error: Array, scale: Array) -> Array:
    """(N, k) |error| / scale; where the scale is zero 0 for no error, else infinite. NaN counts as infinite."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(error == 0.0, 0.0, np.abs(error) / scale)
    return np.where(np.isnan(ratio), np.inf, ratio)


def _first(time: Array, passed: NDArray[np.bool_]) -> float:
    at = np.flatnonzero(passed)
    return float(time[at[0]]) if at.size else float("inf")
