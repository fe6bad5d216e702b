"""Signals in, signals out: what every criterion measures on a trajectory, without judging it.

Two kinds of signal live here. *Sampled* ones (accelerations, forces) yield levels, spectra and order lines over whole
periods; they are as fine as the output grid. *Event-exact* ones (contact share, regime, impacts) come from the log of
corner crossings alone, so no sampling rate limits them.

Takes trajectories and plain arrays; gives plain arrays to the criteria, plots and reports above.
"""

from gearrattle.signals.impacts import Impacts, find_impacts
from gearrattle.signals.levels import peak_to_peak, rms
from gearrattle.signals.lines import Line, strongest, sub_harmonics, super_harmonics
from gearrattle.signals.orders import harmonics, resolved
from gearrattle.signals.regions import Regime, centre, contact_share, in_contact, regime, region_at, region_shares
from gearrattle.signals.spectra import Spectrum, psd
from gearrattle.signals.windows import Window, last_cycles, steady

__all__ = [
    "Impacts",
    "Line",
    "Regime",
    "Spectrum",
    "Window",
    "centre",
    "contact_share",
    "find_impacts",
    "harmonics",
    "in_contact",
    "last_cycles",
    "peak_to_peak",
    "psd",
    "regime",
    "region_at",
    "region_shares",
    "resolved",
    "rms",
    "steady",
    "strongest",
    "sub_harmonics",
    "super_harmonics",
]
