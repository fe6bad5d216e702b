"""Spectra, densities and order maps as labelled data: the functions behind ``gr.spectra``."""

from gearrattle.signals.spectral.densities import coherence, cross_psd, psd
from gearrattle.signals.spectral.order_maps_of_signals import order_cuts, order_map
from gearrattle.signals.spectral.waterfalls import waterfall

__all__ = [
    "coherence",
    "cross_psd",
    "order_cuts",
    "order_map",
    "psd",
    "waterfall",
]
