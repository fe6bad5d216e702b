"""The motion does not depend on how it is written down.

Deflections, velocities and crossings stay the same under a shift of time, other units, another order of the inertias,
swapped ends and mirrored loads; absolute angles of a free train too, where the start is given.
"""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pytest

from tests.laws.motion import crossings, mirror, negate, reorder, rescale, scale_of, shift_time, simulate, times
from tests.oracles.driveline import differ
from tests.oracles.random_drivelines import random_problem

TOLERANCE = 1e-9
TAME = [("chain", 0), ("tree", 1), ("loop", 2), ("mesh", 2), ("half-order", 1), ("free-flight", 2), ("two-trains", 3)]
"""Families and seeds in which a perturbation grows by less than a hundred (measured by the oracle)."""

tame = pytest.mark.parametrize(("family", "seed"), TAME)


def same(a, b, factor: float = 1.0) -> bool:
    return bool(np.max(np.abs(a * factor - b) / scale_of(b)) < TOLERANCE)


@tame
def test_a_shift_of_time(family, seed):
    problem = random_problem(family, seed)
    run = simulate(problem.model, problem.cycles)
    middle = len(run.data.time) // 3
    state = run.data.isel(time=middle)
    start = float(state.time)
    later = simulate(shift_time(problem.model, start, state["angle"].values, state["velocity"].values), problem.cycles)
    n = len(run.data.time) - middle
    for name in ("angle", "deflection", "velocity", "force", "element_torque"):
        assert same(later.data[name].values[:n], run.data[name].values[middle:])
    end = float(run.data.time[-1]) - start
    for clearance in run.data.clearance.values:
        before, after = times(run, clearance), times(later, clearance)
        keep = after <= end - 1e-9
        rest = (before > start) & (before <= start + end - 1e-9)
        assert np.allclose(after[keep], before[rest] - start, rtol=0, atol=1e-8)
        kept = [c for c, k in zip(crossings(later, clearance), keep, strict=True) if k]
        assert kept == [c for c, k in zip(crossings(run, clearance), rest, strict=True) if k]


@tame
@pytest.mark.parametrize(("angle", "time", "torque"), [(-3, -2, 2), (2, 1, -4)])
def test_other_units(family, seed, angle, time, torque):
    problem = random_problem(family, seed)
    run = simulate(problem.model, problem.cycles)
    other = simulate(rescale(problem.model, angle, time, torque), problem.cycles)
    assert same(other.data["deflection"].values, run.data["deflection"].values, 10.0**-angle)
    assert same(other.data["angle"].values, run.data["angle"].values, 10.0**-angle)
    assert same(other.data["velocity"].values, run.data["velocity"].values, 10.0 ** (time - angle))
    assert same(other.data["force"].values, run.data["force"].values, 10.0**-torque)
    for clearance in run.data.clearance.values:
        assert crossings(other, clearance) == crossings(run, clearance)
        assert np.allclose(times(other, clearance) * 10.0**-time, times(run, clearance), rtol=0, atol=1e-8)


@tame
def test_another_order_of_the_inertias(family, seed):
    problem = random_problem(family, seed)
    run = simulate(problem.model, problem.cycles)
    order = list(range(len(problem.model.bodies)))
    random.Random(seed).shuffle(order)
    order = order if order != sorted(order) else order[::-1]
    other = simulate(reorder(problem.model, order), problem.cycles)
    assert list(other.data.inertia.values) == [problem.model.bodies[i].name for i in order]
    for name in ("deflection", "force", "element_torque"):
        assert same(other.data[name].values, run.data[name].values)
    for name in ("angle", "velocity", "acceleration"):
        assert same(other.data[name].values, run.data[name].values[:, order])
    for clearance in run.data.clearance.values:
        assert crossings(other, clearance) == crossings(run, clearance)
        assert np.allclose(times(other, clearance), times(run, clearance), rtol=0, atol=1e-8)


@pytest.mark.parametrize(("family", "seed"), [*TAME, ("staged", 0), ("staged", 2)])
def test_the_mirror_image(family, seed):
    problem = random_problem(family, seed)
    run = simulate(problem.model, problem.cycles)
    other = simulate(mirror(problem.model), problem.cycles)
    for name in ("deflection", "velocity", "force", "angle"):
        assert same(other.data[name].values, -run.data[name].values)
    for clearance in run.data.clearance.values:
        want = [(-1 - a, -1 - b) if _splits(problem, clearance) else (-a, -b) for a, b in crossings(run, clearance)]
        assert crossings(other, clearance) == want


def _splits(problem, clearance: str) -> bool:
    drive, coast = next(e for e in problem.model.elements if e.name == clearance).sides
    return differ(drive[0], coast[0])


@tame
def test_swapped_ends(family, seed):
    problem = random_problem(family, seed)
    model = problem.model
    if not all(c.stages is None for c in model.couplings):
        model = replace(model, couplings=tuple(c for c in model.couplings if c.stages is None))
    swapped = replace(
        model,
        couplings=tuple(replace(c, between=c.between[::-1]) for c in model.couplings),
        meshes=tuple(
            replace(
                m,
                between=m.between[::-1],
                radii=m.radii[::-1],
                error=tuple(replace(h, amplitude=negate(h.amplitude)) for h in m.error),
            )
            for m in model.meshes
        ),
    )
    run, other = simulate(model, problem.cycles), simulate(swapped, problem.cycles)
    assert same(other.data["deflection"].values, -run.data["deflection"].values)
    assert same(other.data["angle"].values, run.data["angle"].values)
    assert same(other.data["velocity"].values, run.data["velocity"].values)
    for clearance in run.data.clearance.values:
        assert crossings(other, clearance) == [(-a, -b) for a, b in crossings(run, clearance)]


@tame
def test_the_output_grid_changes_nothing(family, seed):
    problem = random_problem(family, seed)
    fine, coarse = simulate(problem.model, problem.cycles, 96), simulate(problem.model, problem.cycles, 1)
    assert same(fine.data["deflection"].values[::96], coarse.data["deflection"].values)
    for clearance in fine.data.clearance.values:
        assert crossings(fine, clearance) == crossings(coarse, clearance)
        assert np.allclose(times(fine, clearance), times(coarse, clearance), rtol=0, atol=1e-9)
