"""Spectra, densities and order maps of runs, recordings and sampled signals, as labelled data."""
