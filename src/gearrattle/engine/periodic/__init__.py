"""Periodic motions: the period map, the motions that it repeats, and how they follow the parameters."""
