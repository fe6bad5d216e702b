"""Sums over the chunks of a long motion, which are read one after the other and not kept."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.quantities.evaluation import add
from gearrattle.quantities.quantity import Quantity, Sums
from gearrattle.results import Run
from gearrattle.trajectory import Array
from gearrattle.wording import counted


def add_chunks(
    chunks: Iterable[Run], quantities: Sequence[Quantity[Any]], purpose: str, orders: Sequence[float] | None = None
) -> tuple[Sums, Array, Model]:
    """Return the sums over the chunks of one motion, the orders of its engine, and its model.

    Parameters
    ----------
    purpose
        use of the sums in words ("judged"), for error messages.
    orders
        of the engine's torque; None takes those of the model's torques.

    Raises
    ------
    ModelError
        chunks are not consecutive, or all their cycles are discarded.
    """
    sums: Sums | None = None
    end = None
    last = None
    engine = np.zeros(0)
    for last in chunks:
        chunk = last.trajectory
        if end not in (None, chunk.first_cycle):
            rule = f"must follow the chunk before, which ends at cycle {end}"
            raise ModelError(Problem("chunk", f"one that begins at cycle {chunk.first_cycle}", rule))
        if end is None:
            engine = orders_of(last.model, orders)
        end = chunk.first_cycle + chunk.cycles
        sums = add(chunk, sums, quantities, engine_orders=engine)
    if last is None or sums is None or sums.scope is None:
        rule = f"at least one cycle must remain to be {purpose}"
        raise ModelError(Problem("discard", f"all of {counted(end or 0, 'cycle')}", rule))
    return sums, engine, last.model


def orders_of(model: Model, orders: Sequence[float] | None = None) -> Array:
    """Return the engine's orders, ascending: ``orders``, or the non-zero orders of torques and prescribed motions."""
    if orders is None:
        harmonics = [h for t in model.torques for h in t.harmonics] + [h for m in model.motions for h in m.harmonics]
        orders = [h.order for h in harmonics if h.amplitude and h.order]
    return np.unique(np.asarray(orders, dtype=np.float64))
