"""The drag parts: bearings, churning, sheared films, seals, constants and measured tables; one file for every law.

``DRAG_PARTS`` maps ``kind`` of a table in ``drag_parts`` of an inertia to its class.
"""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, core_schema

from gearrattle.model.drag_parts.churning import Churning
from gearrattle.model.drag_parts.constant_drag import ConstantDrag
from gearrattle.model.drag_parts.drag_part import Drag, DragPart
from gearrattle.model.drag_parts.measured_drag import MeasuredDrag
from gearrattle.model.drag_parts.rolling_bearing import RollingBearing
from gearrattle.model.drag_parts.shaft_seal import ShaftSeal
from gearrattle.model.drag_parts.sheared_films import ClutchPack, SynchroniserCone
from gearrattle.model.drag_parts.skf_bearing import SkfBearing
from gearrattle.model.table import breach, did_you_mean

DRAG_PARTS: dict[str, type[DragPart]] = {
    "needle-bearing": RollingBearing,
    "rolling-bearing": RollingBearing,
    "skf-bearing": SkfBearing,
    "churning": Churning,
    "synchroniser": SynchroniserCone,
    "clutch-pack": ClutchPack,
    "shaft-seal": ShaftSeal,
    "measured": MeasuredDrag,
    "constant": ConstantDrag,
}


class _ByKind:
    """Reads a part by its ``kind``."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        def check(value: Any, _inner: Any, info: ValidationInfo) -> DragPart:
            if isinstance(value, DragPart):
                return value
            kind = value.get("kind") if isinstance(value, Mapping) else None
            part = DRAG_PARTS.get(kind) if isinstance(kind, str) else None
            if part is None:
                kinds = " or ".join(f'"{name}"' for name in DRAG_PARTS)
                raise breach(f"must be a table whose kind is {kinds}", did_you_mean(kind, DRAG_PARTS))
            return part.model_validate(value, context=info.context)

        return core_schema.with_info_wrap_validator_function(check, handler(source))


AnyDragPart = Annotated[
    RollingBearing | SkfBearing | Churning | SynchroniserCone | ClutchPack | ShaftSeal | MeasuredDrag | ConstantDrag,
    _ByKind(),
]
DragParts = tuple[AnyDragPart, ...]
"""Parts of any kind."""

__all__ = ["DRAG_PARTS", "Drag", "DragPart", "DragParts"]
