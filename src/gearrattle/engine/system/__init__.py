"""The equations: one piecewise-linear system, its coordinates, its regions and what bounds them."""
