"""The period map of a large driveline, by the sweep, against a march through tables from the same start."""

from __future__ import annotations

import numpy as np

from gearrattle.assembly import assemble
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.solvers.scheme_choice import is_large_for_periods
from gearrattle.outcome import Outcome
from tests.engine.periodic.test_slope import start, train


def test_without_tables_the_end_and_the_crossings_are_the_same() -> None:
    system = assemble(train(24, gaps=4)).system
    assert is_large_for_periods(system)
    period_map, state = PeriodMap(system), start(24)
    motion = period_map(state)
    march = ExactMarch(period_map.task(state, 1))
    while march.advance() is Outcome.SLICE_SPENT:
        pass
    log, size = march.logged(), period_map.size
    end = march.samples.states[-1, : period_map.flow.states]
    np.testing.assert_allclose(motion.end.y * period_map.scale, end, rtol=0, atol=1e-11 * size)
    assert log.clearance.size > 0
    np.testing.assert_array_equal(motion.crossings.watch, log.clearance)
    np.testing.assert_array_equal(motion.crossings.upward, log.upward)
    np.testing.assert_allclose(motion.crossings.time / motion.period, log.cycle + log.fraction, rtol=0, atol=1e-10)
    speeds = log.rate * period_map.flow.corner_scale[log.clearance] / motion.period
    np.testing.assert_allclose(motion.crossings.velocity, speeds, rtol=1e-8, atol=1e-10)


def test_its_gradient_is_that_of_differences() -> None:
    system, state = assemble(train(24, gaps=4)).system, start(24)
    period_map, step = PeriodMap(system), 1e-6
    gradient, rng = period_map(state).gradient, np.random.default_rng(1)
    direction = rng.normal(size=state.y.size) / period_map.scale * period_map.size
    ends = [period_map.later(type(state)(state.y + side * step * direction)).y for side in (-1.0, 1.0)]
    difference = (ends[1] - ends[0]) / (2.0 * step) * period_map.scale
    expected = gradient @ direction * period_map.scale
    np.testing.assert_allclose(difference, expected, rtol=0, atol=1e-6 * np.linalg.norm(expected))
