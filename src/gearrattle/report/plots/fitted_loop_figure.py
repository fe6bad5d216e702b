"""A measured torque-angle loop and the law fitted to it: the law's loop over the samples, and the residuals."""

from __future__ import annotations

import numpy as np

from gearrattle.measured.identification.loop_result import LoopFit
from gearrattle.report.plots.chart import Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.motion_window import scale
from gearrattle.report.plots.palette import ACCENT, CENTRE, MUTED

_POINTS = 6000
_DEGREES = 180.0 / np.pi


def loop_chart(fit: LoopFit) -> Chart:
    """Draw a fit over the samples that it comes from."""
    # measured samples, thinned, and the loop of the fitted law
    deflection, torque = fit.measured
    part = slice(None, None, max(1, deflection.size // _POINTS))
    loop = fit.drawn()
    torque_scale = scale(torque, "N m")
    left = scale(fit.residuals, "N m")
    margin = 0.03 * float(np.ptp(deflection)) * _DEGREES
    reach = (float(deflection.min()) * _DEGREES - margin, float(deflection.max()) * _DEGREES + margin)
    # rules at the ends of the stages
    corners = [s.until for s in fit.stages if s.until] + [-s.until for s in fit.coast_stages if s.until]
    rules = tuple(Rule(corner * _DEGREES, "x") for corner in sorted(corners))
    x = deflection[part] * _DEGREES
    # measured and fitted torque over deflection [degrees]
    over = (
        Line(x, torque[part] * torque_scale.factor, "measured", MUTED, "points", 2.0, 0.5),
        Line(loop.deflection * _DEGREES, loop.elastic * torque_scale.factor, "without friction", CENTRE, width=1.0),
        Line(loop.deflection * _DEGREES, loop.torque * torque_scale.factor, "fitted law", ACCENT, width=1.6),
    )
    # residuals over deflection
    residuals = (Line(x, fit.residuals[part] * left.factor, "measured less fitted", MUTED, "points", 2.0, 0.5),)
    title = "deflection  [°]"
    return Chart(
        key="loop",
        title="Torque-angle loop",
        caption=(
            f"Torque over deflection as measured, and the loop of the law fitted to it ({fit.name}); below, measured "
            "less fitted torque. Dotted: ends of stages."
        ),
        panels=(
            Panel(fit.name, torque_scale.unit, title, over, rules=rules, x_range=reach),
            Panel("measured less fitted", left.unit, title, residuals, rules=rules, x_range=reach),
        ),
        panel_height=300,
        legend=(Key("measured", MUTED), Key("fitted law", ACCENT), Key("without friction", CENTRE)),
    )
