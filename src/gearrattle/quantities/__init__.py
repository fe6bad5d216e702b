"""Quantities of a motion: criteria, which judge it, and metrics, which measure it.

``CRITERIA`` and ``METRICS`` are the tables, in the order in which reports show them. ``judge`` evaluates every
criterion and says what rattles, where, and how badly. ``measure`` has every metric measure a ``Heard``, made of a
simulated motion or of a recording. A criterion and a metric of one kind (contact, transmissibility) share a file. A new
quantity is its file, one line in a table, and its test. Transmissibility and peak-to-peak values of criteria are of the
last eight cycles; all else is of the steady part.

A motion may come in chunks: ``gather`` from each of them, in order, then ``tell``; no chunk need be kept. For metrics,
``gather_motion`` and ``hear_chunks`` do the same.

Takes a Trajectory or a Recording; gives a Verdict and rows to runs, studies, the pipeline and reports.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError
from gearrattle.quantities.contact import ContactShare, ContactSides
from gearrattle.quantities.criterion import (
    RULE,
    Criterion,
    Entry,
    Measuring,
    Part,
    Scope,
    Tally,
    scope_of,
    worst_first,
)
from gearrattle.quantities.energy import ContactWork, ImpactLoss
from gearrattle.quantities.force import ForceStatistics
from gearrattle.quantities.hearing import gather_motion, hear_chunks, hear_motion, hear_recording, recording_of
from gearrattle.quantities.impacts import ImpactStatistics
from gearrattle.quantities.intensity import ImpactIntensity
from gearrattle.quantities.irregularity import SpeedIrregularity
from gearrattle.quantities.loose_gear import LooseGear
from gearrattle.quantities.loose_motion import LooseMotion
from gearrattle.quantities.metric import Heard, Metric, Value
from gearrattle.quantities.parts import measure_parts
from gearrattle.quantities.peak_to_peak import PeakToPeak
from gearrattle.quantities.rattle_level import RattleLevel
from gearrattle.quantities.regime import ImpactRegime
from gearrattle.quantities.separation import HarmonicSeparation, SeparationRatio
from gearrattle.quantities.spectrum import AccelerationSpectrum, density_of
from gearrattle.quantities.transmissibility import OrderTransmissibility, Transmissibility
from gearrattle.quantities.verdict import Verdict
from gearrattle.signals import Spectrum, Window
from gearrattle.trajectory import Layout, Trajectory

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

MEASURED: Mapping[str, Measuring] = {each.name: each for each in (ImpactRegime(), ImpactStatistics(), ContactShare())}
"""The criteria whose values come from the crossings alone, and of many motions at once, by name."""

_UNITS_WITHOUT_DIMENSION = frozenset({"", "1", "1/cycle", "dB"})

__all__ = [
    "CRITERIA",
    "MEASURED",
    "METRICS",
    "RULE",
    "Criterion",
    "Entry",
    "Gathered",
    "Heard",
    "Metric",
    "Part",
    "RattleLevel",
    "Row",
    "Tally",
    "Value",
    "Verdict",
    "evaluate",
    "gather",
    "gather_motion",
    "hear_chunks",
    "hear_motion",
    "hear_recording",
    "judge",
    "measure",
    "recording_of",
    "tell",
]


@dataclasses.dataclass(frozen=True)
class Gathered:
    """What the criteria keep of the chunks of a motion so far, however many there were.

    Attributes:
        scope: what has been gathered.
        tallies: by the name of the sums (``Criterion.sums``).
    """

    scope: Scope
    tallies: Mapping[str, Tally]

    def packed(self) -> dict[str, NDArray[Any]]:
        """Return the same as named arrays, for a file."""
        window = self.scope.window
        span = np.array([window.start, window.end])
        grid = np.array([window.first, window.last, window.cycles, self.scope.samples_per_cycle])
        flat = {f"{name}/{key}": array for name, tally in self.tallies.items() for key, array in tally.items()}
        return {"span": span, "grid": grid, **flat}

    @classmethod
    def unpacked(cls, arrays: Mapping[str, NDArray[Any]], layout: Layout, algorithm: str) -> Gathered | None:
        """Return what was packed; None for nothing.

        Args:
            arrays: from ``packed``, or empty.
            layout: name plate of the driveline.
            algorithm: what made the motion.
        """
        if not arrays:
            return None
        (start, end), (first, last, cycles, per_cycle) = arrays["span"].tolist(), arrays["grid"].tolist()
        tallies: dict[str, dict[str, NDArray[Any]]] = {criterion.sums: {} for criterion in CRITERIA}
        for name in set(arrays) - {"span", "grid"}:
            sums, _, key = name.partition("/")
            tallies[sums][key] = arrays[name]
        return cls(Scope(layout, Window(start, end, first, last, cycles), per_cycle, algorithm), tallies)


def gather(trajectory: Trajectory, before: Gathered | None = None) -> Gathered:
    """Gather from the next chunk of a motion what the criteria read, each kind of sums once.

    Args:
        trajectory: the chunk, of whole cycles.
        before: what has been gathered from the chunks before it; None at the first.

    Raises:
        ModelError: if no cycle of the chunk remains after the discarded ones.
        GearRattleError: if the log of corner crossings has a gap.
    """
    tallies = _tallies(trajectory, CRITERIA, {} if before is None else before.tallies)
    return Gathered(scope_of(trajectory, None if before is None else before.scope), tallies)


def tell(gathered: Gathered, *, units: str = "SI") -> Verdict:
    """Return the verdict on all that has been gathered.

    Args:
        gathered: from ``gather``.
        units: "SI", or "dimensionless" for a model without units: then every unit reads "1".
    """
    scope, tallies = gathered.scope, gathered.tallies
    entries = [item for criterion in CRITERIA for item in criterion.tell(tallies[criterion.sums], scope)]
    parts = worst_first(measure_parts(entries, scope, tallies[ImpactStatistics.sums]))
    if units != "SI":
        entries = [item if item.unit in _UNITS_WITHOUT_DIMENSION else _bare(item) for item in entries]
        parts = tuple(dataclasses.replace(part, impulse_unit="1", energy_unit="1", speed_unit="1") for part in parts)
    return Verdict(
        verdict=parts[0].regime if parts and parts[0].rattles else "quiet",
        rule=RULE,
        parts=parts,
        entries=tuple(entries),
        notes=_distinct(item.note for item in entries),
        window=scope.window,
        spectra=_density(gathered),
    )


def evaluate(trajectory: Trajectory, criteria: Sequence[Criterion] = CRITERIA) -> list[Entry]:
    """Return the entries of some criteria, in their order.

    Args:
        trajectory: the motion, of whole cycles.
        criteria: which.

    Raises:
        ModelError: if no cycle remains after the discarded ones.
        GearRattleError: if the log of corner crossings has a gap.
    """
    if not criteria:
        return []
    tallies, scope = _tallies(trajectory, criteria, {}), scope_of(trajectory)
    return [item for criterion in criteria for item in criterion.tell(tallies[criterion.sums], scope)]


def _tallies(trajectory: Trajectory, criteria: Sequence[Criterion], before: Mapping[str, Tally]) -> dict[str, Tally]:
    """Each kind of sums that the criteria read, gathered once."""
    readers = {criterion.sums: criterion for criterion in criteria}
    return {sums: reader.gather(trajectory, before.get(sums)) for sums, reader in readers.items()}


def judge(trajectory: Trajectory, *, units: str = "SI") -> Verdict:
    """Evaluate every criterion and return the verdict.

    Args:
        trajectory: the motion, of whole cycles.
        units: "SI", or "dimensionless" for a model without units: then every unit reads "1".

    Raises:
        ModelError: if no cycle remains after the discarded ones.
        GearRattleError: if the log of corner crossings has a gap.
    """
    return tell(gather(trajectory), units=units)


@dataclasses.dataclass(frozen=True)
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
        heard = dataclasses.replace(heard, wanted=frozenset(quantities))
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


def _bare(item: Entry) -> Entry:
    return dataclasses.replace(item, unit="1")


def _distinct(notes: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(note for note in notes if note))


def _density(gathered: Gathered) -> Spectrum | None:
    try:
        return density_of(gathered.tallies[AccelerationSpectrum.sums], gathered.scope)
    except ModelError:
        return None
