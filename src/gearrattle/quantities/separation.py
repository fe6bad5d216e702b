"""Separation ratio: torque that a loose gear needs to follow its driver over its drag torque, in total and by order.

To follow its driver a loose gear needs the torque J (R_d/R_l) theta_d''; only its drag torque T presses it to the
flank:

    ratio = J (R_d/R_l) peak |theta_d''| / T,        margin = 20 log10 ratio  [dB]

If the ratio is above 1 (0 dB), the gear lifts off. The driver's motion is used, because the motion of the loose gear
itself contains its impacts. If the drag torque is a table over the speed, its value at the current speed is used at
every time of a sweep and at every sample of a recorded speed; the ratio is the largest over time. The harmonic ratio
uses the amplitude of the driver's acceleration at one order, (o Omega)^2 times the amplitude of its angle; it shows
which order makes the gear lift off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gearrattle.quantities.metric_inputs import EXACT, FINE, SAMPLES, Inputs, order_word
from gearrattle.quantities.quantity import SINGH, Quantity, Row
from gearrattle.signals import decibels, loose_gears, torque_ratio
from gearrattle.signals.driveline_constants import LooseGear


@dataclass(frozen=True)
class SeparationRatio(Quantity[Inputs]):
    """Inertia torque of a loose gear over its drag torque, from the peak acceleration of its driver."""

    name: str = "separation"
    title: str = "Separation ratio"
    formula: str = "J_loose (R_driver/R_loose) peak|theta_driver''| / T_drag; margin: 20 log10 of it"
    unit: str = "1"
    source: str = SINGH
    window: str = EXACT
    sampling: str = "of samples: peaks as fine as these, with a note"
    of_events: bool = True
    needs: tuple[str, ...] = ("loose gears", "acceleration")
    merging: str = "exact: the peak is the largest"
    sums: tuple[str, ...] = ("crossings", "signals", "peaks")

    def rows(self, inputs: Inputs) -> list[Row]:
        """Return ratio and margin for every loose gear."""
        rows = list[Row]()
        accelerations = inputs.of("acceleration")
        for gear in loose_gears(inputs.known_layout):
            mesh = inputs.known_layout.element_names[gear.mesh]
            driver = inputs.known_layout.inertia_names[gear.driver]
            if driver not in accelerations:
                note = f"{mesh}: no acceleration of its driver {driver}"
                ratio = math.nan
                missed = math.nan
            else:
                ratio, missed = inputs.largest_torque_ratio(gear)
                note = self._note(inputs, gear, ratio, missed)
            rows.append(self.row(mesh, "separation ratio", ratio, "1", note, missed))
            margin = decibels(ratio)
            still = note if margin > -math.inf else note or f"{mesh}: its driver {driver} does not move"
            beyond = 20.0 * math.log10(1.0 + missed / ratio) if 0.0 < ratio < math.inf else 0.0
            rows.append(self.row(mesh, "separation margin", margin, "dB", still, beyond))
        return rows

    def _note(self, inputs: Inputs, gear: LooseGear, ratio: float, missed: float) -> str:
        """Note what a ratio leaves out; empty if nothing."""
        layout = inputs.known_layout
        mesh = layout.element_names[gear.mesh]
        loose = layout.inertia_names[gear.loose]
        if math.isnan(ratio):
            return f"{mesh}: the drag torque of {loose} is a table over the speed, which is not known, or not covered"
        if math.isinf(ratio):
            return f"{mesh}: the drag torque of {loose} is zero at some speed"
        if ratio > 0.0 and missed > FINE * ratio:
            return f"{mesh}: a peak of samples, which may lie about {100.0 * missed / ratio:.2g} % higher"
        return ""


@dataclass(frozen=True)
class HarmonicSeparation(Quantity[Inputs]):
    """Separation ratio for every single order of the driver's motion."""

    name: str = "harmonic_separation"
    title: str = "Separation ratio by order"
    formula: str = "J_loose (R_driver/R_loose) (o Omega)^2 |Theta_driver(o)| / T_drag"
    unit: str = "1"
    source: str = f"{SINGH}, for a driver that moves at one order"
    window: str = f"{SAMPLES}, least squares at all orders of the excitation"
    sampling: str = "orders below half the sampling rate"
    needs: tuple[str, ...] = ("loose gears", "orders", "motions")
    merging: str = "exact, to rounding: the products that least squares rest on add up"

    def rows(self, inputs: Inputs) -> list[Row]:
        """Return for every loose gear the ratio of every order, and the order with the largest ratio."""
        rows: list[Row] = []
        for gear in loose_gears(inputs.known_layout):
            mesh = inputs.known_layout.element_names[gear.mesh]
            driver = inputs.known_layout.inertia_names[gear.driver]
            velocities = inputs.velocities_at(driver)
            if velocities is None:
                note = f"{mesh}: nothing is known of the motion of its driver {driver}"
                rows.append(self.row(mesh, "largest separation ratio of an order", math.nan, "1", note))
                continue
            rates = inputs.orders * inputs.speed
            drag = inputs.known_layout.drag_torque_at(gear.loose, np.full(rates.size, inputs.speed))
            ratios = torque_ratio(inputs.known_layout, gear, rates * np.abs(velocities), drag)
            errors = torque_ratio(inputs.known_layout, gear, rates * inputs.velocity_errors(driver), drag)
            for order, ratio, error in zip(inputs.orders.tolist(), ratios.tolist(), errors.tolist(), strict=True):
                note = "" if math.isfinite(ratio) else "the samples cannot show this order"
                rows.append(self.row(mesh, f"separation ratio at {order_word(order)}", ratio, "1", note, error))
            largest = float(np.nanmax(ratios)) if np.isfinite(ratios).any() else math.nan
            note = "" if math.isfinite(largest) else "the samples show none of the orders"
            error = float(errors[np.nanargmax(ratios)]) if np.isfinite(ratios).any() else math.nan
            rows.append(self.row(mesh, "largest separation ratio of an order", largest, "1", note, error))
        return rows
