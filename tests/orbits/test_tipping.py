"""The smallest pulse that tips a motion over: on both sides of it, and along the saddle between."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest

import gearrattle as gr
from gearrattle.engine.periodic.motion import State
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.system.auxiliary import FORWARD, STICK
from gearrattle.orbits import Orbit, tipping
from gearrattle.orbits.tipping import BACK, ELSEWHERE, UNDECIDED, Destination
from gearrattle.orbits.tipping import _may_go_either_way as may_go_either_way
from gearrattle.orbits.tipping import _radius_of_stability as radius_of_stability
from tests.orbits.test_branch import oscillator
from tests.orbits.test_friction import oscillator as with_friction

AT = {"excitation.frequency": 0.75}
"""Three motions repeat after one period here: a small one, a large one, and the saddle between."""

MESH = {"stiffness": 1.0, "damping": 0.1, "damping_ratio": 1.0, "clearance": 1.0}


@cache
def quiet() -> Orbit:
    return gr.periodic(oscillator().with_(AT), start="linear")


def swing_after(speed: float) -> float:
    """Peak-to-peak deflection long after the body has been given a speed at t = 0."""
    orbit = quiet()
    state = {"angle": orbit.state["angle"], "velocity": [orbit.state["velocity"][0] + speed]}
    run = gr.simulate(orbit.model, cycles=120, discard=110, samples_per_cycle=64, initial=state, audit=False)
    return float(np.ptp(run.data["deflection"].values[-65:]))


@pytest.mark.parametrize("way", ["forward", "backward"])
def test_a_smaller_pulse_dies_out_and_a_larger_one_does_not(way: str) -> None:
    pulse = float(quiet().tipping("body", instants=1)[way][0])  # the inertia is one
    own = float(np.ptp(quiet().run.data["deflection"].values))
    assert swing_after(0.99 * pulse) == pytest.approx(own, rel=1e-3)
    assert swing_after(1.01 * pulse) > 2.0 * own


def test_on_the_border_the_motion_comes_near_the_saddle() -> None:
    pulse = float(quiet().tipping("body", instants=1)["forward"][0])
    saddle = next(orbit for orbit in gr.periodic(quiet().model, every=True) if not orbit.stable)
    period_map = quiet().period_map
    state = State(quiet().motion.start.y + np.array([0.0, pulse]))
    nearest = np.inf
    for _ in range(40):
        state = period_map.later(state)
        nearest = min(nearest, float(np.linalg.norm(state.y - saddle.motion.start.y)))
    assert nearest < 1e-3


def test_the_instant_is_that_of_the_motion() -> None:
    """At half a period later the pulse acts on the motion shifted by as much: harmonics and state go together."""
    pulses = quiet().tipping("body", instants=2)
    half = quiet().model.with_({"coupling.gap.kinematic_error.0.phase": np.pi / 2 + np.pi})
    shifted = gr.periodic(half, start="linear").tipping("body", instants=1)
    assert pulses["forward"][1] == pytest.approx(shifted["forward"][0], rel=1e-5)


def test_at_the_best_instant_a_smaller_pulse_is_enough_than_at_any_other() -> None:
    rows, evenly = quiet().tipping("body", instants=1, best=True), quiet().tipping("body", instants=16)
    assert rows["share"].is_monotonic_increasing
    assert len(rows) == 3
    for way in ("forward", "backward"):
        size, known = rows[way].abs(), evenly[way].abs()
        best, nearest = size.idxmin(), known.idxmin()
        assert known.min() - 0.01 * known.min() < size[best] < known.min()
        assert abs(rows["share"][best] - evenly["share"][nearest]) < 1.0 / 16


def test_what_is_not_stable_or_not_there_is_refused() -> None:
    with pytest.raises(gr.ModelError, match="must be a free inertia: body"):
        quiet().tipping("bodi")
    saddle = next(orbit for orbit in gr.periodic(quiet().model, every=True) if not orbit.stable)
    with pytest.raises(gr.ModelError, match="for a stable motion"):
        saddle.tipping("body")


def test_instants_need_not_divide_a_power_of_two() -> None:
    """At thirds of the period pulses are as large as elsewhere: the state is that of the motion there."""
    pulses = quiet().tipping("body", instants=3)
    assert np.all(pulses["forward"] > 0.01)
    assert np.all(pulses["backward"] < -0.01)


def test_what_dies_out_too_slowly_is_refused() -> None:
    slow = quiet().model.with_({"coupling.gap.damping": 1e-5})
    with pytest.raises(gr.ModelError, match="dies out too slowly"):
        gr.periodic(slow, start="linear").tipping("body")


def test_a_pulse_that_reverses_a_slip_lets_the_slider_stick() -> None:
    """Then its spring follows the deflection from its bound; a pulse along the slip leaves it at the bound."""
    orbit = gr.periodic(with_friction(0.77), start={"angle": [2.5], "velocity": [0.0]})
    period_map, rows = orbit.period_map, 400
    march = period_map.marched(orbit.motion.start, samples_per_cycle=rows)
    states = [period_map.sampled(march, row * orbit.cycles) for row in range(rows)]
    row = next(row for row, state in enumerate(states) if state.auxiliary_pieces[0] == FORWARD)
    inputs = period_map.system.inputs.later(row * orbit.cycles / rows)
    ahead = PeriodMap(replace(period_map.system, inputs=inputs), orbit.cycles)
    speed = states[row].y[1]
    assert speed > 0.0
    for factor, piece in ((-3.0, STICK), (2.0, FORWARD)):
        struck = ahead.struck(states[row], np.array([0.0, factor * speed, 0.0]))
        assert struck.auxiliary_pieces.tolist() == [piece]
        path = ahead.marched(struck, samples_per_cycle=8 * rows)
        first, second = (ahead.sampled(path, k).y for k in (0, 1))
        moved = second[0] - first[0] if piece == STICK else 0.0
        assert second[2] - first[2] == pytest.approx(moved, abs=1e-12)
        assert abs(second[0] - first[0]) > 1e-5


def duffing(speed: float) -> Orbit:
    """The quiet motion of x'' + 0.1 x' + f(x) = 0.1 + 0.028 sin wt; the large one begins at a fold at w = 0.6638636."""
    tables = {
        "schema": 1,
        "units": "dimensionless",
        "inertia": [{"name": "gear", "J": 1.0}],
        "coupling": [{"name": "mesh", "between": ["gear", "ground"], **MESH}],
        "excitation": {"speed": speed},
        "torque": [{"on": "gear", "mean": 0.1, "harmonics": [{"order": 1, "amplitude": 0.028}]}],
    }
    return gr.periodic(gr.Model.from_tables(tables), start="linear")


def driveline(speed: float, torque: tuple[float, float], *couplings: dict[str, object]) -> gr.Model:
    """A body of inertia one between couplings and ground, with a mean torque and one harmonic."""
    fixed = {"between": ["a", "ground"], "stiffness": 1.0}
    tables = {
        "schema": 1,
        "units": "dimensionless",
        "inertia": [{"name": "a", "J": 1.0}],
        "coupling": [{"name": f"c{k}", **fixed, **coupling} for k, coupling in enumerate(couplings)],
        "excitation": {"speed": speed},
        "torque": [{"on": "a", "mean": torque[0], "harmonics": [{"order": 1, "amplitude": torque[1]}]}],
    }
    return gr.Model.from_tables(tables)


def stiff_stop(speed: float) -> Orbit:
    """A motion of 2 T that grazes a stiff stop near the speed 0.81503106, where it meets a saddle without a root."""
    stop = {"stiffness": 300.0, "damping": 0.5, "damping_ratio": 0.0, "clearance": 1.0}
    model = driveline(speed, (0.3, 0.35), {"damping": 0.08}, stop)
    return gr.periodic(model, 2, start={"angle": [-0.65145], "velocity": [0.62848]})


def comes_back(orbit: Orbit, pulse: float, periods: int = 8000) -> bool:
    """Whether the state is that of the motion so long after a pulse on the first body, of inertia one, at t = 0."""
    start = orbit.motion.start.y.copy()
    struck = start.copy()
    struck[len(orbit.period_map.flow.coordinates.elements)] += pulse
    end = orbit.period_map.later(State(struck), periods).y
    return bool(np.abs(end - start).max() < 1e-6)


@pytest.mark.long
@pytest.mark.parametrize("beyond", [1e-6, 1e-5, 1e-4, 1e-3])
def test_beside_a_slow_saddle_a_pulse_tips_the_motion_over_only_if_it_never_comes_back(beyond: float) -> None:
    """The saddle has a multiplier of 1.0034 at the nearest to the fold."""
    orbit = duffing(0.6638636 + beyond)
    row = orbit.tipping("gear", instants=1).iloc[0]
    for way, sign in (("forward", 1.0), ("backward", -1.0)):
        pulse, error = float(row[way]), float(row[f"{way}_error"])
        assert 0.0 < error < 1e-5 * abs(pulse)
        assert not comes_back(orbit, pulse)
        assert comes_back(orbit, pulse - sign * error)


@pytest.mark.long
@pytest.mark.parametrize("beyond", [1e-3, 1e-2, 3e-2])
@pytest.mark.parametrize("way", ["forward", "backward"])
def test_no_smaller_pulse_tips_the_motion_over(beyond: float, way: str) -> None:
    """Steps of 25 % pass over a band from 0.679 to 0.80 and give a backward pulse of 1.003."""
    orbit = duffing(0.6638636 + beyond)
    pulse = float(orbit.tipping("gear", instants=1)[way][0])
    assert all(comes_back(orbit, share * pulse, 1000) for share in np.arange(0.02, 0.9999, 0.01))


@pytest.mark.long
def test_twice_as_many_instants_never_give_a_larger_least_pulse() -> None:
    orbit = duffing(0.69)
    tables = [orbit.tipping("gear", instants=instants, best=True) for instants in (2, 4, 8)]
    for way in ("forward", "backward"):
        least = [float(table[way].abs().min()) for table in tables]
        assert np.all(np.diff(least) <= 0.0)


def test_every_valley_is_searched_for_the_best_instant(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two valleys: the least sample lies in the shallow one."""

    def border(basin: tipping._Basin, sample: int, sign: float) -> tipping._Border:
        share = sample / basin.samples
        shallow, deep = 1.0 + 40.0 * (share - 0.25) ** 2, 0.5 + 40.0 * (share - 0.68) ** 2
        return tipping._Border(min(shallow, deep), 1e-6)

    monkeypatch.setattr(tipping._Basin, "_border", border)
    rows = quiet().tipping("body", instants=4, best=True)
    assert rows["forward"].min() == pytest.approx(0.5, abs=1e-4)
    assert rows["backward"].max() == pytest.approx(-0.5, abs=1e-4)


def test_a_hidden_band_shows_in_the_time_until_the_motion_is_back() -> None:
    """Between two steps lies a band of 0.2 %; towards it the time grows, and again towards the border at one."""

    def destination(speed: float) -> Destination:
        if 0.500 < speed < 0.501 or speed > 1.0:
            return Destination(ELSEWHERE, np.inf)
        return Destination(BACK, 10.0 - np.log(abs(speed - 0.5005)) - np.log(abs(1.0 - speed)))

    border = tipping._Pulses(destination).border()
    assert border.size == pytest.approx(0.5, rel=2e-6)


def with_another_body(gap: float) -> Orbit:
    """The motion of ``duffing(0.75)`` in a gap of another size, and in a gap of one a body that it does not act on."""
    tables = {
        "schema": 1,
        "units": "dimensionless",
        "inertia": [{"name": "gear", "J": 1.0}, {"name": "other", "J": 1.0}],
        "coupling": [
            {"name": "mesh", "between": ["gear", "ground"], **MESH, "clearance": gap},
            {"name": "wide", "between": ["other", "ground"], **MESH},
        ],
        "excitation": {"speed": 0.75},
        "torque": [
            {"on": "gear", "mean": 0.1 * gap, "harmonics": [{"order": 1, "amplitude": 0.028 * gap}]},
            {"on": "other", "mean": 0.1},
        ],
    }
    return gr.periodic(gr.Model.from_tables(tables), start="linear")


@pytest.mark.parametrize("gap", [1e-1, pytest.param(1e-3, marks=pytest.mark.long), 1e-5])
def test_pulses_go_with_the_gap_of_their_body_whatever_others_there_are(gap: float) -> None:
    alone, small = (orbit.tipping("gear", instants=2) for orbit in (duffing(0.75), with_another_body(gap)))
    for way in ("forward", "backward"):
        assert (small[way] / gap).tolist() == pytest.approx(alone[way].tolist(), rel=2e-6)


@pytest.mark.long
@pytest.mark.parametrize("beyond", [1e-7, 1e-6, 1e-5])
def test_a_motion_is_not_back_while_a_saddle_is_nearer_than_what_counts_as_near(beyond: float) -> None:
    """At a millionth the backward pulse is 4.457e-4; a fixed distance gives 4.643e-4."""
    orbit = stiff_stop(0.8150310600942546 + beyond)
    row = orbit.tipping("a", instants=1).iloc[0]
    for way, sign in (("forward", 1.0), ("backward", -1.0)):
        pulse, error = float(row[way]), float(row[f"{way}_error"])
        assert 0.0 < error < 2e-6 * abs(pulse)
        assert not comes_back(orbit, pulse, 1000)
        assert all(comes_back(orbit, share * (pulse - sign * error), 1000) for share in (0.97, 0.99, 0.999, 1.0))


LONG = {
    16: ((0.873, (0.164, 0.249), {**MESH, "damping": 0.052}), 1, [-5.25664, 0.59557]),
    24: ((1.198, (0.208, 0.366), {**MESH, "damping": 0.03}), 2, [1.38970, 0.69375]),
}
"""Drivelines with a stable motion of so many periods T, with periods and state of a shorter one."""


@pytest.mark.long
@pytest.mark.parametrize("periods", LONG)
def test_a_motion_of_many_periods_is_another_one(periods: int) -> None:
    """That of 16 T about repeats after 8 T."""
    (speed, torque, coupling), cycles, (angle, velocity) = LONG[periods]
    start = {"angle": [angle], "velocity": [velocity]}
    orbit = gr.periodic(driveline(speed, torque, coupling), cycles, start=start)
    pulses = orbit.tipping("a", instants=1)
    assert pulses.attrs["notes"] == []
    for way in ("forward", "backward"):
        pulse, error = float(pulses[way][0]), float(pulses[f"{way}_error"][0])
        assert 0.0 < error < 2e-6 * abs(pulse)
        assert not comes_back(orbit, pulse, 3000)
        assert comes_back(orbit, 0.5 * pulse, 3000)


def test_a_motion_that_neither_nears_a_saddle_nor_leaves_it_may_not_go_either_way() -> None:
    periods, band = np.arange(4000), 1e-3 * np.random.default_rng(1).uniform(-1.0, 1.0, 4000)
    assert not may_go_either_way(band[:, None])
    assert may_go_either_way(1e-3 * 1.001 ** (periods[:, None] - 4000.0))
    assert may_go_either_way(1e-3 * 1.001 ** -periods[:, None])
    assert may_go_either_way(np.zeros((4000, 1)))


def test_the_radius_of_stability_is_the_least_change_that_lets_a_disturbance_last() -> None:
    """Of a number one less its modulus; less where one part feeds another."""
    assert radius_of_stability(np.diag([0.9, -0.5])) == pytest.approx(0.1, rel=1e-9)
    feeding = np.array([[0.5, 3.0], [0.0, 0.5]])
    radius = radius_of_stability(feeding)
    assert 0.05 < radius < 0.1
    left, values, right = np.linalg.svd(np.eye(2) - feeding)
    changed = feeding + values[-1] * np.outer(left[:, -1], right[-1])
    assert values[-1] == pytest.approx(radius, rel=1e-9)
    assert np.abs(np.linalg.eigvals(changed)).max() == pytest.approx(1.0, rel=1e-9)
    assert radius_of_stability(np.diag([1.0, 0.9])) == pytest.approx(0.1, rel=1e-9)  # the first one is free


def test_the_first_pulse_comes_back() -> None:
    """A far larger one tips the motion over, and so do some between that come back: halving from there misses one."""

    def destination(speed: float) -> Destination:
        is_back = speed < 1.5e-6 or 2e-4 < speed < 8e-4
        return Destination(BACK if is_back else ELSEWHERE, 10.0 if is_back else np.inf)

    assert tipping._Pulses(destination).border().size == pytest.approx(1.5e-6, rel=2e-6)


def test_pulses_that_are_not_known_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    def border(_: tipping._Basin, __: int, sign: float) -> tipping._Border:
        return tipping._Border(1.0, 1e-6) if sign > 0.0 else tipping._Border(np.nan, np.nan)

    monkeypatch.setattr(tipping._Basin, "_border", border)
    (note,) = quiet().tipping("body", instants=2).attrs["notes"]
    assert note.startswith("2 of 4 smallest pulses are not known (NaN)")


@pytest.mark.parametrize(
    ("known", "unit", "words"),
    [
        (2e-4, "N m s", "230 µN m s"),
        (0.02, "N m s", "0.23 mN m s"),
        (np.nan, "N m s", "230 µN m s"),
        (2e-4, "", "0.00023"),
    ],
)
def test_the_largest_pulse_tried_is_in_the_unit_of_the_table(known: float, unit: str, words: str) -> None:
    table = pd.DataFrame({"forward": [np.nan, known], "backward": [np.nan, -known]})
    (note,) = tipping._missing(table, 2.3e-4, unit)
    assert f"no pulse up to {words} is known" in note


@pytest.mark.parametrize("instants", [1, 2, 4])
def test_a_narrow_valley_is_searched_for_with_eight_instants(instants: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of fewer instants none shows the valley at 0.64."""

    def border(basin: tipping._Basin, sample: int, _: float) -> tipping._Border:
        share = sample / basin.samples
        return tipping._Border(min(1.0 + abs(share - 0.25), 0.5 + 20.0 * abs(share - 0.64)), 1e-6)

    monkeypatch.setattr(tipping._Basin, "_border", border)
    rows = quiet().tipping("body", instants=instants, best=True)
    assert rows["forward"].min() == pytest.approx(0.5, abs=0.02)
    assert len(rows) == instants + 1


def test_what_is_undecided_is_the_error() -> None:
    def destination(speed: float) -> Destination:
        if speed < 0.5:
            return Destination(BACK, 10.0)
        return Destination(ELSEWHERE if speed > 0.51 else UNDECIDED, np.inf)

    border = tipping._Pulses(destination).border()
    assert 0.51 < border.size < 0.515
    assert 0.01 < border.error < 0.02
    never = tipping._Pulses(lambda speed: Destination(BACK if speed < 0.5 else UNDECIDED, np.inf)).border()
    assert np.isnan(never.size)


def test_what_is_larger_over_the_smallest_corner_takes_longer_to_die_out() -> None:
    motion = quiet().motion
    modulus = float(np.abs(quiet().multipliers).max())
    passes = [tipping._passes_until_back(motion, largest) for largest in (1e2, 1e4)]
    assert modulus ** (passes[1] - passes[0]) == pytest.approx(1e-4, rel=1.0 - modulus**2)
