"""Power spectral densities of the accelerations over the steady part, by orders of the reference speed.

Lines at the excited orders are response; a raised floor between them is what an engineer hears as rattle. Dotted rules
mark the natural frequencies with every clearance closed, where impacts ring. Along a sweep the axis is the frequency.
"""

from __future__ import annotations

import numpy as np

from gearrattle.pipeline import Findings
from gearrattle.report.plots.chart import Chart, Line, Panel, Rule
from gearrattle.report.plots.chosen_parts import chosen_bodies
from gearrattle.report.plots.palette import MUTED
from gearrattle.signals import Spectrum
from gearrattle.trajectory import Layout

_DECADES = 12.0
_RIGID = 1e-6


def spectra(findings: Findings) -> Chart | None:
    """Draw the spectrum of every body's acceleration; None where the samples are too few for one."""
    # frequencies as orders of the reference speed; along a sweep in Hz
    trajectory = findings.motion.trajectory
    layout = trajectory.layout
    spectrum = findings.verdict.spectra
    if spectrum is None:
        return None
    unit = layout.omega if layout.ramp is None else 2.0 * np.pi  # one of the axis, in rad/s
    along = spectrum.frequency * 2.0 * np.pi / unit
    highest = float(along[-1])
    # rules at elastic natural frequencies
    natural = np.sort(findings.modes_contact.frequencies)
    elastic = natural[natural > _RIGID * natural.max(initial=0.0)] / unit
    rules = tuple(
        Rule(float(value), "x", MUTED, label=f"f{position}")
        for position, value in enumerate(elastic, start=1)
        if value < highest
    )
    # density of every chosen body, without the mean
    si = findings.model.units == "SI"
    chosen, left_out = chosen_bodies(findings)
    panels = tuple(
        Panel(
            title=layout.inertia_names[i],
            unit="(rad/s²)²/Hz" if si else "",
            x_title=_order_title(findings),
            lines=(Line(along[1:], spectrum.density[1:, i], layout.inertia_names[i], width=1.0),),
            rules=rules,
            x_range=(0.0, highest),
            y_range=_limits(spectrum, i),
            y_log=True,
        )
        for i in chosen
    )
    caption = (
        f"Power spectral density of the angular accelerations, steady part ({spectrum.window}). "
        f"{_words_of_orders(layout)}Dotted: natural frequencies with every "
        f"clearance closed, f1 the lowest above zero.{left_out}"
    )
    return Chart("spectrum", "Spectra", caption, panels, panel_height=116)


def _words_of_orders(layout: Layout) -> str:
    """Say where the excited orders stand."""
    if layout.ramp is not None:
        return "The speed changes, so that an excited order is spread over the frequencies that it passes. "
    return "Lines stand at the excited orders; a raised floor between them is broadband rattle. "


def _order_title(findings: Findings) -> str:
    if findings.motion.trajectory.layout.ramp is not None:
        return "frequency  (Hz)" if findings.model.units == "SI" else "frequency"
    omega = findings.motion.trajectory.layout.omega
    if findings.model.units != "SI":
        return "order of the reference speed"
    return f"order of the reference speed  (order 1 = {omega / (2.0 * np.pi):.4g} Hz)"


def _limits(spectrum: Spectrum, body: int) -> tuple[float, float]:
    """Return limits of at most a dozen decades, so that rounding noise of a smooth run fills no panel."""
    density = spectrum.density[1:, body]
    positive = density[density > 0.0]
    if not positive.size:
        return 1e-12, 1.0
    high = 10.0 ** np.ceil(np.log10(positive.max()))
    low = max(10.0 ** np.floor(np.log10(positive.min())), high * 10.0**-_DECADES)
    return float(low), float(high)
