"""Fits to recorded motions: the truth is recovered within its standard errors, or said not to be."""
