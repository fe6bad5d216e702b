"""Pulses of wheels that turn as a shaft may, with faults at known places: what is repaired, and what must not be."""

from __future__ import annotations

import itertools
import re

import numpy as np
import pytest

from gearrattle.signals.wheel_teeth import Gaps, PulseError, teeth_passed

TURN = 2.0 * np.pi
TIME = np.linspace(0.0, 4.0, 200_001)

WHEELS: tuple[tuple[int, Gaps], ...] = (
    (60, ()),
    (135, ()),
    (36, ()),
    (60, (2,)),
    (36, (1,)),
    (44, (2, 2)),
    (36, (2, 2, 2)),
)
LEFT_OUT = {(60, 1): {59, 60}, (36, 1): {36}, (44, 2): {1, 2, 23, 24}, (36, 3): {1, 2, 19, 20, 22, 23}}
"""Numbers of the teeth left out, by teeth of the full wheel and gaps."""


def _angle(motion: str) -> np.ndarray:
    """The angle of a shaft over ``TIME``."""
    whole = {
        "steady": TURN * 25.0 * TIME,
        "run-up": TURN * (10.0 * TIME + 7.5 * TIME**2),
        "from rest": TURN * 5.0 * TIME**2,
        "to rest": TURN * 5.0 * (16.0 - (4.0 - TIME) ** 2),
        "stop and start": TURN * 5.0 * (TIME - 2.0) * np.abs(TIME - 2.0),
        "clutch": TURN * (15.0 * TIME - 20.0 * 0.01 * np.log1p(np.exp((2.0 - TIME) / 0.01))),
        "vibration": TURN * 25.0 * TIME,
        "cranking": TURN * 4.0 * TIME,
    }[motion]
    swing = {"vibration": 0.1, "run-up": 0.03, "cranking": 0.28}.get(motion, 0.0)
    return whole + 0.5 * swing * np.sin(2.0 * whole)


def _pulses(
    motion: str, wheel: tuple[int, Gaps], jitter: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """When the teeth of an eccentric wheel pass, and their numbers; ``jitter`` in teeth."""
    angle = _angle(motion)
    teeth, gaps = wheel
    number = np.arange(int(np.ceil(angle[0] / TURN * teeth)) + 1, int(angle[-1] / TURN * teeth))
    number = number[~np.isin(number % teeth + 1, list(LEFT_OUT.get((teeth, len(gaps)), ())))]
    angles = TURN / teeth * (number + 0.1 * np.sin(TURN / teeth * number) + jitter * rng.standard_normal(number.size))
    return np.interp(np.sort(angles), angle, TIME), number.astype(float)


@pytest.mark.parametrize("wheel", WHEELS)
@pytest.mark.parametrize("motion", ["steady", "run-up", "vibration", "clutch"])
@pytest.mark.parametrize("jitter", [0.0, 0.03])
def test_faults_are_repaired_and_told(wheel: tuple[int, Gaps], motion: str, jitter: float) -> None:
    """Up to three lost and two too many, anywhere: all are told, and nothing else; no angle is off by half a tooth."""
    rng = np.random.default_rng([wheel[0], len(wheel[1]), len(motion), int(100 * jitter)])
    for _ in range(4):
        times, number = _pulses(motion, wheel, jitter, rng)
        places = rng.choice(np.arange(10, times.size - 10), 5, replace=False)
        lost = np.sort(places[:3])
        extra = times[places[3:]] + (times[places[3:] + 1] - times[places[3:]]) * rng.uniform(0.1, 0.9, 2)
        kept = np.delete(times, lost)
        result = teeth_passed(np.sort(np.append(kept, extra)), *wheel)
        off = np.interp(result.times, times, number) - result.passed
        assert np.abs(off - np.median(off)).max() < 0.5 if not wheel[1] else np.abs(off - np.median(off)).max() < 1.5
        at_teeth = np.isin(result.times, kept)
        known = number[np.searchsorted(times, result.times[at_teeth])] - result.passed[at_teeth]
        assert np.ptp(known) == 0.0
        near = 0.6 * np.diff(times).max()
        np.testing.assert_allclose(result.lost, times[lost], atol=near)
        np.testing.assert_allclose(result.extra, np.sort(extra), atol=near)


@pytest.mark.parametrize("wheel", WHEELS)
@pytest.mark.parametrize("motion", ["steady", "run-up", "from rest", "to rest", "vibration", "clutch", "cranking"])
@pytest.mark.parametrize("jitter", [0.0, 0.01, 0.05])
def test_what_a_shaft_does_is_not_repaired(wheel: tuple[int, Gaps], motion: str, jitter: float) -> None:
    """Starts, stops, a clutch, cranking by 28 % in order 2, an eccentric wheel, noise of a twentieth of a tooth."""
    rng = np.random.default_rng([wheel[0], len(wheel[1]), len(motion), int(100 * jitter)])
    times, number = _pulses(motion, wheel, jitter, rng)
    result = teeth_passed(times, *wheel)
    assert (result.lost.size, result.extra.size) == (0, 0)
    np.testing.assert_array_equal(result.times, times)
    np.testing.assert_array_equal(result.passed, number - number[0])


def test_a_stop_in_between_is_not_repaired_but_told() -> None:
    times, number = _pulses("stop and start", (60, ()), 0.0, np.random.default_rng(1))
    result = teeth_passed(times, 60)
    assert (result.lost.size, result.extra.size) == (0, 0)
    np.testing.assert_array_equal(result.passed, np.arange(number.size))
    assert np.abs(result.unsure - 2.0).min() < 0.1


@pytest.mark.parametrize("teeth", [1, 2, 3, 4, 6, 12])
def test_few_teeth(teeth: int) -> None:
    """Even turning: repaired. Cranking, where a tooth lasts as long as a stroke: nothing invented."""
    times = np.arange(60) * 0.01
    lost = teeth_passed(np.delete(times, 30), teeth)
    np.testing.assert_allclose(lost.lost, [0.3])
    np.testing.assert_allclose(lost.passed, np.delete(np.arange(60.0), 30))
    many = teeth_passed(np.sort(np.append(times, 0.303)), teeth)
    np.testing.assert_allclose(many.extra, [0.303])
    cranked = _angle("cranking")
    places = TURN / teeth * np.arange(1, int(cranked[-1] / TURN * teeth))
    assert teeth_passed(np.interp(places, cranked, TIME), teeth).lost.size == 0


@pytest.mark.parametrize("at", [1, 2, 5, -6, -3, -2])
def test_faults_near_the_ends(at: int) -> None:
    times = np.arange(400) / 1500.0
    result = teeth_passed(np.delete(times, at), 60)
    np.testing.assert_allclose(result.lost, [times[at]])
    many = teeth_passed(np.sort(np.append(times, times[at] + 0.3 / 1500.0)), 60)
    np.testing.assert_allclose(many.extra, [times[at] + 0.3 / 1500.0])


@pytest.mark.parametrize("lost", [2, 3, 4, 5])
def test_several_lost_in_a_row(lost: int) -> None:
    times = np.arange(400) / 1500.0
    result = teeth_passed(np.delete(times, np.arange(200, 200 + lost)), 60)
    np.testing.assert_allclose(result.lost, times[200 : 200 + lost])


def test_a_longer_failure_is_refused() -> None:
    times = np.arange(3000) / 1500.0
    with pytest.raises(PulseError, match=r"no pulse comes from 0[.]666 s to 0[.]674 s, 12 times as long"):
        teeth_passed(np.delete(times, np.arange(1000, 1011)), 60)


@pytest.mark.parametrize(("share", "refused"), [(0.015, False), (0.025, True)])
def test_beyond_a_share_pulses_are_refused(share: float, refused: bool) -> None:
    """The share that the manual states, 2 %."""
    times = np.arange(4000) / 1500.0
    rng = np.random.default_rng(2)
    lost = np.delete(times, 20 + np.sort(rng.choice(395, round(400 * share * 10), replace=False)) * 10)
    if refused:
        with pytest.raises(PulseError, match="100 pulses lost and 0 too many among 3900: more than 2%"):
            teeth_passed(lost, 60)
    else:
        assert teeth_passed(lost, 60).lost.size == 60


@pytest.mark.parametrize("wheel", [(60, (2,)), (36, (1,)), (44, (2, 2)), (36, (2, 2, 2))])
def test_a_wheel_with_gaps_is_not_taken_for_full(wheel: tuple[int, Gaps]) -> None:
    """The message names the wheel; two gaps half a turn apart are one gap on a wheel of half the teeth."""
    times, _ = _pulses("vibration", wheel, 0.01, np.random.default_rng(4))
    named = {(44, (2, 2)): "pulses_per_turn = 22, missing = 2", (36, (2, 2, 2)): r"= 36, missing = \[2, 2, 2\]"}
    with pytest.raises(PulseError) as caught:
        teeth_passed(times, wheel[0])

    assert re.search(named.get(wheel, f"pulses_per_turn = {wheel[0]}, missing = {wheel[1][0]}"), caught.value.remedy)


def test_every_order_of_three_gaps_is_recognised() -> None:
    """36-2-2-2 with its gaps at any places, six turns of it; in three of them a pulse is lost."""
    for one, two in itertools.combinations(range(3, 33, 3), 2):
        missing = {1, 2, one + 1, one + 2, two + 1, two + 2}
        number = np.array([tooth for tooth in range(36 * 6) if tooth % 36 + 1 not in missing])
        gone = [17, 47, 77]
        times = np.delete(number / 900.0, gone)
        for gaps in ((2, 2, 2), ((1, 2), (one + 1, one + 2), (two + 1, two + 2))):
            result = teeth_passed(times, 36, gaps)
            np.testing.assert_array_equal(result.passed, np.delete(number - number[0], gone))


def test_gaps_elsewhere_than_given_are_refused() -> None:
    times, _ = _pulses("steady", (36, (2, 2, 2)), 0.0, np.random.default_rng(4))
    assert teeth_passed(times, 36, ((1, 2), (19, 20), (22, 23))).lost.size == 0
    assert teeth_passed(times, 36, ((7, 8), (25, 26), (28, 29))).lost.size == 0  # the count may begin at any tooth
    with pytest.raises(PulseError, match="no whole turn of a wheel 36-2-2-2"):
        teeth_passed(times, 36, ((1, 2), (13, 14), (25, 26)))
