"""Changes of severity or regime over the grid of a study: points in a plane, or over one axis one row per part."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.report.plots.axis_names import measure_of
from gearrattle.report.plots.chart import Chart, Key, Line, Panel
from gearrattle.report.plots.palette import STATES
from gearrattle.report.plots.row_charts import Series, row_chart
from gearrattle.studies.regime_boundary import CROSSING
from gearrattle.trajectory import IntArray

if TYPE_CHECKING:
    import xarray as xr

_MOST_PANELS = 12


def boundary_chart(crossings: xr.Dataset, axes: Sequence[str], subject: str) -> Chart | None:
    """Draw every change in the colour of the higher code; None for more than two axes, or no change.

    ``subject`` is the variable that names the part; it is empty for one answer a case.
    """
    count = crossings.sizes.get(CROSSING, 0)
    if len(axes) not in (1, 2) or not count or any(crossings[axis].dtype.kind not in "iuf" for axis in axes):
        return None
    parts = [str(name) for name in crossings[subject].values] if subject else [""] * count
    order = {word: rank for rank, word in enumerate(STATES)}
    ranks = [[order.get(str(word), 0) for word in crossings[end].values] for end in ("from", "to")]
    changes = _Changes(_by_part(parts), np.maximum(*map(np.array, ranks)), str(crossings.attrs["output"]))
    return _rows(changes, crossings, axes[0]) if len(axes) == 1 else _plane(changes, crossings, axes)


@dataclass(frozen=True)
class _Changes:
    """Changes of severity or regime: indices of the changes of every part, and (N,) rank of the higher word."""

    of: Mapping[str, IntArray]
    higher: IntArray
    output: str

    @property
    def words(self) -> tuple[str, str, str]:
        """Key, title and caption of the chart."""
        middle = "in the middle between two neighbouring values of the grid. Lines: from one to the other."
        return "boundary", f"Boundary of the {self.output}", f"Changes of the {self.output}: {middle}"

    def kinds(self) -> Iterator[tuple[str, str, NDArray[np.bool_]]]:
        """Words, colour and which changes, by the higher of the two words."""
        for rank, (word, colour) in enumerate(STATES.items()):
            if (chosen := self.higher == rank).any():
                yield f"to or from {word}", colour, chosen


def _by_part(parts: Sequence[str]) -> dict[str, IntArray]:
    """Indices of the changes of every part."""
    return {name: np.array([i for i, part in enumerate(parts) if part == name]) for name in dict.fromkeys(parts)}


def _plane(changes: _Changes, crossings: xr.Dataset, axes: Sequence[str]) -> Chart:
    """Points in the plane of two axes, one panel per part."""
    measures = [measure_of(crossings, axis) for axis in axes]
    x, y = (crossings[axis].values * one.factor for axis, one in zip(axes, measures, strict=True))
    panels = []
    for name, own in list(changes.of.items())[:_MOST_PANELS]:
        mine = np.isin(np.arange(x.size), own)
        lines = tuple(
            Line(x[chosen & mine], y[chosen & mine], words, colour, mark="points", width=6.0)
            for words, colour, chosen in changes.kinds()
            if (chosen & mine).any()
        )
        panels.append(Panel(f"{name}, {measures[1].words}".strip(", "), measures[1].unit, measures[0].title, lines))
    legend = tuple(Key(words, colour) for words, colour, _ in changes.kinds())
    return Chart(
        *changes.words, tuple(panels), columns=min(2, len(panels)), panel_height=260, share_x=False, legend=legend
    )


def _rows(changes: _Changes, crossings: xr.Dataset, axis: str) -> Chart | None:
    """One row per change, with the two values between which it is: a part may change more than once."""
    measure = measure_of(crossings, axis)
    at, low, high = (crossings[name].values * measure.factor for name in (axis, "below", "above"))
    order = np.concatenate([own[np.argsort(at[own])] for own in changes.of.values()])
    series = []
    for words, colour, chosen in changes.kinds():
        middle, start, end = (np.where(chosen, values, np.nan)[order] for values in (at, low, high))
        series.append(Series(words, middle, colour, start, end))
    names = [name or "all" for name, own in changes.of.items() for _ in own]
    return row_chart(*changes.words, names, series, level=measure.title)
