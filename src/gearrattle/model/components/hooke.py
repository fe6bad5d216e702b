"""A Hooke joint (universal joint, Cardan joint), whose output angle differs periodically from its input angle.

Let beta be the angle between the shafts, and phi the angle of the driving shaft, which is zero when the cross arm of
the driving yoke is perpendicular to the plane of the shafts. Then

    tan phi_out = tan phi / cos beta,      phi_out = phi - e(phi),

    e(phi) = - sum_k tan^2k(beta/2) / k  sin 2k phi.

A load T on the driven side loads the driving side with T (1 - de/dphi), so that power is conserved. Here phi increases
uniformly and T in -T de/dphi is the mean load, because fluctuations of phi and T have effects of second order.

Source: the series of arctan(p tan phi), p = 1 / cos beta, with (p - 1) / (p + 1) = tan^2(beta/2); Dubbel, Taschenbuch
fuer den Maschinenbau, "Gelenkwellen".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import pi, tan
from typing import Annotated, Any

from gearrattle.model import units
from gearrattle.model.excitation import Harmonic
from gearrattle.model.table import Breach, Table
from gearrattle.model.value_kinds import GROUND, Plain, Quantity, value_of

_LARGEST = pi / 3.0
_NEGLIGIBLE = 1e-15  # [rad] sum of all neglected terms


class HookeJoint(Table):
    """A Hooke joint in a coupling; its driving shaft is the first of ``between``."""

    angle: Annotated[float, Quantity(units.ANGLE, "non-negative")]
    """Angle beta between the shafts [rad], below 60 deg."""
    order: Annotated[float, Plain("positive")] = 1.0
    """Turns of the driving shaft in a turn of the reference shaft."""
    phase: Annotated[float, Quantity(units.ANGLE)] = 0.0
    """phi at t = 0 [rad]."""

    def errors(self) -> tuple[Harmonic, ...]:
        """Return e(t) as sines [rad]; the neglected terms are below 1e-15 rad together."""
        return tuple(self._sine(k, -(self._ratio**k) / k) for k in range(1, self._terms + 1))

    def load_ripple(self) -> tuple[Harmonic, ...]:
        """Return de/dphi as sines [1]: the further torque on the driving side per unit of the load."""
        return tuple(self._sine(k, -2.0 * self._ratio**k, 0.5 * pi) for k in range(1, self._terms + 1))

    def _sine(self, k: int, amplitude: float, ahead: float = 0.0) -> Harmonic:
        """A sine of 2 k phi."""
        return Harmonic.model_construct(order=2 * k * self.order, amplitude=amplitude, phase=2 * k * self.phase + ahead)

    @property
    def _ratio(self) -> float:
        return tan(0.5 * self.angle) ** 2

    @property
    def _terms(self) -> int:
        """Number of terms: the sum of all further terms is below ``_NEGLIGIBLE``."""
        ratio = self._ratio
        count = 0
        while ratio ** (count + 1) / (count + 1) > _NEGLIGIBLE * (1.0 - ratio):
            count += 1
        return count


def joint_rules(table: Mapping[str, Any], dimensionless: bool) -> Iterator[Breach]:
    """Yield breaches of a coupling with a joint: a shaft that cannot turn, an angle too large, no angle unit."""
    joint = table.get("hooke")
    if joint is None:
        return
    if dimensionless:
        rule = "a Hooke joint has an angle in rad, a dimensionless model counts angles in another unit"
        yield Breach(("hooke",), joint, rule, "write its sines as kinematic_error")
    between = table.get("between")
    if isinstance(between, (list, tuple)) and GROUND in between:
        rule = "a Hooke joint connects two shafts that turn; ground does not"
        yield Breach(("between",), between, rule, "name two inertias")
    angle = value_of(HookeJoint, joint, "angle", dimensionless)
    if angle is not None and angle >= _LARGEST:
        written = joint["angle"] if isinstance(joint, Mapping) else angle
        yield Breach(("hooke", "angle"), written, "must be below 60 deg: no joint transmits beyond", 'such as "12 deg"')
