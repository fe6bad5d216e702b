"""Sounds as figures: pressure over time, and spectra of all designs in one panel."""

from __future__ import annotations

import numpy as np

from gearrattle.report.plots.chart import Chart, Key, Line, Panel
from gearrattle.report.plots.motion_window import DETAIL_POINTS
from gearrattle.report.plots.palette import COLOURS, INK
from gearrattle.report.plots.thinning import thin
from gearrattle.report.sound.listen import Sound
from gearrattle.signals.cross_spectra import cut, power_density

_MOST_DESIGNS = 8
_SEGMENT = 8192
_LOWEST = 20.0  # Hz, lowest audible frequency
_DECADES = 8.0


def sound_charts(sound: Sound) -> list[Chart]:
    """Draw the first eight designs that are longer than a segment of samples; empty for silence."""
    # designs that can be heard, the first few
    designs = [
        (name, pressure) for name, pressure in zip(sound.names, sound.pressure, strict=True) if pressure.size > 1
    ][:_MOST_DESIGNS]
    if not any(pressure.any() for _, pressure in designs):
        return []
    colours = [INK, *COLOURS]
    waves = []
    spectra = []
    # pressure over time, thinned, and power spectral density by Welch's method
    for i, (name, pressure) in enumerate(designs):
        index = thin(pressure, DETAIL_POINTS)
        colour = colours[i % len(colours)]
        time = Line(index / sound.rate, pressure[index], name, colour, width=0.8)
        span = (0.0, pressure.size / sound.rate)
        waves.append(Panel(name, "Pa", "time  [s]", (time,), x_range=span))
        segments = cut(pressure.size, min(_SEGMENT, pressure.size), 0.5, "hann")
        frequency, density = power_density(pressure, sound.rate, segments)
        there = (frequency >= _LOWEST) & (density > 0.0)
        spectra.append(Line(frequency[there], density[there], name, colour, width=1.0))
    # the chart of pressures
    largest = max(float(line.y.max(initial=0.0)) for line in spectra)
    legend = tuple(Key(line.name, line.colour) for line in spectra)
    charts = [
        Chart(
            "pressure",
            "Sound pressure",
            "Sound pressure of every design.",
            tuple(waves),
            panel_height=120,
            share_x=False,
        ),
    ]
    # the chart of densities, at most some decades below the largest
    if largest > 0.0:
        top = 10.0 ** np.ceil(np.log10(largest))
        least = min(float(line.y.min()) for line in spectra if line.y.size)
        bottom = max(10.0 ** np.floor(np.log10(least)), top * 10.0**-_DECADES)
        panel = Panel(
            "power spectral density",
            "Pa²/Hz",
            "frequency  [Hz]",
            tuple(spectra),
            x_log=True,
            y_log=True,
            x_range=(_LOWEST, 0.5 * sound.rate),
            y_range=(float(bottom), float(top)),
        )
        caption = "Power spectral density of the sound pressure of every design, all through one path."
        charts.append(Chart("spectrum", "Spectra", caption, (panel,), panel_height=300, legend=legend))
    return charts
