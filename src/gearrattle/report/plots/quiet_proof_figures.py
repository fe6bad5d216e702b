"""Proven quiet: a map over two parameters, and shares of the volume over every parameter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.model.path_labels import path_label
from gearrattle.report.plots.axis_names import Measure, measure_at
from gearrattle.report.plots.chart import Bars, Cells, Chart, Key, Panel
from gearrattle.studies.quiet import QuietProof
from gearrattle.studies.quiet.edges import Edge
from gearrattle.studies.quiet.proof import STATUS
from gearrattle.trajectory import Array

_LEGEND = tuple(Key(word, colour) for word, colour in zip(STATUS, ("#0072b2", "#a8123e", "#d7c9a8"), strict=True))
_SLICES = 60
_MOST_CELLS = 20_000


def measure_of_edge(proof: QuietProof, edge: Edge) -> Measure:
    """Return what an edge of the box is called, with a unit that suits its values."""
    if edge.path is None:
        return Measure(f"{edge.name}, share of the range", "", 1.0)
    label = path_label(edge.path, proof.model)
    return measure_at(edge.path, label.words, label.unit, max(abs(edge.coordinate(0.0)), abs(edge.coordinate(1.0))))


def proof_charts(proof: QuietProof) -> list[Chart]:
    """Draw the box."""
    low, high = (np.array([getattr(part, end) for part in proof.parts]) * 0.5 + 0.5 for end in ("low", "high"))
    status = np.array([part.status for part in proof.parts])
    is_plane = len(proof.edges) == 2 and len(status) <= _MOST_CELLS
    shares = _shares_chart(proof, low, high, status)
    return [*([_map(proof, low, high, status)] if is_plane else []), shares]


def _map(proof: QuietProof, low: Array, high: Array, status: NDArray[np.int64]) -> Chart:
    """The boxes in the plane of two parameters."""
    measures = [measure_of_edge(proof, edge) for edge in proof.edges]
    (left, right), (bottom, top) = (
        [_shown(edge, measure, ends[:, axis]) for ends in (low, high)]
        for axis, (edge, measure) in enumerate(zip(proof.edges, measures, strict=True))
    )
    cells = []
    for code, key in enumerate(_LEGEND):
        own = status == code
        if own.any():
            cells.append(Cells(left[own], right[own], bottom[own], top[own], key.name, key.colour))
    panel = Panel(measures[1].words, measures[1].unit, measures[0].title, cells=tuple(cells))
    caption = "Where a quiet motion is proven, where it is refuted, and what is open."
    return Chart("box", "The box", caption, (panel,), panel_height=420, legend=_LEGEND)


def _shares_chart(proof: QuietProof, low: Array, high: Array, status: NDArray[np.int64]) -> Chart:
    """Shares of the volume over every parameter, stacked."""
    panels = []
    for axis, edge in enumerate(proof.edges):
        measure = measure_of_edge(proof, edge)
        ends = _shown(edge, measure, np.linspace(0.0, 1.0, _SLICES + 1))
        below = np.zeros(_SLICES)
        bars = []
        for key, heights in zip(_LEGEND, _shares(low, high, status, axis), strict=True):
            bars.append(Bars(ends, heights, key.name, key.colour, below.copy()))
            below += heights
        panels.append(Panel("share of the volume", "", measure.title, bars=tuple(bars), y_range=(0.0, 1.0)))
    caption = "Share of the volume that is proven quiet, refuted and open, over the range of every parameter."
    title = "Shares over the parameters"
    return Chart("shares", title, caption, tuple(panels), panel_height=160, share_x=False, legend=_LEGEND)


def _shown(edge: Edge, measure: Measure, shares: Array) -> Array:
    """Values at shares of an edge, in the unit they are shown in."""
    return np.array([edge.coordinate(share) for share in shares.tolist()]) * measure.factor


def _shares(low: Array, high: Array, status: NDArray[np.int64], axis: int) -> Array:
    """(3, slices) shares of the volume of every slice across a parameter, by status."""
    others = np.delete(high - low, axis, axis=1).prod(axis=1)
    ends = np.linspace(0.0, 1.0, _SLICES + 1)
    shares = np.zeros((len(STATUS), _SLICES))
    for k in range(_SLICES):
        overlap = np.minimum(high[:, axis], ends[k + 1]) - np.maximum(low[:, axis], ends[k])
        volume = np.maximum(overlap, 0.0) * others * _SLICES
        for code in range(len(STATUS)):
            shares[code, k] = volume[status == code].sum()
    return shares
