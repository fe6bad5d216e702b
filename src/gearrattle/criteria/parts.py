"""Measure the parts of the verdict: one row for every mesh and clearance.

Takes a Trajectory and the loose-gear margins by mesh; gives Parts, in element order, to ``judge``.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gearrattle.criteria.base import Part, deflection_rate_unit, impulse_unit, judged_elements
from gearrattle.signals import Impacts, centre, contact_share, find_impacts, regime, steady
from gearrattle.trajectory import Array, Layout, Trajectory


def measure_parts(trajectory: Trajectory, margins: Mapping[str, float]) -> list[Part]:
    """Return the part of every mesh and clearance, in element order.

    Args:
        trajectory: the motion.
        margins: margin of the loose-gear test by mesh name [dB]; meshes without a loose gear are absent.
    """
    impacts = find_impacts(trajectory).within(steady(trajectory))
    return [
        _unbroken(trajectory.layout, element, margins)
        if clearance is None
        else _part(trajectory, element, clearance, impacts.of(clearance), margins)
        for element, clearance in judged_elements(trajectory.layout)
    ]


def _part(trajectory: Trajectory, element: int, clearance: int, impacts: Impacts, margins: Mapping[str, float]) -> Part:
    layout = trajectory.layout
    window = steady(trajectory)
    name = layout.element_names[element]
    drive = int(np.count_nonzero(impacts.drive))
    return Part(
        name=name,
        kind=_kind(layout, element),
        gap=_is_gap(layout, clearance),
        regime=regime(trajectory, clearance, window),
        impacts_per_cycle=len(impacts) / window.cycles,
        impacts_per_second=len(impacts) / window.duration,
        drive_impacts_per_cycle=drive / window.cycles,
        coast_impacts_per_cycle=(len(impacts) - drive) / window.cycles,
        mean_impulse=_mean(np.abs(impacts.impulse)),
        max_impulse=_largest(np.abs(impacts.impulse)),
        max_approach_speed=_largest(np.abs(impacts.velocity)),
        contact_share=contact_share(trajectory, clearance, window),
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


def _is_gap(layout: Layout, clearance: int) -> bool:
    first = int(layout.region_of_first_piece[clearance])
    return any(layout.stiffness_of_piece[clearance][label - first] == 0.0 for label in centre(layout, clearance))


def _mean(magnitudes: Array) -> float | None:
    return float(magnitudes.mean()) if magnitudes.size and not np.isnan(magnitudes).any() else None


def _largest(magnitudes: Array) -> float | None:
    return float(magnitudes.max()) if magnitudes.size and not np.isnan(magnitudes).any() else None
