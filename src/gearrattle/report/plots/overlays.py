"""Overlays on a map of a run-up, as in a Campbell diagram: orders of the excitation, and natural frequencies.

If the y axis is frequency, an order rises with the speed, f = o Omega / (2 pi), and a natural frequency is horizontal.
If the y axis is the order, an order is horizontal and a natural frequency falls, o = omega_r / Omega. In a map over
time, both follow the speed at that time. A horizontal order would cover the ridge in the map, so it is drawn as a tick
at the edge.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gearrattle.report.plots.chart import Label, Line
from gearrattle.report.plots.palette import INK, PAPER, SHADES
from gearrattle.trajectory import Array

_TICK = 0.02  # share of the width of the map
_POINTS = 200


@dataclass(frozen=True)
class Turning:
    """The speed of the shaft (n,) [rad/s] along the x axis of a map, at ascending places (n,) in the axis's unit."""

    places: Array
    speed: Array

    @classmethod
    def along(cls, x_range: tuple[float, float], *, si: bool) -> Turning:
        """Return that of a map whose x axis is the speed, in rpm or without a unit."""
        places = np.linspace(*x_range, _POINTS)
        return cls(places, places * np.pi / 30.0 if si else places)


def overlay(
    x_range: tuple[float, float],
    y_range: tuple[float, float],
    turning: Turning | None,
    *,
    by_order: bool,
    orders: Sequence[float],
    natural: Sequence[float],
) -> tuple[tuple[Line, ...], tuple[Label, ...]]:
    """Return the lines over a map, each named once.

    The y axis is in hertz, or in orders if ``by_order``. ``orders`` are of the excitation, ``natural`` frequencies in
    rad/s; without ``turning`` the speed is unknown.
    """
    lines: list[Line] = []
    labels: list[Label] = []
    # orders: ticks where orders are on the y axis, otherwise f = o Omega / (2 pi)
    for order in orders:
        if by_order and 0.0 < order < y_range[1]:
            end = x_range[0] + _TICK * (x_range[1] - x_range[0])
            lines += _seen(np.array([x_range[0], end]), np.full(2, order), f"order {order:g}", PAPER)
            labels.append(Label(end, order, f"order {order:g}", INK))
        elif not by_order and turning is not None:
            y = order * turning.speed / (2.0 * np.pi)
            curve = _follow(turning.places, y, y_range, (f"order {order:g}", f"order {order:g}", PAPER))
            lines = [*lines, *curve[0]]
            labels = [*labels, *curve[1]]
    # natural frequencies: o = omega_r / Omega where orders are on the y axis, otherwise level
    for mode, frequency in enumerate(natural, start=1):
        words = f"natural frequency {mode}", f"f{mode}", SHADES[-1]
        if by_order and turning is not None and frequency > 0.0:
            with np.errstate(divide="ignore"):
                curve = _follow(turning.places, frequency / turning.speed, y_range, words)
            lines = [*lines, *curve[0]]
            labels = [*labels, *curve[1]]
        elif not by_order and 0.0 < frequency / (2.0 * np.pi) < y_range[1]:
            y = np.full(2, frequency / (2.0 * np.pi))
            lines += _seen(np.array(x_range), y, words[0], words[2])
            labels.append(Label(x_range[0], float(y[0]), words[1], INK))
    return tuple(lines), tuple(labels)


def lines_told(lines: Sequence[Line], *, by_order: bool) -> str:
    """Say what the lines over a map are; empty without any."""
    names = {line.name.split(" ")[0] for line in lines}
    orders = "ticks at the left" if by_order else "lines that follow the speed"
    natural = "falling lines" if by_order else "level lines"
    parts = [f"{orders}: orders of the excitation"] * ("order" in names)
    parts += [f"{natural}: natural frequencies with every clearance closed"] * ("natural" in names)
    return f" {'; '.join(parts).capitalize()}." if parts else ""


def _follow(
    x: Array, y: Array, y_range: tuple[float, float], words: tuple[str, str, str]
) -> tuple[tuple[Line, ...], tuple[Label, ...]]:
    """Return a line that follows the speed as far as it is in the map, with its label where it ends."""
    inside = np.isfinite(y) & (y >= y_range[0]) & (y <= y_range[1])
    if not inside.any():
        return (), ()
    name, label, colour = words
    shown = inside.copy()  # one point beyond, so that the line reaches the edge, where it is cut
    shown[1:] |= inside[:-1]
    shown[:-1] |= inside[1:]
    drawn = _seen(x, np.where(shown & np.isfinite(y), y, np.nan), name, colour)
    held = np.flatnonzero(inside & (y <= 0.94 * y_range[1]))
    at = int(held[-1]) if held.size else int(np.flatnonzero(inside)[-1])
    return drawn, (Label(float(x[at]), float(y[at]), label, INK, "above"),)


def _seen(x: Array, y: Array, name: str, colour: str) -> tuple[Line, Line]:
    """Return a light line on a dark one: one of the two is seen on every shade."""
    return Line(x, y, name, INK, width=2.4, opacity=0.55), Line(x, y, name, colour, width=1.0)
