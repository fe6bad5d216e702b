"""Measure the parts of the verdict: one row for every mesh and clearance.

Takes the entries of the criteria and the sums over impacts; gives Parts, in element order, to ``judge``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import cast

import numpy as np

from gearrattle.quantities.criterion import (
    Entry,
    Part,
    Scope,
    Tally,
    deflection_rate_unit,
    impulse_unit,
    judged_elements,
)
from gearrattle.signals import ImpactSummary, Regime, Severity, is_gap, summarise_impacts
from gearrattle.trajectory import Layout

Key = tuple[str, str, str]
"""Criterion, quantity, subject."""


def measure_parts(entries: Sequence[Entry], scope: Scope, impacts: Tally) -> list[Part]:
    """Return the part of every mesh and clearance, in element order.

    Args:
        entries: those of all criteria.
        scope: what they are of.
        impacts: sums over the crossings (``signals.crossing_sums``).
    """
    said = {(item.criterion, item.quantity, item.subject): item.value for item in entries}
    margins: dict[str, float] = {}
    for item in entries:
        if (item.criterion, item.quantity) == ("loose_gear", "margin") and isinstance(item.value, float):
            margins[item.subject] = max(item.value, margins.get(item.subject, item.value))
    return [
        _unbroken(scope.layout, element, margins)
        if clearance is None
        else _part(scope, element, (summarise_impacts(impacts, scope.layout, clearance), said), margins)
        for element, clearance in judged_elements(scope.layout)
    ]


def _part(
    scope: Scope, element: int, judged: tuple[ImpactSummary, Mapping[Key, float | str]], margins: Mapping[str, float]
) -> Part:
    impacts, said = judged
    layout, window = scope.layout, scope.window
    name = layout.element_names[element]
    clearance = layout.clearance.tolist().index(element)
    return Part(
        name=name,
        kind=_kind(layout, element),
        gap=is_gap(layout, clearance),
        regime=cast(Regime, said["regime", "regime", name]),
        impacts_per_cycle=impacts.count / window.cycles,
        impacts_per_second=impacts.count / window.duration,
        drive_impacts_per_cycle=impacts.drive / window.cycles,
        coast_impacts_per_cycle=(impacts.count - impacts.drive) / window.cycles,
        **_severity(impacts.severity),
        contact_share=cast(float, said["contact", "contact share", name]),
        margin_db=margins.get(name),
        impulse_unit=impulse_unit(layout, element),
        energy_unit="J",
        speed_unit=deflection_rate_unit(layout, element),
    )


def _unbroken(layout: Layout, element: int, margins: Mapping[str, float]) -> Part:
    """Return the part of a mesh that has no corner: in contact for good."""
    name = layout.element_names[element]
    return Part(
        name=name,
        kind=_kind(layout, element),
        gap=False,
        regime="quiet",
        impacts_per_cycle=0.0,
        impacts_per_second=0.0,
        drive_impacts_per_cycle=0.0,
        coast_impacts_per_cycle=0.0,
        **_severity(None),
        contact_share=1.0,
        margin_db=margins.get(name),
        impulse_unit=impulse_unit(layout, element),
        energy_unit="J",
        speed_unit=deflection_rate_unit(layout, element),
    )


def _kind(layout: Layout, element: int) -> str:
    return "mesh" if layout.is_mesh[element] else "coupling"


def _severity(severity: Severity | None) -> dict[str, float | None]:
    """Return how hard its impacts are, by the names of a part; None for what does not exist."""
    names = {
        "max_approach_speed": "largest_speed",
        "max_impact_momentum": "largest_momentum",
        "mean_impact_energy": "mean_energy",
        "max_impact_energy": "largest_energy",
        "mean_exchanged_momentum": "mean_exchanged",
        "max_exchanged_momentum": "largest_exchanged",
        "mean_contact_impulse": "mean_impulse",
        "max_contact_impulse": "largest_impulse",
    }
    values = {} if severity is None else {name: float(value) for name, value in severity._asdict().items()}
    return {name: None if np.isnan(values.get(field, np.nan)) else values[field] for name, field in names.items()}
