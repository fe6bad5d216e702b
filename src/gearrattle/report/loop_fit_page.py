"""A fitted torque-angle loop as a result: the stages with their errors, and the law drawn over the samples."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gearrattle.measured.identification.loop_result import LoopFit
from gearrattle.report.numbers import Arrays
from gearrattle.report.page import Section, figure_sections, notes_section
from gearrattle.report.plots.fitted_loop_figure import loop_chart
from gearrattle.report.presentation import ONE_FIGURE_ENDINGS, Presentation
from gearrattle.report.record_dataset import texts
from gearrattle.report.tables import Table
from gearrattle.wording import counted


class LoopFitPage(Presentation[LoopFit]):
    """The law of a coupling, fitted to a measured loop."""

    kind = "loop fit"
    endings = (*ONE_FIGURE_ENDINGS, ".toml")

    @property
    def title(self) -> str:
        return self.result.name

    @property
    def sentence(self) -> str:
        fit = self.result
        counts = f"{len(fit.stages)} drive-side and {len(fit.coast_stages)} coast-side stages"
        share = f"{100.0 * fit.residual / fit.full_scale:.2g} % of full scale"
        samples = counted(fit.measured[0].size, "sample")
        return f"{fit.source}: {counts} from {samples}; residual {fit.residual:.4g} N m rms, {share}."

    def sections(self) -> tuple[Section, ...]:
        chart = loop_chart(self.result)
        text = ("The coupling for a model file", self.result.toml)
        return (
            Section("summary", "Summary", self.sentence, tables=self.answer(), text=text),
            *figure_sections([chart]),
            *notes_section(self.notes),
        )

    def answer(self) -> tuple[Table, ...]:
        fit = self.result
        head = ("", "value", "± error", "95 % from", "to", *(["bootstrap"] if fit.bootstrap_errors else []), "unit")
        return (Table(head, tuple(self._row(name) for name in fit.values), frozenset({0, len(head) - 1})),)

    def content(self) -> dict[str, Any]:
        return self.result.to_dict()

    def numbers(self) -> Arrays:
        fit = self.result
        names = list(self.result.values)
        deflection, torque = fit.measured
        missing = dict.fromkeys(names, np.nan)
        return Arrays(
            {
                "value": ("parameter", [fit.values[name] for name in names]),
                "standard_error": ("parameter", [fit.errors[name] for name in names]),
                "interval": (("parameter", "end"), [fit.intervals[name] for name in names]),
                "bootstrap_error": ("parameter", [{**missing, **fit.bootstrap_errors}[name] for name in names]),
                "covariance": (("parameter", "other_parameter"), fit.covariance),
                "deflection": ("sample", deflection, {"units": "rad"}),
                "torque": ("sample", torque, {"units": "N m"}),
                "torque_residual": ("sample", fit.residuals, {"units": "N m"}),
                "tried_stages": ("tried", [drive for drive, _, _ in fit.steps]),
                "tried_coast_stages": ("tried", [coast for _, coast, _ in fit.steps]),
                "bic": ("tried", [float(bic) for _, _, bic in fit.steps], {"units": "1"}),
            },
            {"parameter": texts(names), "other_parameter": texts(names), "end": texts(("low", "high"))},
            {"name": fit.name, "source": fit.source, "residual": fit.residual, "tau": fit.tau},
        )

    def write(self, path: Path) -> None:
        """Write the coupling (.toml), or a file with another of the ``endings``."""
        if path.suffix == ".toml":
            path.write_text(self.result.toml, encoding="utf-8")
        else:
            super().write(path)

    def _row(self, name: str) -> tuple[str, ...]:
        fit = self.result
        factor, unit = fit.unit(name.rpartition(".")[2])
        bootstrap = [fit.bootstrap_errors[name]] if fit.bootstrap_errors else []
        numbers = [fit.values[name], fit.errors[name], *fit.intervals[name], *bootstrap]
        value, error, low, high, *more = (number * factor for number in numbers)
        words = [f"{value:.5g}", f"{error:.2g}", f"{low:.4g}", f"{high:.4g}", *(f"{number:.2g}" for number in more)]
        return (name, *words, unit.replace("*", " "))
