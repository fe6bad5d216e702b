"""What depends on two values of a model: curves of events, and the special points at which they end or meet."""
