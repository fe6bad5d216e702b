"""Sums over the chunks of a motion, its verdict, and the rows of its metrics.

``add`` extends the sums over a motion by its next chunk; a whole run is one chunk. A sum is computed once for all
quantities that read it. ``verdict_of`` evaluates the criteria from the sums and returns the verdict. ``rows_of``
returns the rows of metrics from ``Inputs``, which are made from a motion, from sums over its chunks, or from a
recording.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from gearrattle.errors import ModelError
from gearrattle.quantities.loose_gear import add_peaks
from gearrattle.quantities.metric_inputs import Inputs
from gearrattle.quantities.metric_sources import add_signals
from gearrattle.quantities.quantity import WITHOUT_DIMENSION, Quantity, Row, State, Sums, scope_of
from gearrattle.quantities.quantity_table import CRITERIA, METRICS
from gearrattle.quantities.spectrum import add_spectra, density_of
from gearrattle.quantities.verdict import Verdict
from gearrattle.quantities.verdict_parts import (
    ASSUMED,
    Part,
    measure_parts,
    regime_of_all,
    rule_of,
    severity_of_all,
    worst_first,
)
from gearrattle.signals import Spectrum, add_crossings, limits_words, steady
from gearrattle.signals.last_levels import add_levels
from gearrattle.trajectory import Array, NegligibleImpacts, Trajectory
from gearrattle.wording import listed

_STEADY_SUMS: Mapping[str, Callable[[Trajectory, State | None], State]] = {
    "last cycles": add_levels,
    "peaks": add_peaks,
    "spectra": add_spectra,
}
"""By sum: the function that adds the steady part of a chunk. "crossings" and "signals" also read discarded cycles."""


def add(
    chunk: Trajectory,
    before: Sums | None = None,
    quantities: Sequence[Quantity[Any]] = CRITERIA,
    *,
    engine_orders: Array | None = None,
) -> Sums:
    """Return the sums over a chunk of a motion and all chunks before it.

    Parameters
    ----------
    chunk
        the next chunk, of whole cycles; a whole motion is one chunk.
    before
        sums over the chunks before it, of the same quantities; None for the first chunk.
    engine_orders
        orders of the torques, ascending, which metrics need.

    Raises
    ------
    GearRattleError
        if the log of corner crossings has a gap.
    """
    states = {} if before is None else dict(before.states)
    scope = None if before is None else before.scope
    is_steady = chunk.discard < chunk.cycles
    for name in dict.fromkeys(name for quantity in quantities for name in quantity.sums):
        if name == "crossings":
            states[name] = add_crossings(states.get(name), chunk, steady(chunk) if is_steady else None)
        elif name == "signals":
            states[name] = add_signals(chunk, states.get(name), np.zeros(0) if engine_orders is None else engine_orders)
        elif is_steady:
            states[name] = _STEADY_SUMS[name](chunk, states.get(name))
    return Sums(scope_of(chunk, scope) if is_steady else scope, states)


def verdict_of(sums: Sums, *, units: str = "SI", negligible: NegligibleImpacts | None = None) -> Verdict:
    """Return the verdict on a motion.

    Parameters
    ----------
    sums
        of all criteria over the chunks of the motion; at least one cycle is not discarded.
    units
        "SI", or "dimensionless" for a model without units, for which every unit is "1".
    negligible
        sizes below which impacts are touches; None takes those of the layout.
    """
    if negligible is not None:
        layout = dataclasses.replace(sums.steady.layout, negligible=negligible)
        sums = Sums(dataclasses.replace(sums.steady, layout=layout), sums.states)
    layout = sums.steady.layout
    limits = layout.negligible
    rows = [row for criterion in CRITERIA for row in criterion.rows(sums)]
    parts = worst_first(measure_parts(rows, sums.steady, sums.states["crossings"]))
    if units != "SI":
        parts = tuple(dataclasses.replace(part, impulse_unit="1", energy_unit="1", speed_unit="1") for part in parts)
    return Verdict(
        verdict=regime_of_all(parts),
        severity=severity_of_all(parts),
        rule=rule_of(limits, is_si=units == "SI", has_bearings=bool(layout.is_bearing[layout.clearance].any())),
        parts=parts,
        entries=tuple(_in_units(rows, units)),
        notes=tuple(dict.fromkeys([*(row.note for row in rows if row.note), *_assumption(parts, limits)])),
        window=sums.steady.window,
        negligible=limits,
        spectra=_density(sums),
    )


def _assumption(parts: Sequence[Part], limits: NegligibleImpacts) -> list[str]:
    """Note that a threshold is assumed, if some part touches and so depends on it."""
    touching = [part.name for part in parts if part.severity == "touches"]
    if not (touching and limits.is_assumed):
        return []
    return [f"{listed(touching)} {'touches' if len(touching) == 1 else 'touch'}: {limits_words(limits)}; {ASSUMED}"]


def judge(trajectory: Trajectory, *, units: str = "SI", negligible: NegligibleImpacts | None = None) -> Verdict:
    """Evaluate every criterion and return the verdict; ``units`` and ``negligible`` as of ``verdict_of``.

    ModelError if no cycle remains after the discarded ones, GearRattleError if the log of corner crossings has a gap.
    """
    steady(trajectory)  # refuses a motion whose cycles are all discarded
    return verdict_of(add(trajectory), units=units, negligible=negligible)


def rows_of(
    inputs: Inputs,
    metrics: Sequence[Quantity[Inputs]] = METRICS,
    quantities: Collection[str] | None = None,
    *,
    units: str = "SI",
) -> list[Row]:
    """Return every value of the metrics; a metric without the inputs it needs has one row that says what is missing.

    ``quantities`` are the names of the quantities to return, None for all; ``units`` as in ``verdict_of``.
    """
    rows = []
    if quantities is not None:
        inputs = dataclasses.replace(inputs, wanted=frozenset(quantities))
    for metric in metrics:
        lacking = [words for need in metric.needs if (words := inputs.lacks(need))]
        values = [] if lacking else metric.rows(inputs)
        if not values:
            why = f"{metric.title}: {lacking[0] if lacking else 'nothing of the kind is known'}"
            values = [metric.row("", metric.title, math.nan, note=why, error=math.nan)]
        window = f"{metric.window}: {inputs.window}" if "window" in metric.window else metric.window
        rows += [
            dataclasses.replace(row, window=window) for row in values if not row.subject or inputs.wants(row.quantity)
        ]
    return _in_units(rows, units)


def _in_units(rows: Iterable[Row], units: str) -> list[Row]:
    """Return rows with the units of the model; in a model without units, every dimension is "1"."""
    is_si = units == "SI"
    return [row if is_si or row.unit in WITHOUT_DIMENSION else dataclasses.replace(row, unit="1") for row in rows]


def _density(sums: Sums) -> Spectrum | None:
    try:
        return density_of(sums.states["spectra"], sums.steady)
    except ModelError:
        return None
