"""1.96 standard errors hold the truth in 95 % of records, for noise, channels and models of several kinds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

import gearrattle as gr
from tests.measured.fitting import coverage, linear, made

RECORDS = 300
FEW_CYCLES = coverage.KINDS[2]


@pytest.mark.long
@pytest.mark.parametrize("kind", coverage.KINDS, ids=[kind.words for kind in coverage.KINDS])
def test_intervals_hold_the_truth(kind: coverage.Kind) -> None:
    """Of every value of 300 records, by the binomial law at one in a thousand; biased by less than a quarter of one."""
    away = linear.deviations(kind, range(RECORDS))
    low, high = binom.ppf([0.0005, 0.9995], RECORDS, 0.95)
    inside = np.count_nonzero(np.abs(away) < 1.96, axis=0)
    assert np.all((low <= inside) & (inside <= high)), dict(zip(kind.free, inside.tolist(), strict=True))
    assert np.all(np.abs(away.mean(axis=0)) < 0.25)


def test_few_cycles_and_many_weak_lines_hold_the_truth_as_well() -> None:
    """Twenty-four records, three values each; with the lines of the search too many miss it."""
    low = binom.ppf(0.0005, 24, 0.95)
    inside, before = (
        np.count_nonzero(np.abs(linear.deviations(FEW_CYCLES, range(24), anew=anew)) < 1.96, axis=0)
        for anew in (True, False)
    )
    assert inside.min() >= low
    assert before.sum() < inside.sum()


@pytest.mark.long
@pytest.mark.parametrize("kind", coverage.KINDS[:3], ids=[kind.words for kind in coverage.KINDS[:3]])
def test_whole_fits_hold_the_truth(kind: coverage.Kind) -> None:
    away = coverage.deviations(kind, range(10))
    assert np.all(np.count_nonzero(np.abs(away) < 1.96, axis=0) >= binom.ppf(0.0005, 10, 0.95))
    assert np.abs(away).max() < 5.0


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
