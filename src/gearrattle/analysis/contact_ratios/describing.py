"""Describing functions: the gain with which a clearance answers an assumed motion, the third route of the paper.

Any staged law is a line and a sum of ramps, f(delta) = f_0 + k_0 delta + sum_j dk_j (delta - c_j)_+. Under
delta = m + A sin phi a ramp contributes, with u = (c - m) / A cut to -1 ... 1,

    mean force          (A / pi) (sqrt(1 - u^2) - u arccos u)
    amplitude gain      (1 / pi) (arccos u - u sqrt(1 - u^2))
    mean slope          (1 / pi) arccos u

times dk (A. Gelb, W. E. Vander Velde, Multiple-Input Describing Functions, 1968, ch. 2 and app. B; two-stage laws with
a mean: R. J. Comparin, R. Singh 1989, J. Sound Vib. 134, 259-290). Under a Gaussian delta of mean m and deviation s,
with z = (c - m) / s, phi the normal density and Q its upper tail: mean force s phi(z) - (c - m) Q(z), and Q(z) for the
gain *and* the mean slope. The slope of the mean force with m is the mean slope, in both cases. Where the damping steps
at the same corners, the gain of f with the damping steps in place of dk is the damping of equal loss.

For any other motion the gain is the least-squares line of force on deflection over it: the multi-harmonic describing
function, which for a single sine is the amplitude gain.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import erfc, exp, pi, sqrt

import numpy as np

from gearrattle.analysis.contact_ratios.contact_ratio_record import (
    ContactRatio,
    best_line,
    clearances,
    elastic,
    largest_slope,
    law_of,
    without_error,
)
from gearrattle.engine.system.law import PiecewiseLaw
from gearrattle.signals import steady
from gearrattle.trajectory import Array, Trajectory


@dataclass(frozen=True)
class Describing:
    """Equivalent gain, damping and mean slope of a law under an assumed motion.

    Attributes
    ----------
    mean_force
        mean of f [N m or N].
    gain
        amplitude gain: least-squares slope of f on the moving part [N m/rad or N/m].
    damping
        coefficient of equal loss [N m s/rad or N s/m].
    mean_slope
        mean of f', which is also d(mean force) / d(mean) [N m/rad or N/m].
    mean_gain
        (mean force - f(0)) / mean; its limit, the mean slope, at zero mean of a symmetric law.
    """

    mean_force: float
    gain: float
    damping: float
    mean_slope: float
    mean_gain: float


def under_sine(law: PiecewiseLaw, amplitude: float, mean: float = 0.0) -> Describing:
    """Return the describing function of a law under delta = mean + amplitude sin phi.

    The amplitude is positive; both are in rad or m.
    """
    u = np.clip((law.corners - mean) / amplitude, -1.0, 1.0)
    beyond = np.arccos(u)
    root = np.sqrt((1.0 - u) * (1.0 + u))
    ramp = np.where(u > -1.0, amplitude / pi * (root - u * beyond), mean - law.corners)
    share = beyond / pi
    weight = (beyond - u * root) / pi
    return _answer(law, mean, ramp, weight, share)


def under_gaussian(law: PiecewiseLaw, deviation: float, mean: float = 0.0) -> Describing:
    """Return the describing function of a law under a Gaussian delta, of positive standard deviation [rad or m].

    The damping is that of equal loss if the rate is independent of the deflection, as in a stationary Gaussian motion.
    """
    z = (law.corners - mean) / deviation
    tail = np.array([0.5 * erfc(x / sqrt(2.0)) for x in z])
    density = np.array([exp(-0.5 * x * x) / sqrt(2.0 * pi) for x in z])
    return _answer(law, mean, deviation * (density - z * tail), tail, tail)


def _answer(law: PiecewiseLaw, mean: float, ramp: Array, weight: Array, share: Array) -> Describing:
    """Sum line and ramps: (J,) mean of (delta - c)_+, its gain, and the share of time beyond c, for every corner."""
    step = np.diff(law.stiffness)
    loss = np.diff(law.damping)
    force = float(law.stiffness[0] * mean + law.offset[0] + step @ ramp)
    slope = float(law.stiffness[0] + step @ share)
    at_rest = law.elastic(0.0)
    return Describing(
        mean_force=force,
        gain=float(law.stiffness[0] + step @ weight),
        damping=float(law.damping[0] + loss @ weight),
        mean_slope=slope,
        mean_gain=(force - at_rest) / mean if mean != 0.0 else slope,
    )


def describing(trajectory: Trajectory) -> ContactRatio:
    """Return the multi-harmonic describing function of every clearance on its own response.

    The least-squares line of the elastic force on the deflection over the samples of the steady part.

    ModelError if no cycle remains after the discarded ones.
    """
    window = steady(trajectory)
    value = np.empty(trajectory.layout.clearance.size)
    for k in clearances(trajectory):
        law = law_of(trajectory.layout, k)
        deflection = window.periodic(trajectory.deflection[:, k])
        value[k] = best_line(elastic(law, deflection), deflection) / largest_slope(law)
    return without_error("describing", "equivalent gain", value)
