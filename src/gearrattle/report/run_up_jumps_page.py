"""Jumps of a run-up and a run-down compared with those of the branches, as a result."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gearrattle.json_types import json_value
from gearrattle.model.path_labels import in_shown_unit
from gearrattle.orbits import RunUpJumps
from gearrattle.orbits.jumps import Jump
from gearrattle.report.branches_page import BranchesPage
from gearrattle.report.page import Section, figure_sections, notes_section
from gearrattle.report.plots.axis_names import Measure
from gearrattle.report.plots.branches_figure import measure
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.numerals import numeral, quantity
from gearrattle.report.plots.run_up_jumps_figure import run_up_chart
from gearrattle.report.presentation import ModelPresentation
from gearrattle.report.tables import Table
from gearrattle.wording import listed

if TYPE_CHECKING:
    import xarray as xr

_NOTE = (
    "A run jumps where its deflection over a cycle becomes nearer to that of another motion, on which it settles, than "
    "to that of the motion that has ended, or is unstable. A jump belongs to the last event before it at which a "
    "motion ended that the run was on. The slower the run, the nearer to the event it jumps: at a smooth fold the "
    "delay falls with the rate to the power 2/3."
)


def _way(upward: bool) -> str:
    """The word for a run-up or a run-down."""
    return "up" if upward else "down"


class RunUpJumpsPage(ModelPresentation[RunUpJumps]):
    """Jumps of a run-up and a run-down."""

    kind = "jumps of run-ups"
    is_interactive = True

    @property
    def sentence(self) -> str:
        begun = {run.upward for run in self.result.envelopes}
        ends = dict(zip((True, False), sorted(self.result.branch.range), strict=True))
        if not begun:
            words = listed([self._shown.with_unit(end, 6) for end in ends.values()])
            return f"No run begins: no stable motion is known at either end of the range, {words}."
        missing = [(up, self._shown.with_unit(end, 6)) for up, end in ends.items() if up not in begun]
        not_begun = [f" No run {_way(up)} begins: no stable motion is known at {end}." for up, end in missing]
        return "".join([self._seen(), *not_begun])

    def _seen(self) -> str:
        """What the runs show."""
        factor, unit = self._speed
        rate = quantity(self.result.rate * factor, f"{unit}/s" if unit else "")
        jumps = self.result.jumps
        seen = [jump for jump in jumps if not jump.words]
        parts = [
            f"{_way(jump.upward)} at {self._shown.with_unit(jump.value, 6)}, "
            f"{quantity(jump.delay * factor, unit, 3)} or {numeral(jump.periods, 3)} T behind the {jump.kind}"
            for jump in seen
        ]
        if parts:
            return f"At the rate {rate} the motion jumps {listed(parts)}."
        if not jumps:
            return f"At the rate {rate} no run passes an event at which a motion of the branches ends."
        reasons = "; ".join(dict.fromkeys(jump.words for jump in jumps))
        return f"At the rate {rate} no jump is known: {reasons}."

    @property
    def _shown(self) -> Measure:
        return measure(self.result.branch)

    @property
    def _speed(self) -> tuple[float, str]:
        """The factor and the unit of a difference of speeds."""
        return in_shown_unit("excitation.speed", "rad/s" if self.result.model.units == "SI" else "")

    def figures(self) -> tuple[Chart, ...]:
        return (run_up_chart(self.result),) if self.result.envelopes else ()

    def sections(self) -> tuple[Section, ...]:
        first = Section("summary", "Summary", self.sentence, tables=(self._jump_table(),))
        tables = BranchesPage(self.result.branch).tables_of_branch()
        branch = Section("branch", "Branches", tables=tables, folds=True)
        return first, *figure_sections(self.figures()), branch, *notes_section(self.notes)

    def answer(self) -> tuple[Table, ...]:
        return self._jump_table(), *BranchesPage(self.result.branch).answer()

    def _jump_table(self) -> Table:
        (_, speed) = self._speed
        shown = self._shown
        unit = f" [{shown.unit}]" if shown.unit else ""
        head = (
            "going",
            "event",
            f"at{unit}",
            f"jumps at{unit}",
            f"delay{f' [{speed}]' if speed else ''}",
            "delay [T]",
            "decided by",
            "",
        )
        rows = tuple(self._row(jump) for jump in self.result.jumps)
        return Table(head, rows, frozenset({0, 1, 6, 7}), "Jumps beside those of the branches", _NOTE)

    def _row(self, jump: Jump) -> tuple[str, ...]:
        factor = self._shown.factor
        return (
            _way(jump.upward),
            jump.kind,
            numeral(jump.end * factor, 8),
            numeral(jump.value * factor, 6),
            numeral(jump.delay * self._speed[0], 4),
            numeral(jump.periods, 4),
            jump.clearance,
            jump.words,
        )

    def content(self) -> dict[str, Any]:
        jumps = self.result
        keys = {
            "kind": "event",
            "end": "end",
            "value": "jump",
            "delay": "delay",
            "periods": "periods",
            "clearance": "clearance",
            "settles": "settles",
        }
        return {
            "model": jumps.model.name,
            "path": jumps.branch.path,
            "rate": jumps.rate,
            "jumps": [
                {
                    "going": _way(jump.upward),
                    **{key: json_value(getattr(jump, name)) for name, key in keys.items()},
                    "why_none": jump.words,
                }
                for jump in jumps.jumps
            ],
        }

    def numbers(self) -> xr.Dataset:
        return self.result.data
