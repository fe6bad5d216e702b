"""Words and the table of a page of spectra: the highest peaks between their limits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.report.plots.order_maps import raised
from gearrattle.report.tables import Table
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_SHARE = 0.9
_LIMITS = "The highest peaks of the {}; limits enclose with a probability of {:g} %."


def peaks_table(content: dict[str, Any], *, si: bool = True) -> Table:
    """The highest peaks of the density, by frequency; for two signals also coherence and response at the peaks."""
    pair = "reference" in content
    head = ["Hz" if si else "frequency", f"density [{content['units_of']['psd']}]", "limits"]
    head += ["coherence", "limits", "gain", "phase [deg]"] if pair else []
    rows = tuple(_row(row, pair=pair) for row in content["peaks"])
    return Table(tuple(head), rows, frozenset(), note=_LIMITS.format("density", 100.0 * content["level"]))


def cross_table(content: dict[str, Any], *, si: bool = True) -> Table:
    """The highest peaks of a cross density, with the transfer function there."""
    unit = content["units_of"]["cross_magnitude"]
    head = ("Hz" if si else "frequency", f"cross density [{unit}]", "gain", "phase [deg]")
    rows = tuple(
        (_number(row["frequency"]), _number(row["cross_magnitude"]), _within(row), _phase(row))
        for row in content["peaks"]
    )
    return Table(head, rows, frozenset(), note=_LIMITS.format("cross density", 100.0 * content["level"]))


def coherence_table(content: dict[str, Any], *, si: bool = True) -> Table:
    """The highest peaks of a coherence."""
    head = ("Hz" if si else "frequency", "coherence", "limits")
    rows = tuple(
        (_number(row["frequency"]), _number(row["coherence"]), f"{_number(row['low'])} to {_number(row['high'])}")
        for row in content["peaks"]
    )
    return Table(head, rows, frozenset(), note=_LIMITS.format("coherence", 100.0 * content["level"]))


def summary_of(data: xr.Dataset, *, si: bool) -> str:
    """Return sentences on size and frequencies of the signal, and on the share that the reference explains."""
    frequency = data["frequency"].values[1:]
    density = data["psd"].values[1:]
    unit = raised(str(data.attrs["units"])).removesuffix("1")
    sentence = f"The rms of {data.attrs['channel']} is {_with(data.attrs['rms'], unit)}"
    total = float(np.sum(density))
    if total > 0.0:
        most = frequency[int(np.searchsorted(np.cumsum(density), _SHARE * total))]
        sentence += f"; {100.0 * _SHARE:g} % of its power lies below {_with(most, 'Hz' if si else '')}"
        sentence += f", and its density is highest at {_with(frequency[int(np.argmax(density))], 'Hz' if si else '')}"
    if "coherence" not in data:
        return f"{sentence}."
    alike = data["coherence"].values[1:]
    threshold = float(data.attrs["threshold"])
    explained = float(np.sum(density * np.nan_to_num(alike))) / total if total > 0.0 else math.nan
    above = float(np.mean(np.nan_to_num(alike) > threshold))
    share = "" if math.isnan(explained) else f", weighted by it {100.0 * explained:.0f} % of the power"
    return (
        f"{sentence}. Coherence with {data.attrs['reference']} stands above what chance gives ({threshold:.3g}) in "
        f"{100.0 * above:.0f} % of the bins{share}: the most that a linear path from there can explain."
    )


def setting_of(data: xr.Dataset, *, si: bool) -> str:
    """Return a sentence on how the densities were averaged."""
    return (
        f"Segments of {data.attrs['window']}; {data.attrs['averages']:.3g} independent averages of "
        f"{counted(data.attrs['segments'], 'segment')}, bins of {_with(data.attrs['resolution'], 'Hz' if si else '')}."
    )


def _with(value: float, unit: str) -> str:
    return f"{float(value):.4g} {unit}".rstrip()


def _row(row: dict[str, Any], *, pair: bool) -> tuple[str, ...]:
    """Return a peak as text; a dash for a missing number."""
    said = {name: _number(value) for name, value in row.items()}
    cells = (said["frequency"], said["psd"], f"{said['psd_low']} to {said['psd_high']}")
    if not pair:
        return cells
    limits = f"{said['coherence_low']} to {said['coherence_high']}"
    return (*cells, said["coherence"], limits, _within(row), _phase(row))


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _within(row: dict[str, Any]) -> str:
    return f"{_number(row['response_magnitude'])} ± {_number(row['response_radius'])}"


def _phase(row: dict[str, Any]) -> str:
    if row["response_phase"] is None or row["response_phase_limit"] is None:
        return "-"
    turn = 180.0 / math.pi
    return f"{turn * row['response_phase']:.4g} ± {turn * row['response_phase_limit']:.2g}"
