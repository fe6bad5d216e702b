"""A rattling driveline against a record of it: statistics agree, impacts are counted where they can be."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.measured.validation.simulated_recording import recorded
from gearrattle.recording import Channel, Recording

CASE = Path(__file__).resolve().parents[3] / "examples" / "paper" / "case3.toml"


@functools.cache
def runs() -> tuple[gr.Run, gr.Run]:
    """Two motions of the same driveline that are as far apart as chance puts them."""
    model = gr.load(CASE)
    first = gr.simulate(model, cycles=80, discard=20, samples_per_cycle=512, audit=False)
    second = gr.simulate(model, cycles=80, discard=20, samples_per_cycle=512, initial="zero", audit=False)
    return first, second


def rig(run: gr.Run, late: float) -> Recording:
    """What a rig would have of a run after its start-up, by a clock of its own."""
    whole = recorded(run)
    kept = whole.time >= run.trajectory.discard * run.trajectory.layout.period + 0.011
    names = ("acceleration.flywheel", "acceleration.input_gear", "force.gear", "velocity.hub")
    channels = tuple(
        Channel(f"m{k}", c.quantity, c.subject, c.unit, c.values[kept])
        for k, c in enumerate(whole[name] for name in names)
    )
    spare = Channel("mic", "sound pressure", "room", "Pa", np.ones(int(kept.sum())))
    return Recording(whole.time[kept] - late, (*channels, spare), "rig")


def test_two_motions_of_one_driveline_agree_within_chance() -> None:
    run, other = runs()
    actual = gr.validate(run, rig(other, 0.0123), thresholds={"gear": 20.0})
    late = run.trajectory.time > 2.0
    hub, others = (entry.trajectory.velocity[late, 1] for entry in (run, other))
    assert np.abs(hub - others).max() > np.std(hub)  # sample by sample they differ by as much as they move
    rows = [level for pair in actual.pairs for level in pair.levels]
    assert sum(level.by_chance for level in rows) >= len(rows) - 2
    assert all(level.remainder == 0.0 for level in rows)
    assert actual.clock.delay == pytest.approx(0.0123, abs=5.0 * actual.clock.standard_error)
    assert actual.unmatched_measured == ("mic",)
    assert "deflection.spline" in actual.unmatched_simulated


def test_a_gain_is_told_against_the_scatter() -> None:
    run, other = runs()
    record = rig(other, 0.0)
    scaled = tuple(
        Channel(c.name, c.quantity, c.subject, c.unit, (1.5 if c.name == "m1" else 1.0) * c.values)
        for c in record.channels
    )
    actual = gr.validate(run, record.with_(channels=scaled))
    level = actual["m1"].level("rms")
    assert level.low < 100.0 / 3.0 < level.high  # 1 - 1 / 1.5
    assert level.remainder > 20.0
    assert "look first at m1" in actual.verdict


@pytest.mark.slow
def test_impacts_are_exact_in_the_run_and_counted_alike_in_both() -> None:
    run, _ = runs()
    start = run.trajectory.discard * run.trajectory.layout.period
    actual = gr.validate(run, recorded(run), start=start, thresholds={"deflection.gear": 4.99e-5})
    impacts = {impact.clearance: impact for impact in actual.impacts}
    events = run.events
    gear = events[(events.clearance == "gear") & (events.to_region.abs() > events.from_region.abs())]
    begin, end = start, start + actual.simulated_cycles * actual.clock.period
    inside = ((gear.time >= begin) & (gear.time < end)).sum() / actual.simulated_cycles
    assert impacts["gear"].exact == pytest.approx(inside)
    assert impacts["gear"].measured == impacts["gear"].simulated > 0.0
    assert impacts["gear"].low < 0.0 < impacts["gear"].high
    assert np.isnan(impacts["spline"].measured)
    assert "no threshold was stated" in impacts["spline"].words


def test_what_a_file_lacks_is_not_guessed() -> None:
    run, other = runs()
    (one, *_) = rig(other, 0.0).channels
    actual = gr.validate(run, rig(other, 0.0).with_(channels=(one,)))
    assert all(np.isnan(impact.measured) for impact in actual.impacts)
    assert all("neither its force nor its deflection" in impact.words for impact in actual.impacts)
