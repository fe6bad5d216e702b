"""1.96 standard errors hold the truth in 95 % of records, for noise, channels and models of several kinds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

import gearrattle as gr
from tests.measured.fitting import coverage, made

RECORDS = 50


@pytest.mark.long
@pytest.mark.parametrize("kind", coverage.KINDS, ids=[kind.words for kind in coverage.KINDS])
def test_intervals_hold_the_truth(kind: coverage.Kind) -> None:
    """Of every value, by the binomial law at one in a thousand; no bias that a user would notice."""
    away = coverage.deviations(kind, range(RECORDS))
    low, high = binom.ppf([0.0005, 0.9995], RECORDS, 0.95)
    inside = np.count_nonzero(np.abs(away) < 1.96, axis=0)
    assert np.all((low <= inside) & (inside <= high)), dict(zip(kind.free, inside.tolist(), strict=True))
    assert np.all(np.abs(away.mean(axis=0)) < 3.3 / np.sqrt(RECORDS))


def test_standard_errors_from_accelerations_do_not_depend_on_the_start() -> None:
    """An acceleration jumps at an impact: over a short step its samples have stairs for slopes, any slope at all."""
    free = ["coupling.gap.stiffness", "coupling.gap.clearance"]
    model = made.model(**{"simulation.initial": "static"})
    record = made.recording(quantity="acceleration", names=("gear",), noise=0.3, cycles=60)
    starts = model, model.with_({free[0]: 0.98 * 900.0, free[1]: 0.0102})
    one, other = (gr.identification.fit(start, record, free, starts=1).parameters for start in starts)
    for p, q in zip(one, other, strict=True):
        assert q.standard_error == pytest.approx(p.standard_error, rel=0.3)
        assert abs(p.value - q.value) < p.standard_error
