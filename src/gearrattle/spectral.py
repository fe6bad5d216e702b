"""Spectra, densities and order maps as labelled data: what stands behind ``gr.spectra``."""

from gearrattle.signals.spectral.densities import coherence, cross_psd, psd
from gearrattle.signals.spectral.orders import order_cuts, order_map
from gearrattle.signals.spectral.waterfall import waterfall

__all__ = [
    "coherence",
    "cross_psd",
    "order_cuts",
    "order_map",
    "psd",
    "waterfall",
]
