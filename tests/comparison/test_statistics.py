"""Statistics of motions drawn from the same and from different random processes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.comparison import compare_coherence, compare_statistics, portrait
from gearrattle.comparison.nearby_motions import AWAY, MANY, exact_portraits, nearby
from gearrattle.errors import ModelError
from tests import synthetic
from tests.comparison.cases import case
from tests.signals import handmade

CYCLES = 80
EQUAL = "equal"


def drawn(seed, *, gain=1.0, colour=0.0, rate=0.5, push=1.0, cycles=CYCLES, wander=0.0):
    """Noise for accelerations and deflection, impacts with this probability a half-cycle, normal impulses."""
    rng = np.random.default_rng(seed)
    regions = [0]
    times = []
    integral = [0.0]
    for half in range(2 * cycles):
        if rng.random() < rate:
            times += [0.5 * half + 0.1 + 0.1 * rng.random(), 0.5 * half + 0.3]
            regions += [1, 0]
            integral += [integral[-1], integral[-1] + push * (5.0 + rng.normal())]
    rows = [(*row[:5], total) for row, total in zip(handmade.chain(regions, times), integral[1:], strict=True)]
    noise = rng.normal(size=(cycles * 64 + 1, 3))
    noise[1:] += colour * noise[:-1]
    level = np.repeat(np.exp(rng.normal(0.0, wander, cycles // 16 + 1)), 16 * 64)[: len(noise), None]
    motion = handmade.trajectory(rows=rows, cycles=cycles, final=integral[-1])
    return replace(motion, acceleration=gain * level * noise[:, :2], deflection=gain * noise[:, 2:])


def peers(first, **changes):
    return [portrait(drawn(seed, **changes)) for seed in range(first, first + MANY)]


@pytest.fixture(scope="module")
def others():
    return peers(100)


@pytest.mark.parametrize("wander", [0.0, 0.7])
def test_another_draw_of_the_process_differs_as_often_as_chance_has_it_however_slowly_levels_wander(wander):
    actual = []
    for group in range(4):
        rest = peers(1000 * (group + 1), wander=wander)
        actual += [compare_statistics(portrait(drawn(50 * group + i, wander=wander)), rest) for i in range(15)]
    different, expected = sum(entry.different for entry in actual), sum(entry.different_by_chance for entry in actual)
    assert expected == pytest.approx(60 * 11 / 22)
    assert 0.3 * expected < different < 1.9 * expected


def test_every_kind_of_difference_is_found_and_others_only_by_chance(others):
    kinds = [
        ({"gain": 1.1}, {"rms deflection", "rms acceleration", "PSD distance", "PSD outside bands"}),
        ({"colour": 0.8, "gain": 1 / np.sqrt(1.64)}, {"PSD distance", "PSD outside bands"}),
        ({"rate": 0.8}, {"impact rate"}),
        ({"push": 1.3}, {"contact impulse distribution"}),
    ]
    chance = 0
    for changes, expected in kinds:
        for seed in range(7, 12):
            actual = compare_statistics(portrait(drawn(seed, **changes)), others)
            different = {item.quantity for item in actual.items if item.verdict == "different"}
            assert expected <= different, changes
            chance += len(different - expected)
    assert chance < 2 * 20 * 11 / 22


def test_values_are_those_put_in(others):
    actual = compare_statistics(portrait(drawn(3, gain=2.0, push=2.0)), others)
    assert actual.motions == MANY
    assert actual.of("rms acceleration", "loose").value == pytest.approx(2.0, rel=0.05)
    assert actual.of("PSD distance", "driver").value == pytest.approx(20 * np.log10(2.0), rel=0.1)
    assert actual.of("impact rate", "gear").reference == pytest.approx(1.0, abs=0.05)
    assert actual.of("contact impulse distribution", "gear").candidate == pytest.approx(10.0, rel=0.1)
    assert actual.of("contact impulse distribution", "gear").value > 0.95
    assert actual.of("PSD outside bands", "driver").value > 0.9
    assert actual.of("TR rms", "loose").value == pytest.approx(1.0, rel=0.1)
    level = actual.of("rms acceleration", "driver")
    assert level.low < 1.0 < level.high < level.value
    assert level.p_value == pytest.approx(1 / 22)


def test_fewer_than_twenty_others_decide_nothing(others):
    actual = compare_statistics(portrait(drawn(3, gain=2.0)), others[:19])
    assert {item.verdict for item in actual.items} == {"undecided"}
    assert compare_statistics(portrait(drawn(3, gain=2.0)), others[:20]).different > 3


def test_a_periodic_motion_may_differ_by_less_than_counts_but_not_by_more():
    reference = synthetic.trajectory(cycles=24)
    exact = [portrait(reference)] * MANY
    itself = compare_statistics(exact[0], exact).items
    assert {item.verdict for item in itself if item.quantity != "contact impulse distribution"} == {EQUAL}
    rounded = replace(
        reference, deflection=reference.deflection * (1 + 1e-6), acceleration=reference.acceleration * (1 + 1e-6)
    )
    assert compare_statistics(portrait(rounded), exact).different == 0
    louder = replace(reference, acceleration=reference.acceleration * 1.02)
    actual = compare_statistics(portrait(louder), exact)
    assert {item.quantity for item in actual.items if item.verdict == "different"} == {
        "rms acceleration",
        "PSD distance",
        "PSD outside bands",
    }


def test_cycles_before_the_start_do_not_count():
    values = drawn(9)
    values.acceleration[: 40 * 64] *= 10.0
    assert portrait(values).acceleration[0] > 5.0
    later = portrait(values, 39.5)
    assert (later.start, later.end, later.cycles) == (40.0, 80.0, 40)
    assert later.acceleration[0] == pytest.approx(1.0, abs=0.1)
    impacts = np.sum(values.events.to_region[values.events.time >= 40.0])
    assert later.rate[0] == pytest.approx(impacts / 40)
    with pytest.raises(ModelError, match="whole cycle must remain"):
        portrait(values, 79.5)
    with pytest.raises(ModelError, match="pointwise"):
        portrait(values, np.inf)


def test_levels_are_over_whole_cycles():
    """A sine plus its mean: rms^2 = m^2 + a^2 / 2, however few the samples."""
    t = np.arange(2 * 8 + 1) / 8
    noise = drawn(3, cycles=2)
    wave = 3.0 + 2.0 * np.sin(2.0 * np.pi * t)
    few = replace(
        noise,
        time=t,
        cycles=2,
        samples_per_cycle=8,
        acceleration=np.stack([wave, wave], axis=1),
        deflection=wave[:, None],
    )
    reported = portrait(few)
    assert reported.acceleration == pytest.approx(np.sqrt(9.0 + 2.0), rel=1e-12)
    assert reported.deflection == pytest.approx(np.sqrt(9.0 + 2.0), rel=1e-12)


def test_too_little_to_tell_is_undecided():
    few = [portrait(drawn(seed, cycles=2)) for seed in range(MANY)]
    actual = compare_statistics(portrait(drawn(99, cycles=2)), few)
    assert actual.of("contact impulse distribution", "gear").verdict == "undecided"
    assert actual.to_dict()["items"][0]["quantity"] == "rms deflection"
    silent = compare_statistics(portrait(drawn(12, gain=0.0, cycles=2)), few)
    assert silent.of("rms acceleration", "driver").verdict == "different"


def test_nearby_starts_are_as_far_away_as_asked():
    model = case("case3")
    motion = gr.simulate(model, cycles=1).trajectory
    half_gaps = np.array([np.abs(corners).max() for corners in motion.layout.corners])
    for direction in (None, np.array([1.0, -2.0, 0.5, 3.0])):
        away = gr.simulate(model, cycles=1, initial=nearby(motion, AWAY, direction)).trajectory
        moved = np.abs(away.deflection[0] - motion.deflection[0]) / half_gaps
        assert moved.max() == pytest.approx(AWAY, rel=1e-9)


HEAD = """
schema = 1
units = "SI"
inertia = [{ name = "a", J = 1.0, drag = 0.1 }, { name = "b", J = 2.0 }, { name = "c", J = 1.0 }]
excitation = { speed = 8.0 }
torque = [{ on = "a", harmonics = [{ order = 1, amplitude = 30.0 }] }]
coupling = [
"""
SPRINGS = """
  { name = "shaft", between = ["a", "b"], stiffness = 100.0, damping = 0.5 },
  { name = "far", between = ["b", "c"], stiffness = 100.0, damping = 0.5 },
]
"""
GROUNDED = '{ name = "stop", between = ["ground", "a"], stiffness = 100.0, clearance = 0.1 },'
ONE_SIDED = (
    '{ name = "seat", between = ["ground", "a"], stages = [{ stiffness = 100.0, damping = 1.0 }], '
    "coast_stages = [{ stiffness = 20.0, damping = 1.0 }] },"
)


@pytest.mark.parametrize("direction", [None, np.array([1.0, -2.0, 0.5])])
@pytest.mark.parametrize("clearance", [GROUNDED, ONE_SIDED, ""])
def test_nearby_starts_exist_with_ground_first_with_a_corner_at_zero_and_without_clearances(clearance, direction):
    model = gr.loads(HEAD + clearance + SPRINGS)
    motion = gr.simulate(model, cycles=2, samples_per_cycle=64).trajectory
    start = nearby(motion, AWAY, direction)
    shift = np.array(start["angle"]) - motion.angle[0]
    turned = motion.angle @ np.array([[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, -1.0]])  # of stop, shaft, far
    moved = np.abs(shift @ np.array([[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, -1.0]]))
    largest = np.abs(turned).max(axis=0)
    want = {GROUNDED: moved[0] / 0.1, ONE_SIDED: moved[0] / largest[0], "": (moved[1:] / largest[1:]).max()}[clearance]
    assert want == pytest.approx(AWAY, rel=1e-9)
    assert gr.simulate(model, cycles=1, initial=start).trajectory.angle[0] == pytest.approx(start["angle"])


def of_two(simulation, torques=""):
    """Two inertias and a clearance, light damping."""
    return gr.loads(f"""
    schema = 1
    units = "SI"
    inertia = [{{ name = "a", J = 1.0 }}, {{ name = "b", J = 2.0 }}]
    coupling = [{{ name = "s", between = ["a", "b"], stiffness = 100.0, damping = 2.0, clearance = 0.1 }}]
    excitation = {{ speed = 8.0 }}
    {torques}
    [simulation]
    {simulation}
    """)


COME_TO_REST = of_two("initial = { angle = [1.0, 0.0], velocity = [0.0, 0.0] }")
AT_REST = of_two('initial = "static"', 'torque = [{ on = "a", mean = 5.0 }, { on = "b", mean = -5.0 }]')


@pytest.mark.parametrize("model", [COME_TO_REST, AT_REST])
def test_what_is_left_at_rest_is_not_different(model):
    grid = {"cycles": 40, "discard": 10, "samples_per_cycle": 32}
    motion = gr.simulate(model, **grid).trajectory
    exact = exact_portraits(model, motion, grid, None)
    assert compare_statistics(portrait(motion), exact).different == 0
    for algorithm in ("rkv-events", "rk4"):
        step = 2e-3 if algorithm == "rk4" else None
        values = gr.simulate(model, algorithm=algorithm, step=step, **grid).trajectory
        assert compare_statistics(portrait(values), exact).different == 0
        rings = 1e-2 * np.abs(motion.acceleration).max() + 1e-2
        noise = rings * np.sin(2.0 * np.pi * 5.0 * values.time / values.layout.period)[:, None]
        ringing = replace(values, acceleration=values.acceleration + noise)
        actual = compare_statistics(portrait(ringing), exact)
        for quantity in ("rms acceleration", "PSD distance"):
            assert actual.of(quantity, "a").verdict == actual.of(quantity, "b").verdict == "different"


def test_nothing_that_could_differ_is_left_where_it_is():
    free = gr.loads('schema = 1\nunits = "SI"\ninertia = [{ name = "a", J = 1.0 }]\nexcitation = { speed = 8.0 }')
    motion = gr.simulate(free, cycles=2, samples_per_cycle=8).trajectory
    assert nearby(motion, AWAY) == nearby(motion, AWAY, np.ones(1)) == {"angle": [0.0], "velocity": [0.0]}


def test_exact_motions_are_told_from_wrong_ones_and_from_no_right_one():
    """Loaded case 3 wanders: by block means of one motion, right algorithms were once called different in ten items."""
    model, grid = case("case3_loaded"), {"cycles": 60, "discard": 30, "samples_per_cycle": 64}
    motion = gr.simulate(model, **grid).trajectory
    exact = exact_portraits(model, motion, grid, None)
    assert len(exact) == MANY
    right = gr.simulate(model, algorithm="rkv-events", tolerance=1e-9, **grid).trajectory
    assert compare_statistics(portrait(right), exact).different <= 4
    wrong = gr.simulate(model, algorithm="rkv", tolerance=1e-3, **grid).trajectory
    assert compare_statistics(portrait(wrong), exact).different >= 15


def test_portraits_end_with_the_budget():
    model = case("case1_loaded")
    grid = {"cycles": 4, "discard": 1, "samples_per_cycle": 32}
    shares = []
    motion = gr.simulate(model, **grid).trajectory
    assert len(exact_portraits(model, motion, grid, None, budget=0.0, progress=shares.append)) == 1
    assert shares == [1 / MANY]


def test_coherence_of_accelerations_goes_with_what_chance_gives():
    reference, values = drawn(14), drawn(15)
    same = compare_coherence(reference, reference)
    assert same["loose"].mean == pytest.approx(1.0)
    other = compare_coherence(values, reference, 10.0, ensembles=8, points=64)
    assert other["driver"].chance.bias == 0.125
    assert other["driver"].mean < 0.6
    assert list(other) == ["driver", "loose"]
