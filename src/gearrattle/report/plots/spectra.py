"""Power spectral densities of the accelerations over the steady part, by orders of the reference speed.

Lines at the excited orders are response; a raised floor between them is what an engineer hears as rattle. Dotted rules
mark the natural frequencies with every clearance closed, where impacts ring.
"""

from __future__ import annotations

import numpy as np

from gearrattle.pipeline import Findings
from gearrattle.report.plots.chart import Chart, Line, Panel, Rule
from gearrattle.report.plots.chosen import chosen_bodies
from gearrattle.report.plots.palette import MUTED
from gearrattle.signals import Spectrum

_DECADES = 12.0
_RIGID = 1e-6


def spectra(findings: Findings) -> Chart | None:
    """Draw the spectrum of every body's acceleration; None where the samples are too few for one."""
    trajectory = findings.motion.trajectory
    layout = trajectory.layout
    spectrum = findings.verdict.spectra
    if spectrum is None:
        return None
    order = spectrum.frequency * 2.0 * np.pi / layout.omega
    highest = float(order[-1])
    natural = np.sort(findings.modes_contact.frequencies)
    elastic = natural[natural > _RIGID * natural.max(initial=0.0)] / layout.omega
    rules = tuple(
        Rule(float(value), "x", MUTED, label=f"f{position}")
        for position, value in enumerate(elastic, start=1)
        if value < highest
    )
    si = findings.model.units == "SI"
    chosen, left_out = chosen_bodies(findings)
    panels = tuple(
        Panel(
            title=layout.inertia_names[i],
            unit="(rad/s²)²/Hz" if si else "",
            x_title=_order_title(findings),
            lines=(Line(order[1:], spectrum.density[1:, i], layout.inertia_names[i], width=1.0),),
            rules=rules,
            x_range=(0.0, highest),
            y_range=_limits(spectrum, i),
            y_log=True,
        )
        for i in chosen
    )
    caption = (
        f"Power spectral density of the angular accelerations, steady part ({spectrum.window}). Lines stand at the "
        "excited orders; a raised floor between them is broadband rattle. Dotted: natural frequencies with every "
        f"clearance closed, f1 the lowest above zero.{left_out}"
    )
    return Chart("spectrum", "Spectra", caption, panels, panel_height=116)


def _order_title(findings: Findings) -> str:
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
