"""Slow, obvious, independent twins of the fast code: nothing in here imports gearrattle."""
