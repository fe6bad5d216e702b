"""Branches of periodic motions as a result: where motions are stable, where they jump, what they touch.

Takes a Branch; gives its presentation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.json_types import json_value
from gearrattle.orbits import Branch, Orbit
from gearrattle.orbits.stability import CHANGES, Loss, Range, losses_of, ranges_of, slices_of
from gearrattle.report.motion_at_point import motion_at_point
from gearrattle.report.moving_table import moving_table
from gearrattle.report.numbers import write_csv
from gearrattle.report.page import Page, Section, figure_sections, notes_section
from gearrattle.report.plots.branches import branch_charts, circle_chart, measure, modulus_chart
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.orbits import selected_charts
from gearrattle.report.presentation import ModelPresentation
from gearrattle.report.tables import Table, shortened
from gearrattle.wording import counted, listed

if TYPE_CHECKING:
    import xarray as xr

_MOST_SAID, _MOST_ORBITS = 4, 9
_MOST_EVENTS = 40  # rows, by which options name events, on a terminal
_MOST_DIGITS = 10
_NARROW = 1e-3  # of a range: a gap that is not told
_FOLDED_FROM = 12
_MULTIPLIER = "multiplier"


class BranchesPage(ModelPresentation[Branch]):
    """Branches over a value of the model."""

    kind = "branches"
    is_interactive = True

    def __init__(self, result: Branch, deviations: Sequence[float] | None = None) -> None:
        """Present branches; with the standard deviations of their events [SI], if tolerances were named."""
        super().__init__(result)
        self._deviations = deviations

    @cached_property
    def _ranges(self) -> list[Range]:
        return ranges_of(self.result)

    @cached_property
    def _losses(self) -> list[Loss]:
        return losses_of(self.result)

    @cached_property
    def sentence(self) -> str:
        branch = self.result
        shown, ends = measure(branch), sorted(branch.range)
        number = counted(len(branch.curves), "branch", "branches")
        parts = [f"{number} over {shown.words} {self._span(*ends)}: {self._stable_words()}."]
        for upward, way in ((True, "Going up"), (False, "Going down")):
            values = [shown.with_unit(loss.value, 5) for loss in self._losses if loss.jumps and loss.upward == upward]
            if values:  # those of copies of a motion once
                parts.append(f"{way} the motion jumps at {_some(list(dict.fromkeys(values)))}.")
        unknown = [f"{shown.with_unit(loss.value, 5)} ({loss.kind})" for loss in self._losses if loss.jumps is None]
        if unknown:
            parts.append(f"Whether the motion jumps is not known at {_some(list(dict.fromkeys(unknown)))}.")
        if gaps := [self._span(*gap) for gap in _gaps(branch)]:
            parts.append(f"No branch leads through the range {_some(gaps)}.")
        return " ".join(parts)

    @cached_property
    def _moving(self) -> Table:
        return moving_table(self.result)

    def _stable_words(self) -> str:
        stable = [self._span(*sorted((r.begin, r.end))) for r in self._ranges if r.stable]
        unstable = sum(not r.stable for r in self._ranges)
        if not stable:
            return "no motion followed is stable"
        if not unstable:
            return "every motion followed is stable"
        return f"stable motions {_some(stable)}, {counted(unstable, 'range')} of unstable ones"

    def _span(self, low: float, high: float) -> str:
        shown = measure(self.result)
        digits = _digits(low * shown.factor, high * shown.factor, least=4)
        return f"from {numeral(low * shown.factor, digits)} to {shown.with_unit(high, digits)}"

    def sections(self) -> tuple[Section, ...]:
        branch = self.result
        first = Section("summary", "Summary", self.sentence, (self._setting(),), tables=(self._range_table(),))
        events = Section("events", "Events", tables=(self._event_table(),), folds=True)
        figures = [
            Section("branches", "Branches", charts=tuple(branch_charts(branch))),
            *figure_sections([modulus_chart(branch)]),
            Section("motions", "Phase planes", charts=tuple(self._orbit_charts())),
            *figure_sections([circle_chart(branch)]),
        ]
        moving = Section("moving", "What moves the jumps", tables=(self._moving,))
        tables = (events, moving) if self._moving.rows else (events,)
        return first, *figures, *tables, *notes_section(self.notes)

    def page(self) -> Page:
        """Return the page; below the branches it shows the motion at the point that is pointed at."""
        page = super().page()
        sections = (
            replace(section, inlay=motion_at_point(self.result)) if section.key == "branches" else section
            for section in page.sections
        )
        return replace(page, sections=tuple(sections))

    def answer(self) -> tuple[Table, ...]:
        ranges, events = self.tables_of_branch()
        return shortened(ranges), shortened(events, _MOST_EVENTS)

    def tables_of_branch(self) -> tuple[Table, Table]:
        """Return the ranges of one stability and the events, with all rows."""
        return self._range_table(), self._event_table()

    def content(self) -> dict[str, Any]:
        branch = self.result
        table = branch.events
        events = (table if self._deviations is None else table.assign(deviation=self._deviations)).to_dict(
            orient="list"
        )
        return {
            "model": branch.model.name,
            "path": branch.path,
            "unit": str(branch.data["value"].attrs["units"]),
            "range": list(branch.range),
            "cycles": branch.cycles,
            "branches": [{"cycles": curve.cycles, "points": len(curve.points)} for curve in branch.curves],
            "ranges": [
                {"branch": r.branch, "from": r.begin, "to": r.end, "stable": r.stable, "end": r.cause}
                for r in self._ranges
            ],
            "jumps": [
                {"branch": j.branch, "value": j.value, "going": "up" if j.upward else "down", "event": j.kind}
                for j in self._losses
                if j.jumps
            ],
            "events": [json_value(dict(zip(events, row, strict=True))) for row in zip(*events.values(), strict=True)],
        }

    def numbers(self) -> xr.Dataset:
        return self._dataset

    @cached_property
    def _dataset(self) -> xr.Dataset:
        """The Dataset of the branch with real and imaginary parts, as netCDF has no complex numbers; and events."""
        branch, data = self.result, self.result.data
        multiplier = data[_MULTIPLIER]
        added: dict[str, Any] = {
            "multiplier_real": (multiplier.dims, multiplier.values.real.copy()),
            "multiplier_imaginary": (multiplier.dims, multiplier.values.imag.copy()),
        }
        unit = {"units": data["value"].attrs["units"]}
        for name, column in branch.events.items():
            values = column.to_numpy()
            if name in ("kind", "clearance", "grazing"):
                values = np.array([str(value) for value in values], dtype=np.str_)
            added[f"event_{name}"] = ("event", values, unit if name == "value" else {})
        if self._deviations is not None:
            added["event_deviation"] = ("event", np.array(self._deviations), unit)
        return data.drop_vars(_MULTIPLIER).assign(added)

    def write(self, path: Path) -> None:
        """Write a new file; as CSV a row for every point."""
        if path.suffix == ".csv":
            write_csv(self._table(), path)
        else:
            super().write(path)

    def _table(self) -> xr.Dataset:
        """The points with a column for every number."""
        import xarray as xr

        data = self._dataset
        columns = {str(name): data[name] for name in data.data_vars if data[name].dims == ("point",)}
        for name in ("lowest", "highest", "mean", "peak_to_peak"):
            for label in data["clearance"].values:
                columns[f"{name}.{label}"] = data[name].sel(clearance=label, drop=True)
        for i in range(data.sizes["mode"]):
            for part in ("real", "imaginary"):
                columns[f"multiplier.{i + 1}.{part}"] = data[f"multiplier_{part}"].isel(mode=i, drop=True)
        return xr.Dataset(columns)

    def _setting(self) -> str:
        branch = self.result
        points = counted(len(branch.points), "point")
        rows = len(branch.events)
        return (
            f"{points}, {counted(rows, 'event')} between them, located to rounding. The first branch goes through the "
            f"motion at {measure(branch).with_unit(branch.range[0])} that repeats after {branch.cycles} T."
        )

    def _range_table(self) -> Table:
        shown = measure(self.result)
        rows = tuple(
            (
                f"{r.branch}",
                f"{self.result.curves[r.branch].cycles} T",
                *_range_words(r.begin * shown.factor, r.end * shown.factor),
                "stable" if r.stable else "unstable",
                r.cause,
            )
            for r in self._ranges
        )
        unit = f" [{shown.unit}]" if shown.unit else ""
        head = ("branch", "repeats after", f"from{unit}", f"to{unit}", "", "ends at")
        note = "Each branch in the order in which it was followed. At a fold it turns back, so a range ends there."
        return Table(head, rows, frozenset({4, 5}), "Ranges of one stability", note)

    def _event_table(self) -> Table:
        shown, rows = measure(self.result), list[tuple[str, ...]]()
        for row, number, kind, value, _, name, collision, grazing, _ in self.result.events.itertuples():
            how = "gradient jumps" if collision else grazing
            rows.append((f"{row}", f"{number}", kind, numeral(value * shown.factor, 8), name, how))
        head: tuple[str, ...] = ("row", "branch", "event", shown.title, "at clearance", "at the corner")
        words, note = frozenset({2, 4, 5}), ""
        if self._deviations is not None:
            unit = f" [{shown.unit}]" if shown.unit else ""
            head = (*head, f"standard deviation{unit}")
            deviations = (numeral(deviation * shown.factor, 4) for deviation in self._deviations)
            rows = [(*row, deviation) for row, deviation in zip(rows, deviations, strict=True)]
            note = "Standard deviation under the tolerances, to first order; a dash: the event has none."
        return Table(head, tuple(rows), words, "Events", note)

    def _orbit_charts(self) -> list[Chart]:
        return selected_charts(self._selected())

    def _selected(self) -> Sequence[tuple[str, Orbit]]:
        """Motions at the ends of the first branch, and at the events that change the stability."""
        branch, shown = self.result, measure(self.result)
        first = slices_of(branch)[0]
        chosen = [(float(branch.points[i].parameter), "end", branch.orbit(i)) for i in (first.start, first.stop - 1)]
        of_curves = [
            (event, curve.cycles)
            for curve, events in zip(branch.curves, branch.events_of_curves, strict=True)
            for event in events
        ]
        changing = [(event, cycles) for event, cycles in of_curves if event.kind in CHANGES]
        for event, cycles in changing[: _MOST_ORBITS - len(chosen)]:
            chosen.append((event.point.parameter, event.kind, branch.orbit_at(event.point, cycles)))
        ordered = [chosen[0], *chosen[2:], chosen[1]]
        return [(f"{shown.with_unit(value, 5)}, {word}", orbit) for value, word, orbit in ordered]


def _gaps(branch: Branch) -> list[tuple[float, float]]:
    """The parts of the range through which no branch leads, those narrower than a thousandth of it left out."""
    low, high = sorted(branch.range)
    of_curves = [[*curve.points, *(event.point for event in curve.events)] for curve in branch.curves]
    values = [[point.parameter for point in points] for points in of_curves]
    reached, gaps = low, list[tuple[float, float]]()
    for begin, end in [*sorted((min(own), max(own)) for own in values), (high, high)]:
        if begin - reached > _NARROW * (high - low):
            gaps.append((reached, begin))
        reached = max(reached, end)
    return gaps


def _some(words: Sequence[str]) -> str:
    """The first few, and how many more there are."""
    more = len(words) - _MOST_SAID
    return listed([*words[:_MOST_SAID], *([f"{more} more"] if more > 0 else [])])


def _digits(low: float, high: float, least: int) -> int:
    """How many digits tell the ends of a range apart."""
    return next((n for n in range(least, _MOST_DIGITS) if numeral(low, n) != numeral(high, n)), _MOST_DIGITS)


def _range_words(begin: float, end: float) -> tuple[str, str]:
    """Both ends of a range, with at least six digits."""
    digits = _digits(begin, end, least=6)
    return numeral(begin, digits), numeral(end, digits)
