"""Thresholds of negligible impacts: those too weak to be called rattle.

A motion that crosses the corners of a gap meets its flanks, however softly. The thresholds of ``[criteria]`` say which
impacts do not matter. Without a table the energy of an impact in SI has one all the same (``ASSUMED_ENERGY``); a
dimensionless model has none, for no number in it says what is weak.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from gearrattle.model import units
from gearrattle.model.table import Table
from gearrattle.model.table_symbol import Shown, Symbol
from gearrattle.model.value_kinds import Quantity

ASSUMED_ENERGY = 1e-6
"""Energy below which an impact is a touch where the model says nothing [J]."""


class Negligible(Table):
    """Thresholds: an impact below one of them is a touch; 0 switches a threshold off."""

    impact_energy: Annotated[float, Quantity(units.ENERGY, "non-negative")] | None = None
    """Energy m v^2 / 2 of an impact, of meshes and couplings [J]; 1 uJ in SI where the file is silent."""
    approach_speed: Annotated[float, Quantity(units.LINE_SPEED, "non-negative")] | None = None
    """Approach speed along the line of action, of meshes [m/s]."""
    angular_approach_speed: Annotated[float, Quantity(units.ANGULAR_VELOCITY, "non-negative")] | None = None
    """Approach speed in the angle, of couplings with a clearance [rad/s]."""


class Criteria(Shown):
    """The ``[criteria]`` table: how a motion is judged."""

    noun: ClassVar[str] = "criteria"
    symbol: ClassVar[Symbol] = Symbol("m0 6 h8 v-14 h8 v14 h8 m0 -6", 24.0)
    template: ClassVar[Mapping[str, Any]] = {"negligible": {"impact_energy": "1 uJ"}}
    negligible: Negligible | None = None
    """Which impacts are touches."""
