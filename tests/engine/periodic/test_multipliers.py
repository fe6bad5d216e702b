"""Complex pairs of multipliers that cross the unit circle, told from real ones that meet."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from gearrattle.engine.periodic.events.neimark_sacker import pairs_crossed


def pair(modulus: float, angle: float) -> list[complex]:
    return [modulus * np.exp(1j * angle), modulus * np.exp(-1j * angle)]


@pytest.mark.parametrize(
    ("before", "after", "crossed"),
    [
        ([*pair(0.9, 1.0), 0.5], [*pair(1.1, 1.2), 0.4], 1),
        ([*pair(1.1, 1.0), 0.5], [*pair(0.9, 1.2), 0.4], -1),
        ([*pair(1.1, 1.0), 0.9], [*pair(0.9, 1.2), 1.1], -1),  # a real one leaves at once
        ([*pair(1.1, 0.1), 0.5], [1.2, 1.1, 0.4], 0),  # becomes two real ones outside
        ([-1.2, -1.3, 0.5], [*pair(1.25, 3.1), 0.4], 0),
        ([*pair(0.9, 0.1), 0.5], [0.95, 0.85, 0.4], 0),
        ([*pair(0.9, 0.1), 0.5], [1.05, 0.8, 0.4], 0),  # real ones inside, one of which leaves
        ([*pair(0.9, 3.0), 0.5], [-1.2, -1.1, 0.4], 1),  # leaves, then becomes two real ones
        ([*pair(1.009, 0.001), 0.5], [1.02, 0.999, 0.4], 0),  # two real ones outside, one of which comes inside
        ([1.02, 0.999, 0.4], [*pair(1.009, 0.001), 0.5], 0),
        ([*pair(1.009, 3.14), 0.5], [-1.02, -0.999, 0.4], 0),
        ([*pair(1.009, 0.1), 0.999], [*pair(0.999, 0.1), 1.001], -1),
        ([*pair(1.009, 0.1), *pair(1.1, 1.0), 0.5], [*pair(0.99, 1.0), 1.02, 0.999, 0.4], -1),
        ([*pair(1.009, 0.1), *pair(1.1, 1.0), 0.99], [*pair(0.99, 0.1), *pair(0.98, 1.0), 1.01], -2),
    ],
)
def test_pairs_that_cross_the_unit_circle_are_counted(
    before: list[complex], after: list[complex], crossed: int
) -> None:
    points = [SimpleNamespace(multipliers=np.array(values, complex), free=0) for values in (before, after)]
    assert pairs_crossed(*cast(list[Any], points)) == crossed
