"""The dense check can fail: every way of falsifying a log or a sample is reported, and by the statement it breaks."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from gearrattle.engine.kernels.variant_arrays import Crossings
from gearrattle.engine.solvers import Motion
from tests.dense.case import Case, Element, run
from tests.dense.families import seeded
from tests.dense.grazing import MAKERS
from tests.dense.judge import check

SEEDS = range(2)
MOST_TRIED = 4
"""Crossings falsified a case, spread over its log."""
families = pytest.mark.parametrize(
    "family", ["chain", "loop", "undamped", "flight", "stages", "one-sided", "error", "resonance", "stiff"]
)
VISIBLE = 1e-9
"""Of the corner: how far a falsified crossing must lie from it to be demanded; what is allowed is some 1e-12."""


@cache
def cases(family: str) -> tuple[tuple[Case, Motion], ...]:
    """Cases of a family and their motions, sound to begin with, with two crossings at least."""
    made = []
    for seed in SEEDS:
        case = seeded(family, seed, MAKERS[family])
        motion = run(case)
        if len(motion.crossings.time) > 1 and np.abs([case.laws[k].corners[0] for k in case.clearances]).min() > 0:
            assert not check(case, motion).faults
            made.append((case, motion))
    assert made
    return tuple(made)


def kinds(case: Case, motion: Motion) -> set[str]:
    """What kinds of fault are found."""
    return {fault.split(":")[0] for fault in check(case, motion).faults}


def select(log: Crossings, index) -> Crossings:
    """The crossings of an index, in its order."""
    return Crossings(*(getattr(log, name)[index] for name in Crossings._fields))


def inserted(log: Crossings, at: int, **values) -> Crossings:
    """The log with one crossing more before number ``at``; the force integral is that of its neighbour."""
    values.setdefault("force_integral", 0.0)
    return Crossings(*(np.insert(getattr(log, name), at, values[name]) for name in Crossings._fields))


def some(log: Crossings) -> list[int]:
    """A few crossings, the first and the last among them."""
    return sorted({int(e) for e in np.linspace(0, len(log.time) - 1, MOST_TRIED)})


def scale(case: Case, i: int) -> float:
    return float(np.abs(case.laws[case.clearances[i]].corners).max())


@families
def test_a_missing_visit_is_reported(family):
    """Out and back taken from the log, and from the stored pieces too, so that only the deflection can tell."""
    tried = 0
    for case, motion in cases(family):
        log = motion.crossings
        time = np.arange(len(motion.piece)) * case.period / case.samples
        for e in range(len(log.time) - 1):
            if tried >= MOST_TRIED:
                break
            later = [f for f in range(e + 1, len(log.time)) if log.clearance[f] == log.clearance[e]]
            if not later or log.to_piece[later[0]] != log.from_piece[e]:
                continue
            f, i = later[0], int(log.clearance[e])
            if abs(log.velocity[e]) * (log.time[f] - log.time[e]) / 8 < VISIBLE * scale(case, i):
                continue
            piece = motion.piece.copy()
            piece[(time >= log.time[e]) & (time <= log.time[f]), i] = log.from_piece[e]
            keep = np.delete(np.arange(len(log.time)), [e, f])
            assert "outside its region" in kinds(case, replace(motion, crossings=select(log, keep), piece=piece))
            tried += 1
    assert tried > 0


@families
def test_a_missing_last_crossing_is_reported(family):
    for case, motion in cases(family):
        log = motion.crossings
        if case.length * case.period - log.time[-1] < 1e-6 * case.period or abs(log.velocity[-1]) == 0:
            continue
        assert kinds(case, replace(motion, crossings=select(log, slice(0, -1)))) & {"outside its region", "piece"}


@families
@pytest.mark.parametrize("part", [1e-6, -1e-8])
def test_a_shifted_time_is_reported(family, part):
    tried = 0
    for case, motion in cases(family):
        log, shift = motion.crossings, part * case.period
        for e in some(log):
            time = log.time.copy()
            time[e] += shift
            unsorted = np.any(np.diff(time) < 0) or not 0 < time[e] < case.period * case.length
            if unsorted or abs(log.velocity[e] * shift) < 2 * VISIBLE * scale(case, int(log.clearance[e])):
                continue
            assert "on the corner" in kinds(case, replace(motion, crossings=log._replace(time=time)))
            tried += 1
    assert tried > 0


@families
def test_an_invented_visit_is_reported(family):
    """Out and back at one instant half way between two crossings."""
    for case, motion in cases(family):
        log = motion.crossings
        at = int(np.argmax(np.diff(log.time))) + 1
        i = int(log.clearance[at - 1])
        here, corners = int(log.to_piece[at - 1]), case.laws[case.clearances[i]].corners
        there = here + 1 if here < len(corners) else here - 1
        now = 0.5 * (log.time[at - 1] + log.time[at])
        back = inserted(log, at, time=now, clearance=i, from_piece=there, to_piece=here, velocity=0.0)
        both = inserted(back, at, time=now, clearance=i, from_piece=here, to_piece=there, velocity=0.0)
        assert "on the corner" in kinds(case, replace(motion, crossings=both))


@families
def test_a_crossing_undone_and_done_again_is_reported(family):
    """Three crossings at the instant of one: all are on the corner, but one goes against the motion."""
    for case, motion in cases(family):
        log = motion.crossings
        e = int(np.argmax(np.abs(log.velocity)))
        row = {name: getattr(log, name)[e] for name in Crossings._fields}
        back = {**row, "from_piece": row["to_piece"], "to_piece": row["from_piece"]}
        thrice = inserted(inserted(log, e + 1, **row), e + 1, **back)
        assert kinds(case, replace(motion, crossings=thrice)) == {"direction"}


@families
def test_a_wrong_velocity_piece_or_clearance_is_reported(family):
    for case, motion in cases(family):
        log = motion.crossings
        e = int(np.argmax(np.abs(log.velocity)))
        velocity = log.velocity.copy()
        after = log.to_piece.copy()
        clearance = log.clearance.copy()
        velocity[e] *= 1 + 1e-8
        after[e] = log.from_piece[e]
        assert kinds(case, replace(motion, crossings=log._replace(velocity=velocity))) == {"velocity"}
        assert "crossing" in kinds(case, replace(motion, crossings=log._replace(to_piece=after)))
        if len(case.clearances) > 1:
            clearance[e] = (clearance[e] + 1) % len(case.clearances)
            assert kinds(case, replace(motion, crossings=log._replace(clearance=clearance)))


@families
@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("deflection", "deflection"),
        ("velocity", "speed"),
        ("force", "stored force"),
        ("angle", "deflection"),
        ("acceleration", "stored acceleration"),
    ],
)
def test_a_falsified_sample_is_reported(family, name, kind):
    for case, motion in cases(family):
        values = getattr(motion, name).copy()
        j, i = np.unravel_index(np.argmax(np.abs(values[1:])), values[1:].shape)
        values[j + 1, i] *= 1 + 1e-7
        assert any(kind in actual for actual in kinds(case, replace(motion, **{name: values})))


@families
def test_a_falsified_piece_is_reported(family):
    for case, motion in cases(family):
        piece = motion.piece.copy()
        piece[len(piece) // 2, 0] += 1 if piece[len(piece) // 2, 0] == 0 else -1
        assert kinds(case, replace(motion, piece=piece)) & {"piece"}


@families
@pytest.mark.parametrize("name", ["inertia", "rows", "stiffness", "period", "angle"])
def test_slightly_wrong_physics_is_reported(family, name):
    """The motion of another driveline, a hair beside: one part in 1e8."""
    for case, motion in cases(family):
        if name == "stiffness":
            stages = [
                [tuple((k * (1 + 1e-8), c, u) for k, c, u in side) for side in (e.drive, e.coast)]
                for e in case.elements
            ]
            other = replace(
                case, elements=tuple(Element(*s, e.preload) for s, e in zip(stages, case.elements, strict=True))
            )
        else:
            other = replace(case, **{name: getattr(case, name) * (1 + 1e-8)})
        assert kinds(other, motion)


def oscillator(corner: float) -> Case:
    """x'' + x + beyond the corner 2 (x - corner) = 0 from x = -1/2, v = 0.8: the largest x is sqrt(0.89)."""
    none, side = np.zeros((1, 0)), ((1.0, 0.0, corner), (3.0, 0.0, None))
    return Case(
        "oscillator",
        np.ones(1),
        np.zeros(1),
        np.ones((1, 1)),
        (Element(side, side),),
        6.0,
        np.zeros(0),
        np.zeros(1),
        none,
        none,
        none,
        none,
        np.array([-0.5]),
        np.array([0.8]),
        1,
        6,
    )


@pytest.mark.parametrize("part", [1e-3, 1e-6, 1e-9, 1e-10, 1e-11])
def test_the_smallest_missing_visit_that_is_reported(part):
    """Judge a motion that knows of no corner against corners a part below and above its largest deflection."""
    ignorant = run(oscillator(5.0))
    peak = float(np.sqrt(0.89))
    assert kinds(oscillator(peak * (1 - part)), ignorant) == {"outside its region"}
    assert kinds(oscillator(peak * (1 + part)), ignorant) == set()
    (first, *_) = check(oscillator(peak * (1 - part)), ignorant).faults
    assert float(first.split("off by ")[1].split(",")[0]) == pytest.approx(peak * part, rel=1e-2)
