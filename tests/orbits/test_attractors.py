"""In which motions a driveline settles: those of the search for all motions, shares, and what does not settle."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.engine.periodic.motion import State
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.orbits.attractors import Settled, motion_names, settled_motions, settled_orbit
from gearrattle.orbits.orbit import Orbit, settled_state
from gearrattle.orbits.start_states import state_of
from tests.architecture.places import EXAMPLES
from tests.orbits.test_families import train


@cache
def settled_of(name: str, starts: int = 24) -> Settled:
    model = gr.example(name)
    return settled_motions(model, settled_state(model, PeriodMap(assemble(model).system)), starts)


def swing(orbit: Orbit) -> float:
    low, high, _ = orbit.period_map.levels(orbit.motion)
    return float((high - low).max())


@pytest.mark.parametrize("name", ["backlash_oscillator", pytest.param("rattle_oscillator", marks=pytest.mark.long)])
def test_starts_settle_in_the_stable_motions_of_the_search_for_all(name: str) -> None:
    settled = settled_of(name)
    swings = sorted(swing(orbit) for orbit in settled.orbits)
    expected = [swing(orbit) for orbit in gr.periodic(gr.example(name), every=True) if orbit.stable]
    near = [min(abs(one - other) for other in expected) for one in swings]
    assert len(swings) >= 2
    assert max(near) < 1e-9
    assert settled.unsettled == 0


def test_the_share_of_a_basin_is_that_of_many_more_starts() -> None:
    few, many = settled_of("backlash_oscillator"), settled_of("backlash_oscillator", 600)
    shares = dict(zip(many.names, (count / many.starts for count in many.counts), strict=True))
    for i, name in enumerate(few.names):
        low, high = few.interval(i)
        assert low < shares[name] < high


def test_a_train_keeps_its_speed_at_the_starts() -> None:
    """The paper's case 1 loses a difference of its speed over thousands of periods; all starts settle all the same."""
    settled = settled_of("case1")
    assert settled.unsettled == 0
    assert settled.own == 0
    patterns = {tuple(orbit.pattern) for orbit in settled.orbits}
    assert len(patterns) == len(settled.orbits) == 2


def test_both_motions_of_case_1_are_kept_by_a_simulation() -> None:
    """After 200 periods its impacts come at the same instants: what differed at first would have grown or died."""
    for orbit in settled_of("case1").orbits:
        run = gr.simulate(orbit.model, initial=orbit.state, cycles=200, discard=199, audit=False)
        late = run.events[run.events["time"] > 199.0 * orbit.period]
        assert len(late) == len(orbit.run.events)
        np.testing.assert_allclose(late["time"].to_numpy() - 199.0 * orbit.period, orbit.run.events["time"], atol=1e-9)


def test_chaos_settles_in_nothing() -> None:
    light = {"torque.0.mean": 0.5, "torque.0.harmonics.0.amplitude": 2.0}
    model = gr.example("rattle_oscillator").with_(light)
    settled = settled_motions(model, settled_state(model, PeriodMap(assemble(model).system)), 3)
    assert settled.own == -1
    assert settled.unsettled == 3


def test_the_fewest_periods_are_those_of_the_motion() -> None:
    model = gr.load(EXAMPLES / "backlash_oscillator.toml")
    orbit = gr.periodic(model, start="linear")
    four = settled_orbit(model, orbit.motion.start, 4)
    assert four is not None
    assert four.cycles == 1


def test_a_state_far_from_every_motion_is_none() -> None:
    """Newton's method finds a motion from there; it is not the one in which the state has settled."""
    model = gr.load(EXAMPLES / "backlash_oscillator.toml")
    period_map = PeriodMap(assemble(model).system)
    rest = state_of(model, period_map, "static")
    assert settled_orbit(model, State(rest.y + 1.0), 1) is None


def test_an_unstable_motion_is_none() -> None:
    model = gr.load(EXAMPLES / "backlash_oscillator.toml")
    (saddle,) = [orbit for orbit in gr.periodic(model, every=True) if not orbit.stable]
    assert settled_orbit(model, saddle.motion.start, 1) is None


def test_bodies_that_float_anywhere_are_one_motion() -> None:
    model = train()
    settled = settled_motions(model, settled_state(model, PeriodMap(assemble(model).system)), 6)
    floating = [orbit for orbit in settled.orbits if orbit.free]
    assert len(floating) <= 1


def test_motions_of_one_name_are_numbered() -> None:
    names = motion_names([("quiet", 1), ("single-sided", 2), ("quiet", 1), ("double-sided", 1)], [True, False])
    expected = ["quiet, 1 T, a family", "single-sided rattle, 2 T", "quiet, 1 T", "double-sided rattle, 1 T"]
    assert names == expected
    assert motion_names([("quiet", 1)] * 2) == ["quiet, 1 T (1)", "quiet, 1 T (2)"]


def test_a_body_that_floats_in_its_gap_is_one_of_a_family() -> None:
    """The shaft swings by less than the gap, so drag brings the loose body to rest wherever it is."""
    shaft = {"name": "shaft", "between": ["hub", "ground"], "stiffness": 1.0, "damping": 0.1}
    gap = {"name": "gap", "between": ["hub", "gear"], "stiffness": 10.0, "damping": 0.1, "clearance": 1.0}
    tables = {
        "inertia": [{"name": "hub", "J": 1.0}, {"name": "gear", "J": 0.5, "drag": 0.1}],
        "coupling": [shaft, gap],
        "excitation": {"speed": 0.5},
        "torque": [{"on": "hub", "harmonics": [{"order": 1, "amplitude": 0.2}]}],
    }
    model = gr.Model.from_tables({"schema": 1, "name": "loose", "units": "dimensionless", **tables})
    floating, held = gr.periodic(model, start="zero"), gr.periodic(gr.example("rattle_oscillator"), start="linear")
    assert Settled((floating, held), (2, 1), 3, 0).names == ["quiet, 1 T, a family", "quiet, 1 T"]


def behind_a_clutch(wound_up: float) -> gr.Model:
    """A gear pair on an input behind a soft clutch wound up by an angle [degrees], of which the mesh feels nothing."""
    clutch, radius, stiffness, backlash = 30.0, 0.05, 1e6, 1e-4
    inertia, gear = 0.02, 1e-3
    natural = float(np.sqrt(stiffness * radius**2 * (1.0 / inertia + 1.0 / gear)))
    load = 0.05 * backlash * stiffness * radius
    shaft = {"name": "clutch", "between": ["input", "ground"], "stiffness": clutch, "damping": 0.5}
    error = [{"order": 1, "amplitude": 0.025 * backlash, "phase": 1.5708}]
    mesh = {"name": "mesh", "between": ["input", "gear"], "radii": [radius, radius], "stiffness": stiffness}
    tables = {
        "inertia": [{"name": "input", "J": inertia}, {"name": "gear", "J": gear, "drag": 0.1 * natural * gear}],
        "coupling": [shaft],
        "mesh": [{**mesh, "damping": 0.0, "backlash": backlash, "transmission_error": error}],
        "excitation": {"speed": 0.75 * natural},
        "torque": [{"on": "input", "mean": clutch * float(np.radians(wound_up))}, {"on": "gear", "mean": -load}],
        "simulation": {"cycles": 200, "discard": 150},
    }
    return gr.Model.from_tables({"schema": 1, "name": "gears behind a clutch", **tables})


@pytest.mark.parametrize("wound_up", [4.0, 12.0])
def test_a_soft_part_that_is_wound_up_hides_no_motion(wound_up: float) -> None:
    """The basins are those without the load of the clutch; the mesh swings by 0.13 and 0.64 of half its backlash."""
    free, wound = (
        settled_motions(model, settled_state(model, PeriodMap(assemble(model).system)))
        for model in (behind_a_clutch(0.0), behind_a_clutch(wound_up))
    )
    assert [swing(orbit) / 5e-5 for orbit in wound.orbits] == pytest.approx([0.6442, 0.1281], abs=1e-4)
    assert wound.counts == free.counts
    assert (wound.own, wound.unsettled) == (free.own, 0)
