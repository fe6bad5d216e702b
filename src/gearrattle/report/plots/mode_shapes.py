"""Mode shapes on the driveline: the angles of the inertias, and the strain energy of the elements.

Every mode is one SVG file. The length of a body's stem, up or down, is its angle over the largest angle; the tips of
bodies on one shaft line are connected. Elements with a small share of the mode's strain energy are thin and grey, those
with a large share are thick and crimson; the latter are labelled with their share.
"""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from gearrattle.report.plots import driveline
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.palette import ACCENT, INK, MUTED, PAPER
from gearrattle.trajectory import Array, Layout

if TYPE_CHECKING:
    from gearrattle.analysis.statics import Modes

_FRAME = driveline.Frame(pitch_x=118, pitch_y=138, left=54, right=82, top=112, bottom=66)
_TALLEST = 34.0
_FAINTEST = "#b9c2cc"
_STRONGEST = "#a8123e"
_FONT = "'Helvetica Neue', Helvetica, 'Liberation Sans', Arial, sans-serif"
_STYLE = (
    f".disc{{fill:#eef2f5;stroke:{MUTED};stroke-width:1.2}} .link{{fill:none;stroke-linejoin:round;"
    f"stroke-linecap:round}} text{{paint-order:stroke;stroke:{PAPER};stroke-width:4px;stroke-linejoin:round}} "
    f".name{{fill:{INK};font-weight:600}} .title{{fill:{INK};font-weight:600;font-size:15px}} "
    f".share{{fill:{_STRONGEST};font-weight:600}} .value{{fill:{ACCENT}}}"
)


def mode_sketch(layout: Layout, modes: Modes, mode: int, title: str) -> bytes:
    """Draw one mode of a driveline under a title, as an SVG file."""
    # size, with room for the names of meshes and the title
    scene = driveline.scene(layout, _FRAME)
    width, height = scene.size
    meshes = [len(name) for name, mesh in zip(layout.element_names, layout.is_mesh, strict=True) if mesh]
    width += max(0.0, 32.0 + 8.0 * max(meshes, default=0) - _FRAME.right)
    width = max(width, _FRAME.left + 8.5 * len(title))
    # elements by ascending strain energy
    shares = np.nan_to_num(modes.strain_energy[:, mode])
    works = modes.works_in(mode)
    angles = _angles(layout, modes, mode)
    names = layout.inertia_names
    drawn = [f'<text class="title" x="12" y="24">{escape(title)}</text>']
    for element in np.argsort(shares, kind="stable").tolist():  # words of those that work stand on top
        if layout.is_bearing[element]:
            continue
        name = layout.element_names[element]
        share = float(shares[element])
        words = [f'<tspan class="name">{escape(name)}</tspan>', f'<tspan class="share">{_percent(share)}</tspan>']
        line = driveline.element(scene, element, _mixed(share), words if name in works else [])
        drawn.append(f'<g stroke-width="{1.6 + 3.0 * share:.2f}">{line}</g>')
    # bodies with their angles, and the shape along each shaft line
    drawn += [f'<g stroke-width="1.6">{ground}</g>' for ground in driveline.frames(scene)]
    drawn += [
        _body(scene, body, angles, is_held=names[body] not in modes.inertia_names) for body in scene.placement.bodies
    ]
    drawn += [_shape(scene, angles)]
    # the SVG with its description
    words_of_shape = ", ".join(f"{n} {numeral(v, 2)}" for n, v in zip(names, angles.tolist(), strict=True))
    document = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" width="{width:g}" '
        f'height="{height:g}" font-family="{_FONT}" font-size="13" fill="{MUTED}"><title>{escape(title)}</title>'
        f"<desc>{escape(words_of_shape)}</desc><style>{_STYLE}</style>{''.join(drawn)}</svg>\n"
    )
    return document.encode("utf-8")


def _angles(layout: Layout, modes: Modes, mode: int) -> Array:
    """(n,) angles of all inertias; one of prescribed motion is held fast in every mode."""
    by_name = dict(zip(modes.inertia_names, modes.shapes[:, mode].tolist(), strict=True))
    return np.array([by_name.get(name, 0.0) for name in layout.inertia_names])


def _body(scene: driveline.Scene, body: int, angles: Array, *, is_held: bool) -> str:
    """Draw one body with its name and angle, clear of its stem."""
    angle = float(angles[body])
    tip = _TALLEST * angle
    words = [
        f'<tspan class="name">{escape(scene.layout.inertia_names[body])}</tspan>',
        f'<tspan class="value">{"held" if is_held else _angle(angle)}</tspan>',
    ]
    return driveline.body(scene, body, words, up=max(tip, 0.0) + 4.0, down=max(-tip, 0.0) + 4.0)


def _shape(scene: driveline.Scene, angles: Array) -> str:
    """Draw the stems, and a line from tip to tip wherever an element runs along a shaft line."""
    tips = {
        body: (*scene.at(body, -1), scene.at(body, -1)[1] - _TALLEST * float(angles[body]))
        for body in scene.placement.bodies
    }
    joined = []
    for element, pair in enumerate(scene.layout.between.tolist()):
        if element in scene.placement.seats or scene.layout.is_bearing[element]:
            continue
        (x_a, y_a, tip_a), (x_b, y_b, tip_b) = (
            tips[end] if end >= 0 else (*scene.at(end, element), scene.at(end, element)[1]) for end in pair
        )
        if y_a == y_b and abs(x_a - x_b) <= 3 * scene.frame.pitch_x:
            joined.append(f"M{x_a:g} {tip_a:.1f}L{x_b:g} {tip_b:.1f}")
    stems = "".join(f"M{x:g} {y:g}V{tip:.1f}" for x, y, tip in tips.values())
    dots = "".join(f'<circle cx="{x:g}" cy="{tip:.1f}" r="3.6"/>' for x, _, tip in tips.values())
    return (
        f'<path d="{"".join(joined)}" stroke="{ACCENT}" stroke-width="1.2" stroke-dasharray="4 3" fill="none"/>'
        f'<path d="{stems}" stroke="{ACCENT}" stroke-width="3" fill="none"/><g fill="{ACCENT}">{dots}</g>'
    )


def _mixed(share: float) -> str:
    """Return the colour of a share of strain energy."""
    pairs = [(int(_FAINTEST[k : k + 2], 16), int(_STRONGEST[k : k + 2], 16)) for k in (1, 3, 5)]
    return "#" + "".join(f"{round(low + (high - low) * min(max(share, 0.0), 1.0)):02x}" for low, high in pairs)


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if share >= 0.01 else f"{numeral(100.0 * share, 1)} %"


def _angle(value: float) -> str:
    return "0" if abs(value) < 5e-4 else numeral(round(value, 3), 3)
