"""Damaged input for everything that reads a file: ``make fuzz``."""
