"""Statistics of forces of meshes and bearings: standard deviation, crest factor, kurtosis, 5 % exceedance.

Of the force of all bearings together on the casing, a vector F about its mean: rms and peak.

Over the window, with means by the trapezoidal rule,

    standard deviation s = <(F - <F>)^2>^(1/2)            crest factor c = max |F| / <F^2>^(1/2)
    kurtosis k = <(F - <F>)^4> / s^4                      5 % exceedance: level that |F| exceeds for 5 % of the time

Of an exact motion all four are taken between its samples too. k is 1.5 for a sine and 3 for Gaussian noise; hammering
raises it. The force is that on the line of action, of a bearing that on its body along x or y. Of the casing

    rms = <|F - <F>|^2>^(1/2)            peak = max |F - <F>|

with |F| the length of the vector, so that the axes do not matter. A constant force, such as a weight, shakes nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gearrattle.quantities.metric_inputs import EXACT, WHOLE, Inputs, sampled
from gearrattle.quantities.quantity import Quantity, Row
from gearrattle.signals.levels import thinned
from gearrattle.signals.summaries import Summary
from gearrattle.trajectory import AXES, CASING_FORCE

EXCEEDED = "force exceeded 5 % of the time"
RMS_CASING = "rms casing force"
PEAK_CASING = "peak casing force"
CASING = "casing"
"""Subject of the force on the casing."""
_SHARE = 0.05  # share of the time for the exceedance


@dataclass(frozen=True)
class ForceStatistics(Quantity[Inputs]):
    """Standard deviation, crest factor, kurtosis, 5 % exceedance."""

    name: str = "force_statistics"
    title: str = "Forces of meshes, bearings and on the casing"
    formula: str = (
        "s = <(F-<F>)^2>^(1/2), max|F| / <F^2>^(1/2), <(F-<F>)^4> / s^4, 95 % quantile of |F|; of the casing "
        "<|F-<F>|^2>^(1/2), max|F-<F>|"
    )
    unit: str = "N"
    source: str = (
        "definitions; kurtosis after Dyer, Stewart 1978, J. Mech. Des. 100, 229-235; the exceedance as ISO 1996-1 has "
        "it of levels, the 5 % being usage"
    )
    window: str = EXACT
    sampling: str = "of samples: well above the natural frequency of stiff contacts"
    needs: tuple[str, ...] = ("force",)
    merging: str = (
        "exact: moments add up, peaks are the largest; but the force exceeded 5 % of the time and the peak on the "
        "casing are of the whole"
    )

    def rows(self, inputs: Inputs) -> list[Row]:
        """Return the statistics of every force of a mesh or bearing; without a model, of every force in N."""
        rows: list[Row] = []
        # forces of meshes in newtons
        for name in inputs.of("force"):
            if not _is_force(inputs, name):
                continue
            unit = inputs.units.get(("force", name), "N")
            if inputs.layout is None and unit != "N":
                note = f"{name}: its unit is {unit!r}, and forces of meshes are in N: give a model"
                rows.append(self.row(name, "force standard deviation", math.nan, "N", note))
                continue
            # rms, spread, crest factor and kurtosis
            summary = inputs.summary("force", name)
            level = summary.rms
            spread = summary.spread
            still = "" if spread > 1e-12 * level and spread > 0.0 else f"{name}: a force that does not change"
            crest = summary.peak / level if level > 0.0 else math.nan
            peaked = sampled(name, summary, summary.peak) if level > 0.0 else f"{name}: no force"
            kurtosis = math.nan if still else summary.fourth / spread**4
            # errors of sampling
            level_error, crest_error, kurtosis_error = (
                inputs.summary_error("force", name, of) for of in (lambda x: x.spread, _crest, _kurtosis)
            )
            peak_error = summary.miss / level if level > 0.0 else math.nan
            rows += [
                self.row(name, "force standard deviation", spread, "N", error=level_error),
                self.row(name, "force crest factor", crest, "1", peaked, max(crest_error, peak_error)),
                self.row(name, "force kurtosis", kurtosis, "1", still, kurtosis_error),
            ]
            # force exceeded 5 % of the time
            if inputs.wants(EXCEEDED):
                exceeded, exceeded_error, why = _exceeded(inputs, name)
                rows.append(self.row(name, EXCEEDED, exceeded, "N", why, exceeded_error))
        return rows + self._of_casing(inputs)

    def _of_casing(self, inputs: Inputs) -> list[Row]:
        """Return rms and peak of the force on the casing; nothing without one."""
        along_x, along_y = ((CASING_FORCE, axis) for axis in AXES)
        if along_x not in inputs.signals:
            return []
        parts = [inputs.summary(*part).spread for part in (along_x, along_y)]
        error = math.hypot(*(inputs.summary_error(*part, lambda x: x.spread) for part in (along_x, along_y)))
        rows = [self.row(CASING, RMS_CASING, math.hypot(*parts), "N", error=error)]
        if inputs.wants(PEAK_CASING):
            peak, missed = inputs.reach((along_x, along_y))
            note = WHOLE if math.isnan(peak) else ""
            rows.append(self.row(CASING, PEAK_CASING, peak, "N", note, missed))
        return rows


def _crest(summary: Summary) -> float:
    return summary.peak / summary.rms if summary.rms > 0.0 else math.nan


def _kurtosis(summary: Summary) -> float:
    return summary.fourth / summary.spread**4 if summary.spread > 0.0 else math.nan


def _exceeded(inputs: Inputs, name: str) -> tuple[float, float, str]:
    """Return the force exceeded for 5 % of the time, its error, and a note on why it is missing."""
    exact = inputs.exceeded("force", name, _SHARE)
    if exact is not None:
        return exact, 0.0, ""
    samples = inputs.signals["force", name]
    if not isinstance(samples, np.ndarray):
        return math.nan, math.nan, WHOLE
    force = np.abs(samples[:-1])
    levels = [float(np.quantile(some, 1.0 - _SHARE)) for some in (force, *thinned(force))]
    return levels[0], max((abs(level - levels[0]) for level in levels[1:]), default=math.nan), ""


def _is_force(inputs: Inputs, name: str) -> bool:
    """Whether it is no torque of a coupling."""
    if inputs.layout is None or name in inputs.layout.bearing_names:
        return True
    if name not in inputs.layout.element_names:
        return False
    return bool(inputs.layout.is_mesh[inputs.layout.element_names.index(name)])
