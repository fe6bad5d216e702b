"""A verdict as figures: impacts on either side, and the share of time in contact, one row per part."""

from __future__ import annotations

import numpy as np

from gearrattle.quantities.verdict import Verdict
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.palette import ACCENT, COAST, DRIVE
from gearrattle.report.plots.row_charts import Series, row_chart


def verdict_charts(verdict: Verdict) -> list[Chart]:
    """Draw impacts per cycle and contact of every part; empty where no element has a corner."""
    names = [part.name for part in verdict.parts]
    drive = np.array([part.drive_impacts_per_cycle for part in verdict.parts])
    coast = np.array([part.coast_impacts_per_cycle for part in verdict.parts])
    shares = {row.subject: row.value for row in verdict.entries if row.quantity == "contact share"}
    contact = np.array([100.0 * float(shares.get(name, np.nan)) for name in names])
    impacts = row_chart(
        "impacts",
        "Impacts",
        "Impacts per cycle on the drive side and on the coast side of every part.",
        names,
        [Series("drive side", drive, DRIVE), Series("coast side", coast, COAST)],
        level="impacts per cycle",
        marks=[0.0],
    )
    in_contact = row_chart(
        "contact",
        "Contact",
        "Share of the steady time in which a part is in contact on either side.",
        names,
        [Series("", contact, ACCENT)],
        level="% of the time",
        marks=[0.0, 100.0],
    )
    return [chart for chart in (impacts, in_contact) if chart is not None]
