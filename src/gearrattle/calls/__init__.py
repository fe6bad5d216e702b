"""The public functions that take a model: assembly, then mathematics, then results with names."""
