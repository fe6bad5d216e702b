"""What is known without simulation, as tables: where the driveline rests and how it vibrates.

Takes Findings; gives Tables to the page.
"""

from __future__ import annotations

import math
from html import escape
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from gearrattle.pipeline import Findings
from gearrattle.plots.numerals import engineering, numeral
from gearrattle.report.tables import Table
from gearrattle.trajectory import Array

if TYPE_CHECKING:
    from gearrattle.calls.statics import Modes

_RIGID = 1e-6
"""Below this share of the highest frequency a mode counts as rigid: no energy is stored."""


def rest_table(findings: Findings) -> Table:
    """Return the static deflection of every element, with the region it rests in."""
    layout = findings.run.trajectory.layout
    si = findings.model.units == "SI"
    rest = findings.equilibrium
    rows = []
    for name, mesh in zip(layout.element_names, layout.is_mesh, strict=True):
        deflection = rest.deflection.get(name)
        region = rest.region.get(name)
        unit = ("m" if mesh else "rad") if si else ""
        rows.append((name, engineering(deflection, unit, 4), "linear" if region is None else _region(region)))
    note = "Under the mean loads, transmission errors at zero."
    if np.any(np.abs(rest.acceleration) > 0.0):
        pairs = zip(layout.inertia_names, rest.acceleration.tolist(), strict=True)
        note += " The means do not balance, so it accelerates: " + ", ".join(
            f"{name} {engineering(value, 'rad/s²' if si else '')}" for name, value in pairs if value != 0.0
        )
        note += "."
    return Table(("element", "deflection", "rests in"), tuple(rows), frozenset({0, 2}), "Static rest", note)


def _region(label: int) -> str:
    if label == 0:
        return "centre"
    return f"drive side, stage {label}" if label > 0 else f"coast side, stage {-label}"


def modes_tables(findings: Findings) -> list[Table]:
    """Return natural frequencies and shapes about the static rest and, if they differ, with all clearances closed."""
    rest, contact = findings.modes, findings.modes_contact
    if np.array_equal(rest.frequencies, contact.frequencies):
        words = "About the static rest, where every clearance is in its outermost drive stage."
        return [_modes_table(findings, rest, "Modes", words)]
    return [
        _modes_table(findings, rest, "Modes about the static rest", "Every clearance in the region it rests in."),
        _modes_table(findings, contact, "Modes in contact", "Every clearance closed: the stiffest the driveline gets."),
    ]


def _modes_table(findings: Findings, modes: Modes, title: str, note: str) -> Table:
    si = findings.model.units == "SI"
    omega = findings.run.trajectory.layout.omega
    highest = float(np.max(modes.frequencies, initial=0.0))
    rows = []
    for index in np.argsort(modes.frequencies, kind="stable").tolist():
        frequency = float(modes.frequencies[index])
        rigid = frequency <= _RIGID * highest
        shown = numeral(frequency / (2.0 * math.pi) if si else frequency)
        order, damping = numeral(frequency / omega, 3), f"{numeral(100.0 * float(modes.damping_ratios[index]), 3)} %"
        shape = np.real(modes.shapes[:, index])
        rows.append(
            (
                "rigid" if rigid else shown,
                "–" if rigid else order,
                "–" if rigid else damping,
                _shape(shape, modes.inertia_names),
            )
        )
    head = ("frequency [Hz]" if si else "frequency", "order", "damping", "shape: " + ", ".join(modes.inertia_names))
    return Table(head, tuple(rows), frozenset({3}), title, note)


def _shape(shape: Array, names: tuple[str, ...]) -> str:
    """Draw a mode shape as upright bars, one a body in file order."""
    largest = float(np.max(np.abs(shape))) or 1.0
    step = 18
    bars = "".join(
        f'<rect x="{3 + step * i}" y="{13 - 11 * max(v, 0.0):.1f}" width="11" height="{max(11 * abs(v), 0.6):.1f}"/>'
        for i, v in enumerate((shape / largest).tolist())
    )
    width = step * len(names)
    told = escape(", ".join(f"{n} {numeral(v, 2)}" for n, v in zip(names, (shape / largest).tolist(), strict=True)))
    return Markup(
        f'<svg class="shape" viewBox="0 0 {width} 26" width="{width}" height="26" role="img" aria-label="{told}">'
        f"<title>{told}</title>"
        f'<path d="M0 13 H{width}"/>{bars}</svg>'
    )
