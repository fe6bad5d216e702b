"""The example scripts, run as they stand."""
