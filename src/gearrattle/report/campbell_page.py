"""The Campbell diagram as a result: crossings of orders and natural frequencies."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gearrattle.analysis.campbell import Campbell, Crossing
from gearrattle.report.modes_tables import crossings_table, percent, turning
from gearrattle.report.numbers import Arrays
from gearrattle.report.page import Section, notes_section
from gearrattle.report.plots.campbell_figure import campbell_chart
from gearrattle.report.presentation import Presentation
from gearrattle.report.record_dataset import texts
from gearrattle.report.tables import Table
from gearrattle.wording import counted


class CampbellPage(Presentation[Campbell]):
    """The Campbell diagram alone, of one contact state or several."""

    kind = "Campbell diagram"

    @property
    def title(self) -> str:
        return self.result.modes[0].model.name or "driveline"

    @property
    def sentence(self) -> str:
        return crossings_sentence(self.result)

    def sections(self) -> tuple[Section, ...]:
        summary = Section("summary", "Summary", self.sentence)
        return summary, diagram_section(self.result), *notes_section(self.notes)

    def answer(self) -> tuple[Table, ...]:
        return (crossings_table(self.result, si=self.result.units == "SI"),)

    def content(self) -> dict[str, Any]:
        return self.result.to_dict()

    def numbers(self) -> Arrays:
        # crossings of orders and natural frequencies, one variable per field
        diagram = self.result
        unit = "rad/s" if self.result.units == "SI" else "1"
        columns = {
            "speed": unit,
            "order": "1",
            "mode": "",
            "frequency": unit,
            "state": "",
            "source": "",
            "share": "1",
        }
        crossings = {
            f"crossing_{name}": ("crossing", [getattr(crossing, name) for crossing in diagram.crossings], {"units": of})
            for name, of in columns.items()
        }
        # contact ratios that define the states
        names = sorted({name for state in diagram.states for name in state})
        ratios = np.array([[state.get(name, math.nan) for name in names] for state in diagram.states])
        # natural frequencies by state, with the crossings
        return Arrays(
            {
                "frequency": (("state", "mode"), diagram.frequencies, {"units": unit}),
                "contact_ratio": (
                    ("state", "element"),
                    ratios.reshape(len(diagram.states), len(names)),
                    {"units": "1"},
                ),
                **crossings,
            },
            {
                "element": texts(names),
                "order": ("order", [line.order for line in diagram.orders], {"units": "1"}),
            },
            {"lowest_speed": diagram.speeds[0], "highest_speed": diagram.speeds[1], "model_speed": diagram.model_speed},
        )


def diagram_section(diagram: Campbell) -> Section:
    """Return the Campbell diagram with the table of its crossings."""
    si = diagram.units == "SI"
    chart = campbell_chart(diagram, si=si)
    crossings = crossings_table(diagram, si=si)
    none = () if crossings.rows else ("No order line meets a natural frequency in this range.",)
    return Section("campbell", chart.title, words=none, charts=(chart,), tables=(crossings,))


def crossings_sentence(diagram: Campbell) -> str:
    """Return a sentence with the number of crossings and the crossing nearest to the model's speed."""
    si = diagram.units == "SI"
    near = diagram.nearest()
    low, high = (turning(speed, si=si) for speed in diagram.speeds)
    if near is None:
        return f"No order meets a natural frequency between {low} and {high}."
    return (
        f"{counted(len(diagram.crossings), 'crossing')} with orders between {low} and {high}; nearest to the model's "
        f"speed of {turning(diagram.model_speed, si=si)}: {_nearest(diagram, near, si)}."
    )


def _nearest(diagram: Campbell, near: Crossing, si: bool) -> str:
    ratio = near.speed / diagram.model_speed
    side = "above" if ratio > 1.0 else "below"
    away = "at it" if np.isclose(ratio, 1.0, rtol=5e-4) else f"{percent(abs(ratio - 1.0))} {side}"
    return (
        f"order {near.order:g} meets mode {near.mode + 1} at {turning(near.speed, si=si)}, {away} "
        f"({near.source}, {percent(near.share)} of its energy)"
    )
