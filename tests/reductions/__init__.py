"""Reductions: groups, subspaces, the new driveline, and whether the stated errors hold."""
