"""Branches of periodic motions as a result: ranges of stable motions, jumps, and events such as grazings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.assembly import assemble
from gearrattle.json_types import json_value
from gearrattle.orbits import Branch, Orbit
from gearrattle.orbits.stability_ranges import CHANGES, Range, StabilityLoss, losses_of, ranges_of, slices_of
from gearrattle.report.event_families import families_of
from gearrattle.report.motion_at_point import motion_at_point
from gearrattle.report.moving_table import moving_table
from gearrattle.report.numbers import write_csv
from gearrattle.report.page import Page, Section, figure_sections, notes_section
from gearrattle.report.plots.branches_figure import branch_charts, circle_chart, measure, modulus_chart
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.periodic_motion_figures import selected_charts
from gearrattle.report.plots.sweeps_of_motions import swept_chart
from gearrattle.report.presentation import ModelPresentation
from gearrattle.report.record_dataset import texts
from gearrattle.report.stable_motion_sentences import counts_of, counts_words, jumps_words, some
from gearrattle.report.swept_tables import changes_words, jump_table, run_table, stretch_table, value_words
from gearrattle.report.tables import Table, shortened
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_MOST_ORBITS = 9
_FAMILY = 3  # neighbouring jumps, from which number on they are shown as a range
_MOST_EVENTS = 40  # rows of events on a terminal
_MOST_DIGITS = 10
_NARROW = 1e-3  # share of the range: narrower gaps are not shown
_MULTIPLIER = "multiplier"
_SO_FAR = ", as far as the time sufficed"


class BranchesPage(ModelPresentation[Branch]):
    """Branches over a value of the model."""

    kind = "branches"
    is_interactive = True

    def __init__(self, result: Branch, deviations: Sequence[float] | None = None) -> None:
        """Present branches; with tolerances, also the standard deviations of their events [SI]."""
        super().__init__(result)
        self._deviations = deviations

    @cached_property
    def _ranges(self) -> list[Range]:
        return ranges_of(self.result)

    @cached_property
    def _losses(self) -> list[StabilityLoss]:
        return losses_of(self.result)

    @cached_property
    def sentence(self) -> str:
        """The number of stable motions by range of the value, and the values at which the motion jumps."""
        branch = self.result
        counts = counts_of(branch, self._ranges)
        so_far = branch.sweeps is not None and not branch.sweeps.is_complete
        parts = [f"Over {measure(branch).words} {self._span(*sorted(branch.range))}{_SO_FAR if so_far else ''}: "]
        parts[0] += f"{counts_words(counts, self._span)}."
        parts += [jumps_words(upward, self._jump_words(upward)) for upward in (True, False)]
        if not any(parts[1:]) and self._is_known:
            parts.append("Nowhere does the motion change abruptly.")
        if unknown := self._words([loss for loss in self._losses if loss.jumps is None], with_kind=True):
            parts.append(f"Whether the motion jumps is not known at {some(unknown)}.")
        if branch.sweeps is None and (gaps := [self._span(*gap) for gap in _gaps(branch)]):
            parts.append(f"No branch leads through the range {some(gaps)}.")
        return " ".join(part for part in parts if part)

    @property
    def further(self) -> tuple[str, ...]:
        """Sentences on the changes at the jumps, and on the parameters that shift the jumps."""
        sweeps = self.result.sweeps
        changes = [] if sweeps is None else changes_words(self.result, sweeps)
        return (*changes, *([self._moved_by] if self._moved_by else []))

    @cached_property
    def _moved_by(self) -> str:
        """Return a sentence on the numbers that shift the first jump; empty where they are not known."""
        if not self._moving.rows:
            return ""
        value, _, number, change = self._moving.rows[0]
        unit = f" {measure(self.result).unit}".rstrip()
        return f"10 % more of {number} moves the jump at {value}{unit} by {change}{unit}."

    @property
    def _is_known(self) -> bool:
        """Whether there are branches or sweeps, so that jumps can be listed."""
        return bool(self.result.curves) or self.result.sweeps is not None

    def _jump_words(self, upward: bool) -> list[str]:
        """Return the values at which the motion jumps in one direction."""
        sweeps = self.result.sweeps
        if sweeps is not None:
            return [value_words(self.result, jump) for jump in sweeps.jumps if jump.upward == upward]
        return self._words([loss for loss in self._losses if loss.jumps and loss.upward == upward])

    def _words(self, losses: Sequence[StabilityLoss], *, with_kind: bool = False) -> list[str]:
        """Values of losses of stability, each once; of three or more that lie near each other the range."""
        branch = self.result
        shown = measure(self.result)
        width = branch.narrow * abs(branch.range[1] - branch.range[0])
        groups: list[list[StabilityLoss]] = []
        for loss in sorted(losses, key=lambda one: one.value):
            if groups and loss.value - groups[-1][-1].value < width:
                groups[-1].append(loss)
            else:
                groups.append([loss])
        words = []
        for group in groups:
            own = [f"{shown.with_unit(one.value, 5)}{f' ({one.kind})' if with_kind else ''}" for one in group]
            own = list(dict.fromkeys(own))
            if len(own) < _FAMILY:
                words += own
            else:
                low, high = (one.value * shown.factor for one in (group[0], group[-1]))
                digits = _digits(low, high, least=5)
                last = shown.with_unit(group[-1].value, digits)
                words.append(f"{numeral(low, digits)} to {last} ({counted(len(group), 'jump')})")
        return words

    @cached_property
    def _moving(self) -> Table:
        return moving_table(self.result)

    def _span(self, low: float, high: float) -> str:
        shown = measure(self.result)
        digits = _digits(low * shown.factor, high * shown.factor, least=4)
        return f"from {numeral(low * shown.factor, digits)} to {shown.with_unit(high, digits)}"

    def sections(self) -> tuple[Section, ...]:
        branch = self.result
        sweeps = self.result.sweeps
        answer: tuple[Table, ...] = ()
        details: tuple[Section, ...] = ()
        if sweeps is not None:
            answer = (jump_table(branch, sweeps), stretch_table(branch, sweeps))
            details = (Section("runs", "Exact runs", tables=(run_table(branch, sweeps),), folds=True),)
        ranges = (self._range_table(),) if branch.curves else ()
        words = (*self.further, *self._setting())
        first = Section("summary", "Summary", self.sentence, words, tables=(*answer, *ranges))
        moving = Section("moving", "What moves the jumps", tables=(self._moving,))
        events = Section("events", "Events", tables=(self._event_table(),), folds=True)
        return (
            first,
            *(() if sweeps is None else figure_sections([swept_chart(branch, sweeps)])),
            *(self._branch_figures() if branch.curves else ()),
            events,
            *((moving,) if self._moving.rows else ()),
            *details,
            *notes_section(self.notes),
        )

    def _branch_figures(self) -> Iterator[Section]:
        """Figures of the branches that were followed."""
        branch = self.result
        yield Section("branches", "Branches", charts=tuple(branch_charts(branch)))
        yield from figure_sections([modulus_chart(branch)])
        yield Section("motions", "Phase planes", charts=tuple(self._orbit_charts()))
        yield from figure_sections([circle_chart(branch)])

    def page(self) -> Page:
        """Return the page; below the branches it shows the motion at the point under the pointer."""
        page = super().page()
        sections = (
            replace(section, inlay=motion_at_point(self.result)) if section.key == "branches" else section
            for section in page.sections
        )
        return replace(page, sections=tuple(sections))

    def answer(self) -> tuple[Table, ...]:
        sweeps = self.result.sweeps
        of_sweeps = () if sweeps is None else (stretch_table(self.result, sweeps),)
        if not self.result.curves:
            return of_sweeps
        ranges, events = self.tables_of_branch()
        return *of_sweeps, shortened(ranges), shortened(events, _MOST_EVENTS)

    def tables_of_branch(self) -> tuple[Table, Table]:
        """Return the ranges of constant stability and the events, with all rows."""
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
            **({} if branch.sweeps is None else {"sweeps": _swept(branch)}),
            "events": [json_value(dict(zip(events, row, strict=True))) for row in zip(*events.values(), strict=True)],
        }

    def numbers(self) -> xr.Dataset:
        return self._dataset

    @cached_property
    def _dataset(self) -> xr.Dataset:
        """The Dataset of the branch with real and imaginary parts, as netCDF has no complex numbers; and events."""
        branch = self.result
        data = self.result.data
        multiplier = data[_MULTIPLIER]
        added: dict[str, Any] = {
            "multiplier_real": (multiplier.dims, multiplier.values.real.copy()),
            "multiplier_imaginary": (multiplier.dims, multiplier.values.imag.copy()),
        }
        unit = {"units": data["value"].attrs["units"]}
        for name, column in branch.events.items():
            values = column.to_numpy()
            if name in ("kind", "clearance", "grazing"):
                values = texts(map(str, values))
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

    def _setting(self) -> tuple[str, ...]:
        branch = self.result
        if not branch.curves:
            return ()
        points = counted(len(branch.points), "point")
        rows = len(branch.events)
        branches = counted(len(branch.curves), "branch", "branches")
        begin = measure(branch).with_unit(branch.range[0])
        return (
            f"{branches} of {points}, {counted(rows, 'event')} between them, located to rounding. The first branch "
            f"goes through the motion at {begin} that repeats after {branch.cycles} T.",
        )

    def _range_table(self) -> Table:
        shown = measure(self.result)
        branch = self.result
        kept, left_out = _wide_ranges(branch, self._ranges)
        rows = tuple(
            (
                f"{r.branch}",
                f"{branch.curves[r.branch].cycles} T",
                *_range_words(r.begin * shown.factor, r.end * shown.factor),
                "stable" if r.stable else "unstable",
                r.cause,
            )
            for r in kept
        )
        unit = f" [{shown.unit}]" if shown.unit else ""
        head = ("branch", "repeats after", f"from{unit}", f"to{unit}", "", "ends at")
        note = "Each branch in the order in which it was followed. At a fold it turns back, so a range ends there."
        if left_out:
            ranges = counted(left_out, "range")
            note += f" {ranges} narrower than {branch.narrow:g} of the whole left out; results.nc has all points."
        return Table(head, rows, frozenset({4, 5}), "Ranges of one stability", note)

    def _event_table(self) -> Table:
        # one row per family of neighbouring events, or a single event
        shown = measure(self.result)
        rows = list[tuple[str, ...]]()
        events = self.result.events
        is_whole = self._deviations is not None
        for family in () if is_whole else families_of(self.result):
            if len(family.rows) == 1:
                rows.append(self._event_row(family.rows[0]))
                continue
            numbers = sorted(set(events["branch"].iloc[list(family.rows)]))
            branches = f"{numbers[0]}" if len(numbers) == 1 else f"{numbers[0]} to {numbers[-1]}"
            low = family.low * shown.factor
            high = family.high * shown.factor
            span = " to ".join(dict.fromkeys(numeral(end, 8) for end in (low, high)))
            rows.append((_rows_words(family.rows), branches, family.words, span, "", ""))
        # with standard deviations every event has its own row
        if is_whole:
            rows = [self._event_row(row) for row in range(len(events))]
        # columns and the note on families
        head: tuple[str, ...] = ("row", "branch", "event", shown.title, "at clearance", "at the corner")
        words = frozenset({2, 4, 5})
        note = ""
        if len(rows) < len(events):
            note = (
                f"Events nearer to each other than {self.result.narrow:g} of the range stand in one line; summary.json "
                "has each of them."
            )
        # the column of standard deviations under the tolerances
        if self._deviations is not None:
            unit = f" [{shown.unit}]" if shown.unit else ""
            head = (*head, f"standard deviation{unit}")
            deviations = (numeral(deviation * shown.factor, 4) for deviation in self._deviations)
            rows = [(*row, deviation) for row, deviation in zip(rows, deviations, strict=True)]
            note = "Standard deviation under the tolerances, to first order; a dash: the event has none."
        return Table(head, tuple(rows), words, "Events", note)

    def _event_row(self, row: int) -> tuple[str, ...]:
        """An event by itself."""
        event = self.result.events.iloc[row]
        how = "gradient jumps" if event["collision"] else event["grazing"]
        value = numeral(event["value"] * measure(self.result).factor, 8)
        return f"{row}", f"{event['branch']}", event["kind"], value, event["clearance"], how

    def _orbit_charts(self) -> list[Chart]:
        return selected_charts(self._selected())

    def _selected(self) -> Sequence[tuple[str, Orbit]]:
        """Motions at the ends of the first branch, and at the events that change the stability."""
        branch = self.result
        shown = measure(self.result)
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


def _swept(branch: Branch) -> dict[str, Any]:
    """The sweeps for summary.json [SI]."""
    sweeps = branch.sweeps
    names = assemble(branch.model).layout.clearance_names
    assert sweeps is not None
    # the stable motions of both sweeps, by value
    motions = [
        {
            "going": "up" if upward else "down",
            "value": run.value,
            "cycles": run.cycles,
            "periods": run.periods,
            "verdict": run.headline,
            "rms": dict(zip(names, run.rms.tolist(), strict=True)),
            "rattles": [name for name, word in zip(names, run.severities, strict=True) if word == "rattles"],
        }
        for upward, runs in ((True, sweeps.up), (False, sweeps.down))
        for run in runs
    ]
    # jumps with the rms deflection before and after
    jumps = [
        {
            "going": "up" if jump.upward else "down",
            "value": jump.value,
            "error": jump.error,
            "clearance": names[jump.clearance],
            "rms": [float(one.rms[jump.clearance]) for one in (jump.before, jump.after)],
            "event": jump.kind,
        }
        for jump in sweeps.jumps
    ]
    # ranges of two coexisting motions
    coexistence = [list(one) for one in sweeps.coexistence]
    return {"complete": sweeps.is_complete, "two_motions": coexistence, "jumps": jumps, "motions": motions}


def _gaps(branch: Branch) -> list[tuple[float, float]]:
    """The parts of the range without a branch, except parts narrower than ``_NARROW``."""
    low, high = sorted(branch.range)
    of_curves = [[*curve.points, *(event.point for event in curve.events)] for curve in branch.curves]
    values = [[point.parameter for point in points] for points in of_curves]
    reached = low
    gaps = list[tuple[float, float]]()
    for begin, end in [*sorted((min(own), max(own)) for own in values), (high, high)]:
        if begin - reached > _NARROW * (high - low):
            gaps.append((reached, begin))
        reached = max(reached, end)
    return gaps


def _wide_ranges(branch: Branch, ranges: Sequence[Range]) -> tuple[list[Range], int]:
    """Ranges that are not narrow, and the number of the narrow ones. The widest range of a branch is always kept."""
    width = branch.narrow * abs(branch.range[1] - branch.range[0])
    widest = [
        max((one for one in ranges if one.branch == number), key=lambda one: abs(one.end - one.begin), default=None)
        for number in range(len(branch.curves))
    ]
    kept = [one for one in ranges if abs(one.end - one.begin) >= width or any(one is other for other in widest)]
    return kept, len(ranges) - len(kept)


def _rows_words(rows: Sequence[int]) -> str:
    """Rows of a family: "3", "3 to 5", "3, 5 to 7"."""
    parts: list[list[int]] = []
    for row in rows:
        if parts and row == parts[-1][-1] + 1:
            parts[-1].append(row)
        else:
            parts.append([row])
    return ", ".join(f"{part[0]}" if len(part) == 1 else f"{part[0]} to {part[-1]}" for part in parts)


def _digits(low: float, high: float, least: int) -> int:
    """Return the number of digits with which the ends of a range can be distinguished."""
    return next((n for n in range(least, _MOST_DIGITS) if numeral(low, n) != numeral(high, n)), _MOST_DIGITS)


def _range_words(begin: float, end: float) -> tuple[str, str]:
    """Both ends of a range, with at least six digits."""
    digits = _digits(begin, end, least=6)
    return numeral(begin, digits), numeral(end, digits)
