"""A sketch of the driveline: bodies, springs, gaps and gears, coloured by regime and severity.

It is an inline SVG. Bodies are discs seen from the side, higher for larger inertia. An element that rattles has the
colour of its regime, and is labelled with the regime and its rate of impacts; an element that touches has the colour
and word of its severity. So no meaning depends on colour alone.
"""

from __future__ import annotations

from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING

from gearrattle.assembly import own_mean
from gearrattle.quantities.verdict_parts import worst_first
from gearrattle.report.plots import driveline
from gearrattle.report.plots.numerals import numeral, quantity
from gearrattle.report.plots.palette import MUTED, STATES
from gearrattle.report.plots.symbols import LINE_HEIGHT
from gearrattle.signals import is_same_mesh, parts_of
from gearrattle.wording import counted

if TYPE_CHECKING:
    from gearrattle.model import Torque
    from gearrattle.pipeline import Findings
    from gearrattle.quantities.verdict_parts import Part

_FRAME = driveline.Frame(pitch_x=196, pitch_y=200, left=92, right=150, top=104, bottom=96)


def sketch(findings: Findings) -> str:
    """Draw the driveline: one ``<svg>`` with its size in its viewBox, a title and a description for screen readers."""
    layout = findings.motion.trajectory.layout
    parts = {part.name: part for part in findings.verdict.parts}
    cycles = None if findings.verdict.event is None else findings.verdict.window.cycles
    bearings = [_bearings(findings, body, cycles) for body in range(len(layout.inertia_names))]
    scene = _with_room(driveline.scene(layout, _FRAME), bearings)
    width, height = scene.size
    drawn = []
    for element in range(len(layout.element_names)):
        flanks = [k for k in range(len(layout.element_names)) if is_same_mesh(layout, k, element)]
        if layout.is_bearing[element] or flanks[0] < element:
            continue
        names = [layout.element_names[k] for k in flanks]
        judged = worst_first([parts[name] for name in names if name in parts])
        colour = STATES[_state(judged[0])] if judged else MUTED
        label = [line for name in names for line in _label(name, parts.get(name), cycles)]
        drawn.append(driveline.element(scene, element, colour, label))
    drawn += driveline.frames(scene)
    drawn += [
        driveline.body(scene, body, [*_words(findings, body), *bearings[body]]) for body in scene.placement.bodies
    ]
    words = escape(f"{findings.model.name}: {findings.verdict.sentence}")
    return (
        f'<svg class="sketch" viewBox="0 0 {width} {height}" style="max-width:{width}px" role="img" '
        f'aria-label="Driveline sketch"><title>Driveline sketch</title><desc>{words}</desc>{"".join(drawn)}</svg>'
    )


def _with_room(scene: driveline.Scene, bearings: list[list[str]]) -> driveline.Scene:
    """Leave room for the lines on bearings: above the uppermost bodies, below the lowest ones, and between the rows."""
    rows = {body: row for body, (_, row) in scene.placement.bodies.items()}
    ends = (min(rows.values()), max(rows.values()))
    above, below = (max(len(bearings[body]) for body, row in rows.items() if row == end) for end in ends)
    between = max((len(bearings[body]) for body, row in rows.items() if row not in ends), default=0)
    frame = replace(
        scene.frame,
        top=scene.frame.top + LINE_HEIGHT * above,
        bottom=scene.frame.bottom + LINE_HEIGHT * below,
        pitch_y=scene.frame.pitch_y + LINE_HEIGHT * between,
    )
    return replace(scene, frame=frame)


def _words(findings: Findings, body: int) -> list[str]:
    """Name one body, its inertia and its loads."""
    layout = findings.motion.trajectory.layout
    name = layout.inertia_names[body]
    inertia = inertia_words(float(layout.inertia[body]), is_si=findings.model.units == "SI")
    lines = [f'<tspan class="name">{escape(name)}</tspan>', f"J = {inertia}"]
    return lines + [f'<tspan class="load">{words}</tspan>' for words in _loads(findings, name)]


def _bearings(findings: Findings, body: int, cycles: int | None) -> list[str]:
    """Name the bearings with a clearance that hold one body, and say how they do."""
    layout = parts_of(findings.motion.trajectory.layout)
    parts = {part.name: part for part in findings.verdict.parts}
    held = [k for k in layout.clearance.tolist() if layout.is_bearing[k] and layout.between[k, 0] == body]
    names = [layout.element_names[k] for k in held]
    return [line for name in names for line in _label(name, parts.get(name), cycles)]


def _unit(findings: Findings, unit: str) -> str:
    """Return the unit, or nothing in a dimensionless model."""
    return unit if findings.model.units == "SI" else ""


def _loads(findings: Findings, name: str) -> list[str]:
    """Say what drives and what drags one body."""
    is_si = findings.model.units == "SI"
    words = [
        f"↻ {torque_words(torque, is_si=is_si, mean=own_mean(findings.model, index))}"
        for index, torque in enumerate(findings.model.torques)
        if torque.on == name
    ]
    words += ["↻ a prescribed motion" for motion in findings.model.motions if motion.on == name]
    inertia = next(i for i in findings.model.inertias if i.name == name)
    if inertia.drag_torque:
        words.append(f"drag {quantity(inertia.drag_torque, _unit(findings, 'N m'))}")
    return words


def inertia_words(inertia: float, *, is_si: bool) -> str:
    """Write an inertia, as every drawing of a driveline does."""
    return quantity(inertia, "kg m²" if is_si else "")


def torque_words(torque: Torque, *, is_si: bool, mean: float | None = None) -> str:
    """Say in short what a torque is: its mean, its orders, whether there is a record; of one that balances, which."""
    only_mean = not torque.harmonics and torque.signal is None
    own = mean if isinstance(torque.mean, str) else torque.mean
    words = "" if own is None else quantity(own, "N m" if is_si else "")
    if isinstance(torque.mean, str):
        words = f"{torque.mean}: {words}" if words else torque.mean
    pieces = [words] if torque.mean or only_mean else []
    orders = [numeral(term.order) for term in torque.harmonics]
    if orders:
        listed = ", ".join(orders) if len(orders) <= 4 else f"{orders[0]} … {orders[-1]}"
        pieces.append(f"order{'s' if len(orders) > 1 else ''} {listed}")
    if torque.signal is not None:
        pieces.append("a record")
    if torque.ramps:
        levels = [quantity(ramp.to, "N m" if is_si else "") for ramp in torque.ramps]
        pieces.append(f"then {', '.join(levels)}")
    return ", ".join(pieces)


def _state(part: Part) -> str:
    """Return the regime of what rattles, else the severity."""
    return part.regime if part.rattles else part.severity


def _rate(part: Part, cycles: int | None) -> str:
    """Say how often a part hits: each cycle, or in the cycles of a transient."""
    if cycles is None:
        return f"{numeral(part.impacts_per_cycle, 3)} per cycle"
    return counted(round(part.impacts_per_cycle * cycles), "impact")


def _label(name: str, part: Part | None, cycles: int | None) -> list[str]:
    lines = [f'<tspan class="name">{escape(name)}</tspan>']
    if part is not None:
        colour = STATES[_state(part)]
        is_staged = part.regime != "quiet" and not part.separates
        words = [
            "changes stage" if is_staged else _state(part),
            *([_rate(part, cycles)] * (part.regime != "quiet")),
        ]
        lines += [f'<tspan class="regime" fill="{colour}">{word}</tspan>' for word in words]
    return lines
