"""Several periodic motions of one driveline, as one result.

Takes Orbits; gives PeriodicMotions.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from gearrattle.model import Model
from gearrattle.orbits.orbit import Orbit
from gearrattle.result import Result


@dataclass(frozen=True)
class PeriodicMotions(Result):
    """Motions of one driveline that repeat: what the command ``gearrattle periodic --every`` shows.

    Attributes
    ----------
    model
        the driveline.
    orbits
        the motions, those with the largest swings last.

    Examples
    --------
    >>> from gearrattle.orbits import PeriodicMotions
    >>> model = gr.example("rattle_oscillator")
    >>> PeriodicMotions(model, (gr.periodic(model),)).sentence
    '1 motion repeats: 1 stable, 0 unstable.'
    """

    kind: ClassVar[str] = "periodic motions"
    model: Model = field(repr=False, compare=False)
    orbits: tuple[Orbit, ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user must know about them, once each."""
        return tuple(dict.fromkeys(note for orbit in self.orbits for note in orbit.notes))
