"""Criteria: a trajectory in, a verdict out.

A shelf of interchangeable criteria (``CRITERIA``, in the order in which reports show them) and ``judge``, which
evaluates them all and says what rattles, where, and how badly. A new criterion is its file, one line in this table
and its test page. Transmissibility and peak-to-peak values are of the last eight cycles, all else of the steady part.

Takes a Trajectory from any source; gives a Verdict to calls, the pipeline and reports.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

from gearrattle.criteria.base import RULE, Criterion, Entry, Part, Verdict, worst_first
from gearrattle.criteria.contact import ContactShare
from gearrattle.criteria.impacts import ImpactStatistics
from gearrattle.criteria.loose_gear import LooseGear
from gearrattle.criteria.parts import measure_parts
from gearrattle.criteria.peak_to_peak import PeakToPeak
from gearrattle.criteria.regime import ImpactRegime
from gearrattle.criteria.spectrum import AccelerationSpectrum, acceleration_density
from gearrattle.criteria.transmissibility import Transmissibility
from gearrattle.criteria.wording import sentence
from gearrattle.errors import ModelError
from gearrattle.signals import Spectrum, steady
from gearrattle.trajectory import Trajectory

CRITERIA: tuple[Criterion, ...] = (
    ImpactRegime(),
    ImpactStatistics(),
    ContactShare(),
    LooseGear(),
    Transmissibility(),
    PeakToPeak(),
    AccelerationSpectrum(),
)
"""Every criterion, in the order of reports."""

_UNITS_WITHOUT_DIMENSION = frozenset({"", "1", "1/cycle", "dB"})

__all__ = ["CRITERIA", "RULE", "Criterion", "Entry", "Part", "Verdict", "judge"]


def judge(trajectory: Trajectory, *, units: str = "SI") -> Verdict:
    """Evaluate every criterion and return the verdict.

    Args:
        trajectory: the motion, of whole cycles.
        units: "SI", or "dimensionless" for a model without units: then every unit reads "1".

    Raises:
        ModelError: if no cycle remains after the discarded ones.
        GearRattleError: if the log of corner crossings has a gap.
    """
    window = steady(trajectory)
    entries = [item for criterion in CRITERIA for item in criterion.evaluate(trajectory)]
    margins: dict[str, float] = {}
    for item in entries:
        if item.criterion == LooseGear.name and item.quantity == "margin" and isinstance(item.value, float):
            margins[item.subject] = max(item.value, margins.get(item.subject, item.value))
    parts = worst_first(measure_parts(trajectory, margins))
    if units != "SI":
        entries = [item if item.unit in _UNITS_WITHOUT_DIMENSION else _bare(item) for item in entries]
        parts = tuple(dataclasses.replace(part, impulse_unit="1", speed_unit="1") for part in parts)
    return Verdict(
        verdict=parts[0].regime if parts else "quiet",
        sentence=sentence(parts, window.cycles),
        rule=RULE,
        parts=parts,
        entries=tuple(entries),
        notes=_distinct(item.note for item in entries),
        window=window,
        spectra=_density(trajectory),
    )


def _bare(item: Entry) -> Entry:
    return dataclasses.replace(item, unit="1")


def _distinct(notes: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(note for note in notes if note))


def _density(trajectory: Trajectory) -> Spectrum | None:
    try:
        return acceleration_density(trajectory)
    except ModelError:
        return None
