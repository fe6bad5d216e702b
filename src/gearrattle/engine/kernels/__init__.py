"""Compiled loops on floats and arrays: no classes, no units, no input or output, no exceptions."""
