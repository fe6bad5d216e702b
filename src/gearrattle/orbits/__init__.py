"""Periodic motions of a model: one, all of them, and how they change with a value of the model."""

from gearrattle.orbits.branch import Branch
from gearrattle.orbits.find import periodic
from gearrattle.orbits.follow import continuation
from gearrattle.orbits.motion_map import MotionMap
from gearrattle.orbits.motions import PeriodicMotions
from gearrattle.orbits.orbit import Orbit
from gearrattle.orbits.run_ups import RunUpJumps

__all__ = ["Branch", "MotionMap", "Orbit", "PeriodicMotions", "RunUpJumps", "continuation", "periodic"]
