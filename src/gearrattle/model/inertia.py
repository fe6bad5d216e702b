"""A rotating body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from gearrattle.model import units
from gearrattle.model.late_class import LateClass
from gearrattle.model.over_speed import OverSpeed
from gearrattle.model.table_symbol import Shown, Symbol
from gearrattle.model.value_kinds import GROUND, Label, Quantity

if TYPE_CHECKING:
    from gearrattle.model.drag_parts import DragPart
else:
    DragPart = Any  # the class is imported when a file has a drag part


class Inertia(Shown):
    """One rigid rotating body; with a mass, and a bearing that holds it, it moves sideways too."""

    noun: ClassVar[str] = "inertia"
    symbol: ClassVar[Symbol] = Symbol("m0 -18 h18 v36 h-18 z m18 18", 18.0)
    template: ClassVar[Mapping[str, Any]] = {"name": "inertia", "J": "0.01 kg*m^2", "drag": "0.01 N*m*s/rad"}
    name: Annotated[str, Label(reserved=(GROUND,))]
    """Unique name; "ground" is reserved for the fixed frame."""
    J: Annotated[float, Quantity(units.MOMENT_OF_INERTIA, "positive")]
    """Moment of inertia [kg m^2]."""
    drag: Annotated[float, Quantity(units.TORSIONAL_DAMPING, "non-negative")] = 0.0
    """Viscous drag to ground on the fluctuation of speed [N m s/rad]."""
    drag_torque: Annotated[float, OverSpeed(units.TORQUE, "non-negative")] = 0.0
    """Mean drag torque opposing rotation [N m]; acts as a mean torque of the opposite sign."""
    mass: Annotated[float, Quantity(units.MASS, "positive")] | None = None
    """Mass [kg] of a body that bearings hold; None: its axis stays where it is."""
    drag_parts: Annotated[tuple[DragPart, ...], LateClass("gearrattle.model.drag_parts", "DragParts")] = ()
    """What else drags on it: bearings, churning, synchronisers, seals, each by its law over speed and oil."""
