"""Periodic motions and branches of the oscillator with backlash, against an oracle of thirty digits.

Between W = 0.3 and 1.6 its branch grazes, folds, folds back and grazes; a pair of motions of 2 T hangs together with
none of these.
"""

from __future__ import annotations

from functools import cache
from itertools import permutations
from typing import Any

import numpy as np
import pandas as pd
import pytest
from mpmath import mp, mpf

import gearrattle as gr
from gearrattle.orbits import Branch
from tests.oracles import backlash_mp as oracle
from tests.oracles.winding import fixed_points

LOWEST, HIGHEST = 0.3, 1.6
PATH = "excitation.frequency"
ERROR = {"order": 1, "amplitude": 0.05, "phase": np.pi / 2}
KINDS = ["grazing", "fold", "fold", "grazing"]

MOTIONS = [
    pytest.param("0.75", (0.834, 0.164), 1, True, id="upper leg"),
    pytest.param("0.75", (1.2287, 0.1647), 1, False, id="between the folds"),
    pytest.param("0.71", (0.9501, 0.2304), 1, True, id="near the lower fold, above"),
    pytest.param("0.71", (1.0616, 0.2539), 1, False, id="near the lower fold, below"),
    pytest.param("0.82", (1.2311, 0.0467), 1, False, id="near the upper fold"),
    pytest.param("1.0", (0.906, 0.0558), 1, True, id="at resonance"),
    pytest.param("1.4", (1.0001, 0.0203), 1, True, id="just beyond a grazing"),
    pytest.param("1.5", (0.772, -0.123), 2, True, id="2 T"),
    pytest.param("1.5", (0.7478, -0.043), 2, False, id="2 T, saddle"),
]


def gap(name: str = "gap", share: float = 1.0, damping: float = 0.1) -> dict[str, Any]:
    """An element with a share of the stiffness."""
    return {
        "name": name,
        "between": ["body", "ground"],
        "stiffness": share,
        "damping": damping,
        "damping_ratio": 1.0,
        "clearance": 1.0,
        "kinematic_error": [ERROR],
    }


def beyond_reach(name: str, clearance: float) -> dict[str, Any]:
    """An element that never touches."""
    ends = ["body", "ground"]
    return {
        "name": name,
        "between": ends,
        "stiffness": 3.0,
        "damping": 0.4,
        "damping_ratio": 0.0,
        "clearance": clearance,
    }


def oscillator(frequency: float, *couplings: dict[str, Any]) -> gr.Model:
    """x = angle - 0.05 cos(W t) obeys the oracle's equation."""
    return gr.Model.from_tables(
        {
            "schema": 1,
            "units": "dimensionless",
            "inertia": [{"name": "body", "J": 1.0}],
            "coupling": list(couplings or (gap(),)),
            "excitation": {"frequency": frequency},
            "torque": [{"on": "body", "mean": 0.1}],
        }
    )


def driven(frequency: float) -> gr.Model:
    """The same equation, written with drag and an alternating torque: x = angle."""
    cosine = {**ERROR, "amplitude": 0.05 * frequency**2}
    return gr.Model.from_tables(
        {
            "schema": 1,
            "units": "dimensionless",
            "inertia": [{"name": "body", "J": 1.0, "drag": 0.1}],
            "coupling": [{"name": "gap", "between": ["body", "ground"], "stiffness": 1.0, "clearance": 1.0}],
            "excitation": {"frequency": frequency},
            "torque": [{"on": "body", "mean": 0.1, "harmonics": [cosine]}],
        }
    )


def state_of(orbit: gr.orbits.Orbit, shift: float) -> tuple[float, float]:
    return orbit.state["angle"][0] - shift, orbit.state["velocity"][0]


@cache
def exact(frequency: str, near: tuple[float, float], cycles: int) -> tuple[tuple[float, float], list[complex]]:
    """State at t = 0 and multipliers."""
    with mp.workdps(oracle.DIGITS):
        w = mpf(frequency)
        pattern, crossings = oracle.orbit(w, near, cycles)
        state = oracle.state_at_zero(pattern, w, crossings, cycles)
        return (float(state[0]), float(state[1])), oracle.multipliers(w, state, cycles)


@cache
def events() -> tuple[float, ...]:
    """Grazings and folds along the branch, from contact at the lowest frequency to contact at the highest."""
    with mp.workdps(oracle.DIGITS):
        first, last = (oracle.grazing_from_contact(guess) for guess in ("0.82", "1.41"))
        upper, lower = oracle.fold(mpf("0.828"), (1.2165, 0.0319)), oracle.fold(mpf("0.7085"), (0.98, 0.24))
        return tuple(map(float, (first, upper, lower, last)))


def changes(branch: Branch) -> pd.DataFrame:
    """The events at which the motions change their kind or their number: all but those of means."""
    return branch.events[branch.events["kind"] != "mean at corner"]


def check_events(branch: Branch, *, is_grazing_named: bool = True) -> None:
    backward, table = branch.range[0] > branch.range[1], changes(branch)
    kinds = [kind if is_grazing_named or kind != "pattern" else "grazing" for kind in table["kind"]]
    assert kinds == KINDS
    np.testing.assert_allclose(table["value"], events()[:: -1 if backward else 1], rtol=0, atol=1e-8)
    assert not table["collision"].any()
    assert len(branch.curves) == 1
    assert not branch.notes
    assert branch.points[-1].parameter == branch.range[1]


@pytest.mark.parametrize("make", [oscillator, driven], ids=["error", "torque"])
@pytest.mark.parametrize(("frequency", "near", "cycles", "stable"), MOTIONS)
def test_state_and_multipliers(make: Any, frequency: str, near: tuple[float, float], cycles: int, stable: bool) -> None:
    shift = 0.05 if make is oscillator else 0.0
    want, multipliers = exact(frequency, near, cycles)
    start = {"angle": [want[0] + shift + 1e-4], "velocity": [want[1] - 1e-4]}
    orbit = gr.periodic(make(float(frequency)), cycles, start)
    np.testing.assert_allclose(state_of(orbit, shift), want, rtol=0, atol=1e-10)
    np.testing.assert_allclose(orbit.multipliers, multipliers, rtol=0, atol=1e-8)
    assert orbit.stable is stable


@pytest.mark.parametrize("frequency", ["0.45", "0.75", "1.5"])
def test_the_motion_in_contact(frequency: str) -> None:
    with mp.workdps(oracle.DIGITS):
        state = oracle.contact_state(mpf(frequency))
        multipliers = oracle.multipliers(mpf(frequency), state)
    orbit = gr.periodic(oscillator(float(frequency)), 1, {"angle": [1.15], "velocity": [0.0]})
    np.testing.assert_allclose(state_of(orbit, 0.05), [float(x) for x in state], rtol=0, atol=1e-10)
    np.testing.assert_allclose(orbit.multipliers, multipliers, rtol=0, atol=1e-8)


@pytest.mark.parametrize("ends", [(LOWEST, HIGHEST), (HIGHEST, LOWEST)], ids=["up", "down"])
@pytest.mark.parametrize(
    "step_limit", [None, *(pytest.param(limit, marks=pytest.mark.long) for limit in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5))]
)
def test_folds_and_grazings(step_limit: float | None, ends: tuple[float, float]) -> None:
    check_events(gr.continuation(oscillator(ends[0]), PATH, ends, step_limit=step_limit))


@pytest.mark.parametrize(
    "ends",
    [
        *(pytest.param(ends, marks=pytest.mark.long) for ends in ((0.5, 1.55), (0.72, 1.0), (1.5, 0.75))),
        (0.815, 0.7),
        (0.8, 0.83),
    ],
)
def test_within_another_range_the_same_events(ends: tuple[float, float]) -> None:
    """A branch that begins between the folds follows the motion in contact; it may end before a fold or a grazing."""
    start = {"angle": [1.15], "velocity": [0.0]} if ends[0] < 0.9 else None
    branch = gr.continuation(oscillator(ends[0]), PATH, ends, start=start)
    for value in changes(branch)["value"]:
        assert np.abs(np.array(events()) - value).min() < 1e-8
    low, high = sorted(ends)
    assert all(low <= point.parameter <= high for point in branch.points)


ORDERS = list(permutations((gap(), beyond_reach("low", 10.0), beyond_reach("far", 40.0))))
FIVE = (gap(), *(beyond_reach(f"far-{clearance:g}", clearance) for clearance in (40.0, 20.0, 5.0, 3.0)))


@pytest.mark.parametrize(
    "couplings",
    [
        ORDERS[-1],
        *(
            pytest.param(couplings, marks=pytest.mark.long)
            for couplings in (*[order[:2] for order in ORDERS if gap() in order[:2]], *ORDERS[:-1])
        ),
    ],
)
def test_with_elements_that_never_touch_in_any_order(couplings: tuple[dict[str, Any], ...]) -> None:
    branch = gr.continuation(oscillator(LOWEST, *couplings), PATH, (LOWEST, HIGHEST))
    check_events(branch)
    assert changes(branch)["clearance"].tolist() == ["gap", "", "", "gap"]


@pytest.mark.long
@pytest.mark.parametrize("couplings", [FIVE, FIVE[::-1]], ids=["first", "last"])
def test_with_five_clearances(couplings: tuple[dict[str, Any], ...]) -> None:
    check_events(gr.continuation(oscillator(LOWEST, *couplings), PATH, (LOWEST, HIGHEST)))


TWO = (gap("one", 0.3, 0.08), gap("two", 0.7, 0.02))
SHARED = (*(gap(f"share-{i}", share, 0.02) for i, share in enumerate((0.2, 0.3, 0.1, 0.25, 0.15))),)


@pytest.mark.parametrize(
    ("couplings", "ends"),
    [
        (TWO, (LOWEST, HIGHEST)),
        *(
            pytest.param(*case, marks=pytest.mark.long)
            for case in ((TWO, (HIGHEST, LOWEST)), (TWO[::-1], (LOWEST, HIGHEST)), (TWO[::-1], (HIGHEST, LOWEST)))
        ),
    ],
)
def test_in_two_parallel_halves(couplings: tuple[dict[str, Any], ...], ends: tuple[float, float]) -> None:
    """The corners of both are met at the same instants; what this is called: see the next test."""
    branch = gr.continuation(oscillator(ends[0], *couplings), PATH, ends)
    check_events(branch, is_grazing_named=False)


@pytest.mark.long
@pytest.mark.parametrize("couplings", [SHARED, SHARED[::-1]])
def test_in_five_parallel_parts(couplings: tuple[dict[str, Any], ...]) -> None:
    branch = gr.continuation(oscillator(LOWEST, *couplings), PATH, (LOWEST, HIGHEST))
    check_events(branch, is_grazing_named=False)


def test_what_touches_two_corners_at_once_grazes() -> None:
    branch = gr.continuation(oscillator(LOWEST, *TWO), PATH, (LOWEST, 0.825))
    assert changes(branch)["kind"].tolist() == ["grazing"]


def test_over_two_periods_a_grazing_is_a_grazing() -> None:
    branch = gr.continuation(oscillator(LOWEST), PATH, (LOWEST, 0.825), cycles=2)
    assert changes(branch)["kind"].tolist() == ["grazing"]


@pytest.mark.long
@pytest.mark.parametrize("ends", [(LOWEST, HIGHEST), (HIGHEST, LOWEST)], ids=["up", "down"])
def test_the_isolated_pair_of_two_periods(ends: tuple[float, float]) -> None:
    """Stable motion and saddle of 2 T meet in a fold; the branch of both hangs together with no other."""
    branch = gr.continuation(oscillator(ends[0]), PATH, ends, cycles=2, isolated=True)
    assert len(branch.curves) == 2
    table = changes(branch)
    alone = table[table["branch"] == 1]
    with mp.workdps(oracle.DIGITS):
        fold = float(oracle.fold(mpf("1.3575"), (1.2187, 0.2325), 2))
    assert alone["kind"].tolist() == ["fold"]
    assert alone["value"].item() == pytest.approx(fold, abs=1e-8)
    pair = branch.curves[1].points
    assert pair[0].parameter == pair[-1].parameter == HIGHEST
    along = branch.data.isel(point=branch.data.branch == 1)
    assert 0 < int(along.stable.sum()) < along.sizes["point"]
    np.testing.assert_allclose(
        table["value"][table["branch"] == 0],
        events()[:: -1 if ends[0] > ends[1] else 1],
        rtol=0,
        atol=1e-8,
    )


@pytest.mark.parametrize("frequency", [pytest.param(1.36, marks=pytest.mark.long), 1.5])
def test_every_motion_of_two_periods(frequency: float) -> None:
    orbits = gr.periodic(oscillator(frequency), 2, every=True)
    assert sorted((orbit.cycles, orbit.stable) for orbit in orbits) == [(1, True), (2, False), (2, True)]
    assert not any(orbit.notes for orbit in orbits)


def check_every(frequency: float) -> None:
    """Each fixed point that the vector P(y) - y turns round is an orbit, and the other way round."""
    want = sorted(fixed_points(frequency))
    orbits = gr.periodic(oscillator(frequency), every=True)
    actual = sorted(
        (*state_of(orbit, 0.05), round(float(np.sign(np.prod(1.0 - orbit.multipliers).real)))) for orbit in orbits
    )
    assert len(actual) == len(want)
    np.testing.assert_allclose(actual, want, rtol=0, atol=2e-3)
    assert sum(sign for _, _, sign in actual) == 1


@pytest.mark.parametrize("frequency", [0.72, pytest.param(0.8, marks=pytest.mark.long)])
def test_every_motion_is_one_that_is_counted_by_turns(frequency: float) -> None:
    check_every(frequency)


@pytest.mark.long
@pytest.mark.parametrize("frequency", np.random.default_rng(7).uniform(LOWEST, HIGHEST, 30).round(4).tolist())
def test_every_motion_at_many_frequencies(frequency: float) -> None:
    check_every(frequency)


@pytest.mark.slow
def test_motions_that_repeat_sooner_are_among_those_of_more_periods() -> None:
    """Newton's method for three periods does not come to the motion of one, from any of its starts."""
    model = driven(1.4).with_({"torque.0.mean": 0.05, "torque.0.harmonics.0.amplitude": 1.0})
    once, thrice = (gr.periodic(model, cycles, every=True) for cycles in (1, 3))
    assert [orbit.cycles for orbit in once] == [1]
    assert [orbit.cycles for orbit in thrice] == [1, 3, 3, 3, 3]
    np.testing.assert_allclose(thrice[0].motion.start.y, once[0].motion.start.y, rtol=0, atol=1e-10)
    assert thrice[0].notes == ()  # the signs add up to 1
