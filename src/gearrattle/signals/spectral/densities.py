"""``psd``, ``cross_psd``, ``coherence``: densities of runs and recordings by Welch's averages, with their limits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.model import units
from gearrattle.model.table import did_you_mean, listed, shown
from gearrattle.result import KIND
from gearrattle.signals.confidence import (
    LEVEL,
    coherence_limits,
    coherence_threshold,
    density_factors,
    response_radius,
)
from gearrattle.signals.cross_spectra import WINDOWS, CrossSpectra, Segments, cross_spectra, cut, power_density
from gearrattle.signals.spectral.sampled import Sampled, Source, quantity, sampled
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_PARTS = 8
_SHORTEST = 8


def psd(
    source: Source,
    channel: str,
    *,
    resolution: str | float | None = None,
    overlap: float = 0.5,
    window: str = "hann",
    level: float = LEVEL,
) -> xr.Dataset:
    """Power spectral density of a signal, with the limits that enclose it.

    Parameters
    ----------
    source
        a run, from the end of its discarded cycles on, or a recording of uniform samples.
    channel
        "acceleration.hub", or the name of a recording's channel.
    resolution
        width of a bin, "2 Hz" or a plain number [Hz]; None: an eighth of the record a segment.
    overlap
        share of a segment that the next has as well, 0 to below 1.
    window
        "hann", "flattop" or "boxcar".
    level
        probability that the limits of a bin enclose its density, for Gaussian noise flat across the bin.

    Returns
    -------
    xr.Dataset
        density, low, high (frequency) [unit^2/Hz], one-sided; attributes: averages, segments, resolution, notes.

    Raises
    ------
    ModelError
        no such channel, samples that are not uniform, too short a record.

    Examples
    --------
    >>> run = gr.simulate(gr.example("case3"), cycles=60, discard=20)
    >>> answer = gr.spectral.psd(run, "velocity.output_gear")
    >>> sorted(answer.data_vars)
    ['density', 'high', 'low']
    """
    signal = sampled(source, channel)
    segments = segments_of(signal, resolution, overlap, window, _PARTS)
    _probable(level)
    frequency, density = power_density(signal.values, signal.rate, segments)
    factors = np.array([density_factors(segments.averages, level)]).repeat(frequency.size, axis=0)
    single = [0, -1] if segments.length % 2 == 0 else [0]
    factors[single] = density_factors(0.5 * segments.averages, level)
    unit = density_unit(signal)
    return _labelled(
        signal,
        frequency,
        {"density": (density, unit), "low": (density * factors[:, 0], unit), "high": (density * factors[:, 1], unit)},
        {KIND: "density", **described(signal, segments), "level": level},
    )


def cross_psd(
    source: Source,
    channel: str,
    reference: str,
    *,
    resolution: str | float | None = None,
    overlap: float = 0.5,
    window: str = "hann",
    level: float = LEVEL,
) -> xr.Dataset:
    """Cross spectral density of two signals, the transfer function between them and its limits.

    Parameters
    ----------
    source
        a run or a recording.
    channel
        the answer, y.
    reference
        the cause, x, of the same source.
    resolution, overlap, window
        as in ``psd``.
    level
        probability that the circle of each bin encloses its transfer function.

    Returns
    -------
    xr.Dataset
        cross, response (frequency), complex: S_xy, whose argument is the phase of y before x, and H = S_xy / S_xx;
        radius: of the circle about H [its unit]; phase_limit: half the range of its phase [rad], pi where the
        circle encloses zero.

    Raises
    ------
    ModelError
        as ``psd``.

    Examples
    --------
    >>> run = gr.simulate(gr.example("case3"), cycles=60, discard=20)
    >>> answer = gr.spectral.cross_psd(run, "velocity.output_gear", "velocity.flywheel")
    >>> sorted(answer.data_vars)[:2]
    ['cross', 'phase_limit']
    """
    y, x, segments, estimate = _pair(source, channel, reference, resolution=resolution, overlap=overlap, window=window)
    _probable(level)
    radius = response_radius(estimate.coherence, segments.averages, level)
    limit = np.where(radius < 1.0, np.arcsin(np.minimum(radius, 1.0)), np.pi)
    limit = np.where(np.isfinite(estimate.coherence), limit, np.nan)
    ratio = "1" if y.dimensionless else f"({y.unit})/({x.unit})"
    product = "1" if y.dimensionless else f"({x.unit})*({y.unit})/Hz"
    reach = radius * np.abs(estimate.response)
    values = {
        "cross": (estimate.cross, product),
        "response": (estimate.response, ratio),
        "radius": (reach, ratio),
        "phase_limit": (limit, "rad"),
    }
    attributes = {KIND: "cross density", **described(y, segments), "reference": x.name, "level": level}
    return _labelled(y, estimate.frequency, values, attributes)


def coherence(
    source: Source,
    channel: str,
    reference: str,
    *,
    resolution: str | float | None = None,
    overlap: float = 0.5,
    window: str = "hann",
    level: float = LEVEL,
) -> xr.Dataset:
    """Coherence of two signals, with its limits and with what chance alone gives.

    Parameters
    ----------
    source
        a run or a recording.
    channel
        one signal.
    reference
        the other, of the same source.
    resolution, overlap, window
        as in ``psd``.
    level
        probability that the limits enclose the coherence of Gaussian signals, and that independent ones stay
        below the threshold.

    Returns
    -------
    xr.Dataset
        coherence, low, high (frequency); attributes: threshold, averages, segments, resolution, notes.

    Raises
    ------
    ModelError
        as ``psd``; fewer than two segments, of which every coherence is 1.

    Examples
    --------
    >>> run = gr.simulate(gr.example("case3"), cycles=60, discard=20)
    >>> answer = gr.spectral.coherence(run, "velocity.output_gear", "velocity.flywheel")
    >>> round(float(answer["coherence"].max()), 2)
    1.0
    """
    y, x, segments, estimate = _pair(source, channel, reference, resolution=resolution, overlap=overlap, window=window)
    _probable(level)
    if segments.count < 2:
        rule = "of one segment every coherence is 1"
        raise ModelError(Problem(y.place, "1 segment", rule, "coarsen the resolution, or take a longer record"))
    value = estimate.coherence
    low, high = coherence_limits(value, segments.averages, level)
    attributes = {
        KIND: "coherence",
        "reference": x.name,
        "level": level,
        "threshold": coherence_threshold(segments.averages, level),
    }
    values = {"coherence": (value, "1"), "low": (low, "1"), "high": (high, "1")}
    return _labelled(y, estimate.frequency, values, {**described(y, segments), **attributes, "units": "1"})


def segments_of(signal: Sampled, resolution: str | float | None, overlap: float, window: str, parts: int) -> Segments:
    """Return the segments of a signal.

    ``resolution`` is the width of a bin [Hz]; None: a part of the record. ModelError for an unknown window, an overlap
    out of range, and a segment longer than the record or of no samples.
    """
    if window not in WINDOWS:
        rule = f"must be one of {listed(WINDOWS)}"
        raise ModelError(Problem("window", shown(window), rule, did_you_mean(window, WINDOWS)))
    if not 0.0 <= overlap < 1.0:
        raise ModelError(Problem("overlap", shown(overlap), "must lie from 0 to below 1", "0.5 suits a Hann window"))
    count = signal.values.size
    if resolution is None:
        return cut(count, max(_SHORTEST, count // parts), overlap, window)
    width = quantity("resolution", resolution, units.FREQUENCY, signal.dimensionless)
    length = round(signal.rate / width)
    if length > count:
        rule = f"needs {1.0 / width:.6g} s of a record, and {signal.place} has {count * signal.interval:.6g} s"
        raise ModelError(Problem("resolution", f"{width:.6g} Hz", rule, "coarsen it, or take a longer record"))
    if length < _SHORTEST:
        rule = f"leaves {counted(length, 'sample')} a segment at {signal.rate:.6g} Hz; {_SHORTEST} are needed"
        raise ModelError(Problem("resolution", f"{width:.6g} Hz", rule, "refine it"))
    return cut(count, length, overlap, window)


def described(signal: Sampled, segments: Segments) -> dict[str, Any]:
    """Return the attributes that every spectrum has."""
    return {
        "source": signal.source,
        "channel": signal.name,
        "units": signal.unit,
        "window": f"{counted(segments.length, 'sample')}, {segments.step} apart, mean removed",
        "segments": segments.count,
        "averages": segments.averages,
        "resolution": signal.rate / segments.length,
        "notes": "\n".join(signal.notes),
    }


def frequency_unit(signal: Sampled) -> str:
    """Return the unit of a signal's frequencies: cycles a unit of its time."""
    return "1" if signal.dimensionless else "Hz"


def density_unit(signal: Sampled) -> str:
    """Return the unit of a signal's density."""
    if signal.dimensionless:
        return "1"
    return "1/Hz" if signal.unit == "1" else f"({signal.unit})^2/Hz"


def _pair(
    source: Source, channel: str, reference: str, *, resolution: str | float | None, overlap: float, window: str
) -> tuple[Sampled, Sampled, Segments, CrossSpectra]:
    """Return both signals, their segments, and their densities."""
    y, x = sampled(source, channel), sampled(source, reference)
    segments = segments_of(y, resolution, overlap, window, _PARTS)
    return y, x, segments, cross_spectra(x.values, y.values, y.rate, segments)


def _probable(level: float) -> None:
    if not 0.0 < level < 1.0:
        raise ModelError(Problem("level", shown(level), "must lie between 0 and 1", "such as 0.95"))


def _labelled(
    signal: Sampled, frequency: Any, values: dict[str, tuple[Any, str]], attributes: dict[str, Any]
) -> xr.Dataset:
    """Return arrays over frequency with their units."""
    import xarray as xr

    variables = {name: ("frequency", array, {"units": unit}) for name, (array, unit) in values.items()}
    axis_attributes = {"units": frequency_unit(signal)}
    return xr.Dataset(variables, {"frequency": ("frequency", frequency, axis_attributes)}, attributes)
