"""Readers: round trips, files of the formats' own libraries, every kind of damage."""
