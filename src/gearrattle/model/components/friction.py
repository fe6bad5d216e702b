"""Dry friction in a coupling: loops of a full height that may not fall from stage to stage.

Takes raw tables; gives breaches, and hysteresis and stick stiffness of a piece.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from gearrattle.model import units
from gearrattle.model.over_speed import OverSpeed
from gearrattle.model.quantity import Quantity, attempt
from gearrattle.model.table import Breach

_hysteresis = OverSpeed(units.TORQUE, "non-negative", swept=False)
Hysteresis = Annotated[float, _hysteresis]
StickStiffness = Annotated[float, Quantity(units.TORSIONAL_STIFFNESS, "positive")]
_STICK = 20.0


def friction(hysteresis: float, stick: float | None, slope: float) -> tuple[float, float]:
    """Hysteresis and stick stiffness of a piece; 0 and 0 without friction."""
    return (hysteresis, _STICK * slope if stick is None else stick) if hysteresis > 0.0 else (0.0, 0.0)


def stick_rules(location: tuple[str | int, ...], table: Mapping[str, Any], why: str) -> Iterator[Breach]:
    """Yield a breach of friction without a slope to stick with."""
    flat = table.get("stiffness") in (0, 0.0) and not isinstance(table.get("stiffness"), bool)
    if flat and table.get("hysteresis") and table.get("stick_stiffness") is None:
        remedy = 'such as stick_stiffness = "100 N*m/rad"'
        yield Breach(
            (*location, "hysteresis"), table["hysteresis"], f"friction needs a stick_stiffness here: {why}", remedy
        )


def stage_rules(key: str, stages: object, dimensionless: bool) -> Iterator[Breach]:
    """Yield breaches of hysteresis in stages: it may not fall outward, and needs a slope."""
    before = 0.0
    for index, stage in enumerate(stages if isinstance(stages, (list, tuple)) else ()):
        table = stage if isinstance(stage, Mapping) else getattr(stage, "__dict__", {})
        yield from stick_rules((key, index), table, "20 times the stage's slope is zero")
        hysteresis = table.get("hysteresis", 0.0)
        if isinstance(hysteresis, Mapping):  # a table over speed: judged where the values are known, in the assembly
            return
        value = attempt(_hysteresis.read, hysteresis, dimensionless)
        if value is not None and value < before:
            rule = f"hysteresis must not fall from stage to stage: the stage before has {before:.6g} N m in all"
            yield Breach((key, index, "hysteresis"), hysteresis, rule, "give each stage the full height of its loop")
        before = value if value is not None else before
