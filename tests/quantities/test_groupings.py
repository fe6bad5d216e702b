"""The law of sums, for every quantity of the table: whatever the chunks, the values are those of one chunk.

Chunks of any size, in order. The rounding allowed is that of sums of some hundred terms: 1e-9 of a value, and 1e-9 of
the largest value of the same unit where terms cancel.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from gearrattle.quantities.evaluation import add
from gearrattle.quantities.metric_sources import inputs_of_chunks
from gearrattle.quantities.quantity import Quantity, Row, Sums
from gearrattle.quantities.quantity_table import CRITERIA, METRICS, QUANTITIES
from gearrattle.trajectory import Trajectory
from tests import synthetic
from tests.quantities.test_criteria_chunks import LAST_ONLY, chunks

CYCLES, ENGINE = 12, np.array([1.0, 2.0])


def rows_of_chunks(quantity: Quantity[Any], motion: Trajectory, ends: Sequence[int]) -> list[Row]:
    """Return the rows of one quantity by sums over chunks that end after these cycles; none where it lacks a need."""
    sums: Sums | None = None
    for chunk in chunks(motion, ends):
        sums = add(chunk, sums, [quantity], engine_orders=ENGINE)
    assert sums is not None
    if not quantity.needs:
        return quantity.rows(sums)
    inputs = inputs_of_chunks(sums, ENGINE)
    return [] if any(inputs.lacks(need) for need in quantity.needs) else quantity.rows(inputs)


def groupings() -> list[tuple[int, ...]]:
    rng = np.random.default_rng(21)
    cuts = [rng.choice(np.arange(1, CYCLES), size=rng.integers(1, CYCLES - 1), replace=False) for _ in range(6)]
    return [tuple(range(1, CYCLES + 1)), *((*np.sort(some).tolist(), CYCLES) for some in cuts)]


@pytest.mark.parametrize("quantity", QUANTITIES, ids=lambda quantity: quantity.name)
@pytest.mark.parametrize("kind", synthetic.DEFLECTIONS)
def test_every_grouping_of_chunks_gives_the_values_of_the_whole(quantity: Quantity[Any], kind: str) -> None:
    motion = synthetic.trajectory(kind, discard=3)
    whole = rows_of_chunks(quantity, motion, (CYCLES,))
    assert whole or quantity.name == "contact_work"  # no audit
    numbers = [abs(row.value) for row in whole if not isinstance(row.value, str) and np.isfinite(row.value)]
    rounding = 1e-9 * max(numbers, default=0.0)
    for ends in groupings():
        rows = rows_of_chunks(quantity, motion, ends)
        last_only = [LAST_ONLY in row.quantity and not quantity.needs for row in whole]
        rows = [row for row in rows if not (LAST_ONLY in row.quantity and not quantity.needs)]
        kept = [row for row, skip in zip(whole, last_only, strict=True) if not skip]
        assert [(row.subject, row.quantity, row.unit) for row in rows] == [
            (row.subject, row.quantity, row.unit) for row in kept
        ]
        for row, other in zip(rows, kept, strict=True):
            if isinstance(other.value, str):
                assert row.value == other.value
            else:
                assert row.value == pytest.approx(other.value, rel=1e-9, abs=rounding, nan_ok=True), row.quantity


def test_the_table_is_all_criteria_and_all_metrics() -> None:
    names = [quantity.name for quantity in QUANTITIES]
    assert len(set(names)) == len(names)
    assert {quantity.name for quantity in (*CRITERIA, *METRICS)} == set(names)
