"""The motion at a selected point of the branches: its phase plane and its multipliers.

The page, and the view of the workbench, contain the motions of at most 120 points as integers of 16 bits, with as many
samples as a screen can show. If the motions have many impacts, the page contains the motions of fewer points.
``browser/motions.js`` draws them; without a pointer, the user selects a point with a slider.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from gearrattle.assembly import assemble, deflection_rate
from gearrattle.orbits import Branch, Orbit
from gearrattle.report.live_figures import embedded
from gearrattle.report.motion_curves import fine_curves
from gearrattle.report.plots.branches_figure import largest, measure, shown_levels
from gearrattle.report.plots.chords import SCREEN, WITHIN, thinned
from gearrattle.report.plots.corner_marks import reach, shading, units_of
from gearrattle.report.plots.motion_window import scale
from gearrattle.report.plots.numerals import numeral
from gearrattle.trajectory import Array
from gearrattle.wording import counted

_FEW = 120  # points whose motions are shown, if motions have few crossings
_MANY = 50  # points whose motions are shown, if motions have many crossings
_MANY_FROM = 8  # crossings
_MOST_CLEARANCES = 4  # clearances whose motions are shown
_MOST_IMPACTS = 6  # impacts of a motion that are named
_WHOLE = 32767  # largest integer of 16 bits
_RADIUS = 2.0  # largest modulus of multipliers that is drawn
_DIGITS = 6  # significant digits in JSON


def motion_at_point(branch: Branch) -> Markup:
    """Return the part of the page that shows the motion at a point."""
    points = chosen_points(branch)
    if not points:
        return Markup("")
    return (
        Markup('<div id="motion-at-point"></div>\n<script type="application/json" id="motion-at-point-data">')
        + embedded(point_data(branch, points))
        + Markup("</script>")
    )


def chosen_points(branch: Branch) -> list[int]:
    """Return the points whose motions are shown, spread evenly over the points with deflections of all clearances.

    Empty for a model without a clearance.
    """
    if not branch.data.sizes["clearance"]:
        return []
    most = _MANY if int(branch.data["crossings"].max()) > _MANY_FROM else _FEW
    (known,) = np.nonzero(np.isfinite(branch.data["lowest"].values).all(axis=1))
    chosen = np.unique(np.round(np.linspace(0, len(known) - 1, min(len(known), most))).astype(np.int64))
    return [int(i) for i in known[chosen]]


def point_data(branch: Branch, points: list[int]) -> dict[str, Any]:
    """Return the data of the script: words, stability and multipliers of every point, levels, curves."""
    # motions at the points, and the levels of the curves that they lie on
    orbits = [branch.orbit(i) for i in points]
    stable = branch.data["stable"].values[points]
    value = branch.data["value"].values[points] * measure(branch).factor
    levels = {
        key: [[_rounded(line[points]) for line in panel] for panel in panels]
        for key, panels in shown_levels(branch).items()
    }
    # largest multipliers, and the radius in which they are drawn
    moduli = [largest(branch.points[i].multipliers, branch.points[i].free) for i in points]
    names = assemble(branch.model).layout.clearance_names[:_MOST_CLEARANCES]
    sizes = [max(1.0, min(modulus, _RADIUS)) for modulus in moduli]
    return {
        "radius": 1.12 * max(sizes),
        "value": _rounded(value),
        "levels": levels,
        "points": [
            {
                "words": _words(branch, i, modulus, orbit),
                "stable": bool(is_stable),
                "cycles": orbit.cycles,
                "multipliers": [_rounded(np.array([m.real, m.imag])) for m in orbit.multipliers.tolist()],
            }
            for i, orbit, is_stable, modulus in zip(points, orbits, stable, moduli, strict=True)
        ],
        "clearances": _clearances(branch, orbits, len(names)),
    }


def _words(branch: Branch, i: int, modulus: float, orbit: Orbit) -> str:
    """The value at a point and its motion, in words."""
    shown = measure(branch)
    data = branch.data.isel(point=i)
    number = int(data["branch"])
    cycles = int(data["cycles"])
    which = f"branch {number}, " if len(branch.curves) > 1 else ""
    stability = "stable" if bool(data["stable"]) else "unstable"
    where = f"{shown.words} = {shown.with_unit(float(data['value']), 6)}"
    return (
        f"{where}: {which}{stability}, repeats after {cycles} T, largest multiplier {numeral(modulus, 4)}. "
        f"{_pattern_words(orbit)}"
    )


def _pattern_words(orbit: Orbit) -> str:
    """The impacts of a motion in order, the first few by name."""
    pattern = orbit.pattern
    if not pattern:
        return "No impact."
    named = ", ".join(f"{clearance} {side}" for clearance, side in pattern[:_MOST_IMPACTS])
    more = f", {len(pattern) - _MOST_IMPACTS} more" if len(pattern) > _MOST_IMPACTS else ""
    return f"{counted(len(pattern), 'impact')}: {named}{more}."


def _clearances(branch: Branch, orbits: list[Orbit], count: int) -> list[dict[str, Any]]:
    """Return the frame of every clearance, and the curves of all motions in it."""
    # frames common to all motions, and pixels by unit
    frames = [_frame(branch, orbits, k) for k in range(count)]
    spans = np.array([[np.ptp(frame["x_range"]), np.ptp(frame["y_range"])] for frame in frames])
    factors = np.array([frame.pop("factors") for frame in frames])
    drawn: list[list[NDArray[np.int16]]] = [[] for _ in frames]
    starts: list[list[list[int]]] = [[] for _ in frames]
    scales = np.array(SCREEN) / spans
    # curves with as few points as a screen needs, the start of every period among them
    for orbit in orbits:
        begins = orbit.period / orbit.cycles * np.arange(orbit.cycles)
        for k, (time, points) in enumerate(fine_curves(orbit, count, factors * scales)):
            shown = points * factors[k]
            ends = np.searchsorted(time, begins * (1.0 - 1e-12))
            kept = np.union1d(thinned(shown * scales[k], WITHIN), ends)
            # whole numbers of 16 bits over the frame
            ranges = (frames[k]["x_range"], frames[k]["y_range"])
            drawn[k].append(np.stack([_whole(shown[kept, i], ranges[i]) for i in range(2)], axis=-1))
            starts[k].append(np.searchsorted(kept, ends).tolist())
    return [
        frame
        | {
            "counts": [len(curve) for curve in curves],
            "starts": begun,
            "curves": b64encode(np.concatenate(curves).tobytes()).decode("ascii"),
        }
        for frame, curves, begun in zip(frames, drawn, starts, strict=True)
    ]


def _frame(branch: Branch, orbits: list[Orbit], k: int) -> dict[str, Any]:
    """Return ranges and titles of the phase plane of a clearance; ``factors`` from SI to its units."""
    layout = orbits[0].run.trajectory.layout
    unit = units_of(branch.model, layout, k)
    curves = np.concatenate([_curve(orbit, k) for orbit in orbits], axis=1)
    across = scale(np.concatenate([curves[0], layout.corners[k]]), unit["deflection"])
    up = scale(curves[1], unit["rate"])
    x = curves[0] * across.factor
    y = curves[1] * up.factor
    corners = layout.corners[k] * across.factor
    room = 0.08 * (float(np.ptp(y)) or 1.0)
    bands, _ = shading(layout, k, across.factor)
    name = layout.clearance_names[k]
    return {
        "name": name,
        "x_range": list(reach(x, corners)),
        "y_range": [float(y.min()) - room, float(y.max()) + room],
        "x_title": f"deflection [{across.unit}]" if across.unit else "deflection",
        "y_title": f"{name}: rate [{up.unit}]" if up.unit else f"{name}: rate",
        "corners": corners.tolist(),
        "bands": [{"low": band.low, "high": band.high, "colour": band.colour} for band in bands],
        "factors": [across.factor, up.factor],
    }


def _curve(orbit: Orbit, k: int) -> Array:
    """(2, S) deflection and rate of a clearance at the samples of a motion."""
    trajectory = orbit.run.trajectory
    rate = deflection_rate(orbit.model, trajectory, int(trajectory.layout.clearance[k]))
    return np.stack([trajectory.deflection[:, k], rate])


def _whole(values: Array, ends: Sequence[float]) -> NDArray[np.int16]:
    """Values as whole numbers between both ends of a range."""
    share = np.clip((values - ends[0]) / (ends[1] - ends[0]), 0.0, 1.0)
    return np.round((2.0 * share - 1.0) * _WHOLE).astype("<i2")


def _rounded(values: Array) -> list[float]:
    """Finite numbers with a few digits, for JSON."""
    return [float(f"{value:.{_DIGITS}g}") for value in values.tolist()]
