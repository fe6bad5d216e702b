"""What an event of a branch is, and the names of its kinds."""

from __future__ import annotations

from dataclasses import dataclass

from gearrattle.engine.periodic.events.grazing import Grazing
from gearrattle.engine.periodic.motion import Touch
from gearrattle.engine.periodic.point import Point

FOLD, DOUBLING, BREAKING, NEIMARK_SACKER, GRAZING, PATTERN = (
    "fold",
    "period doubling",
    "symmetry breaking",
    "Neimark-Sacker",
    "grazing",
    "pattern",
)


@dataclass(frozen=True)
class Event:
    """Something that happens along a branch."""

    kind: str  # of event
    point: Point  # of the branch at the event, located to rounding
    watch: int = -1  # index of what touches or crosses its bound: clearances first, then auxiliary elements; -1: none.
    is_collision: bool = False  # whether the gradient jumps there
    touch: Touch | None = None  # of a grazing: the corner and the instant.
    grazing: Grazing | None = None  # of a grazing: what it does to the gradient.
