"""A fit as a result: parameters with errors, residuals of all data, undetermined combinations, further minima."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.measured.identification.data_problem import Residual
from gearrattle.measured.identification.fit_result import Fit, FittedParameter
from gearrattle.model.path_labels import in_written_unit
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.row_charts import Series, row_chart
from gearrattle.report.plots.run_up_validation_figures import track_charts
from gearrattle.report.presentation import ModelPresentation
from gearrattle.report.record_dataset import records_dataset, texts
from gearrattle.report.tables import Table
from gearrattle.wording import counted, noun_of

if TYPE_CHECKING:
    import xarray as xr

_RESPONSE = "response "
_FREQUENCY = ": frequency"
_PARTS = ", in phase", ", in quadrature"
"""Ends of the two labels of an order whose phase was compared."""


class FitPage(ModelPresentation[Fit]):
    """A model whose parameters were fitted to measured data."""

    kind = "fit"

    @property
    def title(self) -> str:
        return self.result.model.name or "driveline"

    @property
    def sentence(self) -> str:
        fit = self.result
        number = len(fit.undetermined)
        combinations = noun_of(number, "combination of parameters", "combinations of parameters")
        all_known = (
            "the data determine every parameter" if fit.explains else "no combination of parameters is left open"
        )
        known = f"the data leave {number} {combinations} open" if number else all_known
        verdict = "" if fit.explains else f"{_unexplained(fit)} "
        return (
            f"{verdict}{counted(len(fit.parameters), 'parameter')} fitted to {counted(len(fit.residuals), 'number')}: "
            f"chi-square {fit.chi_square:.4g}, {counted(fit.degrees_of_freedom, 'degree')} of freedom; {known}. The "
            f"best minimum was reached from {fit.minima[0].times} of {counted(fit.starts, 'start')}; "
            f"{_minima(len(fit.minima))}."
        )

    def answer(self) -> tuple[Table, ...]:
        minima = tuple((f"{m.chi_square:.4g}", f"{m.times}") for m in self.result.minima)
        return (
            self._parameters(),
            self._residuals(),
            self._tracks() if self.result.tracks else self._orders(),
            self._responses(),
            self._undetermined(),
            Table(("chi-square", "reached from starts"), minima, frozenset(), "Minima"),
        )

    def figures(self) -> list[Chart]:
        if self.result.tracks:
            blocks = "measured, with 95 % limits, and of the fitted model"
            si = self.result.model.units == "SI"
            return [chart for chart in track_charts(self.result.tracks, "fitted", blocks, si=si) if chart.panels]
        data = [r for r in self.result.residuals if not r.label.startswith(_RESPONSE)]
        charts = [_residual_chart("residuals", "Residuals", [(r.label, r.residual) for r in data])]
        rms = [(row[0], float(row[2])) for row in self._responses().rows]
        charts.append(_residual_chart("responses", "Residuals of responses, rms", rms))
        return [chart for chart in charts if chart is not None]

    def content(self) -> dict[str, Any]:
        return self.result.to_dict()

    def numbers(self) -> xr.Dataset:
        import xarray as xr

        # profile intervals, minima, and exponents of undetermined combinations
        fit = self.result
        paths = texts(p.path for p in self.result.parameters)
        ends = [(math.nan, math.nan) if p.interval is None else p.interval for p in fit.parameters]
        values = [[minimum.values[p.path] for p in fit.parameters] for minimum in fit.minima]
        exponents = [[c.exponents.get(p.path, 0.0) for p in fit.parameters] for c in fit.undetermined]
        shape = (len(fit.undetermined), len(fit.parameters))
        # records of parameters, data and combinations, with the arrays above
        return xr.merge(
            [
                records_dataset(fit.parameters, "parameter", prefix="parameter_"),
                records_dataset(fit.residuals, "datum", prefix="datum_", units={"residual": "1"}),
                records_dataset(fit.undetermined, "combination", prefix="combination_"),
                xr.Dataset(
                    {
                        "profile_interval": (("parameter", "end"), ends),
                        "covariance": (("parameter", "other_parameter"), fit.covariance, {"units": "1"}),
                        "minimum_values": (("minimum", "parameter"), values),
                        "minimum_chi_square": ("minimum", [m.chi_square for m in fit.minima], {"units": "1"}),
                        "minimum_times": ("minimum", [m.times for m in fit.minima], {"units": "1"}),
                        "exponent": (("combination", "parameter"), np.reshape(exponents, shape), {"units": "1"}),
                    },
                    {"parameter": paths, "other_parameter": paths, "end": texts(("low", "high"))},
                ),
            ]
        ).assign_attrs(
            model=fit.model.name,
            chi_square=fit.chi_square,
            degrees_of_freedom=fit.degrees_of_freedom,
            starts=fit.starts,
        )

    def _parameters(self) -> Table:
        profiled = any(p.interval is not None for p in self.result.parameters)
        head = ("parameter", "start", "fitted", "standard error", "bounds", *(["95 % interval"] if profiled else []))
        rows = []
        for p in self.result.parameters:
            scale, unit = in_written_unit(p.path, self.result.model)
            end = f" {unit}" if unit else ""
            bounds = f"{p.lower * scale:.4g} ... {p.upper * scale:.4g}{end}"
            bounds += f", {p.at_bound} reached" if p.at_bound else ""
            row = [p.path, f"{p.start * scale:.6g}{end}", f"{p.value * scale:.6g}{end}", _error(p, scale), bounds]
            rows.append((*row, *([f"{_interval(p.interval, scale)}{end}"] if profiled else [])))
        return Table(head, tuple(rows), title="Parameters")

    def _residuals(self) -> Table:
        rows = []
        for r in self.result.residuals:
            if r.label.startswith(_RESPONSE) or r.label.endswith(_PARTS):
                continue
            scale, unit = (0.5 / math.pi, "Hz") if r.unit == "rad/s" and r.label.endswith(_FREQUENCY) else (1.0, r.unit)
            numbers = (r.measured * scale, r.fitted * scale) if unit else (round(r.measured, 6), round(r.fitted, 6))
            end = f" {unit}" if unit else ""
            words = (f"{number:.6g}{end}" for number in numbers)
            rows.append((r.label, *words, f"{r.standard_error * scale:.2g}", f"{r.residual:+.2f}"))
        return Table(("datum", "measured", "fitted", "standard error", "residual"), tuple(rows), title="Data")

    def _orders(self) -> Table:
        by_label = {r.label: r for r in self.result.residuals}
        rows = []
        for label, along in by_label.items():
            name = label.removesuffix(_PARTS[0])
            if name == label:
                continue
            across = by_label[name + _PARTS[1]]
            line = complex(along.fitted, across.fitted)
            size = abs(line)
            turn = math.degrees(math.atan2(line.imag, line.real))
            rows.append(
                (
                    name,
                    f"{along.measured:.5g} {along.unit}",
                    f"{size:.5g} {along.unit}",
                    f"{along.standard_error:.2g}",
                    f"{turn:+.2f} deg",
                    f"{along.residual:+.2f}, {across.residual:+.2f}",
                )
            )
        head = ("order", "measured", "fitted", "standard error", "fitted ahead by", "residuals")
        return Table(head, tuple(rows), title="Orders of the motion")

    def _tracks(self) -> Table:
        rows = []
        for track in self.result.tracks:
            measured, fitted = track.levels
            away = (track.simulated - track.measured) / track.error
            rms = math.sqrt(np.mean(away**2))
            largest = int(np.argmax(np.abs(away)))
            factor, unit = (30.0 / math.pi, " rpm") if self.result.model.units == "SI" else (1.0, "")
            levels = (f"{numeral(level)} {track.unit}" for level in (measured, fitted))
            worst = f"{away[largest]:+.2f} at {numeral(factor * track.speed[largest])}{unit}"
            rows.append((track.channel, f"{track.order:g}", *levels, f"{rms:.2f}", worst))
        head = ("channel", "order", "measured, rms over speed", "fitted", "residuals, standard errors rms", "largest")
        return Table(head, tuple(rows), frozenset({0}), "Orders over speed")

    def _responses(self) -> Table:
        responses: dict[str, list[Residual]] = {}
        for r in self.result.residuals:
            if r.label.startswith(_RESPONSE):
                responses.setdefault(r.label.split(": ")[0], []).append(r)
        rows = []
        for label, samples in responses.items():
            squares = np.array([r.residual for r in samples]) ** 2
            worst = samples[int(squares.argmax())].label.split(": ")[1]
            rms = math.sqrt(squares.mean())
            largest = math.sqrt(squares.max())
            rows.append((label, f"{len(samples) // 2}", f"{rms:.3g}", f"{largest:.3g}", f"{worst} rad/s"))
        head = ("response", "samples", "residuals, standard errors rms", "largest", "at")
        return Table(head, tuple(rows), title="Responses")

    def _undetermined(self) -> Table:
        rows = [
            ("not determined by the data" if c.structural else "hardly determined by the data", c.words)
            for c in sorted(self.result.undetermined, key=lambda c: not c.structural)
        ]
        return Table(("", "combination"), tuple(rows), frozenset({0, 1}), "What stays open")


def _residual_chart(key: str, title: str, residuals: Sequence[tuple[str, float]]) -> Chart | None:
    """Draw one row per residual; None without residuals."""
    caption = "Fitted less measured, in standard errors of each datum. Most should lie between -2 and 2."
    values = np.array([residual for _, residual in residuals])
    return row_chart(
        key,
        title,
        caption,
        [label for label, _ in residuals],
        [Series("", values)],
        level="residual, standard errors",
        marks=[-2.0, 0.0, 2.0],
    )


def _unexplained(fit: Fit) -> str:
    """Return a sentence if the fit does not explain the data; else an empty text."""
    size = f"{fit.rms_residual:.3g}"
    if fit.chance is None:
        return f"The model hardly explains the data: residuals are {size} times the standard errors that were assumed."
    return (
        f"The model does not explain the data: residuals are {size} standard errors rms, which chance gives with a "
        f"probability of {fit.chance:.1g}."
    )


def _minima(number: int) -> str:
    return f"there {'is' if number == 1 else 'are'} {counted(number, 'distinct minimum', 'distinct minima')}"


def _error(p: FittedParameter, scale: float) -> str:
    if p.at_bound:
        return "on its bound"
    if math.isinf(p.standard_error):
        return "not determined"
    return f"{p.standard_error * scale:.2g} ({100 * p.relative_error:.2g} %)"


def _interval(ends: tuple[float, float] | None, scale: float) -> str:
    if ends is None:
        return "–"
    low = "below the bound" if ends[0] == 0.0 else f"{ends[0] * scale:.5g}"
    high = "beyond the bound" if math.isinf(ends[1]) else f"{ends[1] * scale:.5g}"
    return f"{low} ... {high}"
