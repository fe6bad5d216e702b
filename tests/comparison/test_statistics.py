"""Statistics of motions drawn from the same and from different random processes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gearrattle.comparison import compare_coherence, compare_statistics
from gearrattle.errors import ModelError
from tests import synthetic
from tests.signals import handmade

CYCLES = 80


def drawn(seed, *, gain=1.0, colour=0.0, rate=0.5, push=1.0, cycles=CYCLES):
    """Noise for accelerations and deflection, impacts with this probability a half-cycle, normal impulses."""
    rng = np.random.default_rng(seed)
    regions, times, integral = [0], [], [0.0]
    for half in range(2 * cycles):
        if rng.random() < rate:
            times += [0.5 * half + 0.1 + 0.1 * rng.random(), 0.5 * half + 0.3]
            regions += [1, 0]
            integral += [integral[-1], integral[-1] + push * (5.0 + rng.normal())]
    rows = [(*row[:5], total) for row, total in zip(handmade.chain(regions, times), integral[1:], strict=True)]
    noise = rng.normal(size=(cycles * 64 + 1, 3))
    noise[1:] += colour * noise[:-1]
    motion = handmade.trajectory(rows=rows, cycles=cycles, final=integral[-1])
    return replace(motion, acceleration=gain * noise[:, :2], deflection=gain * noise[:, 2:])


def test_two_draws_of_one_process_differ_about_as_often_as_chance_has_it():
    found = [compare_statistics(drawn(2 * i), drawn(2 * i + 1)) for i in range(40)]
    different = sum(each.different for each in found)
    expected = sum(each.different_by_chance for each in found)
    assert expected == pytest.approx(40 * 9 * 0.05)
    assert different < 2.0 * expected


def test_every_kind_of_difference_is_found_and_no_other():
    reference = drawn(100)
    kinds = {
        "gain": ({"gain": 1.1}, {"rms deflection", "rms acceleration", "PSD distance"}),
        "colour": ({"colour": 0.8, "gain": 1 / np.sqrt(1.64)}, {"PSD distance", "PSD outside bands"}),
        "rate": ({"rate": 0.85}, {"impact rate"}),
        "push": ({"push": 1.3}, {"impulse distribution"}),
    }
    for changes, expected in kinds.values():
        found = compare_statistics(drawn(7, **changes), reference)
        different = {item.quantity for item in found.items if item.verdict == "different"}
        assert expected <= different
        assert different - expected <= {"PSD outside bands"}


def test_values_are_those_put_in():
    found = compare_statistics(drawn(3, gain=2.0, push=2.0), drawn(4))
    assert found.of("rms acceleration", "loose").value == pytest.approx(2.0, rel=0.05)
    assert found.of("PSD distance", "driver").value == pytest.approx(20 * np.log10(2.0), rel=0.1)
    assert found.of("impact rate", "gear").reference == pytest.approx(1.0, abs=0.2)
    assert found.of("impulse distribution", "gear").given == pytest.approx(10.0, rel=0.1)
    assert found.of("impulse distribution", "gear").value > 0.95
    share = found.of("PSD outside bands", "driver")
    assert share.value > 0.5
    assert share.verdict == "different"


def test_a_motion_against_itself_is_the_same_in_everything():
    motion = drawn(5)
    found = compare_statistics(motion, motion)
    assert found.different == 0
    assert {item.verdict for item in found.items} == {"same within sampling error"}


def test_a_periodic_motion_may_differ_by_less_than_counts_but_not_by_more():
    reference = synthetic.trajectory(cycles=24)
    rounded = replace(
        reference, deflection=reference.deflection * (1 + 1e-6), acceleration=reference.acceleration * (1 + 1e-6)
    )
    assert compare_statistics(rounded, reference).different == 0
    louder = replace(reference, acceleration=reference.acceleration * 1.02)
    found = compare_statistics(louder, reference)
    assert {item.quantity for item in found.items if item.verdict == "different"} == {
        "rms acceleration",
        "PSD distance",
    }


def test_cycles_before_the_start_do_not_count():
    reference = drawn(8)
    given = drawn(9)
    given.acceleration[: 40 * 64] *= 10.0
    whole = compare_statistics(given, reference)
    assert whole.wandering == ("driver", "loose")
    assert whole.of("rms acceleration", "driver").verdict == "undecided"
    later = compare_statistics(given, reference, 39.5)
    assert (later.start, later.end, later.cycles) == (40.0, 80.0, 40)
    assert later.of("rms acceleration", "driver").value == pytest.approx(1.0, abs=0.1)
    impacts = np.sum(given.events.to_region[given.events.time >= 40.0])
    assert later.of("impact rate", "gear").given == pytest.approx(impacts / 40)
    with pytest.raises(ModelError, match="whole cycle must remain"):
        compare_statistics(given, reference, 79.5)
    with pytest.raises(ModelError, match="pointwise"):
        compare_statistics(given, reference, np.inf)


def test_levels_that_wander_slowly_are_not_called_different():
    motions = []
    for seed in (21, 22, 23, 24):
        motion, rng = drawn(seed), np.random.default_rng(seed)
        slow = np.repeat(np.exp(rng.normal(0.0, 0.7, CYCLES // 16)), 16 * 64)  # another level every sixteen cycles
        level = np.concatenate([slow, slow[-1:]])[:, None]
        motions.append(replace(motion, acceleration=motion.acceleration * level))
    for given, reference in zip(motions[1:], motions, strict=False):
        found = compare_statistics(given, reference)
        assert found.wandering == ("driver", "loose")
        assert not [i for i in found.items if i.verdict == "different" and i.subject in found.wandering]


def test_steady_levels_are_seldom_said_to_wander():
    found = [compare_statistics(drawn(2 * i), drawn(2 * i + 1)) for i in range(60)]
    assert sum(bool(each.wandering) for each in found) <= 12


def test_too_little_to_tell_is_undecided():
    found = compare_statistics(drawn(10, cycles=2), drawn(11, cycles=2))
    assert found.of("PSD distance", "driver").verdict == "undecided"
    assert found.of("impulse distribution", "gear").verdict == "undecided"
    assert found.to_dict()["items"][0]["quantity"] == "rms deflection"
    silent = compare_statistics(drawn(12, gain=0.0), drawn(13))
    assert silent.of("rms acceleration", "driver").verdict == "different"


def test_coherence_of_accelerations_goes_with_what_chance_gives():
    reference, given = drawn(14), drawn(15)
    same = compare_coherence(reference, reference)
    assert same["loose"].mean == pytest.approx(1.0)
    other = compare_coherence(given, reference, 10.0, ensembles=8, points=64)
    assert other["driver"].chance.bias == 0.125
    assert other["driver"].mean < 0.6
    assert list(other) == ["driver", "loose"]
