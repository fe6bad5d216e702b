"""Densities and transfer functions with their limits as static SVG; dotted rules at natural frequencies.

With the stated probability, a transfer function is within a circle of radius r about its estimate H
(``signals.spectral.densities``): its gain is between |H| - r and |H| + r, and its phase within +- asin(r / |H|). If the
circle contains zero, the phase is unknown and not drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gearrattle.report.plots.chart import Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.order_maps import coherence_chart, raised
from gearrattle.report.plots.palette import ACCENT, MUTED
from gearrattle.report.plots.thinning import thin
from gearrattle.trajectory import Array

if TYPE_CHECKING:
    import xarray as xr

_POINTS = 2000
_DECADES = 12.0
_HEIGHT = 240


def spectra_charts(data: xr.Dataset, *, si: bool = True, natural: Sequence[float] = ()) -> list[Chart]:
    """Return every figure: the density; of two signals also that of the reference, and what they have in common.

    Frequencies are hertz in SI; ``natural`` frequencies [rad/s] are marked.
    """
    rules = natural_rules(data, natural)
    made = [density_chart(data, si=si, rules=rules)]
    if "reference" in data.attrs:
        made += [density_chart(data, "reference", si=si, rules=rules), cross_chart(data, si=si, rules=rules)]
        made.append(response_chart(data, si=si, rules=rules))
        names = {"coherence_low": "low", "coherence_high": "high"}
        kept = data[["coherence", *names]].rename(names)
        made.append(coherence_chart(kept.assign_attrs(data.attrs), si=si))
    return made


def density_chart(data: xr.Dataset, which: str = "channel", *, si: bool = True, rules: tuple[Rule, ...] = ()) -> Chart:
    """Draw a density between its limits, on a logarithmic axis; the mean, at frequency zero, is left out.

    ``which`` is "channel" or "reference". Frequencies are hertz in SI.
    """
    # the density and its limits, without frequency zero
    prefix = "" if which == "channel" else "reference_"
    values = {key: data[f"{prefix}psd{end}"].values[1:] for key, end in (("", ""), ("low", "_low"), ("high", "_high"))}
    frequency = data["frequency"].values[1:]
    words = _percent(data)
    # limits thin, the density above them
    lines = [
        _line(frequency, np.where(values[key] > 0.0, values[key], np.nan), label, colour, width)
        for key, label, colour, width in (
            ("low", f"{words} limit", MUTED, 0.7),
            ("high", f"{words} limit", MUTED, 0.7),
            ("", "density", ACCENT, 1.4),
        )
    ]
    name = str(data.attrs[which])
    caption = (
        f"Power spectral density of {name}, {data.attrs['averages']:.3g} averages, bins of "
        f"{data.attrs['resolution']:.4g} Hz; thin lines enclose it with a probability of {words}, for noise flat "
        f"across a bin.{_marked(rules)}"
    )
    # logarithmic axis over the decades of the density
    panel = Panel(
        name,
        raised(str(data[f"{prefix}psd"].attrs["units"])),
        _axis(si),
        tuple(lines),
        rules=rules,
        x_range=(0.0, float(frequency[-1])),
        y_range=_decades(values["low"], values[""], values["high"]),
        y_log=True,
    )
    legend = (Key("density", ACCENT), Key(f"{words} limits", MUTED))
    title = "Spectral density" if which == "channel" else "Spectral density of the reference"
    return Chart(f"{prefix}psd", title, caption, (panel,), panel_height=_HEIGHT, legend=legend)


def response_chart(data: xr.Dataset, *, si: bool = True, rules: tuple[Rule, ...] = ()) -> Chart:
    """Draw gain and phase of a transfer function between their limits."""
    # gain between |H| - r and |H| + r; limits that are not positive are left out
    frequency = data["frequency"].values[1:]
    words = _percent(data)
    gain = data["response_magnitude"].values[1:]
    radius = data["response_radius"].values[1:]
    low, high = (np.where(bound > 0.0, bound, np.nan) for bound in (gain - radius, gain + radius))
    label = f"{words} limit"
    upper = (
        _line(frequency, low, label, MUTED, 0.7),
        _line(frequency, high, label, MUTED, 0.7),
        _line(frequency, np.where(gain > 0.0, gain, np.nan), "gain", ACCENT, 1.4),
    )
    x = _axis(si)
    x_range = (0.0, float(frequency[-1]))
    unit = raised(str(data["response_magnitude"].attrs["units"]))
    # gain above, phase below
    panels = (
        Panel(
            "gain",
            "" if unit == "(1)/(1)" else unit,
            x,
            upper,
            rules=rules,
            x_range=x_range,
            y_range=_decades(gain, low, high),
            y_log=True,
        ),
        _phase_panel(data, x, rules),
    )
    # caption and legend
    caption = (
        f"Transfer function from {data.attrs['reference']} to {data.attrs['channel']}, {data.attrs['averages']:.3g} "
        f"averages; thin lines enclose it with a probability of {words}, and no phase is drawn where nothing is known "
        f"of it.{_marked(rules)}"
    )
    legend = (Key("transfer function", ACCENT), Key(f"{words} limits", MUTED))
    return Chart("response", "Transfer function", caption, panels, panel_height=_HEIGHT // 2 + 40, legend=legend)


def cross_chart(data: xr.Dataset, *, si: bool = True, rules: tuple[Rule, ...] = ()) -> Chart:
    """Draw magnitude and phase of a cross density; its phase is the transfer function's, with the same limits."""
    frequency = data["frequency"].values[1:]
    words = _percent(data)
    size = data["cross_magnitude"].values[1:]
    line = _line(frequency, np.where(size > 0.0, size, np.nan), "cross density", ACCENT, 1.4)
    unit = raised(str(data["cross_magnitude"].attrs["units"])).replace("*", "·")
    x = _axis(si)
    ends = (0.0, float(frequency[-1]))
    panels = (
        Panel("magnitude", unit, x, (line,), rules=rules, x_range=ends, y_range=_decades(size), y_log=True),
        _phase_panel(data, x, rules),
    )
    caption = (
        f"Cross spectral density of {data.attrs['reference']} and {data.attrs['channel']}, "
        f"{data.attrs['averages']:.3g} averages; thin lines enclose its phase with a probability of {words}, and no "
        f"phase is drawn where nothing is known of it.{_marked(rules)}"
    )
    legend = (Key("cross density", ACCENT), Key(f"{words} limits", MUTED))
    return Chart("cross", "Cross density", caption, panels, panel_height=_HEIGHT // 2 + 40, legend=legend)


def _phase_panel(data: xr.Dataset, x_title: str, rules: tuple[Rule, ...]) -> Panel:
    """Draw a phase between its limits, where it is known."""
    frequency = data["frequency"].values[1:]
    label = f"{_percent(data)} limit"
    phase, limit = (np.degrees(data[f"response_{key}"].values[1:]) for key in ("phase", "phase_limit"))
    phase = np.where(limit < 180.0, phase, np.nan)
    lines = (
        _line(frequency, phase - limit, label, MUTED, 0.7),
        _line(frequency, phase + limit, label, MUTED, 0.7),
        _line(frequency, phase, "phase", ACCENT, 1.4),
    )
    return Panel(
        "phase",
        "°",
        x_title,
        lines,
        rules=rules,
        x_range=(0.0, float(frequency[-1])),
        y_range=(-190.0, 190.0),
        y_ticks=tuple((v, f"{v:g}".replace("-", "−")) for v in (-180.0, -90.0, 0.0, 90.0, 180.0)),
    )


def _line(x: Array, y: Array, name: str, colour: str, width: float) -> Line:
    """Return a curve, thinned for the page with every extreme kept."""
    kept = thin(np.nan_to_num(y), _POINTS)
    return Line(x[kept], y[kept], name, colour, width=width)


def natural_rules(data: xr.Dataset, natural: Sequence[float]) -> tuple[Rule, ...]:
    """Return rules at natural frequencies [rad/s] that lie within a spectrum."""
    highest = float(data["frequency"].values[-1])
    hertz = [(number, value / (2.0 * np.pi)) for number, value in enumerate(natural, start=1)]
    return tuple(Rule(at, "x", MUTED, label=f"f{number}") for number, at in hertz if 0.0 < at < highest)


def _marked(rules: tuple[Rule, ...]) -> str:
    return " Dotted: natural frequencies with every clearance closed." if rules else ""


def _decades(*values: Array) -> tuple[float, float]:
    """Return whole decades about what is finite and positive, a dozen below the largest at most."""
    every = np.concatenate(values)
    every = every[np.isfinite(every) & (every > 0.0)]
    if not every.size:
        return 1e-12, 1.0
    high = 10.0 ** np.ceil(np.log10(every.max()) + 1e-9)
    return float(max(10.0 ** np.floor(np.log10(every.min())), high * 10.0**-_DECADES)), float(high)


def _percent(data: xr.Dataset) -> str:
    return f"{100.0 * data.attrs['level']:g} %"


def _axis(si: bool) -> str:
    return "frequency, Hz" if si else "frequency"
