"""A validation as a result: the verdict first, then levels, budget, mean cycles, orders, spectra and impacts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearrattle.measured.validation import Pair, Validation
from gearrattle.report.numbers import write_csv
from gearrattle.report.page import Section, notes_section
from gearrattle.report.plots.validation_figures import validation_charts
from gearrattle.report.presentation import Presentation
from gearrattle.report.record_dataset import records_dataset, stacked, texts
from gearrattle.report.tables import Table
from gearrattle.report.validation_tables import (
    budget_table,
    impacts_table,
    levels_table,
    orders_table,
    parameter_tables,
    rms_effects_table,
    setting_table,
    ways_table,
)

if TYPE_CHECKING:
    import xarray as xr


class ValidationPage(Presentation[Validation]):
    """A simulated motion against a measured one."""

    kind = "validation"

    @property
    def title(self) -> str:
        return f"{self.result.model} against {Path(self.result.source).name}"

    @property
    def sentence(self) -> str:
        return self.result.verdict

    def sections(self) -> tuple[Section, ...]:
        validation = self.result
        tables = {
            "sigma": (levels_table(validation),),
            "budget": (budget_table(validation), ways_table(validation), *parameter_tables(validation)),
            "orders": tuple(orders_table(pair) for pair in validation.pairs if pair.orders),
        }
        figures = [
            Section(chart.key, chart.title, charts=(chart,), tables=tables.get(chart.key, ()))
            for chart in validation_charts(validation)
            if chart.panels
        ]
        impacts = [Section("impacts", "Impacts", tables=(impacts_table(validation),))] if validation.impacts else []
        return (
            Section("verdict", "Verdict", validation.verdict, notes=tuple(validation.findings)),
            *figures,
            *impacts,
            Section("setting", "What was compared", tables=(setting_table(validation),)),
            *notes_section(self.notes),
        )

    def answer(self) -> tuple[Table, ...]:
        return levels_table(self.result), rms_effects_table(self.result)

    def content(self) -> dict[str, Any]:
        content = self.result.to_dict()
        del content["verdict"]  # it is the sentence
        return content

    def numbers(self) -> xr.Dataset:
        import xarray as xr

        validation = self.result
        pairs = self.result.pairs
        rows = [self._levels(), _orders(pairs), _bands(pairs), _budget(pairs)]
        if validation.impacts:
            rate = dict.fromkeys(("exact", "exact_error", "measured", "simulated", "low", "high"), "1/cycle")
            rows.append(records_dataset(validation.impacts, "impact", prefix="impact_", units=rate))
        clock = {f"clock_{name}": value for name, value in vars(validation.clock).items()}
        shared = {
            name: getattr(validation, name)
            for name in ("model", "source", "algorithm", "measured_cycles", "simulated_cycles", "rate", "trend")
        }
        return xr.merge([*rows, _curves(pairs)]).assign_attrs({**shared, "band": list(validation.band), **clock})

    def write(self, path: Path) -> None:
        """Write all numbers, or as CSV a row for every channel and level."""
        if path.suffix == ".csv":
            write_csv(self._levels(), path)
        else:
            super().write(path)

    def _levels(self) -> xr.Dataset:
        percent = dict.fromkeys(("sigma", "low", "high", "standard_error", "expanded", "remainder"), "%")
        rows = [
            {**vars(level), "channel": pair.name, "partner": pair.partner, "unit": pair.unit}
            for pair in self.result.pairs
            for level in pair.levels
        ]
        return records_dataset(rows, "level", units=percent)


def _orders(pairs: tuple[Pair, ...]) -> xr.Dataset:
    units = {"order": "1", "frequency": "Hz", "sigma": "%", "low": "%", "high": "%"}
    units |= dict.fromkeys(("phase", "phase_error", "phase_low", "phase_high"), "deg")
    rows = [{**vars(order), "channel": pair.name} for pair in pairs for order in pair.orders]
    data = records_dataset(rows, "order_row", prefix="order_", units=units)
    return data.rename(order_order="order") if rows else data


def _bands(pairs: tuple[Pair, ...]) -> xr.Dataset:
    units = {"low": "Hz", "high": "Hz", "decibels": "dB", "least": "dB", "most": "dB", "share": "1"}
    rows = [{**vars(band), "channel": pair.name} for pair in pairs for band in pair.bands]
    return records_dataset(rows, "band", prefix="band_", units=units)


def _budget(pairs: tuple[Pair, ...]) -> xr.Dataset:
    """Return every contribution to the uncertainty of every level."""
    rows = [
        {"source": term.source, "value": term.value, "channel": pair.name, "measure": level.measure}
        for pair in pairs
        for level in pair.levels
        for term in level.budget
    ]
    return records_dataset(rows, "contribution", prefix="budget_", units={"value": "%"})


def _curves(pairs: tuple[Pair, ...]) -> xr.Dataset:
    """Return mean cycles and spectral densities; shorter ones are filled up with NaN."""
    import xarray as xr

    def of(name: str) -> Any:
        return stacked([getattr(pair.curves, name) for pair in pairs])

    cycles = ("measured", "simulated", "measured_scatter", "simulated_scatter")
    densities = ("measured_density", "simulated_density")
    return xr.Dataset(
        {
            **{f"{name}_cycle": (("pair", "sample"), of(name)) for name in cycles},
            **{name: (("pair", "line"), of(name)) for name in densities},
            "density_frequency": (("pair", "line"), of("frequency"), {"units": "Hz"}),
            "pair_unit": ("pair", texts(pair.unit for pair in pairs)),
            "agreement": ("pair", [pair.agreement for pair in pairs], {"units": "1"}),
        },
        {"pair": texts(pair.name for pair in pairs)},
    )
