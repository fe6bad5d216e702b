"""Basins of attraction: closed forms of what must be quiet, another integrator, symmetry, counts, and refusals."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.errors import Cancelled, ModelError
from gearrattle.orbits.attractors import Attractor, settled_orbit
from gearrattle.signals import SEVERITIES
from gearrattle.signals.wilson_interval import wilson
from gearrattle.studies.basin_attractors import attractors_of, orbit_of, quiet_share
from gearrattle.studies.output import REGIMES
from gearrattle.studies.start_coordinates import starts_of
from tests.studies.drivelines import model as two_bodies
from tests.studies.oscillator import DRAG, EXAMPLES, GAP, MEAN, RESPONSE, STIFFNESS, model, quiet

X, V = "deflection.flanks", "rate.flanks"
GRID = {X: {"from": -0.6, "to": 0.8, "count": 13}, V: {"from": -4.0, "to": 4.0, "count": 13}}
AMPLITUDE = 3.9658009


@pytest.fixture(scope="module")
def attractors() -> xr.Dataset:
    return gr.basins(model(), GRID, workers=1)


def test_four_motions_compete_in_the_gap(attractors: xr.Dataset) -> None:
    """As many as the random search of another program's example finds; all of period one."""
    assert attractors["attractor period"].values.tolist() == [1, 1, 1, 1]
    assert sorted(attractors["attractor verdict"].values.tolist()) == [0, 1, 1, 2]
    assert attractors.attrs["within"] < 1e-6
    assert attractors.attrs["between"] > 1e-2
    assert float(attractors["share"].sum()) == 1.0
    assert np.all(attractors["verified"] == 1)
    names = ["double-sided rattle, 1 T", "quiet, 1 T", "single-sided rattle, 1 T (1)", "single-sided rattle, 1 T (2)"]
    assert sorted(attractors["attractor name"].values.tolist()) == names


def test_what_the_closed_form_keeps_in_contact_becomes_quiet() -> None:
    """x = x_q + u, u'' + d u' + k u = 0: contact is kept for ever if u never exceeds min x_q - b.

    |u| <= sqrt(u_0^2 + ((v_0 + d/2 u_0)/w_d)^2), w_d^2 = k - d^2/4, for all later times.
    """
    margin = MEAN / STIFFNESS - AMPLITUDE * abs(RESPONSE)
    x, v = quiet(AMPLITUDE, 0.0)
    swift = np.sqrt(STIFFNESS - DRAG**2 / 4)
    over = {
        X: {"from": x - margin, "to": x + margin, "count": 5},
        V: {"from": v - margin * swift, "to": v + margin * swift, "count": 5},
    }
    attractors = gr.basins(model(), over, workers=1)
    u, w = np.meshgrid(attractors[f"initial.{X}"].values - x, attractors[f"initial.{V}"].values - v, indexing="ij")
    held = np.hypot(u, (w + DRAG / 2 * u) / swift) < 0.999 * margin
    assert np.count_nonzero(held) > 6
    (number,) = np.unique(attractors["basin"].values[held])
    assert number == 1 + attractors["attractor verdict"].values.tolist().index(0)
    orbit = [orbit_of(attractors, int(number), name)[0] for name in (X, V)]
    np.testing.assert_allclose(orbit, (x, v), rtol=0, atol=1e-6)


def test_another_integrator_ends_in_the_same_motions(attractors: xr.Dataset) -> None:
    def slope(t: float, state: np.ndarray) -> list[float]:
        x, v = state
        force = x - GAP if x > GAP else x + GAP if x < -GAP else 0.0
        return [v, MEAN + AMPLITUDE * np.sin(2 * pi * t - 1.6660006) - DRAG * v - STIFFNESS * force]

    rng, basins = np.random.default_rng(5), attractors["basin"].values
    places = np.array([rng.choice(np.argwhere(basins == number)) for number in (1, 2, 3, 4)])
    for i, j in places:
        start = [float(attractors[f"initial.{X}"][i]), float(attractors[f"initial.{V}"][j])]
        end = solve_ivp(slope, (0.0, 40.0), start, method="DOP853", rtol=1e-9, atol=1e-10, max_step=0.02).y[:, -1]
        number = int(attractors["basin"][i, j])
        want = [orbit_of(attractors, number, name)[0] for name in (X, V)]
        np.testing.assert_allclose(end, want, rtol=0, atol=2e-4)


@pytest.mark.slow
def test_basins_of_a_symmetric_driveline_map_onto_each_other() -> None:
    """Without a mean, (x, v, t) -> (-x, -v, t + T/2) maps motions to motions; a family floats within the gap.

    Floating, v' + d v = F sin(w t + p) whatever x, so every point of the family has the same rate.
    """
    even = model(6.0).with_({"torque.0.mean": 0.0, "torque.0.harmonics.0.phase": 0.3, "inertia.gear.drag": 0.3})
    mirrored = even.with_({"torque.0.harmonics.0.amplitude": -6.0})  # to the bit, and so is every motion: chaos, too
    over = {X: {"from": -0.9, "to": 0.9, "count": 9}, V: [-0.9, 0.0, 0.9]}
    one, other = (gr.basins(entry, over, workers=1) for entry in (even, mirrored))
    np.testing.assert_array_equal(one["basin"], other["basin"].values[::-1, ::-1])
    assert one["family"].values.tolist() == other["family"].values.tolist() == [0, 1]
    assert one["attractor verdict"].values.tolist() == [2, 0]
    for name in (X, V):
        np.testing.assert_allclose(orbit_of(one, 1, name), -orbit_of(other, 1, name), atol=1e-6)
    floating = one[V].values[one["basin"].values == 2][:, -1]
    rate = (6.0 * np.exp(0.3j) / (0.3 + 2j * pi)).imag
    assert floating.size > 4
    np.testing.assert_allclose(floating, rate, rtol=0, atol=1e-6)
    assert np.ptp(one[X].values[one["basin"].values == 2][:, -1]) > 0.3


def test_shares_of_drawn_states_have_wilsons_interval_and_agree_with_the_grid(attractors: xr.Dataset) -> None:
    box = {name: {"from": inputs["from"], "to": inputs["to"]} for name, inputs in GRID.items()}
    drawn = gr.basins(model(), box, samples=100, method="random", seed=2, workers=1)
    cases = [int(np.count_nonzero(drawn["basin"].values == n)) for n in drawn["attractor"].values]
    assert drawn["cases"].values.tolist() == cases
    low, high = wilson(np.array(cases), np.full(len(cases), 100))
    np.testing.assert_array_equal([drawn["low"].values, drawn["high"].values], [low, high])
    reported = quiet_share(drawn)
    assert reported["low"] < reported["share"] < reported["high"]
    assert [drawn.attrs[f"quiet_{key}"] for key in ("share", "low", "high")] == [
        reported[k] for k in ("share", "low", "high")
    ]
    assert "quiet_low" not in attractors.attrs
    coarse = quiet_share(attractors)
    assert np.isnan(coarse["low"])
    assert reported["low"] - 0.03 < coarse["share"] < reported["high"] + 0.03  # a grid of 13 x 13 is coarse


def test_a_motion_that_touches_counts_as_one_that_does_not_rattle(attractors: xr.Dataset) -> None:
    severities = attractors["attractor severity"]
    rattling = severities.values == SEVERITIES.index("rattles")
    first = int(np.flatnonzero(rattling)[0])
    touching = attractors.copy(deep=True)
    touching["attractor severity"][first] = SEVERITIES.index("touches")
    assert quiet_share(attractors)["cases"] == attractors["cases"].values[~rattling].sum()
    assert quiet_share(touching)["cases"] == quiet_share(attractors)["cases"] + attractors["cases"].values[first]


def test_what_has_not_settled_is_told_as_such() -> None:
    coarse = {name: {**inputs, "count": 5} for name, inputs in GRID.items()}
    attractors = gr.basins(model(), coarse, cycles=12, discard=6, workers=1)
    undecided = attractors["basin"].values == -1
    assert np.count_nonzero(undecided) > 12
    assert np.array_equal(undecided, attractors["motion"].values == 2)
    assert quiet_share(attractors)["open"] == np.mean(undecided)


def test_chaos_is_a_class_of_its_own() -> None:
    light = {"torque.0.mean": 0.5, "torque.0.harmonics.0.amplitude": 2.0}
    attractors = gr.basins(model(), {X: [-0.3, 0.0, 0.3]}, fixed=light, cycles=400, discard=200, workers=1)
    assert attractors["basin"].values.tolist() == [0, 0, 0]
    assert attractors.sizes["attractor"] == 0
    assert quiet_share(attractors)["share"] == 0.0


@pytest.mark.slow
def test_motions_are_those_that_shooting_finds_with_their_multipliers(attractors: xr.Dataset) -> None:
    """Those of ``gr.periodic``; drag alone damps the oscillator, so |mu_1 mu_2| = exp(-d T) in every one of them."""
    stable = [orbit for orbit in gr.periodic(model(), every=True) if orbit.stable]
    assert len(stable) == attractors.sizes["attractor"]
    for n in attractors["attractor"].values.tolist():
        at = [float(orbit_of(attractors, n, name)[0]) for name in (X, V)]
        states = [[*orbit.state["angle"], *orbit.state["velocity"]] for orbit in stable]
        orbit = stable[int(np.argmin(np.abs(np.array(states) - at).max(axis=1)))]
        np.testing.assert_allclose([*orbit.state["angle"], *orbit.state["velocity"]], at, rtol=0, atol=1e-5)
        assert REGIMES[int(attractors["attractor verdict"][n - 1])] == orbit.verdict.verdict
        modulus = float(attractors["attractor multiplier"][n - 1])
        assert modulus == pytest.approx(abs(orbit.multipliers[0]), rel=1e-9)
        assert np.prod(np.abs(orbit.multipliers)) == pytest.approx(np.exp(-DRAG), rel=1e-9)


def test_groups_that_shooting_leads_to_one_motion_are_one_attractor(attractors: xr.Dataset) -> None:
    """A threshold of rounding parts cases of one motion; what they settle in is the same."""
    oscillator = model()
    period_map = PeriodMap(assemble(oscillator).system)

    def settled(at: tuple[int, ...], cycles: int) -> Attractor | None:
        end = period_map.state_of(attractors[X].values[(*at, [-1])], attractors[V].values[(*at, [-1])])
        orbit = settled_orbit(oscillator, end, cycles)
        return None if orbit is None else Attractor(orbit)

    assert attractors_of(attractors, 1e-17).sizes["attractor"] > 8
    again = attractors_of(attractors, 1e-17, settled)
    np.testing.assert_array_equal(again["basin"], attractors["basin"])
    assert again["attractor name"].values.tolist() == attractors["attractor name"].values.tolist()
    np.testing.assert_allclose(again["attractor multiplier"], attractors["attractor multiplier"], rtol=1e-9)


def test_without_a_motion_nearby_names_are_those_of_the_cases(attractors: xr.Dataset) -> None:
    again = attractors_of(attractors, 1e-3)
    assert np.all(again["verified"] == 0)
    assert np.all(np.isnan(again["attractor multiplier"]))
    assert again["attractor name"].values.tolist() == attractors["attractor name"].values.tolist()


def test_the_threshold_is_free_within_the_empty_space(attractors: xr.Dataset) -> None:
    for same in (1e-5, 1e-4, 1e-2, 0.1):
        assert np.array_equal(attractors_of(attractors, same)["basin"], attractors["basin"])
    assert attractors_of(attractors, 0.5)["basin"].values.max() < 4


def test_stopped_and_resumed_on_other_workers_it_gives_the_same_bits(tmp_path: Path) -> None:
    over = {X: {**GRID[X], "count": 3}, V: [1.0]}
    whole = gr.basins(model(), over, cycles=60, discard=30, workers=1)
    seen: list[float] = []

    def progress(share: float) -> None:
        seen.append(share)
        if share > 0.3:
            raise Cancelled("enough")

    inputs: dict[str, Any] = {"cycles": 60, "discard": 30, "output": tmp_path / "a"}
    with pytest.raises(Cancelled):
        gr.basins(model(), over, **inputs, workers=1, progress=progress)
    again = gr.basins(model(), over, **inputs, workers=2, scheduler="threads", resume=True)
    assert again.identical(whole)
    assert gr.open_study(tmp_path / "a")["basin"].identical(whole["basin"])
    with pytest.raises(ModelError, match="holds another study"):
        gr.basins(model(), over, **inputs, workers=1, resume=True, tolerance=1e-7)


def test_a_state_leaves_momentum_and_the_rest_as_it_was() -> None:
    case = gr.load(EXAMPLES / "paper" / "case2.toml").with_({"simulation.initial": "static"})
    names = ["deflection.gear", "rate.gear", "velocity.flywheel"]
    values = {"deflection.gear": 2e-5, "rate.gear": 0.03, "velocity.flywheel": 0.2}
    state = starts_of(case, names).state(values)
    run = gr.simulate(case, initial=state, cycles=1, discard=0, samples_per_cycle=1, audit=False)
    first = run.data.isel(time=0)
    assert float(first["deflection"].sel(clearance="gear")) == pytest.approx(2e-5, rel=1e-9)
    gear = next(mesh for mesh in case.meshes if mesh.name == "gear")
    (error,) = gear.transmission_error
    swift = error.order * case.excitation.omega
    speeds = dict(zip((i.name for i in case.inertias), state["velocity"], strict=True))
    a, b = (speeds[name] for name in gear.between)
    rate = gear.radii[0] * a - gear.radii[1] * b - error.amplitude * swift * np.cos(error.phase)
    assert rate == pytest.approx(0.03, rel=1e-9)
    assert speeds["flywheel"] == pytest.approx(0.2, rel=1e-12)
    assert speeds["hub"] == 0.0
    J = {inertia.name: inertia.J for inertia in case.inertias}
    impulses = [J[name] * speeds[name] / radius for name, radius in zip(gear.between, gear.radii, strict=True)]
    assert impulses[0] == pytest.approx(-impulses[1], rel=1e-9)


@pytest.mark.parametrize(
    ("over", "more", "match"),
    [
        ({"deflection.flank": [0.0]}, {}, 'did you mean "deflection.flanks"'),
        ({}, {}, "needs an initial value"),
        ({X: [0.0], "angle.gear": [0.0]}, {}, "follow from each other"),
        ({X: ["1 mm"]}, {}, "finite number"),
        ({X: []}, {}, "list of values"),
        ({X: {"from": 0.0, "to": 1.0}}, {}, "needs count"),
        ({X: {"from": 0.0, "to": 1.0, "count": 4}}, {"samples": 5}, "nothing else"),
        ({X: {"from": 1.0, "to": 0.0}}, {"samples": 5}, "must lie below"),
        ({X: [0.0]}, {"samples": -1}, "whole number"),
        ({X: [0.0]}, {"same": 1e-7}, "above tolerance"),
        ({X: [0.0]}, {"same": 0.0}, "above 0"),
        ({X: [0.0, 0.1]}, {"most": 1}, "more than the 1 allowed"),
        ({X: [0.0]}, {"method": "sobel"}, 'did you mean "sobol"'),
    ],
)
def test_wrong_arguments_are_refused(over: dict[str, Any], more: dict[str, Any], match: str) -> None:
    with pytest.raises(ModelError, match=match):
        gr.basins(model(), over, **more)


def test_values_may_have_units() -> None:
    attractors = gr.basins(
        two_bodies(), {"deflection.joint": ["-0.5 deg", "0.5 deg"], "rate.joint": ["60 rpm"]}, workers=1
    )
    np.testing.assert_allclose(attractors["initial.deflection.joint"], np.deg2rad([-0.5, 0.5]), rtol=1e-14)
    np.testing.assert_allclose(attractors["initial.rate.joint"], 2 * pi, rtol=1e-14)
    with pytest.raises(ModelError, match="angle"):
        gr.basins(two_bodies(), {"deflection.joint": ["1 mm"]})
    for huge in (1e31, "1e31 rad"):
        with pytest.raises(ModelError, match="must not be larger than"):
            gr.basins(two_bodies(), {"deflection.joint": [huge]})
