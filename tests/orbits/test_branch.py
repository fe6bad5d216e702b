"""Branches of the backlash oscillator and of Mason's: their points, their events, and what leaves them."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.orbits import Branch
from gearrattle.orbits.stability_ranges import ranges_of

OSCILLATOR: dict[str, Any] = {
    "schema": 1,
    "units": "dimensionless",
    "inertia": [{"name": "body", "J": 1.0}],
    "coupling": [
        {
            "name": "gap",
            "between": ["body", "ground"],
            "stiffness": 1.0,
            "clearance": 1.0,
            "damping": 0.1,
            "damping_ratio": 1.0,
            "kinematic_error": [{"order": 1, "amplitude": 0.05, "phase": np.pi / 2}],
        }
    ],
    "excitation": {"frequency": 0.3},
    "torque": [{"on": "body", "mean": 0.1}],
}
"""x'' + 0.1 x' + f(x) = 0.1 + 0.05 W^2 cos(W t), half gap 1, x the deflection."""
AMPLITUDE = "torque.0.harmonics.0.amplitude"


def oscillator(**torque: float) -> gr.Model:
    return gr.Model.from_tables({**OSCILLATOR, "torque": [{"on": "body", "mean": 0.1, **torque}]})


@cache
def over_frequency() -> Branch:
    return gr.continuation(oscillator(), "excitation.frequency", (0.3, 1.6))


@cache
def over_amplitude() -> Branch:
    return gr.continuation(gr.example("rattle_oscillator"), AMPLITUDE, (3.0, 6.7))


def test_it_begins_and_ends_at_the_ends_of_the_range() -> None:
    value = over_frequency().data["value"].values
    assert value[0] == 0.3
    assert value[-1] == 1.6
    assert over_frequency().notes == ()


def test_events_come_in_the_order_of_the_branch_and_point_to_the_point_before() -> None:
    branch = over_frequency()
    mean = "mean at corner"
    assert branch.events["kind"].tolist() == ["grazing", "fold", mean, "fold", mean, "grazing"]
    assert branch.events["clearance"].tolist() == ["gap", "", "gap", "", "gap", "gap"]
    value = branch.data["value"].values
    for event in branch.events.itertuples():
        if event.kind == "grazing":
            ends = sorted((value[event.point], value[event.point + 1]))
            assert ends[0] <= event.value <= ends[1]


def test_a_mean_at_a_corner_is_there_to_the_last_digits() -> None:
    branch = over_frequency()
    chosen = branch.events["kind"] == "mean at corner"
    np.testing.assert_allclose(branch.event_levels[chosen, 2, 0], 1.0, rtol=0, atol=1e-10)


def test_the_motions_of_the_branch_are_those_of_a_simulation_where_they_are_stable() -> None:
    branch = over_frequency()
    for i in (5, len(branch.points) - 5):
        orbit = branch.orbit(i)
        run = gr.simulate(orbit.model, cycles=400, discard=399, samples_per_cycle=512, audit=False)
        simulated = float(np.ptp(run.data["deflection"].values[-513:]))
        assert simulated == pytest.approx(float(np.ptp(orbit.run.data["deflection"].values)), rel=1e-6)


def test_data_holds_levels_between_the_samples() -> None:
    """In contact delta = 1.1 + amplitude cos(...): its mean and its peak-to-peak value are known."""
    data = over_frequency().data
    w = data["value"].values[:5]
    amplitude = 0.05 * w**2 / np.abs(1.0 - w**2 + 0.1j * w)
    np.testing.assert_allclose(data["peak_to_peak"].values[:5, 0], 2.0 * amplitude, rtol=1e-9)
    np.testing.assert_allclose(data["mean"].values[:5, 0], 1.1, rtol=1e-9)
    assert data["stable"].values[:5].all()
    assert data.sizes == {"point": len(over_frequency().points), "mode": 2, "clearance": 1}
    assert float(data["error"].max()) < 1e-10


@pytest.mark.parametrize("step_limit", [pytest.param(0.01, marks=pytest.mark.long), 0.5])
def test_no_step_is_longer_than_the_limit_and_the_events_stay(step_limit: float) -> None:
    branch = gr.continuation(oscillator(), "excitation.frequency", (0.3, 1.6), step_limit=step_limit)
    values = [point.parameter for point in branch.points]
    assert max(abs(later - sooner) for sooner, later in pairwise(values)) <= step_limit
    np.testing.assert_allclose(branch.events["value"], over_frequency().events["value"], rtol=0, atol=1e-9)


def test_backwards_it_meets_the_same_events() -> None:
    branch = gr.continuation(oscillator(), "excitation.frequency", (1.6, 0.3))
    np.testing.assert_allclose(branch.events["value"], over_frequency().events["value"][::-1], rtol=0, atol=1e-9)


def test_contact_is_lost_where_it_is_known_and_the_period_doubles_into_a_branch_of_its_own() -> None:
    """Mason et al. 2009: the flanks stay together up to the amplitude 4 pi d |200 - 4 pi^2 + 1.2 pi i| / 200."""
    branch = over_amplitude()
    contact = 4.0 * np.pi * 0.6 * abs(200.0 - 4.0 * np.pi**2 + 1.2j * np.pi) / 200.0
    assert branch.events["value"][0] == pytest.approx(contact, rel=1e-9)
    cycles = branch.data["cycles"].values
    assert set(cycles[branch.data["branch"].values == 1]) == {2}
    doublings = branch.events[branch.events["kind"] == "period doubling"]["value"].tolist()
    first = branch.data.isel(point=branch.data["branch"].values == 1)["value"].values[0]
    assert first in doublings
    begin = int(np.flatnonzero(branch.data["branch"].values == 1)[0])
    joined = branch.orbit(begin).run.data["deflection"].values[:, 0]
    assert np.abs(joined[512:] - joined[:513]).max() < 1e-9
    doubled = branch.orbit(begin + 1)
    assert doubled.cycles == 2
    run = doubled.run.data["deflection"].values[:, 0]
    assert np.abs(run[512] - run[0]) > 1e-4
    assert run[-1] == pytest.approx(run[0], abs=1e-9)


@pytest.mark.parametrize("isolated", [False, pytest.param(True, marks=pytest.mark.long)])
def test_progress_tells_of_all_branches_and_never_falls(isolated: bool) -> None:
    shares: list[float] = []
    model = gr.example("rattle_oscillator")
    branch = gr.continuation(model, AMPLITUDE, (3.0, 6.7), isolated=isolated, progress=shares.append)
    assert len(branch.curves) > 1
    assert shares == sorted(shares)
    assert 0.0 <= shares[0] < 0.1
    assert shares[-1] == 1.0
    assert len(shares) >= len(branch.points) - 4 * len(branch.curves)  # one for every point


def test_an_exception_from_progress_ends_the_work() -> None:
    def stop(share: float) -> None:
        if share > 0.6:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        gr.continuation(gr.example("rattle_oscillator"), AMPLITUDE, (3.0, 6.7), progress=stop)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ((0.3, 0.3), "two different values"),
        ((0.3, 0.3 * (1.0 + 1e-15)), "two different values"),
        ((0.3,), "two values"),
        (("0.3 m", 1.0), "plain number"),
    ],
)
def test_a_range_without_sense_is_refused(values: Any, words: str) -> None:
    with pytest.raises(gr.ModelError, match=words):
        gr.continuation(oscillator(), "excitation.frequency", values)


def test_a_path_that_is_no_text_is_refused() -> None:
    with pytest.raises(gr.ModelError, match="path: found 3; must be text"):
        gr.continuation(oscillator(), 3, (0.3, 1.6))  # type: ignore[arg-type]


def test_a_path_that_leads_nowhere_is_refused() -> None:
    with pytest.raises(gr.ModelError, match="no coupling is named gapp"):
        gr.continuation(oscillator(), "coupling.gapp.clearance", (0.5, 1.0))
    with pytest.raises(gr.ModelError, match="cannot be followed: between two orders"):
        gr.continuation(gr.example("rattle_oscillator"), "torque.0.harmonics.0.order", (1.0, 2.0))
    with pytest.raises(gr.ModelError, match=r"simulation.cycles: is a setting of simulations"):
        gr.continuation(gr.example("rattle_oscillator"), "simulation.cycles", (160, 200))


@pytest.mark.parametrize(
    ("limit", "words"), [(0.0, "greater than zero"), (True, "plain number"), ("0.1", "plain number")]
)
def test_a_step_limit_is_a_number_greater_than_zero(limit: Any, words: str) -> None:
    with pytest.raises(gr.ModelError, match=f"step_limit: .*{words}"):
        gr.continuation(oscillator(), "excitation.frequency", (0.3, 1.6), step_limit=limit)


def test_an_orbit_or_event_that_is_not_there_is_refused() -> None:
    with pytest.raises(gr.ModelError, match=r"point: found 10000; must be a whole number from -\d+ to \d+$"):
        over_frequency().orbit(10_000)
    with pytest.raises(gr.ModelError, match=r"event: found 6; must be a whole number from 0 to 5$"):
        over_frequency().gradients(6)
    for index in (1.5, "a", None, True):
        with pytest.raises(gr.ModelError, match="whole number"):
            over_frequency().orbit(index)  # type: ignore[arg-type]
        with pytest.raises(gr.ModelError, match="whole number"):
            over_frequency().gradients(index)  # type: ignore[arg-type]


def test_a_range_may_end_where_the_model_does() -> None:
    """A clearance may close: there the difference over it is one-sided."""
    branch = gr.continuation(gr.example("rattle_oscillator"), "coupling.flanks.clearance", (0.6, 0.0), start="linear")
    assert branch.data["value"].values[-1] == 0.0
    assert branch.notes == ()


AMPLITUDE = "torque.0.harmonics.0.amplitude"
BREAKING = 0.393962524286  # of the symmetric oscillator: 12 figures from three ranges


def symmetric(ratio: float) -> gr.Model:
    """A body between stops, with a share of their stiffness and damping in the gap."""
    contact = {"stiffness": 10.0, "damping": 0.2, "clearance": 1.0, "stiffness_ratio": ratio, "damping_ratio": ratio}
    return gr.Model.from_tables(
        {
            "schema": 1,
            "name": "symmetric oscillator",
            "units": "dimensionless",
            "inertia": [{"name": "body", "J": 1.0, "drag": 0.1}],
            "coupling": [{"name": "gap", "between": ["body", "ground"], **contact}],
            "excitation": {"speed": 0.6},
            "torque": [{"on": "body", "harmonics": [{"order": 1, "amplitude": 1.0}]}],
        }
    )


@pytest.mark.parametrize("span", [(0.3, 0.5), (0.35, 0.42), (0.2, 0.41)])
def test_a_breaking_of_symmetry_is_located_whatever_the_range(span: tuple[float, float]) -> None:
    """There a multiplier of the half-period map, followed by itself, is -1; the whole one knows it to 1e-7 alone."""
    branch = gr.continuation(symmetric(0.0), AMPLITUDE, span)
    breaking = next(event for event in branch.curves[0].events if event.kind == "symmetry breaking")
    assert breaking.point.parameter == pytest.approx(0.39396252429, abs=1e-11)
    half_period = branch.orbit_at(breaking.point, 1).half_period_multipliers
    assert half_period is not None
    assert np.abs(half_period + 1.0).min() < 1e-11


def test_a_branch_begun_without_symmetry_joins_the_symmetric_one() -> None:
    """At 0.45 the start settles in one of two mirror images; the symmetric motion there is unstable."""
    branch = gr.continuation(symmetric(0.0), AMPLITUDE, (0.45, 0.3))
    assert branch.events["kind"].tolist() == ["symmetry breaking"] * 2
    assert branch.events["value"].tolist() == pytest.approx([0.39396252429] * 2, abs=1e-11)
    ends = [[curve.points[end].parameter for end in (0, -1)] for curve in branch.curves]
    assert ends[0] == pytest.approx([0.45, 0.39396252429], abs=1e-11)
    assert sorted(ends[1]) == [0.3, 0.45]
    assert ends[2] == pytest.approx([0.39396252429, 0.45], abs=1e-11)
    assert ranges_of(branch)[0].cause == "symmetry breaking"
    first, image = branch.orbit(0), branch.orbit_at(branch.curves[2].points[-1], 1)
    shown = [orbit.run.data["deflection"].values for orbit in (first, image)]
    half = (len(shown[0]) - 1) // 2
    np.testing.assert_allclose(shown[0][half:], -shown[1][: half + 1], rtol=0, atol=1e-9)


def shown_by(span: tuple[float, float]) -> tuple[list[list[float]], list[float]]:
    """Of the branches over the range both ends, of their events the values, all from the breaking on."""
    branch = gr.continuation(symmetric(0.0), AMPLITUDE, span)
    assert branch.notes == ()
    assert set(branch.events["kind"]) <= {"symmetry breaking"}
    ends = [sorted(curve.points[end].parameter - BREAKING for end in (0, -1)) for curve in branch.curves]
    return ends, (branch.events["value"] - BREAKING).tolist()


@pytest.mark.long
@pytest.mark.parametrize("off", [0.0, 1e-13, -1e-13, 1e-11, -1e-11, 1e-9, -1e-9, 1e-8, -1e-8])
def test_a_range_may_end_at_a_breaking_of_symmetry(off: float) -> None:
    """Three branches lie above it, one below. Nearer than 1e-8 their motions cannot be told apart."""
    (upward, at_first), (downward, _) = shown_by((BREAKING + off, 0.45)), shown_by((BREAKING + off, 0.35))
    np.testing.assert_allclose(upward, [[0.0, 0.45 - BREAKING]] * 3, rtol=0, atol=2e-8)
    np.testing.assert_allclose(at_first, [0.0], rtol=0, atol=1e-11)
    np.testing.assert_allclose(downward, [[0.35 - BREAKING, 0.0]], rtol=0, atol=2e-8)
    (from_below, _), (from_above, joints) = shown_by((0.35, BREAKING + off)), shown_by((0.45, BREAKING + off))
    np.testing.assert_allclose(from_below, [[0.35 - BREAKING, 0.0]], rtol=0, atol=2e-8)
    np.testing.assert_allclose(from_above, [[0.0, 0.45 - BREAKING]] * len(from_above), rtol=0, atol=2e-8)
    assert len(from_above) in ({2} if off > 1e-12 else {3} if off < -1e-12 else {2, 3})  # the third leaves at the end
    np.testing.assert_allclose(joints, 0.0, rtol=0, atol=1e-11)


@pytest.mark.parametrize("off", [1e-7, 1e-6, 1e-5])
def test_a_short_branch_from_a_breaking_of_symmetry_is_listed_once(off: float) -> None:
    """At a value next to the breaking Newton's method finds the symmetric motion, wherever it begins."""
    ends, breakings = shown_by((BREAKING + off, 0.35))
    np.testing.assert_allclose(ends, [[0.0, off], [0.35 - BREAKING, off], [0.0, off]], rtol=0, atol=1e-11)
    np.testing.assert_allclose(breakings, [0.0] * 2, rtol=0, atol=1e-11)


@pytest.mark.slow
def test_branches_of_broken_symmetry_end_where_they_join_the_symmetric_one_and_are_listed_once() -> None:
    """From 0.3939625 to 3.9168158 two motions of 1 T are mirror images of one another; nothing jumps at either end."""
    branch = gr.continuation(symmetric(0.0), AMPLITUDE, (0.3, 4.0))
    kinds = branch.events.groupby("branch")["kind"].apply(list)
    joints = branch.events.loc[branch.events["kind"] == "symmetry breaking", ["branch", "value"]]
    leaving = joints.loc[joints["branch"] == 0, "value"].tolist()
    assert leaving == pytest.approx([0.3939625, 3.9168158, 3.0211643], abs=1e-6)
    broken = [number for number, curve in enumerate(branch.curves) if curve.origin == "symmetry breaking"]
    assert [kinds[number][-1] for number in broken[:2]] == ["symmetry breaking"] * 2
    for number in broken[:2]:
        ends = [branch.curves[number].points[end].parameter for end in (0, -1)]
        assert ends == pytest.approx(leaving[:2], abs=1e-6)
    folds = branch.events.loc[branch.events["kind"] == "fold", "value"].to_numpy(np.float64)
    assert np.abs(folds[:, None] - leaving).min() > 1e-3
    ends = [(c.cycles, *(round(c.points[end].parameter, 6) for end in (0, -1))) for c in branch.curves[1:]]
    assert sorted(ends) == sorted(2 * sorted(set(ends)))  # every branch and its mirror image, once


@pytest.mark.slow
def test_what_leaves_at_doublings_of_branches_of_broken_symmetry_is_followed() -> None:
    """At the amplitude 5.83 two motions of 2 T, images of one another, are the only stable ones."""
    model = symmetric(0.1)
    branch = gr.continuation(model, AMPLITUDE, (1.0, 8.0))
    assert [curve.cycles for curve in branch.curves] == [1, 1, 1, 2, 2, 2, 2]
    data = branch.data
    for number in (4, 6):
        rows = np.flatnonzero((data["branch"].values == number) & data["stable"].values)
        nearest = int(rows[np.argmin(np.abs(data["value"].values[rows] - 5.83))])
        orbit = gr.periodic(model.with_({AMPLITUDE: 5.83}), 2, start=branch.orbit(nearest))
        assert abs(orbit.multipliers[0]) == pytest.approx(0.4916, abs=1e-4)
    settled = gr.periodic(model.with_({AMPLITUDE: 5.83}), 2)
    assert abs(settled.multipliers[0]) == pytest.approx(0.4916, abs=1e-4)


@pytest.mark.slow
def test_isolated_branches_of_two_periods_are_sought_on_request() -> None:
    """At the speed 1.445 a third of all starts settle in a rattle of 2 T; no branch of 1 T doubles its period there."""
    model = gr.example("backlash_oscillator").with_({"torque.0.mean": 0.0975})
    sought = gr.continuation(model, "excitation.speed", (1.42, 1.48), isolated=True)
    assert [curve.cycles for curve in sought.curves] == [1, 2]
    assert any(sought.curves[1].stable)
    assert max(sought.data["value"].values[sought.data["branch"].values == 1]) == 1.48


def body_with_backlash(drag: float, mean: float, amplitude: float, frequency: float) -> gr.Model:
    """x'' + drag x' + f(x) = mean + amplitude sin(W t), damped as much in the gap as in contact."""
    return gr.Model.from_tables(
        {
            "schema": 1,
            "units": "dimensionless",
            "inertia": [{"name": "body", "J": 1.0, "drag": drag}],
            "coupling": [{"name": "gap", "between": ["body", "ground"], "stiffness": 1.0, "clearance": 1.0}],
            "excitation": {"frequency": frequency},
            "torque": [{"on": "body", "mean": mean, "harmonics": [{"order": 1, "amplitude": amplitude}]}],
        }
    )


def test_a_branch_of_two_periods_ends_where_it_joins_that_of_one() -> None:
    """Its motions settle softly into those of 1 T: nothing folds or jumps there, and the other branch goes on."""
    model = body_with_backlash(0.1216, 0.1555, 0.216, 0.46)
    doubled = gr.continuation(model, "excitation.frequency", (0.455, 0.475), cycles=2)
    single = gr.continuation(model, "excitation.frequency", (0.455, 0.475))
    assert [curve.cycles for curve in doubled.curves] == [2, 1]
    assert doubled.events["kind"].tolist() == ["period doubling", "period doubling"]
    (doubling,) = single.events["value"].tolist()
    assert doubled.events["value"].tolist() == pytest.approx([doubling] * 2, abs=1e-12)
    assert "jump" not in doubled.sentence


def test_motions_that_repeat_sooner_are_followed_over_fewer_periods() -> None:
    model = body_with_backlash(0.1216, 0.1555, 0.216, 0.46)
    asked, single = (gr.continuation(model, "excitation.frequency", (0.475, 0.455), cycles=n) for n in (2, 1))
    assert asked.cycles == 1
    assert asked.notes[0] == "The motion at the first end repeats after 1 period: cycles is 1."
    assert asked.events["kind"].tolist() == single.events["kind"].tolist() == ["period doubling"]
    assert asked.events["value"].tolist() == pytest.approx(single.events["value"].tolist(), abs=1e-12)
    assert [curve.cycles for curve in asked.curves] == [1, 2]


@pytest.mark.slow
def test_a_fold_of_a_branch_without_symmetry_near_its_joint_is_a_fold() -> None:
    """Of 1e-5 of w after the breaking it grazes and folds, before it is farther from its mirror image than 4e-5."""
    coupling = [
        {"name": "s", "between": ["a", "ground"], "stiffness": 2.3, "damping": 0.1},
        {
            "name": "g0",
            "between": ["a", "b"],
            "stiffness": 25.5,
            "damping": 0.6,
            "clearance": 0.53,
            "stiffness_ratio": 0.0,
            "damping_ratio": 0.2,
        },
        {"name": "o", "between": ["b", "ground"], "stiffness": 1.65, "damping": 0.05},
    ]
    harmonics = [{"order": 1, "amplitude": 2.81}, {"order": 3, "amplitude": 0.4, "phase": 2.0}]
    tables = {
        "schema": 1,
        "units": "dimensionless",
        "inertia": [{"name": "a", "J": 0.93, "drag": 0.127}, {"name": "b", "J": 1.34, "drag": 0.045}],
        "coupling": coupling,
        "excitation": {"speed": 1.26},
        "torque": [{"on": "a", "harmonics": harmonics}],
    }
    branch = gr.continuation(gr.Model.from_tables(tables), AMPLITUDE, (3.55, 3.66), start="linear")
    assert [curve.cycles for curve in branch.curves] == [1, 1, 1, 2, 2]
    for curve in branch.curves[1:3]:
        assert [event.kind for event in curve.events] == ["grazing", "fold", "period doubling"]
        assert curve.events[1].point.parameter == pytest.approx(3.62775588275, abs=1e-9)
