"""Words and the table of a page of spectra: the highest peaks between their limits.

Takes the Dataset of ``gearrattle.spectra``, or its content for machines; gives text.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.plots.order_maps import raised
from gearrattle.report.tables import Table
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_SHARE = 0.9


def peaks_table(content: dict[str, Any], *, si: bool = True) -> Table:
    """The highest peaks of the density, by frequency; of two signals also what coherence and response are there."""
    pair = "reference" in content
    head = ["Hz" if si else "frequency", f"density [{content['units_of']['psd']}]", "limits"]
    head += ["coherence", "limits", "gain", "phase [deg]"] if pair else []
    rows = tuple(_row(row, pair=pair) for row in content["peaks"])
    note = f"The highest peaks of the density; limits enclose with a probability of {100.0 * content['level']:g} %."
    return Table(tuple(head), rows, frozenset(), note=note)


def summary_of(data: xr.Dataset, *, si: bool) -> str:
    """Say in a sentence or two how large the signal is, where its power is, and how far the reference explains it."""
    frequency, density = data["frequency"].values[1:], data["psd"].values[1:]
    unit = raised(str(data.attrs["units"])).removesuffix("1")
    told = f"The rms of {data.attrs['channel']} is {_with(data.attrs['rms'], unit)}"
    total = float(np.sum(density))
    if total > 0.0:
        most = frequency[int(np.searchsorted(np.cumsum(density), _SHARE * total))]
        told += f"; {100.0 * _SHARE:g} % of its power lies below {_with(most, 'Hz' if si else '')}"
        told += f", and its density is highest at {_with(frequency[int(np.argmax(density))], 'Hz' if si else '')}"
    if "coherence" not in data:
        return f"{told}."
    alike, threshold = data["coherence"].values[1:], float(data.attrs["threshold"])
    explained = float(np.sum(density * np.nan_to_num(alike))) / total if total > 0.0 else math.nan
    above = float(np.mean(np.nan_to_num(alike) > threshold))
    share = "" if math.isnan(explained) else f", weighted by it {100.0 * explained:.0f} % of the power"
    return (
        f"{told}. Coherence with {data.attrs['reference']} stands above what chance gives ({threshold:.3g}) in "
        f"{100.0 * above:.0f} % of the bins{share}: the most that a linear path from there can explain."
    )


def setting_of(data: xr.Dataset, *, si: bool) -> str:
    """Say how the densities were averaged."""
    return (
        f"Segments of {data.attrs['window']}; {data.attrs['averages']:.3g} independent averages of "
        f"{counted(data.attrs['segments'], 'segment')}, bins of {_with(data.attrs['resolution'], 'Hz' if si else '')}."
    )


def _with(value: float, unit: str) -> str:
    return f"{float(value):.4g} {unit}".rstrip()


def _row(row: dict[str, Any], *, pair: bool) -> tuple[str, ...]:
    """Return a peak as text; a dash where there is no number."""
    said = {name: "-" if value is None else f"{value:.4g}" for name, value in row.items()}
    told = (said["frequency"], said["psd"], f"{said['psd_low']} to {said['psd_high']}")
    if not pair:
        return told
    phase = "-"
    if row["response_phase"] is not None and row["response_phase_limit"] is not None:
        turn = 180.0 / math.pi
        phase = f"{turn * row['response_phase']:.4g} ± {turn * row['response_phase_limit']:.2g}"
    limits = f"{said['coherence_low']} to {said['coherence_high']}"
    return (*told, said["coherence"], limits, f"{said['response_magnitude']} ± {said['response_radius']}", phase)
