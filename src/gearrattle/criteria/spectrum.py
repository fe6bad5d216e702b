"""Spectra of the accelerations: power density, amplitudes at the excited orders, super- and sub-harmonics.

Power spectral density by Welch's method over whole cycles; amplitudes at the excited orders by Fourier sums over the
whole steady part; super- and sub-harmonics as lines that stand out of their surroundings at orders nothing excites
(the rule is told in ``gearrattle.signals.lines``). All are of samples: nothing beyond half the sampling rate is seen,
and what a response holds beyond it folds back.

Takes a Trajectory; gives entries for every inertia, and the densities themselves to the verdict.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearrattle.criteria.base import PAPER, Entry, entry
from gearrattle.errors import ModelError
from gearrattle.signals import Line, Spectrum, harmonics, psd, steady, strongest, sub_harmonics, super_harmonics
from gearrattle.signals.lines import FEWEST_PERIODS
from gearrattle.trajectory import Array, Trajectory

FLUCTUATION = "rms of the fluctuation"


@dataclass(frozen=True)
class AccelerationSpectrum:
    """Spectral content of every inertia's acceleration."""

    name: str = "spectrum"
    title: str = "Acceleration spectrum"
    formula: str = "Fourier sums over [discard T, end]"
    unit: str = "rad/s^2"
    source: str = f"Welch 1967, IEEE Trans. Audio Electroacoust. AU-15, 70-73; {PAPER}, sec. 8"

    def evaluate(self, trajectory: Trajectory) -> list[Entry]:
        """Return density, order amplitudes, super- and sub-harmonics for every inertia."""
        window = steady(trajectory)
        acceleration = window.periodic(trajectory.acceleration)
        time = window.periodic(trajectory.time)
        layout = trajectory.layout
        amplitudes = np.abs(harmonics(acceleration, time, layout.omega, layout.orders))
        try:
            density, too_short = acceleration_density(trajectory), ""
        except ModelError as error:
            density, too_short = None, f"no power spectral density: {error}"
        entries: list[Entry] = []
        for i, inertia in enumerate(layout.inertia_names):
            if density is None:
                entries.append(entry(self, inertia, FLUCTUATION, float("nan"), note=too_short))
            else:
                entries += self._density(trajectory, inertia, density, i)
            for order, amplitude in zip(layout.orders.tolist(), amplitudes[:, i].tolist(), strict=True):
                unseen = f"order {order:g} is not resolved by {trajectory.samples_per_cycle} samples a cycle"
                note = unseen if np.isnan(amplitude) else ""
                words = "a of a sin(order Omega t + phase), least squares over [discard T, end]"
                entries.append(
                    entry(self, inertia, f"amplitude at order {order:g}", amplitude, formula=words, note=note)
                )
            entries += self._unexcited(trajectory, inertia, acceleration[:, i])
        return entries

    def _density(self, trajectory: Trajectory, inertia: str, spectrum: Spectrum, column: int) -> list[Entry]:
        density = spectrum.density[:, column]
        peak = int(np.argmax(density))
        order = float(2.0 * np.pi * spectrum.frequency[peak] / trajectory.layout.omega)
        level = float(np.sqrt(np.sum(density) * spectrum.resolution))
        by = f"Welch: {spectrum.window}"
        return [
            entry(self, inertia, FLUCTUATION, level, formula=f"sqrt(sum of the density x bin width); {by}"),
            entry(self, inertia, "order of the density's peak", order, unit="1", formula=by),
            entry(self, inertia, "density at its peak", float(density[peak]), unit="(rad/s^2)^2/Hz", formula=by),
        ]

    def _unexcited(self, trajectory: Trajectory, inertia: str, signal: Array) -> list[Entry]:
        layout, per_cycle = trajectory.layout, trajectory.samples_per_cycle
        if layout.orders.size == 0:
            return []
        fundamental = 2.0 * np.pi / (layout.omega * layout.period)
        cycles = signal.size // per_cycle
        rule = "lines of at least 1 % of the largest harmonic and 5 x the median around them"
        entries: list[Entry] = []
        kinds = (("super-harmonic", super_harmonics, 1), ("sub-harmonic", sub_harmonics, 2))
        for kind, search, divisor in kinds:
            need = FEWEST_PERIODS * divisor
            note = "" if cycles >= need else f"{kind}s not sought: fewer than {need} steady cycles"
            lines = search(signal, per_cycle, fundamental, layout.orders)
            count = float("nan") if note else float(len(lines))
            entries.append(entry(self, inertia, f"{kind}s present", count, unit="1", formula=rule, note=note))
            entries += self._strongest(inertia, kind, strongest(lines), rule)
        return entries

    def _strongest(self, inertia: str, kind: str, line: Line | None, rule: str) -> list[Entry]:
        if line is None:
            return []
        return [
            entry(self, inertia, f"order of the strongest {kind}", line.order, unit="1", formula=rule),
            entry(self, inertia, f"amplitude of the strongest {kind}", line.amplitude, formula=rule),
        ]


def acceleration_density(trajectory: Trajectory) -> Spectrum:
    """Return the power spectral density of all accelerations over the steady part, density (f, n).

    Raises:
        ModelError: if the steady part holds fewer than four samples.
    """
    window = steady(trajectory)
    signal = window.periodic(trajectory.acceleration)
    return psd(signal, trajectory.layout.period, trajectory.samples_per_cycle)
