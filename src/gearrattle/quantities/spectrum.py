"""Spectra of the accelerations: power spectral density, amplitudes at excited orders, super- and sub-harmonics.

The power spectral density is computed by Welch's method over whole cycles; amplitudes at the excited orders by Fourier
sums over the whole steady part. Super- and sub-harmonics are spectral lines higher than their neighbourhood at orders
that nothing excites (rule in ``gearrattle.signals.subharmonics``). All are computed from samples: they cover
frequencies up to half the sampling rate, and contain aliases of higher frequencies. Along a sweep there are no values
by order, because an order has no fixed frequency.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError
from gearrattle.quantities.quantity import PAPER, Quantity, Row, Scope, State, Sums
from gearrattle.signals import (
    Line,
    Spectrum,
    amplitudes_from,
    order_sums,
    psd,
    resolved,
    steady,
    strongest,
    sub_harmonics,
    super_harmonics,
)
from gearrattle.signals.subharmonics import FEWEST_PERIODS
from gearrattle.signals.welch import CYCLES_PER_SEGMENT, window_words
from gearrattle.trajectory import Array, Layout, Trajectory
from gearrattle.wording import counted

FLUCTUATION = "rms of the fluctuation"
_NO_SPEED = "along a sweep an order has no one frequency: gr.spectral.order_map follows the angle"


@dataclass(frozen=True)
class AccelerationSpectrum(Quantity[Sums]):
    """Spectral content of every inertia's acceleration."""

    name: str = "spectrum"
    title: str = "Acceleration spectrum"
    formula: str = "Fourier sums over [discard T, end]"
    unit: str = "rad/s^2"
    source: str = f"Welch 1967, IEEE Trans. Audio Electroacoust. AU-15, 70-73; {PAPER}, sec. 8"
    sums: tuple[str, ...] = ("spectra",)
    merging: str = (
        "exact: sums of the least squares and of the segments' densities add up, segments reach across chunks; "
        "super- and sub-harmonics are of the longest chunk's number of last cycles only"
    )

    def occasional(self, layout: Layout) -> list[Row]:
        """Return the peak of the density, which needs four samples, and the strongest lines that nothing excites."""
        rows = []
        nan = float("nan")
        for inertia in layout.inertia_names:
            rows += [
                self.row(inertia, "order of the density's peak", nan, unit="1"),
                self.row(inertia, "density at its peak", nan, unit="(rad/s^2)^2/Hz"),
            ]
            for kind in ("super-harmonic", "sub-harmonic") if layout.orders.size else ():
                order = f"order of the strongest {kind}"
                amplitude = f"amplitude of the strongest {kind}"
                rows.append(self.row(inertia, order, nan, unit="1", note=f"no {kind} seen"))
                rows.append(self.row(inertia, amplitude, nan, note=f"no {kind} seen"))
        return rows

    def rows(self, sums: Sums) -> list[Row]:
        """Return density, order amplitudes, super- and sub-harmonics for every inertia."""
        scope = sums.steady
        state = sums.states["spectra"]
        layout = scope.layout
        # amplitudes at the excited orders, by least squares
        amplitudes = np.full((layout.orders.size, len(layout.inertia_names)), np.nan)
        if layout.ramp is None:
            shown = _shown(layout, scope.samples_per_cycle)
            amplitudes[shown] = np.abs(amplitudes_from(state["gram"], state["moments"]))
        # power spectral density by Welch's method
        try:
            density = density_of(state, scope)
            too_short = ""
        except ModelError as error:
            density = None
            too_short = f"no power spectral density: {error}"
        rows: list[Row] = []
        # rows of every inertia: density, orders, lines that nothing excites
        for i, inertia in enumerate(layout.inertia_names):
            if density is None:
                rows.append(self.row(inertia, FLUCTUATION, float("nan"), note=too_short))
            else:
                rows += self._density(layout, inertia, density, i)
            for order, amplitude in zip(layout.orders.tolist(), amplitudes[:, i].tolist(), strict=True):
                unseen = _NO_SPEED
                if layout.ramp is None:
                    unseen = f"order {order:g} is not resolved by {scope.samples_per_cycle} samples a cycle"
                note = unseen if np.isnan(amplitude) else ""
                words = "a of a sin(order Omega t + phase), least squares over [discard T, end]"
                rows.append(self.row(inertia, f"amplitude at order {order:g}", amplitude, formula=words, note=note))
            rows += self._unexcited(scope, inertia, state["last"][:, i])
        return [replace(row, error=math.nan) for row in rows]  # from samples, without an estimate of the error

    def _density(self, layout: Layout, inertia: str, spectrum: Spectrum, column: int) -> list[Row]:
        density = spectrum.density[:, column]
        peak = int(np.argmax(density))
        swept = layout.ramp is not None
        order = math.nan if swept else float(2.0 * np.pi * spectrum.frequency[peak] / layout.omega)
        level = float(np.sqrt(np.sum(density) * spectrum.resolution))
        by = f"Welch: {spectrum.window}"
        return [
            self.row(inertia, FLUCTUATION, level, formula=f"sqrt(sum of the density x bin width); {by}"),
            self.row(
                inertia, "order of the density's peak", order, unit="1", formula=by, note=_NO_SPEED if swept else ""
            ),
            self.row(inertia, "density at its peak", float(density[peak]), unit="(rad/s^2)^2/Hz", formula=by),
        ]

    def _unexcited(self, scope: Scope, inertia: str, signal: Array) -> list[Row]:
        # cycles of the signal, and the rule by which a line counts
        layout = scope.layout
        per_cycle = scope.samples_per_cycle
        if layout.orders.size == 0:
            return []
        fundamental = 2.0 * np.pi / (layout.omega * layout.period)
        cycles = signal.size // per_cycle
        rule = "lines of at least 1 % of the largest harmonic and 5 x the median around them"
        of = (
            ""
            if cycles == scope.window.cycles
            else f" in the last {cycles} of {counted(scope.window.cycles, 'cycle')} only"
        )
        rows: list[Row] = []
        amplitudes: dict[int, Array] = {}
        kinds = (("super-harmonic", super_harmonics, 1), ("sub-harmonic", sub_harmonics, 2))
        # super-harmonics, then sub-harmonics, which need more cycles
        for kind, search, divisor in kinds:
            need = FEWEST_PERIODS * divisor
            # sweeps have no orders
            if layout.ramp is not None:
                words = f"{kind}s present"
                rows.append(self.row(inertia, words, math.nan, unit="1", formula=rule, note=_NO_SPEED))
                continue
            note = "" if cycles >= need else f"{kind}s not sought: fewer than {need} steady cycles"
            remark = note or (of and f"super- and sub-harmonics are sought{of}")
            # number of lines, and the strongest of them
            lines = search(signal, per_cycle, fundamental, layout.orders, amplitudes)
            count = float("nan") if note else float(len(lines))
            rows.append(self.row(inertia, f"{kind}s present", count, unit="1", formula=rule, note=remark))
            rows += self._strongest(inertia, kind, strongest(lines), rule)
        return rows

    def _strongest(self, inertia: str, kind: str, line: Line | None, rule: str) -> list[Row]:
        if line is None:
            return []
        return [
            self.row(inertia, f"order of the strongest {kind}", line.order, unit="1", formula=rule),
            self.row(inertia, f"amplitude of the strongest {kind}", line.amplitude, formula=rule),
        ]


def add_spectra(trajectory: Trajectory, before: State | None) -> State:
    """Return the state "spectra" over a chunk and all chunks before it.

    Its arrays are: gram and moments (see ``order_sums``); density (f, n), the sum over segments, and segments, their
    number; rest (samples, n), samples of segments that are not complete yet; last (samples, n), the last cycles, as
    many as in the longest chunk.
    """
    window = steady(trajectory)
    layout = trajectory.layout
    per_cycle = trajectory.samples_per_cycle
    signal = window.periodic(trajectory.acceleration)
    time = window.periodic(trajectory.time)
    shown = layout.orders[_shown(layout, per_cycle)]
    gram, moments = order_sums(signal, time, layout.omega, shown, periods=window.cycles)
    state = {
        "gram": gram,
        "moments": moments,
        "last": signal,
        **_segments(signal, per_cycle, layout.period, before),
    }
    if before is not None:
        state["gram"] = before["gram"] + gram
        state["moments"] = before["moments"] + moments
        longest = max(len(before["last"]), len(signal))
        state["last"] = np.concatenate([before["last"], signal])[-longest:]
    return state


def _shown(layout: Layout, per_cycle: int) -> NDArray[np.bool_]:
    """Return (o,) whether an order is below half the sampling rate."""
    return resolved(layout.orders, layout.omega, layout.period / per_cycle)


def _segments(signal: Array, per_cycle: int, period: float, before: State | None) -> dict[str, Array]:
    """Return the sum of the densities of all complete segments so far, their number, and samples for later segments."""
    if before is not None:
        signal = np.concatenate([before["rest"], signal])
    length = CYCLES_PER_SEGMENT * per_cycle
    hop = length - length // 2
    density = np.zeros((length // 2 + 1, signal.shape[1]))
    segments = 0
    if len(signal) >= length:
        spectrum = psd(signal, period, per_cycle)
        density = spectrum.density * spectrum.segments
        segments = spectrum.segments
        signal = signal[segments * hop :]
    if before is not None:
        density = density + before["density"]
        segments = segments + int(before["segments"])
    return {"density": density, "segments": np.array(float(segments)), "rest": signal.copy()}


def density_of(state: State, scope: Scope) -> Spectrum:
    """Return the power spectral density of all accelerations over the steady part, density (f, n).

    ModelError if the steady part holds fewer than four samples.
    """
    period = scope.layout.period
    per_cycle = scope.samples_per_cycle
    segments = int(state["segments"])
    if segments == 0:
        return psd(state["rest"], period, per_cycle)
    frequency = np.fft.rfftfreq(CYCLES_PER_SEGMENT * per_cycle, period / per_cycle).astype(np.float64)
    return Spectrum(frequency, state["density"] / segments, window_words(CYCLES_PER_SEGMENT, segments), segments)
