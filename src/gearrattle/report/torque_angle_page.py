"""The static characteristic of a coupling as a result: its loop, and the energy lost to friction."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearrattle.analysis.torque_angle import TorqueAngle
from gearrattle.report.numbers import Arrays
from gearrattle.report.page import Section, figure_sections
from gearrattle.report.plots.chart import Chart, Key, Line, Panel
from gearrattle.report.plots.numerals import engineering, numeral
from gearrattle.report.plots.palette import ACCENT, CENTRE
from gearrattle.report.presentation import ONE_FIGURE_ENDINGS, Presentation
from gearrattle.report.tables import Table


class TorqueAnglePage(Presentation[TorqueAngle]):
    """A slow cycle of a coupling's torque over its deflection."""

    kind = "torque over angle"
    endings = ONE_FIGURE_ENDINGS

    @property
    def title(self) -> str:
        return self.result.element

    @property
    def sentence(self) -> str:
        loop = self.result
        angle = self._unit("rad")
        ends = (engineering(float(end), angle) for end in (loop.deflection.min(), loop.deflection.max()))
        loss = f"takes {engineering(loop.loss, self._unit('J'))}" if loop.loss else "takes nothing"
        return f"From {' to '.join(ends)} and back, friction {loss} a cycle."

    def sections(self) -> tuple[Section, ...]:
        chart = self._chart()
        summary = Section("summary", "Summary", self.sentence)
        points = Section("points", "Points", tables=self.answer(), folds=True)
        return summary, *figure_sections([chart]), points

    def answer(self) -> tuple[Table, ...]:
        loop = self.result
        angle = self._unit("rad")
        torque = self._unit("N m")
        points = zip(loop.deflection.tolist(), loop.torque.tolist(), loop.elastic.tolist(), strict=True)
        rows = tuple((numeral(d, 6), numeral(t, 6), numeral(e, 6)) for d, t, e in points)
        heads = ("deflection", angle), ("torque", torque), ("without friction", torque)
        head = tuple(f"{word} [{unit}]" if unit else word for word, unit in heads)
        return (Table(head, rows, frozenset()),)

    def content(self) -> dict[str, Any]:
        loop = self.result
        arrays = {name: getattr(loop, name) for name in ("deflection", "torque", "elastic")}
        return {"element": loop.element, **arrays, "loss": loop.loss, "units": loop.units}

    def numbers(self) -> Arrays:
        loop = self.result
        torque = {"units": self._unit("N m") or "1"}
        return Arrays(
            {
                "deflection": ("point", loop.deflection, {"units": self._unit("rad") or "1"}),
                "torque": ("point", loop.torque, torque),
                "elastic": ("point", loop.elastic, {**torque, "long_name": "torque without friction"}),
            },
            attributes={"element": loop.element, "loss": loop.loss, "loss_units": self._unit("J") or "1"},
        )

    def _unit(self, unit: str) -> str:
        return unit if self.result.units == "SI" else ""

    def _chart(self) -> Chart:
        loop = self.result
        unit = self._unit("N m")
        factor, across = (180.0 / np.pi, "°") if self.result.units == "SI" else (1.0, "")
        x = loop.deflection * factor
        lines = (
            Line(x, loop.elastic, "without friction", CENTRE, width=1.0),
            Line(x, loop.torque, "static loop", ACCENT, width=1.6),
        )
        margin = 0.04 * float(np.ptp(x))
        reach = (float(x.min()) - margin, float(x.max()) + margin)
        panel = Panel("torque", unit, f"deflection  [{across}]" if across else "deflection", lines, x_range=reach)
        caption = "Torque over deflection in a slow cycle from one end to the other and back; damping plays no part."
        legend = (Key("static loop", ACCENT), Key("without friction", CENTRE))
        return Chart("torque_angle", "Torque over deflection", caption, (panel,), panel_height=320, legend=legend)
