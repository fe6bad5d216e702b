"""A comparison of algorithms as a result: the recommendation first, then the numbers and figures behind it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.comparison.comparison_rows import Comparison, Row
from gearrattle.comparison.comparison_table import COLUMNS
from gearrattle.comparison.nearby_motions import MANY
from gearrattle.comparison.precision import WorkPrecision
from gearrattle.report.comparison_tables import (
    coherence_table,
    cost_table,
    short_table,
    stability_table,
    statistics_tables,
    transmissibility_table,
    truth_table,
    verdict_table,
)
from gearrattle.report.numbers import write_csv
from gearrattle.report.page import Section, figure_sections, notes_section
from gearrattle.report.plots.comparison_figures import growth_of_errors, work_precision_chart
from gearrattle.report.presentation import Presentation
from gearrattle.report.record_dataset import records_dataset, texts
from gearrattle.report.tables import Table
from gearrattle.wording import counted

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


class ComparisonPage(Presentation[Comparison]):
    """Presentation of a comparison of algorithms."""

    kind = "comparison"

    def __init__(self, result: Comparison | pd.DataFrame, precision: WorkPrecision | None = None) -> None:
        """Present a comparison, or the table of ``gearrattle.compare``; with ``precision`` also error against work."""
        super().__init__(result if isinstance(result, Comparison) else result.attrs["comparison"])
        self.precision = precision

    @property
    def title(self) -> str:
        return self.result.model or "driveline"

    @property
    def sentence(self) -> str:
        return self.result.recommendation

    def sections(self) -> tuple[Section, ...]:
        comparison = self.result
        charts = [growth_of_errors(comparison)]
        if self.precision is not None:
            charts.append(work_precision_chart(self.precision, [row.label for row in comparison.rows[1:-1]]))
        tables = (verdict_table(comparison), cost_table(comparison), truth_table(comparison))
        return (
            Section("recommendation", "Recommendation", self.sentence, (_setting(comparison),), tables=tables),
            *figure_sections(charts),
            *_detail(comparison),
            *notes_section(self.notes),
        )

    def answer(self) -> tuple[Table, ...]:
        return (short_table(self.result),)

    def content(self) -> dict[str, Any]:
        precision = None if self.precision is None else self.precision.to_dict()
        content = {**self.result.to_dict(), "work_precision": precision}
        del content["recommendation"]  # it is the sentence
        return content

    def numbers(self) -> xr.Dataset:
        import xarray as xr

        comparison = _with_distinct_labels(self.result)
        shared = {name: getattr(comparison, name) for name in ("model", "reference", "tolerance", "window", "period")}
        attributes = {**shared, "predictability_horizon": comparison.horizon, "cycles": comparison.cycles}
        parts = [_table(comparison), _errors(comparison.rows), _histories(comparison.rows), _growths(comparison.rows)]
        if self.precision is not None:
            parts.append(_work_precision(self.precision))
        labels = [row.label for row in comparison.rows]
        return xr.merge(parts, join="outer").sel(algorithm=labels).assign_attrs(attributes)

    def write(self, path: Path) -> None:
        """Write all numbers, or as CSV a row for every algorithm."""
        if path.suffix == ".csv":
            write_csv(_table(_with_distinct_labels(self.result)), path)
        else:
            super().write(path)


def _with_distinct_labels(comparison: Comparison) -> Comparison:
    """Return a comparison with a different label in every row: "exact" may be both reference and contender."""
    seen: dict[str, int] = {}
    rows = []
    for row in comparison.rows:
        seen[row.label] = seen.get(row.label, 0) + 1
        number = seen[row.label]
        rows.append(row if number == 1 else replace(row, label=f"{row.label} ({number})"))
    return replace(comparison, rows=tuple(rows))


def _table(comparison: Comparison) -> xr.Dataset:
    """Return the table of the comparison, with units."""
    rows = [{name: read(row) for name, (_, read) in COLUMNS.items()} for row in comparison.rows]
    units = {name: unit for name, (unit, _) in COLUMNS.items()} | {"error": _error_unit(comparison.rows)}
    return records_dataset(rows, "algorithm", units=units).assign_coords(algorithm=_labels(comparison.rows))


def _error_unit(rows: tuple[Row, ...]) -> str:
    return next((row.error.unit for row in rows if row.error is not None), "half-gaps")


def _labels(rows: Iterable[Row]) -> Any:
    return texts(row.label for row in rows)


def _errors(rows: tuple[Row, ...]) -> xr.Dataset:
    """Return the errors of every clearance and inertia, with coherence and transmissibility of the inertias."""
    import xarray as xr

    ended = [row for row in rows if row.error is not None]
    if not ended or ended[0].error is None:
        return xr.Dataset()
    first = ended[0].error
    by_inertia = ("algorithm", "inertia")
    errors = [row.error for row in ended if row.error is not None]
    moved = [row.transmissibility for row in ended]
    missing = np.full(len(first.inertias), np.nan)
    ratio = {"units": "1"}
    # values that an algorithm does not have are NaN
    coherences = [
        [np.nan if row.coherence is None else row.coherence[name].mean for name in first.inertias] for row in ended
    ]
    return xr.Dataset(
        {
            "deflection_error": (("algorithm", "clearance"), [e.deflection for e in errors], {"units": "half-gaps"}),
            "velocity_error": (by_inertia, [e.velocity for e in errors], {"units": "rms velocity"}),
            "mean_coherence": (by_inertia, coherences, ratio),
            "transmissibility_rms_error": (by_inertia, [missing if t is None else t.rms_error for t in moved], ratio),
            "transmissibility_peak_error": (by_inertia, [missing if t is None else t.peak_error for t in moved], ratio),
        },
        {
            "algorithm": _labels(ended),
            "clearance": texts(first.clearances),
            "inertia": texts(first.inertias),
        },
    )


def _histories(rows: tuple[Row, ...]) -> xr.Dataset:
    """Return the errors over time; a value is the largest error since the time before it."""
    import xarray as xr

    ended = [row for row in rows if row.history is not None]
    histories = [row.history for row in ended if row.history is not None]
    if not histories:
        return xr.Dataset()
    unit = _error_unit(rows)
    return xr.Dataset(
        {"largest_error": (("algorithm", "time"), [worst for _, worst in histories], {"units": unit})},
        {"algorithm": _labels(ended), "time": ("time", histories[0][0], {"units": "s"})},
    )


def _growths(rows: tuple[Row, ...]) -> xr.Dataset:
    """Return by region the growth of a mode per step, for algorithms with fixed steps."""
    import xarray as xr

    fixed = [row for row in rows if row.growths]
    if not fixed:
        return xr.Dataset()
    regions = list(dict.fromkeys(region for row in fixed for region in row.growths))
    growths = [[row.growths.get(region, np.nan) for region in regions] for row in fixed]
    return xr.Dataset(
        {"growth_a_step": (("algorithm", "region"), growths, {"units": "1"})},
        {"algorithm": _labels(fixed), "region": texts(regions)},
    )


def _work_precision(precision: WorkPrecision) -> xr.Dataset:
    """Return the points of all curves; the point of the exact solution is last."""
    points = [{**vars(point), "algorithm": curve.algorithm} for curve in precision.curves for point in curve.points]
    points.append({**vars(precision.exact), "algorithm": "exact"})
    units = {"error": precision.unit, "function_calls": "1", "wall_time": "s"}
    return records_dataset(points, "run", prefix="work_precision_", units=units)


def _setting(comparison: Comparison) -> str:
    horizon = comparison.horizon / comparison.period
    until = counted(horizon, "cycle") if horizon < comparison.cycles else "the end"
    return (
        f"{counted(comparison.cycles, 'cycle')}, {comparison.discard} of them discarded, "
        f"{counted(comparison.samples_per_cycle, 'sample')} a "
        f"cycle; tolerance {comparison.tolerance:.2g} where steps are chosen; reference: {comparison.reference}. "
        f"Predictable to {until}. No contender may take longer than {comparison.budget:g} s."
    )


def on_statistics(comparison: Comparison, *, differ: bool) -> str:
    """Return a sentence on statistics and the number of algorithms; it mentions only statistics that were compared."""
    statistics = [row.statistics for row in comparison.rows[1:-1] if row.statistics is not None]
    motions = max((statistic.motions for statistic in statistics), default=0)
    if not any(statistic.decided for statistic in statistics):
        why = (
            f"time allowed for {motions} exact motions of {MANY}"
            if motions
            else "the runs are too short, or none ended"
        )
        return f"Nothing can be said of statistics: {why}."
    if differ:
        return (
            "Beyond the predictability horizon two right motions differ sample by sample, but not in their statistics. "
            f"{counted(motions, 'exact motion')} begun within a thousandth of a half-gap show what a right "
            "one may come to; these lie outside:"
        )
    return f"No statistic that was compared lies outside those of {counted(motions, 'exact motion')} begun nearby."


def _detail(comparison: Comparison) -> list[Section]:
    # statistics that differ, and growth of modes in fixed steps
    different = tuple(statistics_tables(comparison))
    stability = stability_table(comparison)
    words_on_steps = (
        "Fixed steps can lie outside the method's stability region; variable steps are kept inside by their error test."
    )
    return [
        *([Section("stability", "Stability", words=(words_on_steps,), tables=(stability,))] if stability.rows else []),
        # statistics, accuracy by distance from the driving point, agreement with the exact motion
        Section(
            "statistics",
            "Statistics",
            words=(on_statistics(comparison, differ=bool(different)),),
            tables=different,
        ),
        Section(
            "transmissibility",
            "Transmissibility",
            words=("How accuracy falls off away from the driving point.",),
            tables=(transmissibility_table(comparison),),
        ),
        Section(
            "coherence",
            "Coherence",
            words=(
                "The 1995 paper's index of agreement, with the coherence that chance gives and the ceiling that even "
                "the exact motion from nearby reaches.",
            ),
            tables=(coherence_table(comparison),),
        ),
    ]
