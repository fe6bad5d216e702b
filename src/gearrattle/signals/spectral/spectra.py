"""``spectra``: all densities of a signal, or of two, as real variables that every file format takes.

netCDF has no complex numbers (Unidata, NetCDF User's Guide, data model); what h5netcdf writes of them is a file that
other tools may refuse. So a cross density and a transfer function stand as real and imaginary part, and as magnitude
and phase, each a labelled variable. Their definitions and limits stand in ``densities``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.result import KIND
from gearrattle.signals.confidence import LEVEL
from gearrattle.signals.spectral.densities import coherence, cross_psd, psd
from gearrattle.signals.spectral.sampled import Source

if TYPE_CHECKING:
    import xarray as xr

_PSD = (("density", "psd"), ("low", "psd_low"), ("high", "psd_high"))
_COHERENCE = (("coherence", "coherence"), ("low", "coherence_low"), ("high", "coherence_high"))


def spectra(
    source: Source,
    channel: str,
    reference: str | None = None,
    *,
    resolution: str | float | None = None,
    overlap: float = 0.5,
    window: str = "hann",
    level: float = LEVEL,
) -> xr.Dataset:
    """Density of a signal, or densities, cross density, transfer function and coherence of two, with their limits.

    Parameters
    ----------
    source
        a run or a recording.
    channel
        the signal, or the answer y.
    reference
        the cause x, of the same source; None: the density of the signal alone.
    resolution, overlap, window
        as in ``psd``.
    level
        probability that the limits enclose what they are of, bin by bin.

    Returns
    -------
    xr.Dataset
        psd, psd_low, psd_high (frequency). With a reference also reference_psd, reference_psd_low, reference_psd_high;
        cross and response, each as _real, _imaginary, _magnitude and _phase [rad]; response_radius, of the circle about
        the transfer function, and response_phase_limit [rad]; coherence, coherence_low, coherence_high. All are real,
        with units and long_name, so ``to_netcdf`` and ``to_dataframe`` take them. Attributes: channel, reference,
        level, averages, segments, resolution, rms of the signal by its density [its unit], notes; of two signals
        threshold, that coherence stays below by chance.

    Raises
    ------
    ModelError
        as ``psd``; of two signals as ``coherence``.

    Examples
    --------
    >>> run = gr.simulate(gr.example("case3"), cycles=40, discard=20)
    >>> density = gr.spectra(run, "velocity.output_gear")
    >>> sorted(density.data_vars)[:2]
    ['psd', 'psd_high']
    """
    how: dict[str, Any] = {"resolution": resolution, "overlap": overlap, "window": window, "level": level}
    first = psd(source, channel, **how)
    long_name = f"power spectral density of {first.attrs['channel']}"
    variables = _named(first, _PSD, long_name)
    attributes = {**first.attrs, KIND: "spectra", "rms": rms_of(first)}
    if reference is not None:
        other = psd(source, reference, **how)
        both = cross_psd(source, channel, reference, **how)
        alike = coherence(source, channel, reference, **how)
        x, y = both.attrs["reference"], both.attrs["channel"]
        names = tuple((old, f"reference_{new}") for old, new in _PSD)
        variables |= _named(other, names, f"power spectral density of {x}")
        variables |= cross_parts(both)
        variables |= _named(alike, _COHERENCE, f"coherence of {x} and {y}")
        attributes |= {"reference": x, "reference_units": other.attrs["units"], "reference_rms": rms_of(other)}
        attributes["threshold"] = alike.attrs["threshold"]
    import xarray as xr

    return xr.Dataset(variables, {"frequency": first["frequency"]}, attributes)


def _named(data: xr.Dataset, names: tuple[tuple[str, str], ...], words: str) -> dict[str, Any]:
    """Return variables under new names, with their descriptions."""
    ends = {"low": ", lower limit", "high": ", upper limit"}
    return {new: data[old].assign_attrs(long_name=words + ends.get(old, "")) for old, new in names}


def cross_parts(both: xr.Dataset) -> dict[str, Any]:
    """Return the result of ``cross_psd`` as real variables, by name."""
    x, y = both.attrs["reference"], both.attrs["channel"]
    return {
        **_parts(both["cross"], "cross", f"cross spectral density of {x} and {y}"),
        **_parts(both["response"], "response", f"transfer function from {x} to {y}"),
        **_named(both, (("radius", "response_radius"),), "radius of the circle about the transfer function"),
        **_named(both, (("phase_limit", "response_phase_limit"),), "half the range of the response's phase"),
    }


def _parts(values: xr.DataArray, name: str, words: str) -> dict[str, Any]:
    """Return a complex variable as real ones."""
    unit = values.attrs["units"]
    plain = values.values
    made = {
        "real": (plain.real, unit, "real part"),
        "imaginary": (plain.imag, unit, "imaginary part"),
        "magnitude": (np.abs(plain), unit, "magnitude"),
        "phase": (np.where(np.isfinite(plain), np.angle(plain), np.nan), "rad", "phase"),
    }
    return {
        f"{name}_{part}": ("frequency", array, {"units": what, "long_name": f"{words}, {description}"})
        for part, (array, what, description) in made.items()
    }


def rms_of(data: xr.Dataset) -> float:
    """Return the root of the integral of a density over frequency, by Parseval's theorem the signal's rms."""
    return float(np.sqrt(np.sum(data["density"].values) * data.attrs["resolution"]))
