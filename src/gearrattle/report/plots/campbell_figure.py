"""The Campbell diagram as static SVG: natural frequencies, order lines and their crossings over speed.

Torques and transmission errors have separate panels, because their orders differ by the number of teeth. The size of a
crossing shows the share of energy that its source supplies to the mode.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from gearrattle.analysis.campbell import Campbell, OrderLine
from gearrattle.report.plots.chart import Chart, Key, Label, Line, Panel, Rule
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.palette import CENTRE, INK, MUTED

STATES = ("#0b5c8f", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6bb1", "#7a5c3e")
"""Colours of contact states; further ones are drawn in grey."""
_CROSSING = "#a8123e"
_STEPS = ((0.0, 5.0), (0.01, 8.0), (0.1, 11.0))
_HEIGHT = 340
_LABEL = 12.0


def campbell_chart(diagram: Campbell, *, si: bool) -> Chart:
    """Draw the diagram; SI speeds [rad/s] are drawn in rpm and Hz, others as they are."""
    kinds = {
        "Torque orders": [line for line in diagram.orders if any(s.startswith("torque") for s in line.sources)],
        "Transmission error orders": [
            line for line in diagram.orders if any(s.startswith("transmission error") for s in line.sources)
        ],
    }
    panels = tuple(_panel(diagram, title, lines, si) for title, lines in kinds.items() if lines)
    if not panels:
        panels = (_panel(diagram, "Natural frequencies", [], si),)
    several = len(diagram.states) > 1
    legend = tuple(Key(_state(state), _colour(j)) for j, state in enumerate(diagram.states)) if several else ()
    caption = (
        "Level: natural frequencies; rising: what the orders of the excitation make of the speed. Where they meet, "
        "there is resonance: the larger the mark, the more of the source's energy goes into that mode (below 1 %, "
        "below 10 %, above). Dotted: the model's speed."
    )
    return Chart("campbell", "Campbell diagram", caption, panels, panel_height=_HEIGHT, share_x=False, legend=legend)


def _state(state: dict[str, float]) -> str:
    return ", ".join(f"{name} {ratio:g}" for name, ratio in state.items())


def _colour(state: int) -> str:
    return STATES[state] if state < len(STATES) else CENTRE


def _panel(diagram: Campbell, title: str, orders: list[OrderLine], si: bool) -> Panel:
    """Draw one kind of orders, up to the largest frequency of the highest order, or to the next mode above."""
    # the highest frequency drawn: above all orders, and up to the next natural frequency
    speed, hertz = (30.0 / math.pi, 0.5 / math.pi) if si else (1.0, 1.0)
    low, high = diagram.speeds
    elastic = diagram.frequencies[diagram.frequencies > 0.0]
    reach = max((line.order for line in orders), default=0.0) * high
    above = elastic[elastic > reach]
    top = max(1.06 * reach, 1.06 * float(above.min()) if above.size and above.min() < 1.5 * reach else 0.0)
    if not orders or not top:
        top = 1.1 * float(elastic.max(initial=0.0)) or 1.0
    # order lines, rising with speed
    rising = [
        Line(np.array([low, high]) * speed, line.order * np.array([low, high]) * hertz, f"order {line.order:g}", MUTED)
        for line in orders
    ]
    ends = [(line.order * high * hertz, high, f"order {line.order:g}") for line in orders]
    inside = low <= diagram.model_speed <= high
    # natural frequencies, crossings and the model's own speed
    return Panel(
        title,
        "Hz" if si else "",
        "speed of the reference shaft, rpm" if si else "speed of the reference shaft",
        lines=(*rising, *_level(diagram, top, speed, hertz), *_marks(diagram, orders, speed, hertz)),
        rules=(Rule(diagram.model_speed * speed, "x", INK),) * inside,
        labels=(
            *(Label(diagram.model_speed * speed, 0.97 * top * hertz, "the model's speed", INK),) * inside,
            *(Label(high * speed, y, words) for y, _, words in _spread(ends, top * hertz)),
            *(
                Label(x, y, words, INK, "above")
                for y, x, words in _spread(_names(diagram, orders, top, speed, hertz, si=si), top * hertz)
            ),
        ),
        x_range=(low * speed, (high + 0.1 * (high - low)) * speed),
        y_range=(0.0, top * hertz),
        note="" if elastic.size else "every motion is rigid",
    )


def _level(diagram: Campbell, top: float, speed: float, hertz: float) -> list[Line]:
    """Natural frequencies of all states."""
    ends = np.array(diagram.speeds) * speed
    return [
        Line(ends, np.full(2, frequency * hertz), f"mode {mode + 1}", _colour(j), width=1.5)
        for j, frequencies in enumerate(diagram.frequencies)
        for mode, frequency in enumerate(frequencies.tolist())
        if 0.0 < frequency <= top
    ]


def _names(
    diagram: Campbell, orders: list[OrderLine], top: float, speed: float, hertz: float, *, si: bool
) -> list[tuple[float, float, str]]:
    """Words above the horizontal lines; a word ends where an order line crosses, so that it does not cover the line."""
    names = []
    (low, high) = diagram.speeds
    several = len(diagram.states) > 1
    for state, frequencies in zip(diagram.states, diagram.frequencies, strict=True):
        for mode, frequency in enumerate(frequencies.tolist()):
            if 0.0 < frequency <= top * (1.0 - 1.3 * _LABEL / _HEIGHT):  # else the words would stand outside
                description = _state(state) if several else f"{numeral(frequency * hertz)}{' Hz' if si else ''}"
                met = sorted(frequency / line.order for line in orders if low < frequency / line.order < high)
                end = max(pairwise((low, *met, high)), key=lambda gap: gap[1] - gap[0])[1]
                names.append((frequency * hertz, end * speed, f"mode {mode + 1}, {description}"))
    return names


def _marks(diagram: Campbell, orders: list[OrderLine], speed: float, hertz: float) -> list[Line]:
    """Crossings of some orders, as large as their shares."""
    drawn = {line.order for line in orders}
    marks = []
    for (least, width), beyond in zip(_STEPS, (*(step[0] for step in _STEPS[1:]), math.inf), strict=True):
        met = [c for c in diagram.crossings if c.order in drawn and least <= c.share < beyond]
        if met:
            x, y = np.array([c.speed for c in met]) * speed, np.array([c.frequency for c in met]) * hertz
            marks.append(Line(x, y, "crossing", _CROSSING, "points", width))
    return marks


def _spread(labels: list[tuple[float, float, str]], top: float) -> list[tuple[float, float, str]]:
    """Leave out labels that would overlap, from the top down."""
    kept: list[tuple[float, float, str]] = []
    for label in sorted(labels, reverse=True):
        if not kept or kept[-1][0] - label[0] >= _LABEL / _HEIGHT * top:
            kept.append(label)
    return kept
