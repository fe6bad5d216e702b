"""Periodic motions of a model: one, all of them, and how they change with a value of the model."""

from gearrattle.orbits.branch import Branch, continuation
from gearrattle.orbits.find import periodic
from gearrattle.orbits.motions import PeriodicMotions
from gearrattle.orbits.orbit import Orbit

__all__ = ["Branch", "Orbit", "PeriodicMotions", "continuation", "periodic"]
