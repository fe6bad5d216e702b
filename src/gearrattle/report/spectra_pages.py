"""Spectra as results: the peaks of the density, the coherence with another signal, and the curves with their limits.

Figures are interactive, and static SVG without JavaScript. The attribute ``natural_frequencies`` [rad/s], which the
command sets, holds the natural frequencies to mark.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.json_types import json_value
from gearrattle.report.labelled_data import channel_title, is_si, numbers_in, plain_attributes
from gearrattle.report.page import Section, figure_sections, notes_section
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.density_figures import cross_chart as cross_density_chart
from gearrattle.report.plots.density_figures import density_chart, natural_rules, response_chart, spectra_charts
from gearrattle.report.plots.order_maps import coherence_chart, raised
from gearrattle.report.presentation import Presentation
from gearrattle.report.spectra_tables import coherence_table, cross_table, peaks_table, setting_of, summary_of
from gearrattle.report.tables import Table
from gearrattle.signals.spectral.spectra import cross_parts, rms_of

if TYPE_CHECKING:
    import xarray as xr

_MOST = 8


class _OverFrequency(Presentation["xr.Dataset"]):
    """Base of presentations of data over frequency."""

    is_interactive = True
    is_data = True
    heading = "Where the power is"
    peaked: tuple[str, ...] = ("psd",)
    """Names of the variable whose peaks are listed, and of further variables listed at these peaks."""

    def __init__(self, result: xr.Dataset) -> None:
        super().__init__(result)
        self.si = is_si(result)

    @property
    def title(self) -> str:
        return channel_title(self.result.attrs)

    def sections(self) -> tuple[Section, ...]:
        first = Section(
            "summary",
            self.heading,
            self.sentence,
            tables=tuple(replace(table, head=tuple(map(raised, table.head))) for table in self.answer()),
        )
        figures = figure_sections(self.charts())
        return first, *figures, *notes_section(self.notes)

    def answer(self) -> tuple[Table, ...]:
        table = self._table(self.content())
        return (replace(table, note=f"{table.note} {setting_of(self.result, si=self.si)}"),)

    def content(self) -> dict[str, Any]:
        """Return attributes, and the highest peaks, ascending."""
        data = self.result
        names = self._channel_words()
        values = data[names[0]].values
        inner = np.flatnonzero((values[1:-1] >= values[:-2]) & (values[1:-1] > values[2:])) + 1
        highest = sorted(sorted(inner.tolist(), key=lambda k: -values[k])[:_MOST])
        rows = [{"frequency": float(data["frequency"][k]), **{n: float(data[n][k]) for n in names}} for k in highest]
        units = {name: str(data[name].attrs["units"]) for name in names}
        return {
            **plain_attributes(data.attrs),
            "bins": int(data.sizes["frequency"]),
            "units_of": units,
            "peaks": json_value(rows),
        }

    def numbers(self) -> xr.Dataset:
        return self.result

    def _channel_words(self) -> tuple[str, ...]:
        """Return the names in ``peaked`` in words."""
        return self.peaked

    def _table(self, content: dict[str, Any]) -> Table:
        """Return the table of the peaks."""
        raise NotImplementedError


class SpectraPage(_OverFrequency):
    """Density of a signal; for two signals also cross density, transfer function and coherence."""

    kind = "spectra"

    @property
    def sentence(self) -> str:
        return summary_of(self.result, si=self.si)

    def _table(self, content: dict[str, Any]) -> Table:
        return peaks_table(content, si=self.si)

    def charts(self) -> list[Chart]:
        return spectra_charts(self.result, si=self.si, natural=numbers_in(self.result, "natural_frequencies"))

    def _channel_words(self) -> tuple[str, ...]:
        alone = ("psd", "psd_low", "psd_high")
        if "reference" not in self.result.attrs:
            return alone
        return (
            *alone,
            "coherence",
            "coherence_low",
            "coherence_high",
            "response_magnitude",
            "response_radius",
            "response_phase",
            "response_phase_limit",
        )


class DensityPage(SpectraPage):
    """The power spectral density of one signal, from ``psd``."""

    kind = "density"

    def __init__(self, result: xr.Dataset) -> None:
        names = {"density": "psd", "low": "psd_low", "high": "psd_high"}
        super().__init__(result.rename(names).assign_attrs(rms=rms_of(result)))
        self._density = result

    def charts(self) -> list[Chart]:
        rules = natural_rules(self.result, numbers_in(self.result, "natural_frequencies"))
        return [density_chart(self.result, si=self.si, rules=rules)]

    def numbers(self) -> xr.Dataset:
        return self._density


class CrossDensityPage(_OverFrequency):
    """Cross density of two signals and the transfer function between them; its data is real."""

    kind = "cross density"
    heading = "What the signals have in common"
    peaked = ("cross_magnitude", "response_magnitude", "response_radius", "response_phase", "response_phase_limit")

    def __init__(self, result: xr.Dataset) -> None:
        import xarray as xr

        is_complex = any(values.dtype.kind == "c" for values in result.data_vars.values())
        if is_complex:
            result = xr.Dataset(cross_parts(result), {"frequency": result["frequency"]}, result.attrs)
        super().__init__(result)

    @property
    def sentence(self) -> str:
        attributes = self.result.attrs
        magnitude = self.result["cross_magnitude"].values[1:]
        at = float(self.result["frequency"].values[1:][int(np.argmax(magnitude))])
        unit = " Hz" if self.si else ""
        return (
            f"The cross density of {attributes['channel']} and {attributes['reference']} is largest at {at:.4g}{unit}: "
            f"{magnitude.max():.4g} {raised(str(self.result['cross_magnitude'].attrs['units']))}".removesuffix(" 1")
            + "."
        )

    def _table(self, content: dict[str, Any]) -> Table:
        return cross_table(content, si=self.si)

    def charts(self) -> list[Chart]:
        rules = natural_rules(self.result, numbers_in(self.result, "natural_frequencies"))
        charts = cross_density_chart(self.result, si=self.si, rules=rules)
        return [charts, response_chart(self.result, si=self.si, rules=rules)]


class CoherencePage(_OverFrequency):
    """Presentation of a coherence: the share of one signal that another explains, bin by bin."""

    kind = "coherence"
    heading = "How far one signal explains the other"
    peaked = ("coherence", "low", "high")

    @property
    def sentence(self) -> str:
        attributes = self.result.attrs
        threshold = float(self.result.attrs["threshold"])
        coherence = np.nan_to_num(self.result["coherence"].values[1:])
        share = 100.0 * float(np.mean(coherence > threshold)) if coherence.size else math.nan
        return (
            f"Coherence of {attributes['channel']} and {attributes['reference']} stands above what chance gives "
            f"({threshold:.3g}) in {share:.0f} % of the bins."
        )

    def _table(self, content: dict[str, Any]) -> Table:
        return coherence_table(content, si=self.si)

    def charts(self) -> list[Chart]:
        return [coherence_chart(self.result, si=self.si)]
