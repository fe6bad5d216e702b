"""``torque_angle``: the static characteristic of a coupling, with its hysteresis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from gearrattle.assembly import assemble
from gearrattle.engine.system.auxiliary import Auxiliary
from gearrattle.engine.system.law import PiecewiseLaw
from gearrattle.engine.system.quasi_static_loops import cycle
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model, check_model, units
from gearrattle.model.table import did_you_mean, shown
from gearrattle.model.value_kinds import Quantity
from gearrattle.result import Result

Array = NDArray[np.float64]

_BEYOND = 1.25  # of the outermost corner
_REACHES = 4.0  # of the largest deflection over which a slider sticks


@dataclass(frozen=True)
class TorqueAngle(Result):
    """Torque over deflection in a slow, closed cycle from one end to the other and back.

    The curve is straight between points; two points at the same deflection are a jump where friction is released.

    Attributes
    ----------
    element
        name of the coupling.
    deflection
        (N,) from the lowest to the highest and back [rad].
    torque
        (N,) [N m].
    elastic
        (N,) the torque without friction [N m].
    loss
        area of the loop, the energy that friction dissipates in a cycle [J].
    units
        of the model, "SI" or "dimensionless".

    Examples
    --------
    >>> gr.torque_angle(gr.example("clutch_friction"), "damper").deflection.ndim
    1
    """

    kind: ClassVar[str] = "torque over angle"
    notes: ClassVar[tuple[str, ...]] = ()
    element: str
    deflection: Array
    torque: Array
    elastic: Array
    loss: float
    units: str = "SI"

    @property
    def turn(self) -> int:
        """Index of the highest deflection: end of the rising branch, start of the return branch."""
        return int(np.argmax(self.deflection))


def torque_angle(
    model: Model, element: str, low: float | str | None = None, high: float | str | None = None
) -> TorqueAngle:
    """The torque of a coupling over a slow cycle of its deflection: stages, preload and dry friction.

    Parameters
    ----------
    model
        the driveline.
    element
        name of a coupling.
    low, high
        the cycle's ends, "-10 deg" or plain numbers [rad]; by default 1.25 times the outermost corner of
        each side, plus four times the largest deflection over which friction sticks.

    Returns
    -------
    TorqueAngle
        The steady cycle, with a point at every kink. Damping is not included.

    Raises
    ------
    ModelError
        no such coupling, ends in the wrong order, or an end that is not an angle.

    Examples
    --------
    >>> loop = gr.torque_angle(gr.example("clutch_friction"), "damper", "-10 deg", "10 deg")
    >>> round(float(loop.torque.max()), 2)
    42.0
    """
    check_model(model)
    names = [element.name for element in model.elements]
    torsional = [element.name for element in model.elements if not element.along_line]
    if element not in torsional:
        rule = f"there is no such coupling; there are {', '.join(torsional) or 'none'}"
        raise ModelError(Problem("element", shown(element), rule, did_you_mean(element, torsional)))
    k = names.index(element)
    system = assemble(model).system
    law = system.laws[k]
    sliders = [auxiliary for auxiliary in system.auxiliaries if auxiliary.element == k and auxiliary.remembers]
    ends = _ends(law, sliders)
    chosen = [
        end if asked is None else _angle(model, name, asked)
        for name, asked, end in zip(("low", "high"), (low, high), ends, strict=True)
    ]
    if not chosen[0] < chosen[1]:
        rule = f"must lie below high, {chosen[1]:.6g} rad"
        raise ModelError(Problem("low", f"{chosen[0]:.6g} rad", rule, "give the lower end first"))
    deflection, torque = cycle(law, sliders, *chosen)
    elastic = np.array([law.elastic(float(d)) for d in deflection])
    friction = torque - elastic if sliders else np.zeros_like(torque)
    loss = float(np.sum(0.5 * (friction[1:] + friction[:-1]) * np.diff(deflection)))
    return TorqueAngle(element, deflection, torque, elastic, loss, model.units)


def _ends(law: PiecewiseLaw, sliders: list[Auxiliary]) -> tuple[float, float]:
    """A range that contains all corners and slips; -1 or 1 on a side without any."""
    stick = _REACHES * max((slider.scale for slider in sliders), default=0.0)
    low = _BEYOND * float(law.corners.min(initial=0.0)) - stick
    high = _BEYOND * float(law.corners.max(initial=0.0)) + stick
    return low or -1.0, high or 1.0


def _angle(model: Model, key: str, angle: float | str) -> float:
    try:
        return float(Quantity(units.ANGLE).read(angle, model.units == "dimensionless"))
    except PydanticCustomError as error:
        context = error.context or {}
        raise ModelError(Problem(key, shown(angle), context["rule"], context["remedy"])) from None
