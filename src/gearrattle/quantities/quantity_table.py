"""The table of all quantities, in the order in which reports show them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gearrattle.quantities.contact import ContactShare, ContactSides
from gearrattle.quantities.force import ForceStatistics
from gearrattle.quantities.impact_energy import ContactWork, ImpactLoss
from gearrattle.quantities.impact_statistics import ImpactStatistics
from gearrattle.quantities.intensity import ImpactIntensity
from gearrattle.quantities.irregularity import SpeedIrregularity
from gearrattle.quantities.loose_gear import LooseGear
from gearrattle.quantities.loose_motion import LooseMotion
from gearrattle.quantities.metric_inputs import Inputs
from gearrattle.quantities.peak_to_peak import PeakToPeak
from gearrattle.quantities.quantity import CrossingQuantity, Quantity, Sums
from gearrattle.quantities.rattle_level import RattleLevel
from gearrattle.quantities.regime import ImpactRegime
from gearrattle.quantities.separation import HarmonicSeparation, SeparationRatio
from gearrattle.quantities.severity import ImpactSeverity
from gearrattle.quantities.spectrum import AccelerationSpectrum
from gearrattle.quantities.transmissibility import OrderTransmissibility, Transmissibility

QUANTITIES: tuple[Quantity[Any], ...] = (
    ImpactRegime(),
    ImpactSeverity(),
    ImpactStatistics(),
    ContactShare(),
    LooseGear(),
    Transmissibility(),
    PeakToPeak(),
    AccelerationSpectrum(),
    SeparationRatio(),
    HarmonicSeparation(),
    ImpactIntensity(),
    ImpactLoss(),
    ContactWork(),
    RattleLevel(),
    ForceStatistics(),
    LooseMotion(),
    ContactSides(),
    OrderTransmissibility(),
    SpeedIrregularity(),
)
"""Every quantity, in the order of reports."""

CRITERIA: tuple[Quantity[Sums], ...] = tuple(quantity for quantity in QUANTITIES if not quantity.needs)
"""The criteria: they need only a simulated motion."""

METRICS: tuple[Quantity[Inputs], ...] = tuple(quantity for quantity in QUANTITIES if quantity.needs)
"""The metrics: quantities that state the inputs they need."""

CROSSING_CRITERIA: Mapping[str, CrossingQuantity] = {
    quantity.name: quantity for quantity in QUANTITIES if isinstance(quantity, CrossingQuantity)
}
"""By name, the criteria whose values depend on the crossings alone and can be computed for many motions at once."""
