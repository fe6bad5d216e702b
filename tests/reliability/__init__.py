"""Attacks on what is stored: kills and power cuts, counted."""
