"""Periodic motions, against closed forms and differences."""
