"""Transmissibility: acceleration of every inertia over the acceleration of the reference inertia.

TR_rms,i = rms(theta_i'') / rms(theta_r'') and TR_peak,i = pp(theta_i'') / pp(theta_r'') over the last eight cycles,
where r is the inertia with the first torque (Padmanabhan et al. 1995, eqs. (23)-(25)); the mean of the accelerations is
included. For an exact motion, extremes and means include the motion between samples. For a sampled motion they are
computed from samples, the rms by the trapezoidal rule over whole periods, with an estimate of the error.

Transmissibility by order is the amplitude of a body over the amplitude of the reference body at one order,

    T_i(o) = |Theta_i(o)| / |Theta_r(o)|,

the same for angles, velocities and accelerations. Only orders of the engine count, because motion that a transmission
error excites is not transmitted from the reference body. An order at which the amplitude of the reference body is less
than 1e-9 of its largest amplitude has no transmissibility.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gearrattle.quantities.metric_inputs import SAMPLES, Inputs, order_word
from gearrattle.quantities.quantity import PAPER, Quantity, Row, Sums
from gearrattle.signals.last_levels import LAST_CYCLES, peak_to_peak_of, rms_of, shortened


@dataclass(frozen=True)
class Transmissibility(Quantity[Sums]):
    """Ratio of rms and of peak-to-peak accelerations to those of the reference inertia."""

    name: str = "transmissibility"
    title: str = "Transmissibility"
    formula: str = "rms(theta_i'') / rms(theta_r'') and pp(theta_i'') / pp(theta_r''), r: reference inertia, last 8 T"
    unit: str = "1"
    source: str = f"{PAPER}, eqs. (23)-(25)"
    sums: tuple[str, ...] = ("last cycles",)
    merging: str = "exact: levels of each of the last eight cycles are kept across chunks"

    def rows(self, sums: Sums) -> list[Row]:
        """Return TR_rms and TR_peak of every inertia; NaN, with a note, where the reference does not move."""
        scope = sums.steady
        state = sums.states["last cycles"]
        layout = scope.layout
        cycles = min(LAST_CYCLES, scope.window.cycles)
        reference = layout.inertia_names[layout.reference]
        short = shortened("transmissibility", cycles)
        rows = []
        for quantity, over, level in (
            ("TR rms", f"rms(theta_i'') / rms(theta_{reference}'')", rms_of(state)),
            ("TR peak", f"pp(theta_i'') / pp(theta_{reference}'')", peak_to_peak_of(state)),
        ):
            base = float(level.value[layout.reference])
            still = "" if base > 0.0 else f"{quantity}: {reference} shows no acceleration to refer to"
            for i, inertia in enumerate(layout.inertia_names):
                value = float("nan")
                error = value
                if base > 0.0:
                    value = float(level.value[i]) / base
                    error = float(level.error[i]) / base
                    error += value * float(level.error[layout.reference]) / base if i != layout.reference else -error
                words = f"{over}, last {cycles} T"
                rows.append(self.row(inertia, quantity, value, formula=words, note=still or short, error=error))
        return rows


_STILL = 1e-9  # share of the largest amplitude of the reference body


@dataclass(frozen=True)
class OrderTransmissibility(Quantity[Inputs]):
    """Ratio of amplitudes to those of the reference body, at every engine order."""

    name: str = "order_transmissibility"
    title: str = "Transmissibility by order"
    formula: str = (
        "|Theta_i(o)| / |Theta_r(o)|, r: the inertia of the first torque, else the first whose motion is known"
    )
    unit: str = "1"
    source: str = "definition (harmonic transmissibility)"
    window: str = f"{SAMPLES}, least squares at all orders of the excitation"
    sampling: str = "orders below half the sampling rate"
    needs: tuple[str, ...] = ("engine orders", "motions")
    merging: str = "exact, to rounding: the products that least squares rest on add up"

    def rows(self, inputs: Inputs) -> list[Row]:
        """Return the transmissibility of every body but the reference, order by order."""
        # velocity amplitudes of the reference
        movers = inputs.movers()
        layout = inputs.layout
        reference = movers[0] if layout is None else layout.inertia_names[layout.reference]
        base = inputs.velocities_at(reference)
        if base is None:
            return [
                self.row(
                    reference, "transmissibility", math.nan, "1", f"nothing is known of {reference}, the reference"
                )
            ]
        # quotient of amplitudes at every engine order
        strongest = float(np.nanmax(np.abs(base), initial=0.0))
        rows: list[Row] = []
        for name in movers:
            velocities = inputs.velocities_at(name)
            if name == reference or velocities is None:
                continue
            errors = inputs.velocity_errors(name), inputs.velocity_errors(reference)
            for order, own, to, own_error, to_error in zip(
                inputs.orders.tolist(), np.abs(velocities), np.abs(base), *errors, strict=True
            ):
                if order not in inputs.engine_orders:
                    continue
                moves = to > _STILL * strongest
                note = (
                    "" if moves else f"{reference} does not move at {order_word(order)}, or the samples cannot show it"
                )
                value = float(own / to) if moves else math.nan
                error = float(own_error + value * to_error) / float(to) if moves else math.nan
                rows.append(self.row(name, f"transmissibility at {order_word(order)}", value, "1", note, error))
        return rows
