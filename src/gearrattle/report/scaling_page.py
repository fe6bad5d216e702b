"""A dimensionless model as a result: its scales, its coefficients, and its condition numbers."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from gearrattle.analysis.scaling import Nondimensional
from gearrattle.analysis.stiffness import Stiffness, stiffness
from gearrattle.report.numbers import Arrays
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.row_charts import Series, row_chart
from gearrattle.report.presentation import ModelPresentation
from gearrattle.report.record_dataset import texts
from gearrattle.report.tables import Table

_UNITS = {"frequency": "rad/s", "angle": "rad", "length": "m", "radius": "m", "inertia": "kg m^2"}


class ScalingPage(ModelPresentation[Nondimensional]):
    """A model in multiples of its characteristic quantities."""

    kind = "scaling"

    def __init__(self, result: Nondimensional, stiff: Stiffness | None = None) -> None:
        """Present a model without dimensions.

        ``stiff`` has the condition numbers of the model in SI; default: with every clearance closed.
        """
        super().__init__(result)
        self.stiff = stiffness(result.original) if stiff is None else stiff

    @property
    def title(self) -> str:
        return self.result.original.name or "driveline"

    @property
    def sentence(self) -> str:
        scales = asdict(self.result.scales).items()
        return f"One stands for {', '.join(f'{name} {value:.6g} {_UNITS[name]}' for name, value in scales)}."

    def answer(self) -> tuple[Table, ...]:
        scaling = self.result
        r_lambda = numeral(self.stiff.r_lambda)
        scales = tuple((name, f"{value:.6g} {_UNITS[name]}") for name, value in asdict(scaling.scales).items())
        coefficients = tuple((name, f"{value:.6g}") for name, value in scaling.coefficients.items())
        conditions = tuple((name, f"{value:.4g}", r_lambda) for name, value in self.stiff.condition.items())
        note = "R_lambda is the same in all: changes of coordinates and units are similarity transforms."
        return (
            Table(("unit", ""), scales),
            Table(("coefficient", ""), coefficients),
            Table(("formulation", "condition number", "R_lambda"), conditions, note=note),
        )

    def figures(self) -> list[Chart]:
        coefficients = self.result.coefficients
        sizes = np.abs(np.array(list(coefficients.values())))
        caption = "Magnitudes of the dimensionless coefficients: what is much smaller than the rest may be left out."
        chart = row_chart(
            "coefficients",
            "Coefficients",
            caption,
            list(coefficients),
            [Series("", sizes)],
            level="magnitude",
            log=True,
        )
        return [] if chart is None else [chart]

    def content(self) -> dict[str, Any]:
        return {
            "scales": asdict(self.result.scales),
            "coefficients": self.result.coefficients,
            "r_lambda": self.stiff.r_lambda,
            "condition": self.stiff.condition,
        }

    def numbers(self) -> Arrays:
        scales = asdict(self.result.scales)
        coefficients = self.result.coefficients
        return Arrays(
            {
                **{f"scale_{name}": ((), value, {"units": _UNITS[name]}) for name, value in scales.items()},
                "coefficient": ("name", list(coefficients.values()), {"units": "1"}),
                "condition_number": ("formulation", list(self.stiff.condition.values()), {"units": "1"}),
                "r_lambda": ((), self.stiff.r_lambda, {"units": "1"}),
            },
            {"name": texts(coefficients), "formulation": texts(self.stiff.condition)},
            {"model": self.result.original.name},
        )
