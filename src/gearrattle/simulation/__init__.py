"""A model is simulated: its settings, its limits, one run, or a stream of chunks that is kept on disk."""
