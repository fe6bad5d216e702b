"""``waterfall``: spectra side by side along time or a change of speed, of runs and recordings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.model import units
from gearrattle.model.table import did_you_mean, listed, shown
from gearrattle.result import KIND
from gearrattle.signals.order_tracking import TURN
from gearrattle.signals.spectra_over_speed import Waterfall, by_steps, over_orders
from gearrattle.signals.spectra_over_speed import waterfall as spectra
from gearrattle.signals.spectral.densities import density_unit, described, frequency_unit, segments_of
from gearrattle.signals.spectral.order_maps_of_signals import row_coordinates
from gearrattle.signals.spectral.sampled import Sampled, Source, quantity, required, sampled, shaft_of
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_PARTS = 40
_MOST = 50_000_000  # values of a map
_SCALINGS = ("amplitude", "density")


def waterfall(
    source: Source,
    channel: str,
    *,
    speed: str | float | None = None,
    resolution: str | float | None = None,
    overlap: float = 0.5,
    window: str = "hann",
    scaling: str = "amplitude",
    highest: str | float | None = None,
    speed_step: str | float | None = None,
    orders: Sequence[float] | None = None,
) -> xr.DataArray:
    """Spectra of segments side by side.

    Parameters
    ----------
    source
        a run, from the end of its discarded cycles on, or a recording of uniform samples.
    channel
        "acceleration.hub", or the name of a recording's channel.
    speed
        as in ``order_map``; where it is not stated, rows have times only.
    resolution
        width of a bin, "2 Hz" or a plain number [Hz]; None: a fortieth of the record a segment.
    overlap
        share of a segment that the next has as well, 0 to below 1.
    window
        "hann", "flattop" or "boxcar".
    scaling
        "amplitude" of lines [unit], or "density" [unit^2/Hz].
    highest
        frequency up to which they are kept, "2 kHz" or a plain number [Hz]; None: half the rate.
    speed_step
        rows whose speed rounds to the same step, "25 rpm" or a plain number [rad/s], are gathered: mean
        square amplitudes, mean densities.
    orders
        read along these orders instead of over frequency; NaN beyond the highest frequency.

    Returns
    -------
    xr.DataArray
        (time, frequency) or, gathered, (speed, frequency), or order instead of frequency, with units.

    Raises
    ------
    ModelError
        as ``psd``; steps of speed or orders without a speed.

    Examples
    --------
    >>> time = np.arange(0.0, 4.0, 1e-3)
    >>> turns = 10.0 * time + 2.5 * time**2
    >>> speed = gr.measured.Channel("n", "speed", "", "rad/s", 2.0 * np.pi * (10.0 + 5.0 * time))
    >>> load = gr.measured.Channel("load", "torque", "", "N m", 3.0 * np.cos(2.0 * np.pi * 2.0 * turns))
    >>> record = gr.measured.Recording(time, (speed, load), "rig")
    >>> rows = gr.spectral.waterfall(record, "load", speed="n", resolution="2 Hz")
    >>> rows.dims
    ('time', 'frequency')
    """
    if scaling not in _SCALINGS:
        rule = f"must be one of {listed(_SCALINGS)}"
        raise ModelError(Problem("scaling", shown(scaling), rule, did_you_mean(scaling, _SCALINGS)))
    # segments of the signal, and the shaft where orders or speeds are wanted
    signal = sampled(source, channel)
    segments = segments_of(signal, resolution, overlap, window, _PARTS)
    needed = orders is not None or speed_step is not None
    shaft = required(source, signal, speed) if needed else shaft_of(source, signal, speed)
    # the map must not become too large
    top = 0.5 * signal.rate
    if highest is not None:
        top = quantity("highest", highest, units.FREQUENCY, signal.dimensionless)
    size = segments.count * segments.length * min(1.0, top * signal.interval)
    if size > _MOST:
        rule = f"{size:.3g} values make a map larger than {_MOST:.3g}"
        raise ModelError(Problem(signal.place, counted(segments.count, "row"), rule, "lower highest or the overlap"))
    # the spectrum of every segment
    density = scaling == "density"
    turning = None if shaft is None else shaft.speed
    rows = spectra(signal.values, signal.rate, segments, turning, density=density, highest=top)
    attributes = {
        KIND: "waterfall",
        **described(signal, segments),
        "shaft": "" if shaft is None else shaft.name,
        "scaling": scaling,
    }
    attributes["units"] = density_unit(signal) if density else signal.unit
    # gather by speed, or read along orders
    if speed_step is not None:
        step = quantity("speed_step", speed_step, units.ANGULAR_VELOCITY, signal.dimensionless)
        rows = by_steps(rows, step, density)
        attributes["speed_step"] = step
    if orders is not None:
        rows = _along(rows, orders)
    return _labelled(signal, rows, attributes, gathered=speed_step is not None, tracked=orders is not None)


def _along(rows: Waterfall, orders: Sequence[float]) -> Waterfall:
    """Read rows along orders, or refuse orders that no row shows."""
    wanted = np.asarray(orders, dtype=np.float64)
    if wanted.ndim != 1 or not wanted.size or not np.all(np.isfinite(wanted) & (wanted >= 0.0)):
        raise ModelError(Problem("orders", shown(np.shape(wanted)), "must be a list of numbers from 0 on"))
    most = float(rows.axis[-1] * TURN / rows.speed.min())
    if wanted.min() > most:
        rule = f"no order above {most:.6g} lies below {rows.axis[-1]:.6g} Hz at any speed"
        raise ModelError(Problem("orders", f"{wanted.min():g} and above", rule, "raise highest, or sample faster"))
    return over_orders(rows, wanted)


def _labelled(
    signal: Sampled, rows: Waterfall, attributes: dict[str, Any], *, gathered: bool, tracked: bool
) -> xr.DataArray:
    """Return rows with their coordinates."""
    import xarray as xr

    over = "speed" if gathered else "time"
    along = "order" if tracked else "frequency"
    known = row_coordinates(signal, over, rows.time, rows.speed)
    coordinates: dict[str, Any] = {over: known[over]}
    if not gathered and np.isfinite(rows.speed).all():
        coordinates["speed"] = known["speed"]
    if gathered:
        coordinates["segments"] = (over, rows.counts, {"units": "1"})
    coordinates[along] = (along, rows.axis, {"units": "1" if tracked else frequency_unit(signal)})
    name = str(attributes["scaling"])
    return xr.DataArray(rows.values, coordinates, (over, along), name=name, attrs=attributes)
