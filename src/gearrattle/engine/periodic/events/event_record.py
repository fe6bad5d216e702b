"""What an event of a branch is, and the names of its kinds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from gearrattle.engine.periodic.events.grazing import Grazing
from gearrattle.engine.periodic.motion import Touch
from gearrattle.engine.periodic.point import Point

FOLD = "fold"
DOUBLING = "period doubling"
BREAKING = "symmetry breaking"
NEIMARK_SACKER = "Neimark-Sacker"
GRAZING = "grazing"
PATTERN = "pattern"


@dataclass(frozen=True)
class Event:
    """An event of a branch."""

    kind: str  # of event
    point: Point  # of the branch at the event, located to rounding
    watch: int = -1  # index of the quantity that touches or crosses: clearances, then auxiliaries; -1: none
    is_collision: bool = False  # whether the gradient jumps there
    touch: Touch | None = None  # for a grazing: the corner and the instant
    grazing: Grazing | None = None  # for a grazing: its effect on the gradient


class Loss(NamedTuple):
    """A kind of event at which multipliers cross the unit circle."""

    test: Callable[[Point], float]  # smooth along a branch, and zero at the event
    crossing: Callable[[Point], list[complex]]  # multipliers that cross the unit circle at an event
    nearest: Callable[[Point], tuple[complex, float]] | None = None  # the multiplier that may cross, and its distance
