"""Transmissibility by order: what of an order's motion at the reference body reaches each other one.

    T_i(o) = |Theta_i(o)| / |Theta_r(o)|

the quotient of amplitudes at one order; it is the same for angles, velocities and accelerations, so a body may be
heard by any of them. Only orders of the engine count: what a transmission error excites elsewhere is not transmitted
from the reference. An order at which the reference moves by less than 1e-9 of its strongest has no transmissibility.

Takes what is heard; gives one value a body and order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gearrattle.metrics.base import SAMPLES, Heard, Value, order_word

_STILL = 1e-9


@dataclass(frozen=True)
class OrderTransmissibility:
    """Quotient of amplitudes at every engine order."""

    name: str = "order_transmissibility"
    title: str = "Transmissibility by order"
    formula: str = "|Theta_i(o)| / |Theta_r(o)|, r: the inertia of the first torque, else the first that is heard"
    unit: str = "1"
    source: str = "definition (harmonic transmissibility)"
    window: str = f"{SAMPLES}, least squares at all orders of the excitation"
    sampling: str = "orders below half the sampling rate"
    needs: tuple[str, ...] = ("engine orders", "motions")
    merging: str = "exact, to rounding: the products that least squares rest on add up"

    def measure(self, heard: Heard) -> list[Value]:
        """Return the transmissibility of every body but the reference, order by order."""
        movers = heard.movers()
        plate = heard.layout
        reference = movers[0] if plate is None else plate.inertia_names[plate.reference]
        base = heard.velocities_at(reference)
        if base is None:
            return [
                Value(reference, "transmissibility", math.nan, "1", f"nothing is heard of {reference}, the reference")
            ]
        strongest = float(np.nanmax(np.abs(base), initial=0.0))
        values = []
        for name in movers:
            found = heard.velocities_at(name)
            if name == reference or found is None:
                continue
            errors = heard.velocity_errors(name), heard.velocity_errors(reference)
            for order, own, to, own_error, to_error in zip(
                heard.orders.tolist(), np.abs(found), np.abs(base), *errors, strict=True
            ):
                if order not in heard.engine_orders:
                    continue
                moves = to > _STILL * strongest
                note = (
                    "" if moves else f"{reference} does not move at {order_word(order)}, or the samples cannot show it"
                )
                value = float(own / to) if moves else math.nan
                error = float(own_error + value * to_error) / float(to) if moves else math.nan
                values.append(Value(name, f"transmissibility at {order_word(order)}", value, "1", note, error))
        return values
