"""Numerical stiffness as a result: eigenvalues, R_lambda over contact ratios and regions, and fixed steps."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearrattle.analysis.stiffness import RegionStiffness, Stiffness
from gearrattle.report.numbers import Arrays
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.eigenvalues import eigenvalue_chart, ratio_chart
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.presentation import Presentation
from gearrattle.report.record_dataset import record_columns, stacked, texts
from gearrattle.report.tables import Table
from gearrattle.simulation.fixed_steps import StepLimit


@dataclass(frozen=True)
class OverRatios:
    """R_lambda over the contact ratio of every single element: (R,) ratios, and (R,) values by element."""

    ratios: tuple[float, ...]
    r_lambda: Mapping[str, Sequence[float]]


class StiffnessPage(Presentation[Stiffness]):
    """Presentation of the numerical stiffness of a driveline."""

    kind = "stiffness"

    def __init__(
        self,
        result: Stiffness,
        over: OverRatios | None = None,
        regions: Sequence[RegionStiffness] = (),
        limits: Sequence[StepLimit] = (),
        notes: Sequence[str] = (),
    ) -> None:
        """Present the stiffness of a driveline with every clearance replaced by one slope.

        ``regions`` are all regions of the driveline, or the regions that a motion visits. ``notes`` concern the limits
        of fixed steps.
        """
        super().__init__(result)
        self.over = over
        self.regions = regions
        self.limits = limits
        self.more_notes = tuple(notes)
        self.si = result.model.units == "SI"

    @property
    def title(self) -> str:
        return self.result.model.name or "driveline"

    @property
    def sentence(self) -> str:
        if math.isnan(self.result.r_lambda):
            return "Every motion is rigid: there is no R_lambda."
        return f"R_lambda {self.result.r_lambda:.6g} ({self.result.stiffness_class}), rigid motions left out."

    @property
    def notes(self) -> tuple[str, ...]:
        unstable = (
            f"{limit.algorithm}: a step multiplies a mode by {_growth(limit.growth)}: unstable"
            for limit in self.limits
            if limit.growth > 1.0 + 1e-9
        )
        return (*self.more_notes, *self.result.notes, *unstable)

    def answer(self) -> tuple[Table, ...]:
        return self._eigenvalues(), self._conditions(), self._over_ratios(), self._regions(), self._steps()

    def figures(self) -> list[Chart]:
        over = None if self.over is None else ratio_chart(self.over.ratios, self.over.r_lambda)
        return [chart for chart in (eigenvalue_chart(self.result), over) if chart is not None]

    def content(self) -> dict[str, Any]:
        result = self.result
        content = {}
        if self.over is not None:
            content["over"] = {"contact_ratio": self.over.ratios, "r_lambda": self.over.r_lambda}
        return {
            "r_lambda": result.r_lambda,
            "stiffness_class": result.stiffness_class,
            "eigenvalues": _complex(result.eigenvalues),
            "rigid_eigenvalues": _complex(result.rigid_eigenvalues),
            "condition": result.condition,
            **content,
            "regions": [_region(region) for region in self.regions],
            "steps": self.limits,
        }

    def numbers(self) -> Arrays:
        result = self.result
        rate = {"units": "1/s" if self.si else "1"}
        variables = {
            "r_lambda": ((), result.r_lambda, {"units": "1"}),
            "eigenvalue": (("part", "eigenvalue_number"), _parts(result.eigenvalues), rate),
            "rigid_eigenvalue": (("part", "rigid_eigenvalue_number"), _parts(result.rigid_eigenvalues), rate),
            "condition_number": ("formulation", list(result.condition.values()), {"units": "1"}),
        }
        coordinates = {"formulation": texts(result.condition), "part": texts(("real", "imaginary"))}
        if self.over is not None and self.over.r_lambda:
            table = ("element", "contact_ratio"), list(self.over.r_lambda.values()), {"units": "1"}
            variables["r_lambda_over_contact_ratio"] = table
            coordinates |= {"element": texts(self.over.r_lambda), "contact_ratio": list(self.over.ratios)}
        if self.regions:
            variables |= self._region_columns()
            coordinates["clearance"] = texts(self.regions[0].labels)
        seconds = "s" if self.si else "1"
        units = {"step": seconds, "largest_step": seconds, "product": "1", "growth": "1"}
        variables |= record_columns(self.limits, "algorithm_number", prefix="fixed_step_", units=units)
        attributes = {"model": result.model.name, "stiffness_class": result.stiffness_class}
        return Arrays(variables, coordinates, attributes)

    def _region_columns(self) -> dict[str, Any]:
        eigenvalues = [region.eigenvalues.elastic for region in self.regions]
        by_region = ("region", "region_eigenvalue")
        rate = {"units": "1/s" if self.si else "1"}
        return {
            "region_label": (("region", "clearance"), [list(region.labels.values()) for region in self.regions]),
            "region_r_lambda": ("region", [r.eigenvalues.r_lambda for r in self.regions], {"units": "1"}),
            "region_share": ("region", [r.share for r in self.regions], {"units": "1"}),
            "region_eigenvalue_real": (by_region, stacked([values.real for values in eigenvalues]), rate),
            "region_eigenvalue_imaginary": (by_region, stacked([values.imag for values in eigenvalues]), rate),
        }

    def _eigenvalues(self) -> Table:
        values = [value for value in self.result.eigenvalues.tolist() if value.imag >= 0.0]
        rows = tuple((f"{value.real:.6g} {value.imag:+.6g}i", f"{abs(value):.6g}") for value in values)
        return Table(("eigenvalue [1/s]" if self.si else "eigenvalue", "magnitude"), rows)

    def _conditions(self) -> Table:
        rows = tuple((name, f"{value:.4g}") for name, value in self.result.condition.items())
        return Table(("formulation", "condition number of the Jacobian"), rows)

    def _over_ratios(self) -> Table:
        if self.over is None:
            return Table((), ())
        values = self.over.r_lambda.values()
        rows = tuple((f"{ratio:g}", *(numeral(v[j], 5) for v in values)) for j, ratio in enumerate(self.over.ratios))
        return Table(("R_lambda over contact ratio", *self.over.r_lambda), rows)

    def _regions(self) -> Table:
        if not self.regions:
            return Table((), ())
        has_share = not math.isnan(self.regions[0].share)
        rows = []
        for region in self.regions:
            values = region.eigenvalues
            numbers = (numeral(values.r_lambda, 5), values.stiffness_class, f"{values.fastest:.5g}")
            share = (f"{100.0 * region.share:.4g}",) if has_share else ()
            rows.append((*map(str, region.labels.values()), *numbers, *share))
        largest = "largest [1/s]" if self.si else "largest"
        shares = ("share of time [%]",) if has_share else ()
        return Table((*self.regions[0].labels, "R_lambda", "class", largest, *shares), tuple(rows))

    def _steps(self) -> Table:
        rows = tuple(
            (x.algorithm, f"{x.step:.5g}", f"{x.product:.4g}", f"{x.growth:.5g}", f"{x.largest_step:.5g}")
            for x in self.limits
        )
        unit = " [s]" if self.si else ""
        return Table(("fixed step", f"step{unit}", "largest x step", "growth", f"limit{unit}"), rows)


def _growth(growth: float) -> str:
    return f"{growth:.4g}" if growth > 1.001 else f"1 + {growth - 1.0:.2g}"


def _complex(values: Any) -> list[list[float]]:
    return [[value.real, value.imag] for value in values.tolist()]


def _parts(values: Any) -> Any:
    return np.array([values.real, values.imag])


def _region(region: RegionStiffness) -> dict[str, Any]:
    return {
        "labels": region.labels,
        "r_lambda": region.eigenvalues.r_lambda,
        "stiffness_class": region.eigenvalues.stiffness_class,
        "share": region.share,
        "eigenvalues": _complex(region.eigenvalues.elastic),
        "rigid_eigenvalues": _complex(region.eigenvalues.rigid),
    }
