"""Simulation of a model: settings, limits, one run, or a stream of chunks that is kept on disk."""
