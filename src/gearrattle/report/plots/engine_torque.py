"""The torque of an engine as figures: over the crank angle of a cycle, and its harmonics."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearrattle.measured.gas_torque import GasTorque
from gearrattle.model.engine import Wave
from gearrattle.report.plots.chart import Bars, Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.palette import ACCENT, CENTRE, COAST, INK
from gearrattle.trajectory import Array

_CYCLE = 720.0
_POINTS = 1441


def engine_charts(engine: GasTorque) -> list[Chart]:
    """Draw the torque over a cycle of four strokes from its harmonics, and their amplitudes."""
    # gas and inertia torque over the crank angle of a cycle
    angle = np.linspace(0.0, _CYCLE, _POINTS)
    gas, masses = (_sum(waves, angle) for waves in (engine.gas, engine.masses))
    lines = [Line(angle, engine.mean + gas, "gas", ACCENT, width=1.2)]
    if engine.masses:
        lines.append(Line(angle, masses, "oscillating masses", COAST, width=1.2))
    lines.append(Line(angle, engine.mean + gas + masses, "together", INK, width=1.8))
    ticks = tuple((float(value), str(value)) for value in range(0, 721, 90))
    rules = (Rule(0.0, dashed=False), Rule(engine.mean, label="mean"))
    # the chart over the crank angle
    over_angle = Panel(
        "torque",
        "N m",
        "crank angle of the first cylinder  [°]",
        tuple(lines),
        rules=rules,
        x_range=(0.0, _CYCLE),
        x_ticks=ticks,
    )
    legend = tuple(Key(line.name, line.colour) for line in lines)
    caption = "Torque on the crankshaft over one cycle of four strokes, from its mean and its harmonics."
    charts = [Chart("torque", "Torque over a cycle", caption, (over_angle,), panel_height=280, legend=legend)]
    # amplitudes by order
    if engine.harmonics:
        order = np.array([wave.order for wave in engine.harmonics])
        half = 0.35 * float(np.diff(order).min()) if order.size > 1 else 0.2
        bars = tuple(
            Bars(np.array([wave.order - half, wave.order + half]), np.array([wave.amplitude]), "amplitude", CENTRE)
            for wave in engine.harmonics
        )
        panel = Panel("amplitude", "N m", "order of the crankshaft", bars=bars, x_range=(0.0, float(order[-1]) + 1.0))
        words = "Amplitudes of the harmonics of gas and masses together."
        charts.append(Chart("harmonics", "Harmonics", words, (panel,), panel_height=200))
    return charts


def _sum(waves: Sequence[Wave], angle: Array) -> Array:
    """Sum harmonics over crank angles [deg]."""
    phi = np.radians(angle)
    return sum((w.amplitude * np.sin(w.order * phi + w.phase) for w in waves), np.zeros_like(phi))
