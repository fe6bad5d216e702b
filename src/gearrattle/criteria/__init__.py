"""Criteria: a trajectory in, a verdict out.

A shelf of interchangeable criteria (``CRITERIA``, in the order in which reports show them) and ``judge``, which
evaluates them all and says what rattles, where, and how badly. A new criterion is its file, one line in this table
and its test page. Transmissibility and peak-to-peak values are of the last eight cycles, all else of the steady part.

A motion may come in chunks: ``gather`` from each of them, in order, then ``tell``; no chunk need be kept.

Takes a Trajectory from any source; gives a Verdict to calls, the pipeline and reports.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.criteria.base import (
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
from gearrattle.criteria.contact import ContactShare
from gearrattle.criteria.impacts import ImpactStatistics
from gearrattle.criteria.loose_gear import LooseGear
from gearrattle.criteria.parts import measure_parts
from gearrattle.criteria.peak_to_peak import PeakToPeak
from gearrattle.criteria.regime import ImpactRegime
from gearrattle.criteria.spectrum import AccelerationSpectrum, density_of
from gearrattle.criteria.transmissibility import Transmissibility
from gearrattle.criteria.verdict import Verdict
from gearrattle.errors import ModelError
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

MEASURED: Mapping[str, Measuring] = {each.name: each for each in (ImpactRegime(), ImpactStatistics(), ContactShare())}
"""Those whose values come from the crossings alone, and of many motions at once, by name."""

_UNITS_WITHOUT_DIMENSION = frozenset({"", "1", "1/cycle", "dB"})

__all__ = [
    "CRITERIA",
    "MEASURED",
    "RULE",
    "Criterion",
    "Entry",
    "Gathered",
    "Part",
    "Tally",
    "Verdict",
    "evaluate",
    "gather",
    "judge",
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


def _bare(item: Entry) -> Entry:
    return dataclasses.replace(item, unit="1")


def _distinct(notes: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(note for note in notes if note))


def _density(gathered: Gathered) -> Spectrum | None:
    try:
        return density_of(gathered.tallies[AccelerationSpectrum.sums], gathered.scope)
    except ModelError:
        return None
