"""TR of pure sines: the ratio of their amplitudes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gearrattle.quantities.transmissibility import Transmissibility
from tests.quantities.reading import evaluate, one, value
from tests.signals.handmade import layout, sine, still, trajectory

criterion = Transmissibility()


def test_ratio_of_sines() -> None:
    entries = evaluate(criterion, trajectory(accelerations=(sine(4.0), sine(1.0, 1.0, 0.7)), cycles=20, discard=10))
    assert value(entries, "loose", "TR rms") == pytest.approx(0.25, rel=1e-14)
    assert value(entries, "loose", "TR peak") == pytest.approx(0.25, rel=1e-3)
    assert value(entries, "driver", "TR rms") == value(entries, "driver", "TR peak") == 1.0
    assert not any(item.note for item in entries)


def test_mean_counts_in_rms_but_not_in_peak_to_peak() -> None:
    motion = trajectory(accelerations=(sine(4.0), sine(3.0, 2.0, mean=1.0)), cycles=20)
    entries = evaluate(criterion, motion)
    assert value(entries, "loose", "TR rms") == pytest.approx(math.sqrt((9 / 2 + 1) / 8), rel=1e-13)
    assert value(entries, "loose", "TR peak") == pytest.approx(0.75, rel=1e-14)


def test_only_the_last_eight_cycles_count() -> None:
    motion = trajectory(accelerations=(sine(1.0), sine(1.0)), cycles=20, discard=2)
    motion.acceleration[: 12 * 64, 1] *= 100.0
    assert value(evaluate(criterion, motion), "loose", "TR rms") == pytest.approx(1.0, rel=1e-14)
    motion.acceleration[: 12 * 64 + 17, 1] += 1.0
    assert value(evaluate(criterion, motion), "loose", "TR rms") > 1.01


def test_trapezoidal_rule_shares_the_bounds() -> None:
    motion = trajectory(cycles=8, samples=2)
    motion.acceleration[:, 0] = 1.0
    motion.acceleration[0, 1] = motion.acceleration[-1, 1] = 2.0
    expected = math.sqrt((0.5 * 4.0 + 0.5 * 4.0) / 16)
    assert value(evaluate(criterion, motion), "loose", "TR rms") == pytest.approx(expected, rel=1e-14)


def test_reference_is_the_layouts() -> None:
    motion = trajectory(layout(reference=1), accelerations=(sine(4.0), sine(1.0)), cycles=8)
    entry = one(evaluate(criterion, motion), "driver", "TR rms")
    assert entry.value == pytest.approx(4.0, rel=1e-14)
    assert entry.formula == "rms(theta_i'') / rms(theta_loose''), last 8 T"


@pytest.mark.parametrize(
    ("cycles", "discard", "words"),
    [(5, 0, "5 cycles remain"), (10, 9, "1 cycle remains")],
)
def test_fewer_cycles_are_noted(cycles: int, discard: int, words: str) -> None:
    motion = trajectory(accelerations=(sine(4.0), sine(1.0)), cycles=cycles, discard=discard)
    entry = one(evaluate(criterion, motion), "loose", "TR rms")
    assert entry.value == pytest.approx(0.25, rel=1e-13)
    assert words in entry.note


def test_reference_at_rest_gives_no_ratio_and_says_so() -> None:
    entries = evaluate(criterion, trajectory(accelerations=(still, sine(1.0)), cycles=8))
    assert all(math.isnan(float(item.value)) for item in entries)
    assert {item.note for item in entries} == {
        "TR rms: driver shows no acceleration to refer to",
        "TR peak: driver shows no acceleration to refer to",
    }


def test_scale_of_the_motion_does_not_matter() -> None:
    small, large = (
        evaluate(criterion, trajectory(accelerations=(sine(4.0 * s), sine(s, 3.0)), cycles=8)) for s in (1e-180, 1e180)
    )
    assert np.array([item.value for item in small]) == pytest.approx(
        np.array([item.value for item in large]), rel=1e-12
    )
