"""How long motions are followed until they settle, and from how many starts."""

STARTS = 24
BLOCK, BLOCKS = 32, 5
"""Periods between two looks at whether a motion repeats, and after how many looks it counts as not settled."""
