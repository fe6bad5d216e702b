"""Spectra as one page: where the power is, how far another signal explains it, and the curves between their limits.

``fill_spectra`` writes report.html, results.nc, results.csv, summary.json and figures/ into a folder. The figures are
interactive, and ink without JavaScript; the page loads nothing.

Takes the Dataset of ``gearrattle.spectra``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.json_types import json_value
from gearrattle.plots.densities import spectra_charts
from gearrattle.plots.order_maps import raised
from gearrattle.report.page import Page, Section, fill_page, notes_section
from gearrattle.report.saved import write_json, write_netcdf
from gearrattle.report.spectra_tables import peaks_table, setting_of, summary_of

if TYPE_CHECKING:
    import xarray as xr

_MOST = 8


def spectra_content(data: xr.Dataset) -> dict[str, Any]:
    """Return for machines where the power is: the highest peaks of the density, ascending."""
    density = data["psd"].values
    inner = np.flatnonzero((density[1:-1] >= density[:-2]) & (density[1:-1] > density[2:])) + 1
    highest = sorted(sorted(inner.tolist(), key=lambda k: -density[k])[:_MOST])
    names = ["psd", "psd_low", "psd_high"]
    if "coherence" in data:
        names += ["coherence", "coherence_low", "coherence_high", "response_magnitude", "response_radius"]
        names += ["response_phase", "response_phase_limit"]
    rows = [{"frequency": float(data["frequency"][k]), **{n: float(data[n][k]) for n in names}} for k in highest]
    attributes: dict[str, Any] = json_value(dict(data.attrs))
    attributes["notes"] = str(data.attrs["notes"]).splitlines()
    units = {name: str(data[name].attrs["units"]) for name in names}
    return {**attributes, "bins": int(data.sizes["frequency"]), "units_of": units, "peaks": json_value(rows)}


def fill_spectra(data: xr.Dataset, folder: Path, *, si: bool, natural: Sequence[float] = ()) -> None:
    """Write all files into an existing empty folder.

    Args:
        data: what ``spectra`` returned.
        folder: where to.
        si: whether frequencies are hertz.
        natural: natural frequencies to mark [rad/s].
    """
    content = spectra_content(data)
    table = peaks_table(content, si=si)
    power = Section(
        "summary",
        "Where the power is",
        summary_of(data, si=si),
        (setting_of(data, si=si),),
        tables=(replace(table, head=tuple(map(raised, table.head))),),
    )
    charts = spectra_charts(data, si=si, natural=natural)
    figures = [Section(chart.key, chart.title, charts=(chart,)) for chart in charts]
    sections = (power, *figures, *notes_section(tuple(content["notes"])))
    fill_page(Page("spectra", _title(data), sections, is_interactive=True), folder)
    write_json(content, folder / "summary.json", "spectra summary")
    write_netcdf(data, folder / "results.nc", "spectra")
    _write_csv(data, folder / "results.csv", si=si)


def _title(data: xr.Dataset) -> str:
    pair = f" and {data.attrs['reference']}" if "reference" in data.attrs else ""
    return f"{data.attrs['channel']}{pair}, {data.attrs['source']}"


def _write_csv(data: xr.Dataset, path: Path, *, si: bool) -> None:
    """Write every variable over frequency, units in the head."""
    names = [str(name) for name in data.data_vars]
    head = ["frequency [Hz]" if si else "frequency", *(f"{name} [{data[name].attrs['units']}]" for name in names)]
    with open(path, "w", encoding="utf-8", newline="\n") as stream:
        stream.write(f"# {data.attrs['channel']} of {' '.join(str(data.attrs['source']).split())}\n")
        stream.write(",".join(head) + "\n")
        for row in zip(data["frequency"].values.tolist(), *(data[n].values.tolist() for n in names), strict=True):
            stream.write(",".join(map(repr, row)) + "\n")
