"""Contact ratios forecast from models against those of exact motions: ``python -m benchmarks.forecast``."""
