"""Result of a proof of quiet: shares of a box of parameters, and the boxes that it was divided into."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

from gearrattle.model import Model
from gearrattle.result import Result
from gearrattle.studies.quiet.branch_and_bound import OPEN, PROVEN, REFUTED, Part
from gearrattle.studies.quiet.edges import Edge

if TYPE_CHECKING:
    import pandas as pd

STATUS = ("proven", "refuted", "open")
"""Words of PROVEN, REFUTED and OPEN."""
LOW = " low"
HIGH = " high"
"""Suffixes of the ends of a range in the table of boxes."""


@dataclass(frozen=True)
class QuietProof(Result):
    """Where in a box of parameters a quiet motion is proven, where it is refuted, and what is open.

    Attributes
    ----------
    model
        the driveline.
    edges
        of the box: names, paths and ends.
    proven
        share of the box's volume in which a quiet motion exists and is stable: no gap opens or closes, no spring
        changes its stage, no friction slips.
    refuted
        share in which no motion stays in the state of rest without a gap that opens or closes.
    parts
        that fill the box, each parameter from -1 to 1.
    looked_at
        how many parts were looked at.
    is_complete
        whether the search ended by itself; it was stopped, or out of its budget, otherwise.
    notes
        what the user must know.

    Examples
    --------
    >>> model = gr.example("backlash_oscillator")
    >>> proof = gr.prove_quiet(model, {"torque.0.mean": (0.02, 0.2)})
    >>> round(proof.proven, 3), round(proof.refuted, 3), round(proof.open, 3)
    (0.759, 0.241, 0.0)
    """

    kind: ClassVar[str] = "proof of quiet"
    model: Model = field(repr=False, compare=False)
    edges: tuple[Edge, ...] = field(repr=False)
    proven: float
    refuted: float
    parts: tuple[Part, ...] = field(repr=False, compare=False)
    looked_at: int
    is_complete: bool
    notes: tuple[str, ...] = ()

    @property
    def open(self) -> float:
        """Share of the box's volume of which neither is shown."""
        return max(0.0, 1.0 - self.proven - self.refuted)

    @property
    def boxes(self) -> pd.DataFrame:
        """A DataFrame, one row per box: ends of every range [SI], status, reason and element, share of the volume.

        The ends of several paths that vary together are shares of their ranges, 0 to 1. The largest proven boxes come
        first, then the refuted and the open ones.
        """
        import pandas as pd

        parts = sorted(self.parts, key=lambda part: (part.status, -part.share))
        columns: dict[str, list[object]] = {}
        for axis, edge in enumerate(self.edges):
            columns[f"{edge.name}{LOW}"] = [edge.coordinate(0.5 + 0.5 * float(part.low[axis])) for part in parts]
            columns[f"{edge.name}{HIGH}"] = [edge.coordinate(0.5 + 0.5 * float(part.high[axis])) for part in parts]
        columns["status"] = [STATUS[part.status] for part in parts]
        columns["reason"] = [part.reason for part in parts]
        columns["element"] = [self.name_of(part.element) for part in parts]
        columns["share"] = [part.share for part in parts]
        return pd.DataFrame(columns)

    def name_of(self, element: int) -> str:
        """Return the name of an element; empty for none."""
        return self.model.elements[element].name if element >= 0 else ""

    def shares(self, status: int) -> dict[tuple[str, str], float]:
        """Return the share of every reason and element among parts of a status, the largest first."""
        shares: dict[tuple[str, str], float] = {}
        for part in self.parts:
            if part.status == status:
                key = part.reason, self.name_of(part.element)
                shares[key] = shares.get(key, 0.0) + part.share
        return dict(sorted(shares.items(), key=lambda item: -item[1]))


def proof_of(
    model: Model, edges: Sequence[Edge], parts: Sequence[Part], looked_at: int, notes: Sequence[str], *, ended: bool
) -> QuietProof:
    """Return the proof that the parts of a box make."""
    shares = {status: sum(part.share for part in parts if part.status == status) for status in (PROVEN, REFUTED, OPEN)}
    return QuietProof(
        model, tuple(edges), shares[PROVEN], shares[REFUTED], tuple(parts), looked_at, ended, tuple(notes)
    )
