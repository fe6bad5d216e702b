"""Limits of searches for settled motions: number of starts, periods of a simulation, time of an answer."""

from gearrattle.model import units
from gearrattle.model.value_kinds import Quantity

STARTS = 24
"""Number of starts."""
BLOCK = 32
"""Periods between two checks whether a motion repeats."""
BLOCKS = 5
"""Number of checks after which a motion counts as not settled."""
LONGEST = 8
"""Largest number of periods after which a motion may repeat."""
WITHIN = Quantity(units.TIME, "positive")
"""A time that an answer may take."""
