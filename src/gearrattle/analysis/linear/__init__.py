"""Linear analysis of a piecewise-linear system: every element with one slope, no integration in time."""
