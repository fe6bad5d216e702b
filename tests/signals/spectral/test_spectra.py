"""Everything that densities tell, as real variables: against SciPy, by Parseval, and through a netCDF file."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy import signal

import gearrattle as gr
from gearrattle.recording import Channel, Recording

RATE = 1000.0
RNG = np.random.default_rng(5)
X = RNG.standard_normal(20_000)
Y = 2.0 * np.roll(X, 3) + RNG.standard_normal(X.size)


def rig() -> Recording:
    channels = Channel("T", "torque", "hub", "N m", X), Channel("a", "acceleration", "hub", "rad/s^2", Y)
    return Recording(np.arange(X.size) / RATE, channels, "rig")


def test_it_is_what_scipy_gives() -> None:
    """Welch's density, csd and coherence of scipy.signal with the same segments."""
    actual = gr.spectra(rig(), "a", "T", resolution="10 Hz")
    how = {"fs": RATE, "window": "hann", "nperseg": 100, "noverlap": 50, "detrend": "constant"}
    assert actual.psd.values == pytest.approx(signal.welch(Y, **how)[1], rel=1e-10)
    assert actual.reference_psd.values == pytest.approx(signal.welch(X, **how)[1], rel=1e-10)
    cross = signal.csd(X, Y, **how)[1]
    assert actual.cross_real.values == pytest.approx(cross.real, rel=1e-9, abs=1e-12)
    assert actual.cross_imaginary.values == pytest.approx(cross.imag, rel=1e-9, abs=1e-12)
    assert actual.coherence.values == pytest.approx(signal.coherence(X, Y, **how)[1], rel=1e-9)
    response = cross / signal.welch(X, **how)[1]
    assert actual.response_magnitude.values == pytest.approx(np.abs(response), rel=1e-9)
    assert actual.response_phase.values == pytest.approx(np.angle(response), rel=1e-9, abs=1e-12)


def test_magnitude_and_phase_are_the_parts() -> None:
    actual = gr.spectra(rig(), "a", "T", resolution="10 Hz")
    for name in ("cross", "response"):
        turned = actual[f"{name}_magnitude"] * np.exp(1j * actual[f"{name}_phase"])
        parts = actual[f"{name}_real"] + 1j * actual[f"{name}_imaginary"]
        assert np.abs(turned.values - parts.values).max() < 1e-12 * np.abs(parts.values).max()


def test_a_delayed_gain_lies_in_its_circle() -> None:
    """Y is twice X three samples ago, and noise: 95 of 100 circles hold 2 exp(-2 pi i f 3 / rate)."""
    actual = gr.spectra(rig(), "a", "T", resolution="5 Hz").isel(frequency=slice(1, -1))
    truth = 2.0 * np.exp(-2j * np.pi * actual.frequency.values * 3.0 / RATE)
    away = np.abs(actual.response_real.values + 1j * actual.response_imaginary.values - truth)
    held = np.mean(away <= actual.response_radius.values)
    assert 0.88 < held < 1.0
    expected = 4.0 / 5.0  # of the power, by the gain 2 and noise of 1
    assert np.mean((actual.coherence_low <= expected) & (actual.coherence_high >= expected)) > 0.88


def test_rms_is_that_of_the_signal() -> None:
    """Without taper and overlap the integral of the density is the variance about the segments' means, exactly."""
    actual = gr.spectra(rig(), "a", window="boxcar", overlap=0.0, resolution="10 Hz")
    segments = Y.reshape(-1, 100)
    assert actual.attrs["rms"] == pytest.approx(np.sqrt(np.mean((segments - segments.mean(axis=1)[:, None]) ** 2)))
    assert "reference" not in actual.attrs
    assert set(actual.data_vars) == {"psd", "psd_low", "psd_high"}


def test_a_file_keeps_everything(tmp_path: Path) -> None:
    """netCDF has no complex numbers: none is left, and units and words come back."""
    actual = gr.spectra(rig(), "a", "T")
    assert {entry.dtype.kind for entry in actual.values()} == {"f"}
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # of a complex variable h5netcdf says that the file is no netCDF
        actual.to_netcdf(tmp_path / "s.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "s.nc", engine="h5netcdf") as kept:
        xr.testing.assert_identical(kept.drop_attrs(deep=False).load(), actual.drop_attrs(deep=False))
        assert kept.cross_real.attrs == {
            "units": "(N m)*(rad/s^2)/Hz",
            "long_name": "cross spectral density of T and a, real part",
        }
        assert kept.response_phase.attrs["units"] == "rad"
        assert kept.attrs["threshold"] == pytest.approx(actual.attrs["threshold"])
    assert list(actual.to_dataframe().columns) == list(actual.data_vars)


def test_a_run_has_spectra_in_its_own_units() -> None:
    run = gr.simulate(gr.load("examples/paper/case3.toml"), cycles=40, discard=8)
    actual = gr.spectra(run, "acceleration.hub", "torque.clutch")
    assert actual.psd.attrs["units"] == "(rad/s^2)^2/Hz"
    assert actual.reference_psd.attrs["units"] == "(N m)^2/Hz"
    assert actual.attrs["reference_units"] == "N m"
    with pytest.raises(gr.ModelError, match="1 segment"):
        gr.spectra(run, "acceleration.hub", "torque.clutch", resolution=1.0 / (32 * run.trajectory.layout.period))
