"""Branches of periodic motions over a value of the model: their swing and their stability.

Stable motions are solid lines, unstable ones dashed lines; every kind of event has its own shape.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble
from gearrattle.engine.periodic.events.event_record import BREAKING, DOUBLING, FOLD, GRAZING, NEIMARK_SACKER, PATTERN
from gearrattle.model import Model
from gearrattle.model.path_labels import path_label
from gearrattle.orbits import Branch
from gearrattle.orbits.family_ends import EDGE
from gearrattle.orbits.stability_ranges import CHANGES, Course, courses_of, slices_of
from gearrattle.report.plots.axis_names import Measure, measure_at
from gearrattle.report.plots.chart import Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.corner_marks import units_of
from gearrattle.report.plots.motion_window import Scale, scale
from gearrattle.report.plots.palette import CENTRE, COLOURS, INK
from gearrattle.report.plots.unit_circle import outside_words, unit_circle
from gearrattle.trajectory import Array
from gearrattle.wording import counted

EVENTS = {
    FOLD: Key(FOLD, INK, "square"),
    DOUBLING: Key(DOUBLING, INK, "diamond"),
    BREAKING: Key(BREAKING, INK, "triangle"),
    NEIMARK_SACKER: Key(NEIMARK_SACKER, INK, "circle"),
    GRAZING: Key(GRAZING, INK, "cross"),
    PATTERN: Key(PATTERN, INK, "plus"),
    "mean at corner": Key("mean at corner", INK, "inverted triangle"),
    EDGE: Key(EDGE, INK, "star"),
}
"""Shape and words for every kind of event."""
_OTHER = Key("other event", INK, "star")
_STABLE = Key("stable", INK, dash="solid")
_UNSTABLE = Key("unstable", INK, dash="dashed")
_MOST_PANELS = 6
_MOST_NAMED = 6
_LOG_FROM = 10.0
"""Largest modulus above which the axis is logarithmic."""


def measure(branch: Branch) -> Measure:
    """Return what the value is called, and the unit it is shown in."""
    return measure_over(branch.model, branch.path, branch.range)


def measure_over(model: Model, path: str, ends: tuple[float, float]) -> Measure:
    """Return what the value at a path is called, and the unit in which a range of it is shown."""
    label = path_label(path, model)
    return measure_at(path, label.words, label.unit, max(map(abs, ends)))


@dataclass(frozen=True)
class _Drawing:
    """A branch, with the parts that all figures over the parameter have in common."""

    branch: Branch

    @cached_property
    def courses(self) -> list[Course]:
        """Every branch from node to node."""
        return courses_of(self.branch)

    @cached_property
    def values(self) -> tuple[Array, Array]:
        """The parameter at points and at events, as it is shown."""
        factor = measure(self.branch).factor
        return self.branch.data["value"].values * factor, self.branch.events["value"].to_numpy(np.float64) * factor

    def lines(self, at_points: Array, at_events: Array) -> list[Line]:
        """Draw a quantity along all branches: stable parts solid, the others dashed."""
        lines = []
        for number, course in enumerate(self.courses):
            x = course.value * measure(self.branch).factor
            y = np.array([at_points[i] if e < 0 else at_events[e] for i, e in course.nodes])
            for is_stable in (True, False):
                chosen = np.array([stable == is_stable for stable in course.stable], dtype=np.bool_)
                if chosen.any():
                    word = "stable" if is_stable else "unstable"
                    dash = _STABLE.dash if is_stable else _UNSTABLE.dash
                    part = _parts(x, y, chosen)
                    lines.append(Line(*part, f"{self.name(number)}, {word}", self.colour(number), width=1.7, dash=dash))
        return lines

    def moved(self, corner: Array) -> Line:
        """Draw a corner that moves with the parameter."""
        order = np.argsort(self.values[0])
        return Line(self.values[0][order], corner[order], "corner", CENTRE, width=1.0, dash="dotted")

    def marks(self, at_events: Array, clearance: str = "") -> list[Line]:
        """Draw the events, every kind in its shape; of a clearance without those of other ones."""
        kinds = self.branch.events["kind"].to_numpy()
        names = self.branch.events["clearance"].to_numpy()
        others = (names != "") & (names != clearance) if clearance else np.zeros(len(names), dtype=np.bool_)
        lines = []
        for kind in dict.fromkeys(kinds.tolist()):
            here = (kinds == kind) & ~others
            key = EVENTS.get(kind, _OTHER)
            if not here.any():
                continue
            lines.append(Line(self.values[1][here], at_events[here], kind, key.colour, "points", 8.0, shape=key.shape))
        return lines

    def frame(self, title: str, unit: str, lines: Sequence[Line], rules: Sequence[Rule] = ()) -> Panel:
        """A panel over the parameter."""
        low, high = sorted(value * measure(self.branch).factor for value in self.branch.range)
        room = 0.02 * (high - low)
        shown = measure(self.branch)
        x_title = f"{shown.words}  [{shown.unit}]" if shown.unit else shown.words
        return Panel(title, unit, x_title, tuple(lines), rules=tuple(rules), x_range=(low - room, high + room))

    def name(self, number: int) -> str:
        """What a branch is called."""
        return f"branch {number}, {self.branch.curves[number].cycles} T"

    @staticmethod
    def colour(number: int) -> str:
        """Of a branch."""
        return COLOURS[number % len(COLOURS)]

    def legend(self) -> tuple[Key, ...]:
        """Stability, branches, and the kinds of events that occur."""
        count = len(self.branch.curves)
        branches = [Key(self.name(n), self.colour(n)) for n in range(min(count, _MOST_NAMED))] if count > 1 else []
        kinds = dict.fromkeys(self.branch.events["kind"].tolist())
        return (_STABLE, _UNSTABLE, *branches, *(EVENTS.get(kind, _OTHER) for kind in kinds))


def _parts(x: Array, y: Array, chosen: NDArray[np.bool_]) -> tuple[Array, Array]:
    """The chosen steps of a curve, with the pen lifted between those that are not connected."""
    across = []
    up = []
    for i in np.flatnonzero(chosen).tolist():
        if i == 0 or not chosen[i - 1]:
            across += [np.nan, x[i]]
            up += [np.nan, y[i]]
        across.append(x[i + 1])
        up.append(y[i + 1])
    return np.array(across[1:]), np.array(up[1:])


def branch_charts(branch: Branch) -> list[Chart]:
    """Return the highest and lowest deflection over the parameter, and the peak-to-peak deflection."""
    drawing = _Drawing(branch)
    data = branch.data
    levels = branch.event_levels
    layout = assemble(branch.model).layout

    def extremes(k: int) -> Panel:
        low = data["lowest"].values[:, k]
        high = data["highest"].values[:, k]
        in_unit = _extremes_scale(branch, k)
        # the branches, their events, and the corners that lie near
        drawn: list[Line] = []
        for values, at_events in ((low, levels[:, 0, k]), (high, levels[:, 1, k])):
            drawn += drawing.lines(values * in_unit.factor, at_events * in_unit.factor)
        drawn += drawing.marks(_touched(branch, levels, k) * in_unit.factor, layout.clearance_names[k])
        reach = (float(np.nanmin(low)), float(np.nanmax(high)))
        lowest = reach[0] - np.ptp(reach)
        highest = reach[1] + np.ptp(reach)
        near = [own for own in branch.corners[k].T if np.any((lowest <= own) & (own <= highest))]
        rules = [Rule(own[0] * in_unit.factor) for own in near if not np.ptp(own)]
        drawn += [drawing.moved(own * in_unit.factor) for own in near if np.ptp(own)]
        return drawing.frame(layout.clearance_names[k], in_unit.unit, drawn, rules)

    words = f"of every clearance over {measure(branch).words}"
    return [
        _over(branch, "extremes", "Highest and lowest deflection", f"{words}; dotted: corners", extremes),
        _over(branch, "swings", "Peak-to-peak deflection", words, partial(swing_panel, branch)),
    ]


def shown_levels(branch: Branch) -> dict[str, list[list[Array]]]:
    """Return the heights at which ``branch_charts`` draw the points, by chart, a list a panel, (P,) a curve."""
    data = branch.data
    panels = range(min(branch.data.sizes["clearance"], _MOST_PANELS))
    low, high, swings = (data[name].values for name in ("lowest", "highest", "peak_to_peak"))
    factors = [_extremes_scale(branch, k).factor for k in panels]
    return {
        "extremes": [[low[:, k] * factors[k], high[:, k] * factors[k]] for k in panels],
        "swings": [[swings[:, k] * _swings_scale(branch, k, []).factor] for k in panels],
    }


def _extremes_scale(branch: Branch, k: int) -> Scale:
    """Return the scale of the highest and the lowest deflection of a clearance."""
    data = branch.data
    layout = assemble(branch.model).layout
    levels = [data[name].values[:, k] for name in ("lowest", "highest")]
    return scale(np.concatenate([*levels, layout.corners[k]]), units_of(branch.model, layout, k)["deflection"])


def _swings_scale(branch: Branch, k: int, others: Sequence[Line]) -> Scale:
    """Return the scale of peak-to-peak deflections of a clearance."""
    values = np.concatenate([branch.data["peak_to_peak"].values[:, k], *(line.y for line in others)])
    return scale(values, units_of(branch.model, assemble(branch.model).layout, k)["deflection"])


def swing_panel(branch: Branch, k: int, others: Sequence[Line] = ()) -> Panel:
    """Draw the peak-to-peak deflection of a clearance over the parameter.

    ``others`` are drawn under it, in the units of the Dataset.
    """
    drawing = _Drawing(branch)
    layout = assemble(branch.model).layout
    levels = branch.event_levels
    values = branch.data["peak_to_peak"].values[:, k]
    at_events = levels[:, 1, k] - levels[:, 0, k]
    in_unit = _swings_scale(branch, k, others)
    across = measure(branch).factor
    drawn = [replace(line, x=line.x * across, y=line.y * in_unit.factor) for line in others]
    drawn += drawing.lines(values * in_unit.factor, at_events * in_unit.factor)
    drawn += drawing.marks(at_events * in_unit.factor, layout.clearance_names[k])
    return drawing.frame(layout.clearance_names[k], in_unit.unit, drawn)


def branch_legend(branch: Branch) -> tuple[Key, ...]:
    """Return what lines and shapes of a branch mean."""
    return _Drawing(branch).legend()


def _over(branch: Branch, key: str, what: str, words: str, panel: Callable[[int], Panel]) -> Chart:
    """A chart with a panel for every clearance, the first few."""
    count = branch.data.sizes["clearance"]
    more = f" {counted(count - _MOST_PANELS, 'clearance')} more are in results.nc." if count > _MOST_PANELS else ""
    return Chart(
        key,
        "Branches",
        f"{what} {words}. Solid: stable motions; dashed: unstable ones, which no simulation shows.{more}",
        tuple(panel(k) for k in range(min(count, _MOST_PANELS))),
        panel_height=300 if count == 1 else 230,
        legend=_Drawing(branch).legend(),
        group="branches",
        tab=what,
    )


def _touched(branch: Branch, levels: Array, k: int) -> Array:
    """(E,) where an event is marked: a grazing at the end of the motion that is nearer to a corner, others above."""
    low = levels[:, 0, k]
    high = levels[:, 1, k]
    if not low.size or not branch.event_corners[k].size:
        return high
    away = [np.abs(values[:, None] - branch.event_corners[k]).min(axis=1) for values in (low, high)]
    is_grazing = branch.events["kind"].to_numpy() == GRAZING
    return np.where(is_grazing & (away[0] < away[1]), low, high)


def modulus_chart(branch: Branch) -> Chart:
    """Draw the largest modulus of a multiplier over the parameter."""
    # largest moduli at points and at located events
    drawing = _Drawing(branch)
    at_points = np.array([largest(point.multipliers, point.free) for point in branch.points])
    located = [event.point for events in branch.events_of_curves for event in events]
    at_events = np.array([largest(point.multipliers, point.free) for point in located])
    sizes = np.concatenate([at_points, at_events])
    # curves, marks of events, and the rule at modulus 1
    lines = [*drawing.lines(at_points, at_events), *drawing.marks(at_events)]
    panel = drawing.frame("largest modulus", "", lines, [Rule(1.0, dashed=False)])
    # a logarithmic axis where moduli are large
    if float(sizes.max(initial=0.0)) > _LOG_FROM:
        smallest = max(float(sizes.min()), 1e-3)
        top = 10.0 ** np.ceil(np.log10(float(sizes.max()) * 1.001))
        ends = (float(10.0 ** np.floor(np.log10(smallest))), float(top))
        panel = Panel(
            panel.title,
            "",
            panel.x_title,
            panel.lines,
            rules=panel.rules,
            x_range=panel.x_range,
            y_range=ends,
            y_log=True,
        )
    caption = (
        f"Largest modulus of a Floquet multiplier over {measure(branch).words}: a small disturbance is multiplied by "
        "it until the motion repeats. Above 1 it grows: the motion is unstable."
    )
    return Chart("modulus", "Largest multiplier", caption, (panel,), panel_height=230, legend=drawing.legend())


def largest(multipliers: np.ndarray, free: int) -> float:
    """Return the largest modulus, without as many multipliers nearest to 1 as there are free directions."""
    others = np.delete(multipliers, np.argsort(np.abs(multipliers - 1.0))[:free])
    return float(np.abs(others).max(initial=0.0))


def circle_chart(branch: Branch) -> Chart:
    """Draw the multipliers of all points in the complex plane, those of events in their shapes."""
    # multipliers along every branch
    drawing = _Drawing(branch)
    marks = []
    for number, part in enumerate(slices_of(branch)):
        values = np.concatenate([point.multipliers for point in branch.points[part]])
        marks.append(
            Line(
                values.real.copy(),
                values.imag.copy(),
                drawing.name(number),
                drawing.colour(number),
                "points",
                3.4,
            )
        )
    # multipliers on the unit circle at events that change stability
    located = [(event.kind, event.point) for events in branch.events_of_curves for event in events]
    for kind in dict.fromkeys(kind for kind, _ in located):
        if kind not in CHANGES:
            continue
        values = np.array([_crossing(point.multipliers, kind) for of, point in located if of == kind])
        key = EVENTS.get(kind, _OTHER)
        marks.append(Line(values.real.copy(), values.imag.copy(), kind, key.colour, "points", 9.0, shape=key.shape))
    # caption and legend
    caption = (
        "Floquet multipliers along the branches. They leave the unit circle at 1 in a fold or a symmetry breaking, at "
        f"-1 in a period doubling, as a pair in a Neimark-Sacker bifurcation.{outside_words(marks)}"
    )
    legend = tuple(key for key in drawing.legend() if not key.dash and (not key.shape or key.name in CHANGES))
    return Chart(
        "circle", "Multipliers", caption, (unit_circle(marks, "multipliers"),), panel_height=360, legend=legend
    )


def _crossing(multipliers: np.ndarray, kind: str) -> complex:
    """The multiplier that crosses the unit circle at an event."""
    target = -1.0 if kind == DOUBLING else 1.0
    away = np.abs(np.abs(multipliers) - 1.0) if kind == NEIMARK_SACKER else np.abs(multipliers - target)
    return complex(multipliers[int(np.argmin(away))])
