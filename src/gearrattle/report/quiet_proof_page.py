"""A proof of quiet as a result: shares of the box, reasons why other parts are not quiet, the largest proven boxes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from gearrattle.json_types import json_value
from gearrattle.model.path_labels import path_label
from gearrattle.report.page import Section, figure_sections, notes_section
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.quiet_proof_figures import measure_of_edge, proof_charts
from gearrattle.report.presentation import ModelPresentation
from gearrattle.report.tables import Table
from gearrattle.studies.quiet import QuietProof
from gearrattle.studies.quiet.branch_and_bound import (
    CLIPS,
    ENDURES,
    FLOATS,
    OPEN,
    PROVEN,
    REFUTED,
    SLIPS,
    STAGES,
    UNDECIDED,
)
from gearrattle.studies.quiet.proof import STATUS
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_REASONS = {
    "": "its gap opens or closes",
    UNDECIDED: "would have to be divided further",
    STAGES: "leaves its stage of rest, which is no rattle",
    SLIPS: "its friction slips, or may slip",
    CLIPS: "its contact damping is clipped",
    FLOATS: "a body floats in a gap without load, or nothing rests",
    ENDURES: "not all motion is shown to decay",
}
_MEANING = (
    "Proven: at every point a quiet motion exists and is stable; no gap opens or closes, no spring changes its stage, "
    "no friction slips. Refuted: no motion that stays in the state of rest keeps all gaps as they are. Open: neither is"
    " shown."
)
_MOST_BOXES = 12


def _percent(share: float) -> str:
    """A share in per cent with one decimal; never rounded to 0 % or 100 %."""
    if 0.0 < share < 0.0005:
        return "< 0.1 %"
    if 0.9995 < share < 1.0 - 1e-12:
        return "> 99.9 %"
    return f"{100.0 * share:.1f} %"


class QuietProofPage(ModelPresentation[QuietProof]):
    """Presentation of a proof of quiet."""

    kind = "proof of quiet"
    is_interactive = True

    @property
    def sentence(self) -> str:
        proof = self.result
        if proof.proven >= 1.0 - 1e-12:
            return "Quiet is proven in the whole box: everywhere a quiet motion exists and is stable."
        words = f"A quiet motion is proven in {_percent(proof.proven)} of the box's volume, refuted in "
        words += f"{_percent(proof.refuted)}; {_percent(proof.open)} is open."
        largest = [item for status in (REFUTED, OPEN) for item in self._against(status)]
        reason, element, share = max(largest, key=lambda item: item[2], default=("", "", 0.0))
        if share and reason != UNDECIDED:
            subject = f"{element}: " if element else ""
            words += f" What stands against it most: {subject}{_REASONS[reason]} ({_percent(share)})."
        return words

    def _against(self, status: int) -> Iterator[tuple[str, str, float]]:
        """Yield reason, element and share of the box, for all parts with a status."""
        for (reason, element), share in self.result.shares(status).items():
            yield reason, element, share

    def sections(self) -> tuple[Section, ...]:
        summary = Section("summary", "Summary", self.sentence, (_MEANING,), tables=self.answer())
        figures = figure_sections(self.figures())
        boxes = Section("boxes", "Largest proven boxes", tables=(self._boxes(),))
        return summary, *figures, boxes, *notes_section(self.notes)

    def figures(self) -> list[Chart]:
        return proof_charts(self.result)

    def answer(self) -> tuple[Table, ...]:
        return self._shares(), self._ranges()

    def _shares(self) -> Table:
        rows = []
        for status, word in enumerate(STATUS):
            for reason, element, share in self._against(status):
                why = "" if status == PROVEN else _REASONS[reason]
                rows.append((word, _percent(share), element, why))
        return Table(("status", "share", "element", "why"), tuple(rows), frozenset({0, 2, 3}), "Shares of the volume")

    def _ranges(self) -> Table:
        rows = []
        for edge in self.result.edges:
            for path, low in edge.low.items():
                measure = measure_of_edge(self.result, type(edge)(path, {path: low}, {path: edge.high[path]}))
                ends = (numeral(end * measure.factor, 6) for end in (low, edge.high[path]))
                rows.append((edge.name if edge.path is None else path, measure.words, *ends, measure.unit))
        return Table(("range", "of", "low", "high", "unit"), tuple(rows), frozenset({0, 1, 4}), "Ranges")

    def _boxes(self) -> Table:
        proof = self.result
        proven = sorted((part for part in proof.parts if part.status == PROVEN), key=lambda part: -part.share)
        measures = [measure_of_edge(proof, edge) for edge in proof.edges]
        rows = []
        for part in proven[:_MOST_BOXES]:
            cells = []
            for axis, (edge, measure) in enumerate(zip(proof.edges, measures, strict=True)):
                ends = (edge.coordinate(0.5 + 0.5 * float(end[axis])) * measure.factor for end in (part.low, part.high))
                cells.append(" to ".join(numeral(end, 5) for end in ends))
            rows.append((*cells, _percent(part.share)))
        left = len(proven) - len(rows)
        note = f"{counted(left, 'smaller box', 'smaller boxes')} more: in the numbers." if left > 0 else ""
        head = (*(measure.title for measure in measures), "share")
        return Table(head, tuple(rows), frozenset(), note=note)

    def content(self) -> dict[str, Any]:
        proof = self.result
        return {
            "model": proof.model.name,
            "units": proof.model.units,
            "proven": proof.proven,
            "refuted": proof.refuted,
            "open": proof.open,
            "complete": proof.is_complete,
            "boxes": len(proof.parts),
            "looked_at": proof.looked_at,
            "ranges": {
                edge.name: {path: [low, edge.high[path]] for path, low in edge.low.items()} for edge in proof.edges
            },
            "shares": [
                {"status": word, "reason": reason, "element": element, "share": json_value(share)}
                for status, word in enumerate(STATUS)
                for reason, element, share in self._against(status)
            ],
            "notes": list(proof.notes),
        }

    def numbers(self) -> xr.Dataset:
        import xarray as xr

        proof = self.result
        units: dict[str, str] = {}
        for edge in proof.edges:
            unit = path_label(edge.path, proof.model).unit if edge.path else ""
            units |= {f"{edge.name} {end}": unit or "1" for end in ("low", "high")}
        variables: dict[str, Any] = {}
        for name, column in proof.boxes.items():
            attributes = {"units": units.get(str(name), "1")} if column.dtype.kind == "f" else {}
            variables[str(name)] = ("box", column.to_numpy(), attributes)
        shares = {"proven": proof.proven, "refuted": proof.refuted, "open": proof.open}
        return xr.Dataset(variables, attrs={"model": proof.model.name, **shares})
