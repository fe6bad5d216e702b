"""Rattle metrics, one shelf: each defined once, with formula, unit, window and source.

A shelf of interchangeable metrics (``METRICS``, in the order in which reports show them) and ``measure``, which lets
them all measure one thing that is heard. They take simulated and measured signals alike (``base.Heard``); what a source
cannot give is told, metric by metric. Criteria (``gearrattle.criteria``) judge; metrics measure, in the terms in which
rattle is compared, specified and calibrated.

Takes a Heard; gives rows to calls, studies and reports.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from gearrattle.metrics.base import Heard, Metric, Value
from gearrattle.metrics.contact import ContactSides
from gearrattle.metrics.energy import ContactWork, ImpactLoss
from gearrattle.metrics.force import ForceStatistics
from gearrattle.metrics.hearing import gather_motion, hear_chunks, hear_motion, hear_recording, recording_of
from gearrattle.metrics.intensity import ImpactIntensity
from gearrattle.metrics.irregularity import SpeedIrregularity
from gearrattle.metrics.loose_motion import LooseMotion
from gearrattle.metrics.rattle_level import RattleLevel
from gearrattle.metrics.separation import HarmonicSeparation, SeparationRatio
from gearrattle.metrics.transmissibility import OrderTransmissibility

METRICS: tuple[Metric, ...] = (
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
"""Every metric, in the order of reports."""


@dataclass(frozen=True)
class Row:
    """One value with where it comes from.

    Attributes:
        metric: name of the metric in the table.
        subject, quantity, value, unit, note, error: as in ``Value``; one row without a subject where a metric has
            nothing.
        window: over what it was taken.
        source: where the formula comes from.
    """

    metric: str
    subject: str
    quantity: str
    value: float
    unit: str
    window: str
    source: str
    note: str
    error: float


def measure(heard: Heard, metrics: Sequence[Metric] = METRICS, quantities: Collection[str] | None = None) -> list[Row]:
    """Return every value of the metrics; those that lack something give one row that says what.

    Args:
        heard: what there is to measure.
        metrics: which.
        quantities: which of theirs; None for all.
    """
    rows = []
    if quantities is not None:
        heard = replace(heard, wanted=frozenset(quantities))
    for metric in metrics:
        lacking = [words for need in metric.needs if (words := heard.lacks(need))]
        values = [] if lacking else metric.measure(heard)
        if not values:
            why = f"{metric.title}: {lacking[0] if lacking else 'nothing of the kind is heard'}"
            values = [Value("", metric.title, math.nan, metric.unit, why, math.nan)]
        window = f"{metric.window}: {heard.window}" if "window" in metric.window else metric.window
        rows += [
            Row(metric.name, v.subject, v.quantity, v.value, v.unit, window, metric.source, v.note, v.error)
            for v in values
            if not v.subject or heard.wants(v.quantity)
        ]
    return rows


__all__ = [
    "METRICS",
    "Heard",
    "Metric",
    "RattleLevel",
    "Row",
    "Value",
    "gather_motion",
    "hear_chunks",
    "hear_motion",
    "hear_recording",
    "measure",
    "recording_of",
]
