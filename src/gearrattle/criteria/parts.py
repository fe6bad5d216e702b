"""Measure the parts of the verdict: one row for every mesh and clearance.

Takes the entries of the criteria and the sums over impacts; gives Parts, in element order, to ``judge``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import cast

import numpy as np

from gearrattle.criteria.base import Entry, Part, Scope, Tally, deflection_rate_unit, impulse_unit, judged_elements
from gearrattle.signals import ImpactSummary, Regime, is_gap, summarise_impacts
from gearrattle.trajectory import Layout

Key = tuple[str, str, str]
"""Criterion, quantity, subject."""


def measure_parts(entries: Sequence[Entry], scope: Scope, impacts: Tally) -> list[Part]:
    """Return the part of every mesh and clearance, in element order.

    Args:
        entries: those of all criteria.
        scope: what they are of.
        impacts: sums over the impacts (see ``add_impacts``).
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
    scope: Scope, element: int, found: tuple[ImpactSummary, Mapping[Key, float | str]], margins: Mapping[str, float]
) -> Part:
    impacts, said = found
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
        mean_impulse=_if_any(impacts.mean_impulse),
        max_impulse=_if_any(impacts.largest_impulse),
        max_approach_speed=_if_any(impacts.largest_speed),
        contact_share=cast(float, said["contact", "contact share", name]),
        margin_db=margins.get(name),
        impulse_unit=impulse_unit(layout, element),
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
        mean_impulse=None,
        max_impulse=None,
        max_approach_speed=None,
        contact_share=1.0,
        margin_db=margins.get(name),
        impulse_unit=impulse_unit(layout, element),
        speed_unit=deflection_rate_unit(layout, element),
    )


def _kind(layout: Layout, element: int) -> str:
    return "mesh" if layout.is_mesh[element] else "coupling"


def _if_any(magnitude: float) -> float | None:
    return None if np.isnan(magnitude) else magnitude
