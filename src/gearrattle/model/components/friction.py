"""Dry friction in a coupling: the full height of the torque-angle loop must not decrease from stage to stage."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from gearrattle.model import units
from gearrattle.model.over_speed import OverSpeed
from gearrattle.model.table import Breach, Location, Table
from gearrattle.model.value_kinds import Quantity, value_of

Hysteresis = Annotated[float, OverSpeed(units.TORQUE, "non-negative", swept=False)]
StickStiffness = Annotated[float, Quantity(units.TORSIONAL_STIFFNESS, "positive")]
_STICK = 20.0  # default stick stiffness over the slope of the piece


def friction(hysteresis: float, stick: float | None, slope: float) -> tuple[float, float]:
    """Hysteresis and stick stiffness of a piece; 0 and 0 without friction."""
    return (hysteresis, _STICK * slope if stick is None else stick) if hysteresis > 0.0 else (0.0, 0.0)


def stick_rules(
    owner: type[Table], location: Location, table: Mapping[str, Any], dimensionless: bool, why: str
) -> Iterator[Breach]:
    """Yield a breach if friction has no stick stiffness and no slope for its default; ``owner`` is the class."""
    is_flat = value_of(owner, table, "stiffness", dimensionless) == 0.0
    is_tabled = isinstance(table.get("hysteresis"), Mapping)  # over speed
    rubs = is_tabled or bool(value_of(owner, table, "hysteresis", dimensionless))
    if is_flat and rubs and table.get("stick_stiffness") is None:
        remedy = 'such as stick_stiffness = "100 N*m/rad"'
        yield Breach(
            (*location, "hysteresis"), table["hysteresis"], f"friction needs a stick_stiffness here: {why}", remedy
        )


def stage_rules(owner: type[Table], key: str, stages: object, dimensionless: bool) -> Iterator[Breach]:
    """Yield breaches of hysteresis in stages of class ``owner``: it must not decrease outward, and needs a slope."""
    before = 0.0
    for index, stage in enumerate(stages if isinstance(stages, (list, tuple)) else ()):
        table = stage if isinstance(stage, Mapping) else getattr(stage, "__dict__", {})
        yield from stick_rules(owner, (key, index), table, dimensionless, "20 times the stage's slope is zero")
        hysteresis = table.get("hysteresis", 0.0)
        if isinstance(hysteresis, Mapping):  # a table over speed: the assembly checks it, where its values are known
            return
        value = value_of(owner, table, "hysteresis", dimensionless)
        if value is not None and value < before:
            rule = f"hysteresis must not fall from stage to stage: the stage before has {before:.6g} N m in all"
            yield Breach((key, index, "hysteresis"), hysteresis, rule, "give each stage the full height of its loop")
        before = value if value is not None else before
