"""The results of a comparison: a row for every contender, judged, and all of them together.

Frozen records; made by ``compare``, read by ``table``, ``recommendation`` and reports.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from gearrattle.comparison.comparison_record import Record
from gearrattle.comparison.crossing_comparison import EventComparison
from gearrattle.comparison.pointwise import PointwiseError
from gearrattle.comparison.statistics_comparison import StatisticalComparison
from gearrattle.comparison.transmissibility_comparison import TransmissibilityComparison
from gearrattle.result import Result
from gearrattle.signals.coherence import Coherence
from gearrattle.trajectory import Array, Cost


@dataclass(frozen=True)
class Row(Record):
    """One contender, judged.

    Attributes
    ----------
    cost
        cost of the run; None if it did not end (then the following fields are None or empty as well).
    statistics
        statistics beyond the horizon; None if no whole cycle lies there.
    coherence
        coherence of every inertia's acceleration; empty if the run is too short for it.
    history
        times [s], and the worst error since the time before [``error.unit``], to the end.
    verdict
        "sound", "not sound" or "no motion"; empty without a verdict.
    """

    label: str
    algorithm: str
    status: str
    cost: Cost | None = None
    error: PointwiseError | None = None
    crossings: EventComparison | None = None
    impacts: EventComparison | None = None
    statistics: StatisticalComparison | None = None
    transmissibility: TransmissibilityComparison | None = None
    coherence: Mapping[str, Coherence] | None = None
    history: tuple[Array, Array] | None = None
    growths: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    verdict: str = ""
    reasons: tuple[str, ...] = ()

    @property
    def growth(self) -> float | None:
        """The largest growth of a mode in a step; above 1 the step is unstable. None for a variable step."""
        return max(self.growths.values(), default=None)


@dataclass(frozen=True)
class Comparison(Result, Record):
    """All contenders against the reference.

    Attributes
    ----------
    rows
        the reference first (against itself: zero error, its own cost), then the contenders as asked for, last
        the exact motion from nearby.
    tolerance
        tolerance of contenders with variable step that have none of their own.
    window
        time up to which errors are given sample by sample [s].
    horizon
        the reference's predictability horizon [s]; infinite if it is beyond the end.
    period
        T [s].
    budget
        longest time a contender may take [s].
    """

    kind: ClassVar[str] = "comparison"
    model: str
    reference: str
    rows: tuple[Row, ...]
    tolerance: float
    window: float
    horizon: float
    period: float
    cycles: int
    discard: int
    samples_per_cycle: int
    budget: float
    recommendation: str = ""

    def row(self, label: str) -> Row:
        """The row of a label."""
        return next(row for row in self.rows if row.label == label)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes of the runs, each with the label of its run."""
        return tuple(f"{row.label}: {note}" for row in self.rows[:-1] for note in row.notes)
