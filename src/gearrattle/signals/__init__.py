"""Signals measured on a trajectory for every criterion, without a judgement of them.

Two kinds of signal live here. *Sampled* ones (accelerations, forces) yield levels, spectra and order lines over whole
periods; they are as fine as the output grid. *Event-exact* ones (contact share, regime, impacts) come from the log of
corner crossings alone, so no sampling rate limits them.
"""

from gearrattle.signals.alignment import Alignment, align
from gearrattle.signals.bands import band_rms
from gearrattle.signals.coherence import ChanceCoherence, Coherence, by_chance, coherence_at_harmonics
from gearrattle.signals.crossing_sums import add_crossings, contact_share, dwell_times, pieces_of, regime, region_shares
from gearrattle.signals.driveline_constants import (
    LooseGear,
    decibels,
    gap_names,
    is_gap,
    is_same_mesh,
    loose_gears,
    reduced_inertia,
    reduced_inertias,
    speed_ratios,
    torque_ratio,
)
from gearrattle.signals.ensembles import (
    density_distances,
    distribution_distances,
    explained_distance,
    number_distances,
    rank,
)
from gearrattle.signals.impact_sums import Hardness, ImpactSummary, measure_impacts, summarise_impacts
from gearrattle.signals.impacts import Impacts, find_impacts
from gearrattle.signals.levels import peak_to_peak, rms
from gearrattle.signals.negligible import RANKS, SEVERITIES, Severity, are_negligible, are_touches, limits_words
from gearrattle.signals.orders import amplitudes_from, harmonics, order_sums, resolved
from gearrattle.signals.regions import (
    Regime,
    centre,
    centre_words,
    clearance_arrays,
    dwell_of_regions,
    in_contact,
    regime_of,
    region_at,
    share_in_contact,
)
from gearrattle.signals.rings import by_parts, judged_arrays, own_elements, parts_of, rings
from gearrattle.signals.subharmonics import Line, strongest, sub_harmonics, super_harmonics
from gearrattle.signals.welch import Spectrum, psd
from gearrattle.signals.windows import Window, last_cycles, steady

__all__ = [
    "RANKS",
    "SEVERITIES",
    "Alignment",
    "ChanceCoherence",
    "Coherence",
    "Hardness",
    "ImpactSummary",
    "Impacts",
    "Line",
    "LooseGear",
    "Regime",
    "Severity",
    "Spectrum",
    "Window",
    "add_crossings",
    "align",
    "amplitudes_from",
    "are_negligible",
    "are_touches",
    "band_rms",
    "by_chance",
    "by_parts",
    "centre",
    "centre_words",
    "clearance_arrays",
    "coherence_at_harmonics",
    "contact_share",
    "decibels",
    "density_distances",
    "distribution_distances",
    "dwell_of_regions",
    "dwell_times",
    "explained_distance",
    "find_impacts",
    "gap_names",
    "harmonics",
    "in_contact",
    "is_gap",
    "is_same_mesh",
    "judged_arrays",
    "last_cycles",
    "limits_words",
    "loose_gears",
    "measure_impacts",
    "number_distances",
    "order_sums",
    "own_elements",
    "parts_of",
    "peak_to_peak",
    "pieces_of",
    "psd",
    "rank",
    "reduced_inertia",
    "reduced_inertias",
    "regime",
    "regime_of",
    "region_at",
    "region_shares",
    "resolved",
    "rings",
    "rms",
    "share_in_contact",
    "speed_ratios",
    "steady",
    "strongest",
    "sub_harmonics",
    "summarise_impacts",
    "super_harmonics",
    "torque_ratio",
]
