"""Structures of a study's cases: the parts with a clearance, those that can separate, and the loose gears.

Two cases have the same structure if their quantities have the same names. A gap that closes, a slope or a drag torque
that vanishes, or another order makes another structure. A study keeps the outputs of all structures together, so that
they do not depend on which case is the first.

A number changes the structure where it becomes zero, or passes a corner: of an axis the first value, the smallest, the
largest and zero are tried, of anything else than a plain number all values up to ``MOST_WORDS``, in all combinations up
to ``MOST_TRIED``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble
from gearrattle.assembly.variant_assembly import bound_of
from gearrattle.errors import GearRattleError
from gearrattle.model import Model
from gearrattle.quantities.chunk_sums import orders_of
from gearrattle.signals import gap_names, loose_gears
from gearrattle.studies.plan import Plan

MOST_WORDS = 64
MOST_TRIED = 256


def structures_of(plan: Plan) -> list[Model]:
    """Return a case of every structure, in the order of the grid.

    Cases that are no model are passed over. Without any other the plan's own model is left.
    """
    models: dict[Any, Model] = {}
    for index in _places(plan):
        try:
            model = plan.model.with_(plan.changes(index))
            models.setdefault(_structure(model), model)
        except GearRattleError:
            continue
    return list(models.values()) or [plan.model]


def _structure(model: Model) -> Any:
    """Names that the outputs depend on."""
    layout = assemble(model).layout
    regions = zip(layout.region_of_first_piece.tolist(), layout.stiffness_of_piece, strict=True)
    loose = tuple((gear.mesh, gear.loose, gear.driver) for gear in loose_gears(layout))
    return (
        layout.inertia_names,
        layout.element_names,
        layout.clearance_names,
        layout.auxiliary_names,
        assemble(model).system.memories,
        gap_names(layout),
        tuple((first, slopes.size) for first, slopes in regions),
        loose,
        tuple(layout.orders.tolist()),
        tuple(orders_of(model).tolist()),
    )


def _places(plan: Plan) -> Iterator[tuple[int, ...]]:
    """Yield the places of the grid that are tried: all combinations of those along every dimension, if not too many."""
    along = [_tried(plan.model, axis.values) for axis in plan.axes]
    if plan.samples is not None:
        columns = plan.samples.values.items()
        along.append(_tried(plan.model, {path: column.tolist() for path, column in columns}))
    if prod(map(len, along)) <= MOST_TRIED:
        yield from product(*along)
        return
    for origin in {tuple(tried[0] for tried in along): None, tuple(tried[-1] for tried in along): None}:
        for dimension, tried in enumerate(along):
            yield from ((*origin[:dimension], i, *origin[dimension + 1 :]) for i in tried)


def _tried(model: Model, values: dict[str, Sequence[Any]] | Any) -> list[int]:
    """Return the places along one dimension at which the structure may be another one, ascending."""
    places = {0}
    for path, column in values.items():
        if bound_of(model, path) is None or not all(type(value) in (int, float) for value in column):
            places |= set(_even(len(column)))
            continue
        numbers: NDArray[np.float64] = np.asarray(column, dtype=np.float64)
        places |= {int(numbers.argmin()), int(numbers.argmax()), int(np.abs(numbers).argmin())}
    return sorted(places)


def _even(count: int) -> list[int]:
    """Return up to ``MOST_WORDS`` places spread evenly over a dimension, both ends included."""
    return sorted({int(index) for index in np.linspace(0, count - 1, min(count, MOST_WORDS)).round()})
