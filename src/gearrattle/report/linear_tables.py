"""Tables of the linear driveline, without a simulation: static equilibrium, modes and natural frequencies."""

from __future__ import annotations

import math
from html import escape
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from gearrattle.model.element_groups import element_groups
from gearrattle.pipeline import Findings
from gearrattle.report.plots.numerals import engineering, numeral
from gearrattle.report.tables import Table
from gearrattle.trajectory import Array

if TYPE_CHECKING:
    from gearrattle.analysis.statics import Equilibrium, Modes
    from gearrattle.model import Model

_MOST_NAMED = 16  # bodies; mode shapes of more bodies are given by names
_THIN = 0.03  # share of the largest bar: least height, so that a bar can be seen
_RIGID = 1e-6
"""A mode counts as rigid below this share of the highest frequency: it stores no energy."""


def elements_table(model: Model, rest: Equilibrium, title: str, note: str = "") -> Table:
    """Return the static deflection of every element, with its region; of a bearing the size of the displacement."""
    si = model.units == "SI"
    rows = []
    for name, elements in element_groups(model).items():
        unit = ("m" if elements[0].along_line else "rad") if si else ""
        deflection = rest.deflection[elements[0].name]
        where = _region_in_words(rest.region.get(elements[0].name))
        if len(elements) > 1:  # rows of unit length, at even angles over half a turn
            along = sum(rest.deflection[e.name] * complex(e.pushes[0].x, e.pushes[0].y) for e in elements)
            deflection = abs(along) * 2.0 / len(elements)
            labels = [rest.region.get(element.name) for element in elements]
            where = "linear" if labels[0] is None else "contact" if any(labels) else "centre"
        rows.append((name, engineering(deflection, unit, 4), where))
    return Table(("element", "deflection", "rests in"), tuple(rows), frozenset({0, 2}), title, note)


def rest_table(findings: Findings) -> Table:
    """Return the static deflections; if the means do not balance, also the accelerations."""
    layout = findings.motion.trajectory.layout
    si = findings.model.units == "SI"
    rest = findings.equilibrium
    note = "Under the mean loads, transmission errors at zero."
    if np.any(np.abs(rest.acceleration) > 0.0):
        pairs = zip(layout.inertia_names, rest.acceleration.tolist(), strict=True)
        note += " The means do not balance, so it accelerates: " + ", ".join(
            f"{name} {engineering(value, 'rad/s²' if si else '')}" for name, value in pairs if value != 0.0
        )
        note += "."
    return elements_table(findings.model, rest, "Static rest", note)


def _region_in_words(label: int | None) -> str:
    """Return a region label in words; None is the label of an element without corners."""
    if not label:
        return "linear" if label is None else "centre"
    return f"drive side, stage {label}" if label > 0 else f"coast side, stage {-label}"


def modes_tables(findings: Findings) -> list[Table]:
    """Return natural frequencies and shapes about the static rest and, if they differ, with all clearances closed."""
    rest = findings.modes
    contact = findings.modes_contact
    if np.array_equal(rest.frequencies, contact.frequencies):
        words = "About the static rest, where every clearance is in its outermost drive stage."
        return [_modes_table(findings, rest, "Modes", words)]
    return [
        _modes_table(findings, rest, "Modes about the static rest", "Every clearance in the region it rests in."),
        _modes_table(findings, contact, "Modes in contact", "Every clearance closed: the stiffest the driveline gets."),
    ]


def _modes_table(findings: Findings, modes: Modes, title: str, note: str) -> Table:
    # modes by ascending frequency; rigid ones store no energy
    si = findings.model.units == "SI"
    layout = findings.motion.trajectory.layout
    highest = float(np.max(modes.frequencies, initial=0.0))
    rows = []
    for index in np.argsort(modes.frequencies, kind="stable").tolist():
        frequency = float(modes.frequencies[index])
        rigid = frequency <= _RIGID * highest
        shown = numeral(frequency / (2.0 * math.pi) if si else frequency)
        order = numeral(frequency / layout.omega, 3) if layout.ramp is None else "–"
        damping = f"{numeral(100.0 * float(modes.damping_ratios[index]), 3)} %"
        shape = np.real(modes.shapes[:, index])
        rows.append(
            (
                "rigid" if rigid else shown,
                "–" if rigid else order,
                "–" if rigid else damping,
                _shape(shape, modes.inertia_names),
            )
        )
    # heads with units
    bodies = ", ".join(modes.inertia_names) if len(modes.inertia_names) <= _MOST_NAMED else "bodies in file order"
    head = ("frequency [Hz]" if si else "frequency", "order", "damping", f"shape: {bodies}")
    return Table(head, tuple(rows), frozenset({3}), title, note)


def _shape(shape: Array, names: tuple[str, ...]) -> str:
    """Draw a mode shape as vertical bars, one per body in file order; for many bodies, name those that move most."""
    largest = float(np.max(np.abs(shape))) or 1.0
    values = (shape / largest).tolist()
    step = 18 if len(names) <= _MOST_NAMED else 6
    bars = "".join(
        f"M{(i + 0.5) * step:g} {13.3 if abs(v) < _THIN else 13}v{-11 * v if abs(v) >= _THIN else -0.6:.1f}"
        for i, v in enumerate(values)
    )
    width = step * len(names)
    most = sorted(np.argsort(-np.abs(shape), kind="stable")[:_MOST_NAMED].tolist())
    left = len(names) - len(most)
    description = escape(
        ", ".join(f"{names[i]} {numeral(values[i], 2)}" for i in most) + (f", {left} more" if left else "")
    )
    return Markup(
        f'<svg class="shape" viewBox="0 0 {width} 26" width="{width}" height="26" role="img" '
        f'aria-label="{description}">'
        f"<title>{description}</title>"
        f'<path d="M0 13 H{width}"/><path class="bars" stroke-width="{0.6 * step:g}" d="{bars}"/></svg>'
    )
