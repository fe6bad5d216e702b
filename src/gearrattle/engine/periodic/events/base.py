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
    """Something that happens along a branch.

    Attributes
    ----------
    kind
        of event.
    point
        of the branch at the event, located to rounding.
    watch
        index of what touches or crosses its bound: clearances first, then auxiliary elements; -1: none.
    is_collision
        whether the gradient jumps there.
    touch
        of a grazing: the corner and the instant.
    grazing
        of a grazing: what it does to the gradient.
    """

    kind: str
    point: Point
    watch: int = -1
    is_collision: bool = False
    touch: Touch | None = None
    grazing: Grazing | None = None
