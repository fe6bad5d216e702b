"""Touches that come and go, or go and come back, within one step of a branch: closed forms of the linear motion."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

import gearrattle as gr
from tests.engine.periodic.test_grazing import DRAG, MEAN, oscillator
from tests.orbits.test_curve import paper_case

pytestmark = pytest.mark.compiled  # without compiled kernels every family is a general one

ABOVE, BELOW = 1e-5, 1e-7  # by which the response exceeds the stop, or does not reach it: within a small part of a step
WAVES = 720


def rigidity(w: float) -> complex:
    return 1.0 - w**2 + 1j * DRAG * w


def model_of(harmonics: list[dict[str, Any]]) -> gr.Model:
    torque = {"on": "body", "mean": MEAN, "harmonics": harmonics}
    return gr.Model.from_tables({**oscillator().to_tables(), "torque": [torque]})


def grazings_of(model: gr.Model, path: str, ends: tuple[float, float], limit: float | None) -> np.ndarray:
    branch = gr.continuation(model, path, ends, step_limit=limit)
    events = branch.events[branch.events["branch"] == 0]
    assert branch.notes == ()
    return events.loc[events["kind"] == "grazing", "value"].to_numpy()


@pytest.mark.parametrize("limit", [*(pytest.param(limit, marks=pytest.mark.long) for limit in (0.01, 0.05, 0.5)), None])
def test_a_touch_that_comes_and_goes_within_a_step_is_two_grazings(limit: float | None) -> None:
    """Over the frequency the response has its largest value a little above the stop."""
    least = minimize_scalar(lambda w: abs(rigidity(w)), bounds=(0.8, 1.2), method="bounded", options={"xatol": 1e-12})
    amplitude = (1.0 - MEAN) * (1.0 + ABOVE) * float(least.fun)
    ends = [
        brentq(lambda w: amplitude / abs(rigidity(w)) - (1.0 - MEAN), *span, xtol=1e-14)
        for span in ((0.9, least.x), (least.x, 1.1))
    ]
    assert 1e-4 < ends[1] - ends[0] < 1e-3
    model = model_of([{"order": 1, "amplitude": amplitude}])
    grazings = grazings_of(model, "excitation.frequency", (0.7, 1.3), limit)
    np.testing.assert_allclose(grazings, ends, rtol=0, atol=1e-8)


def highest(phase: float, amplitudes: tuple[float, float]) -> float:
    """The largest deflection of the linear motion at the frequency 0.8 with two harmonics."""
    waves = [
        a / rigidity(0.8 * n) * np.exp(1j * p) for n, (a, p) in enumerate(zip(amplitudes, (0.0, phase), strict=True), 1)
    ]

    def deflection(t: float) -> float:
        return float(MEAN + sum((wave * np.exp(1j * n * t)).imag for n, wave in enumerate(waves, 1)))

    times = np.linspace(0.0, 2.0 * np.pi, WAVES)
    top = times[np.argmax([deflection(t) for t in times])]
    near = (top - 0.01, top + 0.01)
    return -float(minimize_scalar(lambda t: -deflection(t), bounds=near, method="bounded", options={"xatol": 1e-9}).fun)


@pytest.mark.parametrize("limit", [pytest.param(0.01, marks=pytest.mark.long), None])
def test_a_touch_that_goes_and_comes_back_within_a_step_is_two_grazings(limit: float | None) -> None:
    """Over the phase of its second harmonic the largest deflection has its least value a little below the stop."""
    shape = (0.3, 0.06)
    least = minimize_scalar(lambda p: highest(p, shape), bounds=(0.0, 6.0), method="bounded", options={"xatol": 1e-9})
    factor = (1.0 - MEAN) * (1.0 - BELOW) / (float(least.fun) - MEAN)
    amplitudes = factor * shape[0], factor * shape[1]
    ends = [
        brentq(lambda p: highest(p, amplitudes) - 1.0, *span, xtol=1e-12)
        for span in ((least.x - 0.3, least.x), (least.x, least.x + 0.3))
    ]
    assert 1e-3 < ends[1] - ends[0] < 5e-3
    model = model_of([{"order": 1, "amplitude": amplitudes[0]}, {"order": 2, "amplitude": amplitudes[1]}])
    path = "torque.0.harmonics.1.phase"
    span = (float(least.x) - 0.6, float(least.x) + 0.7)
    grazings = grazings_of(model, path, span, limit)
    np.testing.assert_allclose(grazings, ends, rtol=0, atol=1e-7)


def test_with_every_step_limit_the_backlash_oscillator_has_the_same_grazings() -> None:
    model = gr.example("backlash_oscillator")
    counts = {limit: grazings_of(model, "excitation.speed", (0.3, 1.6), limit) for limit in (0.1, 0.5)}
    for grazings in counts.values():
        np.testing.assert_allclose(grazings, counts[0.1], rtol=0, atol=1e-8)


def test_rebounds_are_told_apart_where_all_of_them_shift() -> None:
    """Case 1 near 190.5 rad/s: over a step its rebounds move by more than from one of them to the next."""
    points = paper_case(300.0, 190.3).points
    shares = []
    for before, after in pairwise(points):
        turns = before.motion.turns
        assert turns is not None
        if before.parameter < 191.0 and before.touch is None:
            moved = np.abs(turns.time_slope).max() * (after.length - before.length)
            shares.append(moved / np.diff(np.unique(turns.time[turns.upward == 1])).min())
    assert max(shares) > 1.0
