"""Equilibria of closed loops, held against a solution in 50 digits of the pieces found and of what is at rest there.

The potential is convex: an equilibrium of the pieces that lies inside their corners is the equilibrium.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from mpmath import diag, lu_solve, matrix, mp, mpf

from gearrattle.engine.system.equilibrium import PositionAtRest, Runaway, equilibrium
from gearrattle.engine.system.law import PiecewiseLaw, Stage, staged
from gearrattle.engine.system.piecewise import PiecewiseSystem
from tests.engine.system.drivelines import clearance, inputs, linear

PROMISED = 2.3e-16
"""Error of the angles, relative to them and to the condition of the stiffness."""
ROUNDED = 1e-15
"""The same where the condition is a few: four sums, each rounded."""
SPREADS = (1e4, 1e6, 1e8, 1e10)
"""Largest over smallest stiffness."""


def system_of(
    rng: np.random.Generator, rows: np.ndarray, laws: list[PiecewiseLaw], mean: np.ndarray
) -> PiecewiseSystem:
    size = len(mean)
    inertia = 10.0 ** rng.uniform(-4, 0, size)
    return PiecewiseSystem(inertia, np.zeros(size), rows, tuple(laws), inputs(size, len(rows), mean=mean))


def four_bodies(rng: np.random.Generator, spread: float, with_gaps: bool) -> PiecewiseSystem:
    """Return four bodies in a ring, often with a chord, elements in any order; without gaps every one is linear."""
    edges = [(0, 1), (1, 2), (2, 3), (3, 0)] + [(0, 2)] * int(rng.integers(2))
    radii = 10.0 ** rng.uniform(-1.5, -0.5, 4) if rng.integers(2) else np.ones(4)
    rows = np.zeros((len(edges), 4))
    for row, (a, b) in zip(rows, rng.permutation(edges), strict=True):
        row[a], row[b] = radii[a], -radii[b]
    laws = []
    for stiffness in 100.0 * 10.0 ** rng.uniform(0, np.log10(spread), len(edges)):
        gap, form = 1e-3 * 10.0 ** rng.uniform(-1, 1), rng.random() if with_gaps else 0.0
        soft = [Stage(0.1 * stiffness, 0.0, gap), Stage(stiffness, 0.0, None)]
        with_gap = clearance(stiffness, 0.0, gap, float(rng.choice([0.0, 1e-3]))) if form < 0.8 else staged(soft, soft)
        laws.append(linear(stiffness) if form < 0.4 else with_gap)
    return system_of(rng, rows, laws, rng.normal(size=4) * 10.0 ** rng.uniform(0, 3))


def gearbox(rng: np.random.Generator, with_gaps: bool) -> PiecewiseSystem:
    """Return input gear, two lay shafts of two gears each, output gear: the power takes two ways."""
    radii = rng.uniform(0.02, 0.09, 4)
    ways = [(0, 1, radii[0], radii[1]), (0, 2, radii[0], radii[1]), (1, 3, 1.0, 1.0), (2, 4, 1.0, 1.0)]
    ways += [(3, 5, radii[2], radii[3]), (4, 5, radii[2], radii[3])]
    rows, laws = np.zeros((6, 6)), []
    for row, (a, b, ra, rb) in zip(rows, ways, strict=True):
        row[a], row[b] = ra, -rb
        mesh = ra < 1.0
        stiffness = 10.0 ** (rng.uniform(7.5, 9.0) if mesh else rng.uniform(3.0, 6.0))
        has_gap = mesh and with_gaps
        laws.append(clearance(stiffness, 0.0, 10.0 ** rng.uniform(-5, -4)) if has_gap else linear(stiffness))
    mean = -(10.0 ** rng.uniform(-2, 0.5, 6))
    mean[0] = 10.0 ** rng.uniform(0, 3)
    mean[5] = -mean[0] * radii[1] / radii[0] * radii[3] / radii[2] * rng.uniform(0.9, 1.1)
    return system_of(rng, rows, laws, mean)


@dataclass(frozen=True)
class Solved:
    """The equilibrium of the pieces: angles, whether they lie inside the pieces, condition of the stiffness."""

    angle: np.ndarray
    is_inside: bool
    condition: float


def solved(system: PiecewiseSystem, rest: PositionAtRest) -> Solved:
    with mp.workdps(50):
        rows, held = matrix(system.rows.tolist()), system.size - 1
        slopes = [mpf(float(law.stiffness[p])) for law, p in zip(system.laws, rest.pieces, strict=True)]
        offsets = matrix([float(law.offset[p]) for law, p in zip(system.laws, rest.pieces, strict=True)])
        rigid = matrix([1 / mpf(float(np.abs(system.rows[:, i]).max())) for i in range(system.size)])
        for k in range(len(system.laws)):  # gears of a shaft have radii of their own: go from element to element
            a, b = np.flatnonzero(system.rows[k])
            rigid[int(b)] = -rigid[int(a)] * rows[k, int(a)] / rows[k, int(b)]
        mean, inertia = matrix(system.inputs.mean.tolist()), diag([mpf(float(j)) for j in system.inertia])
        acceleration = (rigid.T * mean)[0] / (rigid.T * inertia * rigid)[0]
        load = mean - inertia * rigid * acceleration - rows.T * offsets
        stiffness = (rows.T * diag(slopes) * rows)[:held, :held]
        angle = [*lu_solve(stiffness, load[:held]), mpf(0)]
        delta = rows * matrix(angle)
        bounds = [law.bounds(p) for law, p in zip(system.laws, rest.pieces, strict=True)]
        slack = [mpf(1e-9) * sum(abs(rows[k, i] * angle[i]) for i in range(system.size)) for k in range(len(bounds))]
        inside = all(low - s <= d <= high + s for (low, high), d, s in zip(bounds, delta, slack, strict=True))
        condition = float(np.linalg.cond(np.array(stiffness.tolist(), dtype=float)))
        return Solved(np.array([float(x) for x in angle]), inside, condition)


def check(system: PiecewiseSystem) -> bool:
    """Check one equilibrium; whether it could be told: a gap that carries nothing leaves angles to choice."""
    rest = equilibrium(system)
    free = [law.stiffness[p] == 0.0 for law, p in zip(system.laws, rest.pieces, strict=True)]
    if rest.middled or np.linalg.matrix_rank(system.rows[~np.array(free)]) < system.size - 1:
        return False
    want = solved(system, rest)
    assert want.is_inside
    error = np.linalg.norm(rest.angle - want.angle) / np.linalg.norm(want.angle)
    assert error <= max(PROMISED * want.condition, ROUNDED)
    return True


@pytest.mark.parametrize("spread", SPREADS)
def test_a_linear_loop_is_solved_to_rounding_times_its_condition(spread: float) -> None:
    assert all(check(four_bodies(np.random.default_rng(seed), spread, with_gaps=False)) for seed in range(40))


@pytest.mark.parametrize("spread", SPREADS)
def test_a_loop_with_gaps_rests_inside_the_pieces_named(spread: float) -> None:
    assert sum(check(four_bodies(np.random.default_rng(seed), spread, with_gaps=True)) for seed in range(40)) > 30


@pytest.mark.parametrize("with_gaps", [False, True])
def test_two_lay_shafts_share_the_load(with_gaps: bool) -> None:
    assert sum(check(gearbox(np.random.default_rng(seed), with_gaps)) for seed in range(40)) > 20


def test_a_loop_that_carries_no_more_is_still_a_runaway() -> None:
    ends = [Stage(10.0, 0.0, 0.5), Stage(0.0, 0.0, None)]
    weak = staged(ends, ends)
    rows = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0], [1.0, 0.0, -1.0]])
    laws = [linear(1e8), weak, weak]
    assert check(system_of(np.random.default_rng(0), rows, laws, np.array([9.0, 0.0, -9.0])))
    with pytest.raises(Runaway):
        equilibrium(system_of(np.random.default_rng(0), rows, laws, np.array([12.0, 0.0, -12.0])))


@pytest.mark.long
@pytest.mark.parametrize("spread", [*SPREADS, 1e12])
@pytest.mark.parametrize("with_gaps", [False, True])
def test_five_hundred_loops(spread: float, with_gaps: bool) -> None:
    reported = [check(four_bodies(np.random.default_rng(1000 + seed), spread, with_gaps)) for seed in range(500)]
    assert sum(reported) > 350


@pytest.mark.long
@pytest.mark.parametrize("with_gaps", [False, True])
def test_five_hundred_gearboxes(with_gaps: bool) -> None:
    assert sum(check(gearbox(np.random.default_rng(1000 + seed), with_gaps)) for seed in range(500)) > 250
