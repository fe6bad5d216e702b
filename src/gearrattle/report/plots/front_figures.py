"""Figures of an optimisation: the front among all designs, its growth, and the values of its members."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from gearrattle.report.plots.axis_names import measure_of
from gearrattle.report.plots.chart import Chart, Key, Label, Line, Panel, Rule
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.palette import ACCENT, CENTRE, COAST, COLOURS, DRIVE, INK
from gearrattle.trajectory import Array

if TYPE_CHECKING:
    import xarray as xr

_MOST_PAIRS = 6
_MOST_LINES = 60
_FEASIBLE = "#8fb8d6"
_OTHER = CENTRE


def front_chart(data: xr.Dataset) -> Chart | None:
    """Draw every pair of objectives: all designs, those that are feasible, and the front; None for one objective."""
    # groups of designs: those that miss a limit, feasible ones, the front
    names = [str(name) for name in data["objective"].values]
    if len(names) < 2 or not data.sizes["design"]:
        return None
    values = data["value"].values
    front = data["front"].values == 1
    feasible = (data["violation"].values == 0.0) & ~front
    groups = (
        ("misses a limit", ~feasible & ~front, _OTHER, 4.0),
        ("feasible", feasible, _FEASIBLE, 4.5),
        ("front", front, ACCENT, 7.0),
    )
    # a panel for every pair of objectives
    panels = []
    for i, j in itertools.islice(itertools.combinations(range(len(names)), 2), _MOST_PAIRS):
        lines = [
            Line(values[which, i], values[which, j], name, colour, "points", size)
            for name, which, colour, size in groups
            if np.isfinite(values[which][:, [i, j]]).all(axis=1).any()
        ]
        lines += _marked(data, values[:, i], values[:, j])
        # limits of the axes fit the feasible designs
        shown = values[feasible | front] if (feasible | front).any() else values
        panels.append(
            Panel(
                f"{names[j]}{_unit(data, j)}",
                "",
                f"{names[i]}{_unit(data, i)}",
                tuple(lines),
                x_range=_room(shown[:, i]),
                y_range=_room(shown[:, j]),
            )
        )
    # caption and legend
    caption = "All designs by their objectives; on the front stands what no feasible design beats in everything."
    legend = (
        Key("front", ACCENT),
        Key("feasible", _FEASIBLE),
        Key("misses a limit", _OTHER),
        Key("nearest to the ideal", COAST),
        Key("the model itself", INK),
    )
    return Chart(
        "front",
        "The front",
        caption,
        tuple(panels),
        columns=min(2, len(panels)),
        panel_height=300,
        share_x=False,
        legend=legend,
    )


def growth_chart(data: xr.Dataset) -> Chart | None:
    """Draw the best value of every objective, and the hypervolume, over the generations."""
    count = data.sizes["generation"]
    if count < 2 or not np.isfinite(data["best"].values).any():
        return None
    x = np.arange(count, dtype=np.float64)
    panels = []
    for i, name in enumerate(map(str, data["objective"].values)):
        best = data["best"].values[:, i]
        panels.append(_stepped(f"best {name}{_unit(data, i)}", x, best))
    if len(panels) > 1:
        panels.append(_stepped("hypervolume, share of the box", x, data["hypervolume"].values))
    caption = "What had been found up to every generation; flat at the end means that more of them would hardly help."
    return Chart(
        "growth",
        "How the search went on",
        caption,
        tuple(panels),
        columns=min(2, len(panels)),
        panel_height=170,
        share_x=True,
    )


def parallel_chart(data: xr.Dataset) -> Chart | None:
    """Draw the front's members across variables and objectives, every axis from its least to its largest value."""
    # variables of the front's members, each between the limits of its range
    members = np.flatnonzero(data["front"].values == 1)
    if len(members) < 2:
        return None
    paths = [str(path) for path in data.attrs["variables"]]
    low = np.array(data.attrs["low"], dtype=float)
    high = np.array(data.attrs["high"], dtype=float)
    measures = [measure_of(data, path) for path in paths]
    columns = [
        (m.factor * data[path].values[members], (m.factor * low[i], m.factor * high[i]))
        for i, (path, m) in enumerate(zip(paths, measures, strict=True))
    ]
    # objectives, each between its extremes over the front
    front_values = data["value"].values[members]
    columns += [(column, (float(column.min()), float(column.max()))) for column in front_values.T]
    # every column from 0 to 1
    shares = np.column_stack([(c - a) / (b - a) if b > a else np.full(len(c), 0.5) for c, (a, b) in columns])
    # a line a member, in two colours by the first objective
    x = np.arange(shares.shape[1], dtype=np.float64)
    rank = np.argsort(np.argsort(front_values[:, 0]))
    lines = [
        Line(
            x,
            row,
            f"design {members[i]}",
            COLOURS[0] if rank[i] < len(members) / 2 else COLOURS[1],
            width=0.9,
            opacity=0.6,
        )
        for i, row in enumerate(shares[:_MOST_LINES])
    ]
    best = int(data.attrs["best"])
    lines.append(Line(x, shares[members.tolist().index(best)], "nearest to the ideal", INK, width=2.4))
    # names and limits of the columns
    names = [*(f"{i + 1}" for i in range(len(paths))), *(f"{chr(65 + i)}" for i in range(front_values.shape[1]))]
    labels = [Label(float(at), 1.06, numeral(b, 3)) for at, (_, (_, b)) in zip(x, columns, strict=True)]
    labels += [Label(float(at), -0.09, numeral(a, 3)) for at, (_, (a, _)) in zip(x, columns, strict=True)]
    rules = tuple(Rule(float(at), "x", CENTRE, dashed=False) for at in x)
    panel = Panel(
        "Members of the front",
        lines=tuple(lines),
        labels=tuple(labels),
        rules=rules,
        x_range=(-0.2, float(x[-1]) + 0.6),
        y_range=(-0.16, 1.14),
        y_ticks=((-9.0, ""),),
        x_ticks=tuple(zip(x.tolist(), names, strict=True)),
    )
    # caption and legend
    objectives = [str(name) for name in data["objective"].values]
    words = [*(m.title for m in measures), *(f"{name}{_unit(data, i)}" for i, name in enumerate(objectives))]
    description = "; ".join(f"{short}: {name}" for short, name in zip(names, words, strict=True))
    caption = f"Each line a member of the front. Variables over their ranges, objectives over the front. {description}."
    legend = (
        Key(f"low {objectives[0]}", COLOURS[0]),
        Key(f"high {objectives[0]}", COLOURS[1]),
        Key("nearest to the ideal", INK),
    )
    return Chart("parallel", "What the front has in common", caption, (panel,), panel_height=300, legend=legend)


def _marked(data: xr.Dataset, x: Array, y: Array) -> list[Line]:
    """The model itself, if it is the first design, and the design nearest to the ideal."""
    marks = []
    if bool(data.attrs.get("own", 0)) and np.isfinite([x[0], y[0]]).all():
        marks.append(Line(x[:1], y[:1], "the model itself", INK, "points", 9.0))
    best = int(data.attrs["best"])
    if best >= 0:
        marks.append(Line(x[best : best + 1], y[best : best + 1], "nearest to the ideal", COAST, "points", 10.0))
    return marks


def _stepped(title: str, x: Array, y: Array) -> Panel:
    line = Line(x, y, title, DRIVE, width=1.8)
    return Panel(title, "", "generation", (line,), x_range=(0.0, float(x[-1])), y_range=_room(y))


def _room(values: Array) -> tuple[float, float]:
    there = values[np.isfinite(values)]
    if not there.size:
        return 0.0, 1.0
    low = float(there.min())
    high = float(there.max())
    room = 0.06 * (high - low) or 0.5 * (abs(high) or 1.0)
    return low - room, high + room


def _unit(data: xr.Dataset, i: int) -> str:
    unit = str(data.attrs["units"][i])
    return f" [{unit}]" if unit else ""
