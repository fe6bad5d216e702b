"""What the exact solver alone promises: the same bits, however the run is cut up and whatever was run before."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.engine.kernels import march_arrays
from gearrattle.engine.kernels.workspace import LARGEST_STATE
from gearrattle.engine.solvers import Motion, Task, exact, region_slots
from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.system.flow import Flow
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.region_arrays import RegionBuilder
from gearrattle.outcome import Outcome
from tests.engine.solvers.tasks import oscillator, run, task
from tests.engine.system.drivelines import clearance, random_chain


def same_bits(one: Motion, other: Motion) -> None:
    for name in ("angle", "velocity", "acceleration", "force", "piece", "final_force_integral"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    for name in ("time", "clearance", "from_piece", "to_piece", "velocity", "force_integral"):
        assert np.array_equal(getattr(one.crossings, name), getattr(other.crossings, name)), name


def fresh_slots(system: PiecewiseSystem) -> region_slots.Slots:
    return region_slots.Shelf(region_slots.flow_of(system)).slots


def rattling(seed: int) -> Task:
    system = random_chain(seed)
    rng = np.random.default_rng(seed)
    return task(system, list(rng.normal(size=system.size)), list(3 * rng.normal(size=system.size)), cycles=8)


@pytest.mark.compiled
@pytest.mark.parametrize("budget", [1, 7, 1000])
@pytest.mark.parametrize("seed", range(4))
def test_slices_change_no_bit(seed: int, budget: int, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = run(rattling(seed))
    monkeypatch.setattr(exact, "_BUDGET", budget)
    assert len(whole.crossings.time) > 0
    same_bits(whole, run(rattling(seed)))


@pytest.mark.compiled
@pytest.mark.parametrize("seed", range(4))
def test_regions_built_on_the_way_or_before_change_no_bit(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    values = rattling(seed)
    monkeypatch.setattr(exact, "slots_of", fresh_slots)
    first = run(values)
    shelf = region_slots.Shelf(region_slots.flow_of(values.system))
    monkeypatch.setattr(exact, "slots_of", lambda _: shelf.slots)
    run(values)
    same_bits(first, run(values))


def test_inputs_kept_as_states_and_inputs_split_off_are_one_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    """A limit of zero keeps every input: the augmented exponential, without any particular solution."""
    problem = task(oscillator(clearance(4.0, 0.2, 0.5, 0.1), force=3.0, mean=0.2), [0.9], [0.0], cycles=6)
    split, begin = run(problem), RegionBuilder.__init__

    def keeping(self: RegionBuilder, flow: Flow) -> None:
        begin(self, flow)
        self.workspace.common.limits[LARGEST_STATE] = 0.0

    monkeypatch.setattr(RegionBuilder, "__init__", keeping)
    monkeypatch.setattr(exact, "slots_of", fresh_slots)
    march = ExactMarch(problem)
    assert march.slots.packed.width[march.march.counts[march_arrays.SLOT]] == march.flow.states + 3
    while march.advance() is not Outcome.DONE:
        pass
    kept = march.motion()
    assert np.abs(kept.angle - split.angle).max() <= 1e-12
    assert np.abs(kept.crossings.time - split.crossings.time).max() <= 1e-12
    assert np.abs(kept.crossings.force_integral - split.crossings.force_integral).max() <= 1e-12


def test_chatter_is_judged_by_the_time_that_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """The march's clock holds the entry of its region and the age of its bounds beside the time."""
    march, reports = ExactMarch(rattling(0)), list[tuple[float, float]]()

    def heard(_log: march_arrays.Log, _count: int, now: float) -> bool:
        reports.append((now, march.position().time / march.flow.system.inputs.period))
        return False

    monkeypatch.setattr(exact, "_BUDGET", 7)
    monkeypatch.setattr(exact, "chatters", heard)
    while march.advance() is not Outcome.DONE:
        pass
    assert reports
    assert all(now == pytest.approx(there, rel=1e-12) for now, there in reports)
