"""Sums over crossings: the compiled loop against NumPy, and the law that chunks of any size give the whole's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.errors import GearRattleError
from gearrattle.signals import add_crossings, by_parts, centre, steady
from gearrattle.signals.crossing_sums import Sums, contacts_of, sides_of
from gearrattle.trajectory import Layout, Trajectory
from tests.architecture.places import EXAMPLES
from tests.laws.test_sideways import driven
from tests.quantities.test_criteria_chunks import chunks
from tests.signals import numpy_sums
from tests.signals.handmade import Row, chain, layout, staged, trajectory, two_gaps

PLATES = {
    "gap": layout(),
    "two gaps": two_gaps(),
    "stages": staged([-2.0, -1.0, 1.0, 2.0], -2, [9.0, 4.0, 1.0, 4.0, 9.0]),
    "corner at zero": staged([-2.0, 0.0, 1.0], -2, [8.0, 2.0, 1.0, 9.0]),
    "gap above zero": staged([0.0, 1.0], -1, [5.0, 0.0, 7.0]),
}
ROUNDED = ("lost", "kept", "held")
"""Added up pairwise by NumPy."""
CYCLES = 12


def at_random(plate: Layout, seed: int, crossings: int = 60) -> Trajectory:
    """A motion of twelve cycles whose every clearance wanders through its regions."""
    rng = np.random.default_rng(seed)
    rows = list[Row]()
    initial = []
    for k, corners in enumerate(plate.corners):
        first = int(plate.region_of_first_piece[k])
        region = int(rng.integers(first, first + corners.size + 1))
        initial.append(region)
        for time in np.sort(rng.uniform(0.01, CYCLES - 0.01, crossings)).tolist():
            ways = [r for r in (region - 1, region + 1) if first <= r <= first + corners.size]
            to = int(rng.choice(ways))
            rows.append((time, k, region, to, (to - region) * rng.uniform(0.1, 3.0), rng.normal()))
            region = to
    return trajectory(plate, sorted(rows), initial=initial, cycles=CYCLES, discard=3, samples=8, final=rng.normal())


def in_chunks(motion: Trajectory, ends: Sequence[int]) -> Sums:
    sums = None
    for chunk in chunks(motion, ends):
        sums = add_crossings(sums, chunk, steady(chunk) if chunk.discard < chunk.cycles else None)
    assert sums is not None
    return sums


def same(have: Sums, want: Sums, rounded: Sequence[str]) -> None:
    assert set(have) == set(want)
    for name in want:
        if name in rounded:
            assert have[name] == pytest.approx(want[name], rel=1e-12, abs=1e-12, nan_ok=True), name
        else:
            assert np.array_equal(have[name], want[name], equal_nan=True), name


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("kind", PLATES)
def test_the_compiled_loop_gives_the_bits_of_numpy(kind: str, seed: int) -> None:
    motion = at_random(PLATES[kind], seed)
    window = steady(motion)
    have, want = add_crossings(None, motion, window), numpy_sums.sums_of(motion, window)
    opened = have["open"] > 0.0  # what else stands there is left from contacts that have ended
    for name in ("begun", "met", "since"):
        have = {**have, name: np.where(opened, have[name], 0.0)}
    same(have, want, ROUNDED)


@pytest.mark.parametrize("file", ["paper/case1_loaded.toml", "paper/case3.toml", "manual_transmission.toml"])
@pytest.mark.parametrize("algorithm", ["exact", "rkv"])
def test_motions_of_examples_have_the_sums_of_numpy(file: str, algorithm: str) -> None:
    model = gr.load(EXAMPLES / file)
    motion = gr.simulate(model, algorithm, cycles=6, discard=2, samples_per_cycle=32, audit=False).trajectory
    have, want = add_crossings(None, motion, steady(motion)), numpy_sums.sums_of(motion, steady(motion))
    assert want["count"].sum() > 0
    same(have, want, ROUNDED)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("kind", PLATES)
def test_chunks_of_any_size_give_the_sums_of_the_whole(kind: str, seed: int) -> None:
    """Counts and largest values to the bit, sums to rounding; what stands of contacts that have ended is not read."""
    motion, rng = at_random(PLATES[kind], seed), np.random.default_rng([7, seed])
    whole = add_crossings(None, motion, steady(motion))
    cuts = np.flatnonzero(rng.random(CYCLES - 1) < rng.choice([0.2, 0.5, 1.0])) + 1
    parts = in_chunks(motion, [*cuts.tolist(), CYCLES])
    opened = whole["open"] > 0.0
    for name in ("begun", "met", "since"):
        assert np.array_equal(parts[name][opened], whole[name][opened])
    kept = {name: whole[name] for name in whole if name not in ("begun", "met", "since")}
    same({name: parts[name] for name in kept}, kept, (*ROUNDED, "dwell", "speed", "square", "left", "push"))
    assert whole["count"].sum() >= 10


def test_at_least_one_contact_reaches_across_chunks() -> None:
    motion = at_random(PLATES["gap"], 0)
    first, *_ = chunks(motion, (5, 12))
    sums = add_crossings(None, first, steady(first))
    assert sums["open"].sum() == 1.0
    assert in_chunks(motion, (5, 12))["held"] == pytest.approx(add_crossings(None, motion, steady(motion))["held"])


def test_contacts_and_sides_are_those_known_by_hand() -> None:
    rows = [(0.5, 0, 0, 1, 2.0, 1.0), (0.75, 0, 1, 0, -1.0, 4.0), (1.5, 0, 0, -1, -4.0, 4.0), (3.0, 0, -1, 0, 3.0, 9.0)]
    motion = trajectory(rows=[*rows, (3.5, 0, 0, -1, -1.0, 9.0)], final=9.5)
    sums = add_crossings(None, motion, steady(motion))
    contacts, sides = contacts_of(sums, motion.layout, 0, motion.end), sides_of(sums, motion.layout, 0, 4.0)
    assert (contacts.whole, contacts.speeds, contacts.squares, contacts.cut) == (2, 11.0, 10.0, True)
    assert (contacts.kept, contacts.moving, contacts.time) == (1.25, 2, 2.25)
    assert sides.shares == {-1: 0.5, 0: 0.4375, 1: 0.0625}
    assert (sides.single, sides.double) == (2, 1)


def test_discarded_chunks_tell_the_flank_of_the_last_contact() -> None:
    motion = trajectory(rows=chain([0, 1, 0, -1, 0], [0.5, 0.6, 2.5, 2.6]), cycles=4, discard=2)
    for ends in ((4,), (1, 2, 3, 4), (2, 4)):
        sums = in_chunks(motion, ends)
        assert (sums["count"][0], sums["same"][0], sums["other"][0]) == (1.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ((2.5, 0, 1, 3, 1.0, 0.0), "from region 1 to 3, which is not its neighbour"),
        ((2.5, 0, 1, 2, 1.0, 0.0), "from region 1 to 2, which is not its neighbour"),
        ((2.5, 1, 0, 1, 1.0, 0.0), "there is no clearance 1"),
        ((2.5, -1, 0, 1, 1.0, 0.0), "there is no clearance -1"),
    ],
)
def test_crossings_that_cannot_be_are_refused(row: Row, message: str) -> None:
    motion = trajectory(rows=[*chain([0, 1], [0.5]), row])
    with pytest.raises(GearRattleError, match=message):
        add_crossings(None, motion, steady(motion))


def test_a_motion_that_begins_nowhere_is_refused() -> None:
    motion = replace(trajectory(), initial_region=np.array([2]))
    assert centre(motion.layout, 0) == {0}
    with pytest.raises(GearRattleError, match=r"begins in regions \[2\], which do not exist"):
        add_crossings(None, motion, steady(motion))


def ring(faces: int) -> Layout:
    """A gear whose bearing is a ring, after a mesh that has a gap."""
    return replace(assemble(driven(clearance=1e-5, faces=faces)).layout, period=1.0)


def merged(motion: Trajectory, name: str) -> tuple[list[tuple[float, int, float]], list[tuple[float, float]]]:
    """Crossings (time, region, speed) at which any face of a bearing is in contact or none, and (time, direction).

    From the regions alone, without the log's own: contact is looked up at every instant.
    """
    layout = motion.layout
    faces = [k for k, face in enumerate(layout.clearance_names) if face.rpartition("-")[0] == name]
    region = {k: int(motion.initial_region[k]) for k in faces}
    rows, directions = [], []
    log = motion.events
    for time, k, to, speed in zip(log.time, log.clearance, log.to_region, log.velocity, strict=True):
        if k not in faces:
            continue
        was = any(region.values())
        side = np.sign(region[k] or to)
        region[k] = int(to)
        if any(region.values()) != was:
            rows.append((float(time), int(not was), abs(float(speed))))
            directions.append((float(time), np.pi * (faces.index(k) / len(faces) + (side < 0))))
    return rows, directions


@pytest.mark.parametrize("faces", [4, 8, 16])
@pytest.mark.parametrize("seed", range(4))
def test_the_faces_of_a_ring_are_one_part(faces: int, seed: int) -> None:
    motion = at_random(ring(faces), seed, crossings=24 // faces)
    whole = by_parts(motion)
    sums = add_crossings(None, motion, steady(motion))
    window = steady(motion)
    with np.errstate(invalid="ignore"):
        expected = numpy_sums.sums_of(whole, window)
    for name in set(expected) - {"touched", "crossings", "sides", *ROUNDED}:
        np.testing.assert_allclose(sums[name], expected[name], rtol=1e-12, atol=1e-12, err_msg=name)
    names = whole.layout.clearance_names
    assert names == ("gear-drive", "gear-coast", "at_pinion", "at_wheel")
    for name in ("at_pinion", "at_wheel"):
        p = names.index(name)
        rows, directions = merged(motion, name)
        own = whole.events.clearance == p
        log = zip(whole.events.time[own], whole.events.to_region[own], np.abs(whole.events.velocity[own]), strict=True)
        assert list(log) == rows
        inside = [angle for time, angle in directions if window.contains(np.array(time))]
        apart = max((np.cos(one - other) for one in inside for other in inside), default=None)
        least = min((np.cos(one - other) for one in inside for other in inside), default=1.0)
        assert (sums["sides"][p, 0] > 0.0) == (apart is not None)
        assert (sums["sides"][p, 1] > 0.0) == (least < -1e-9)


@pytest.mark.parametrize("ends", [(3, 7, 12), (1, 2, 5, 6, 11, 12)])
@pytest.mark.parametrize("seed", range(3))
def test_chunks_of_a_ring_add_up(seed: int, ends: tuple[int, ...]) -> None:
    motion = at_random(ring(8), seed, crossings=20)
    whole = add_crossings(None, motion, steady(motion))
    parts = in_chunks(motion, ends)
    opened = whole["open"] > 0.0
    for name in ("begun", "met", "since"):
        np.testing.assert_array_equal(parts[name][opened], whole[name][opened])
    kept = {name: whole[name] for name in whole if name not in ("begun", "met", "since")}
    same({name: parts[name] for name in kept}, kept, (*ROUNDED, "dwell", "speed", "square", "left", "push"))
