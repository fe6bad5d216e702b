"""What a Branch knows, as the files that it calls take it: they cannot import it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events import Event
from gearrattle.engine.periodic.point import Point
from gearrattle.model import Model
from gearrattle.model.factors import Written
from gearrattle.orbits.curve import Curve
from gearrattle.orbits.orbit import Orbit

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

Array = NDArray[np.float64]


class Followed(Protocol):
    """A Branch; see there what each member is."""

    @property
    def model(self) -> Model:
        """The driveline."""

    @property
    def path(self) -> str:
        """Of the value."""

    @property
    def range(self) -> tuple[float, float]:
        """Its ends [SI]."""

    @property
    def cycles(self) -> int:
        """Periods T after which the motions repeat."""

    @property
    def curves(self) -> tuple[Curve, ...]:
        """The branches."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user must know."""

    @property
    def points(self) -> tuple[Point, ...]:
        """The points of all branches."""

    @property
    def data(self) -> xr.Dataset:
        """The points."""

    @property
    def events(self) -> pd.DataFrame:
        """The events."""

    @property
    def events_of_curves(self) -> tuple[tuple[Event, ...], ...]:
        """The events of every branch."""

    @property
    def event_levels(self) -> Array:
        """(E, 3, K) lowest, highest and mean deflection at the events."""

    def boundary(self, event: int, second: str, range: tuple[Written, Written]) -> xr.Dataset:
        """Return an event over a second value."""

    def follower(self, curve: Curve) -> Continuation:
        """Return what follows a branch."""

    def orbit_at(self, point: Point, cycles: int) -> Orbit:
        """Return the motion of a point of the engine."""

    def orbit(self, i: int) -> Orbit:
        """Return the motion at a point."""
