"""Kinds of events at which multipliers cross the unit circle."""

from __future__ import annotations

from gearrattle.engine.periodic.events.event_record import BREAKING, DOUBLING, FOLD, NEIMARK_SACKER, Loss
from gearrattle.engine.periodic.events.fold import along_parameter
from gearrattle.engine.periodic.events.neimark_sacker import nearest_pair, pair_of, pair_size
from gearrattle.engine.periodic.events.period_doubling import det_plus, nearest_to_minus_one
from gearrattle.engine.periodic.events.symmetry_breaking import det_minus, nearest_to_one

LOSSES = {
    FOLD: Loss(along_parameter, lambda _: [1.0]),
    DOUBLING: Loss(det_plus, lambda _: [-1.0], nearest_to_minus_one),
    NEIMARK_SACKER: Loss(pair_size, pair_of, nearest_pair),
    BREAKING: Loss(det_minus, lambda _: [1.0], nearest_to_one),
}
"""Their test functions and multipliers, by kind."""
