"""How the cost of ``exact`` grows with the number of inertias: ``python -m benchmarks.growth``."""
