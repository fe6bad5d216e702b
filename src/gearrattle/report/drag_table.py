"""The drag of every body by its parts, with the error of linearising the law of a part during a run.

A run uses the straight line T + c delta instead of the law T(Omega + delta), where delta is the fluctuation of the
speed. The error of the line is the largest difference between the two over the range of delta in the run, relative to
T. The error of the law itself is in another column.
"""

from __future__ import annotations

import math
from itertools import groupby

import numpy as np

from gearrattle.errors import ModelError
from gearrattle.model import GROUND, Model
from gearrattle.model.drag_points import DragPoint, drag_points
from gearrattle.report.plots.numerals import numeral, quantity
from gearrattle.report.tables import Table
from gearrattle.trajectory import Trajectory
from gearrattle.wording import engineering

_POINTS = 65  # values of delta at which law and line are compared
_ROUNDING = 1e-6  # relative error; smaller ones are rounding


def drag_table(model: Model, trajectory: Trajectory | None = None) -> Table | None:
    """Return the table; None for a model without drag parts. Without a motion it has no error of the straight line."""
    points = drag_points(model)
    if not points:
        return None
    torque_unit = "N m" if model.units == "SI" else ""
    # parts of every body, and their sum
    rows: list[tuple[str, ...]] = []
    for body, group in groupby(points, key=lambda point: point.body):
        parts = list(group)
        total = sum(point.against for point in parts)
        rows.extend((body if point is parts[0] else "", *_row(model, point, trajectory)) for point in parts)
        if len(parts) > 1:
            rows.append(("", "sum", "", "", quantity(total, torque_unit), *[""] * (len(rows[-1]) - 5)))
    # the oil in the title
    head = (
        "body",
        "part",
        "against",
        "relative speed",
        "drag torque",
        "slope",
        *(() if trajectory is None else ("error of the straight line",)),
        "error of the law",
    )
    oil = model.oil
    title = "Drag by parts"
    if oil is not None:
        viscosity = engineering(1e6 * oil.kinematic_viscosity(), "mm²/s", 4)
        title += f", oil at {numeral(oil.temperature)} °C ({viscosity}, {numeral(oil.mass_density())} kg/m³)"
    return Table(head, tuple(rows), frozenset({0, 1, 2, len(head) - 1}), title)


def _row(model: Model, point: DragPoint, trajectory: Trajectory | None) -> tuple[str, ...]:
    """One part: against what, at what speed, torque, slope and errors."""
    is_si = model.units == "SI"
    rpm = 30.0 / math.pi * point.speed
    line = () if trajectory is None else (_error_words(straight_line_error(model, point, trajectory)),)
    return (
        point.part.noun,
        "housing" if point.on == GROUND else point.on,
        f"{numeral(rpm)} rpm" if is_si else numeral(point.speed),
        quantity(point.against, "N m" if is_si else ""),
        engineering(point.slope, "N m s/rad" if is_si else ""),
        *line,
        point.part.law_error,
    )


def _error_words(error: float | None) -> str:
    """The error of a straight line in words; an error below a millionth is rounding."""
    if error is None:
        return "–"
    if math.isinf(error):
        return "it reverses"
    if math.isnan(error):
        return "beyond the measured speeds"
    return f"{numeral(100.0 * error, 2)} %" if error > _ROUNDING else "0 %"


def straight_line_error(model: Model, point: DragPoint, trajectory: Trajectory) -> float | None:
    """Return the largest difference of law and straight line over the fluctuation, relative to the torque.

    NaN if the fluctuation leaves a measured table. Infinite if the relative rotation changes its sense, because a drag
    torque then jumps and has no straight line. None along a sweep, where the torque is a table over speed, and for a
    part without torque.
    """
    if trajectory.layout.ramp is not None or not point.torque:
        return None
    names = trajectory.layout.inertia_names
    per_cycle = trajectory.samples_per_cycle
    steady = slice(max(0, trajectory.discard - trajectory.first_cycle) * per_cycle, None)
    swing = trajectory.velocity[steady, names.index(point.body)]
    if point.on != GROUND:
        swing = swing - trajectory.velocity[steady, names.index(point.on)]
    low = float(swing.min())
    high = float(swing.max())
    speed = abs(point.speed)
    forward = 1.0 if point.speed > 0.0 else -1.0
    least, most = sorted((forward * low, forward * high))
    if speed + least <= 0.0:
        return math.inf
    deltas = np.linspace(least, most, _POINTS).tolist()
    try:
        laws: list[float] = [point.part.at(speed + delta, model.oil).torque for delta in deltas]
    except ModelError:  # of a measured table, which the mean speed alone must lie in
        return math.nan
    lines = [point.torque + point.slope * delta for delta in deltas]
    return float(max(abs(law - line) for law, line in zip(laws, lines, strict=True)) / point.torque)
