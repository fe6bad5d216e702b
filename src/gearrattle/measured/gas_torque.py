"""``gas_torque``: mean torque and harmonics of a four-stroke engine, from a pressure trace and its geometry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydantic import ValidationError

from gearrattle.json_types import TomlTable
from gearrattle.model.engine import Engine, SquareOfSpeed, Wave
from gearrattle.model.excitation import Excitation
from gearrattle.model.over_speed import OMEGA
from gearrattle.model.pydantic_problems import Positions, model_error
from gearrattle.result import Result


@dataclass(frozen=True)
class GasTorque(Result):
    """The torque of an engine.

    Attributes
    ----------
    mean
        mean torque of all cylinders [N m].
    work
        of one cycle of all cylinders, 4 pi times the mean [J].
    gas, masses
        (order, amplitude [N m], phase [rad]) of gas and of oscillating masses at the speed.

    Examples
    --------
    >>> angle = np.arange(0.0, 721.0, 10.0)
    >>> pressure = 1e5 + 40e5 * np.exp(-(((angle - 370.0) / 30.0) ** 2))
    >>> trace = {"angle": np.radians(angle).tolist(), "value": pressure.tolist()}
    >>> engine = {"cylinders": 4, "bore": "80 mm", "stroke": "85 mm", "rod": "140 mm", "pressure": trace}
    >>> torque = gr.gas_torque(**engine, speed="800 rpm")
    >>> len(torque.harmonics)
    6
    """

    kind: ClassVar[str] = "gas torque"
    notes: ClassVar[tuple[str, ...]] = ()
    mean: float
    work: float
    gas: tuple[Wave, ...]
    masses: tuple[Wave, ...]

    @property
    def harmonics(self) -> tuple[Wave, ...]:
        """Gas and masses together, one harmonic an order."""
        sums: dict[float, complex] = {}
        for wave in (*self.gas, *self.masses):
            sums[wave.order] = sums.get(wave.order, 0.0) + wave.amplitude * np.exp(1j * wave.phase)
        return tuple(Wave(n, float(abs(z)), float(np.angle(z))) for n, z in sorted(sums.items()))

    def to_table(self) -> TomlTable:
        """Return mean and harmonics as a ``[[torque]]`` of a model file has them."""
        return {"mean": self.mean, "harmonics": [{k: float(v) for k, v in w._asdict().items()} for w in self.harmonics]}


def gas_torque(
    *,
    cylinders: int,
    bore: float | str,
    stroke: float | str,
    rod: float | str,
    pressure: Mapping[str, object],
    speed: float | str,
    mass: float | str = 0.0,
    crankcase: float | str = 101325.0,
    firing: Sequence[float | str] = (),
    orders: int = 12,
) -> GasTorque:
    """Torque of a four-stroke engine on its crankshaft, at a constant speed.

    Parameters
    ----------
    cylinders
        their number.
    bore, stroke, rod
        diameter, twice the crank radius, length of a connecting rod [m], or with a unit.
    pressure
        absolute pressure in a cylinder over 720 deg of crank angle: ``{"file": ..., "angle": ..., "value":
        ...}``, a CSV file and its columns, or two lists ``{"angle": [...], "value": [...]}`` [rad, Pa]. Angle 0 is
        a top dead centre.
    speed
        of the crankshaft [rad/s], or with a unit.
    mass
        oscillating mass of one cylinder: piston, pin, and the rod's share [kg], or with a unit.
    crankcase
        pressure below the pistons [Pa], or with a unit.
    firing
        crank angle at which each cylinder is where the trace begins [rad]; empty: even intervals.
    orders
        the highest order.

    Returns
    -------
    GasTorque
        Mean, work of a cycle and harmonics; phases count from angle 0 of the trace of the first cylinder.

    Raises
    ------
    ModelError
        a value, unit or file that is not valid.

    Examples
    --------
    >>> angle = np.arange(0.0, 721.0, 10.0)
    >>> pressure = 1e5 + 40e5 * np.exp(-(((angle - 370.0) / 30.0) ** 2))
    >>> trace = {"angle": np.radians(angle).tolist(), "value": pressure.tolist()}
    >>> engine = {"cylinders": 4, "bore": "80 mm", "stroke": "85 mm", "rod": "140 mm", "pressure": trace}
    >>> torque = gr.gas_torque(**engine, speed="800 rpm")
    >>> round(torque.mean, 1), [wave.order for wave in torque.harmonics[:2]]
    (51.0, [2.0, 4.0])
    """
    table = {
        "cylinders": cylinders,
        "bore": bore,
        "stroke": stroke,
        "rod": rod,
        "pressure": pressure,
        "mass": mass,
        "crankcase": crankcase,
        "firing": list(firing),
        "orders": orders,
    }
    try:
        omega = Excitation.model_validate({"speed": speed}).omega
        engine = Engine.model_validate(table, context={OMEGA: omega})
    except ValidationError as error:
        raise model_error(error, table, Positions()) from None
    gas, masses = engine.waves()
    mean = engine.mean_torque()
    moving = tuple(w._replace(amplitude=float(SquareOfSpeed(w.amplitude, omega))) for w in masses)
    return GasTorque(mean, 4.0 * np.pi * mean, gas, moving)
