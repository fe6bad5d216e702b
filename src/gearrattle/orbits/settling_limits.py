"""How long motions are followed until they settle, from how many starts, and how long an answer may take."""

from gearrattle.model import units
from gearrattle.model.value_kinds import Quantity

STARTS = 24
BLOCK = 32
BLOCKS = 5
"""Periods between two looks at whether a motion repeats, and after how many looks it counts as not settled."""
LONGEST = 8
"""Periods after which a motion may repeat."""
WITHIN = Quantity(units.TIME, "positive")
"""A time that an answer may take."""
