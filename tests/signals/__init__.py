"""Signals: windows, levels, spectra, orders, regions, impacts."""
