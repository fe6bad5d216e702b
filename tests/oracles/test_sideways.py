"""The program against plain integration of the equations of sideways motion: every crossing, every sample."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from tests.oracles.sideways import Motion, nested_tables, random_tables, solved

CYCLES = 1
SAMPLES = 32
CLOSE = 1e-9  # of the largest of its kind
GROWTH = 1e5  # of a perturbation: beyond, rounding of either side is seen


def started(tables: dict[str, Any], seed: int) -> np.ndarray:
    """Return a start (2, 3 n) at random, and write it into the tables."""
    rng = random.Random(f"start/{seed}")
    bodies = tables["inertia"]
    start = np.zeros((2, 3 * len(bodies)))
    for i, body in enumerate(bodies):
        start[:, 3 * i] = rng.uniform(-0.05, 0.05), rng.uniform(-0.5, 0.5)
        if "mass" in body:
            start[0, 3 * i + 1 : 3 * i + 3] = rng.uniform(-0.03, 0.03), rng.uniform(-0.03, 0.03)
            start[1, 3 * i + 1 : 3 * i + 3] = rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3)
    moves = [3 * i + k for i, body in enumerate(bodies) if "mass" in body for k in (1, 2)]
    tables["simulation"] = {
        "initial": {
            "angle": start[0, ::3].tolist(),
            "velocity": start[1, ::3].tolist(),
            "displacement": start[0, moves].tolist(),
            "displacement_velocity": start[1, moves].tolist(),
        }
    }
    return start


def compare(tables: dict[str, Any], seed: int) -> tuple[int, float]:
    """Return the number of crossings, and the largest error while a perturbation has not grown too much.

    All crossings must be there, in order.
    """
    start = started(tables, seed)
    run = gr.simulate(gr.Model.from_tables(tables), cycles=CYCLES, discard=0, samples_per_cycle=SAMPLES)
    t = run.trajectory
    truth = solved(tables, start, t.layout.period, CYCLES, SAMPLES)
    names = t.layout.clearance_names
    log = t.events
    mine = [(names[k], region) for k, region in zip(log.clearance.tolist(), log.to_region.tolist(), strict=True)]
    assert mine == [(part, region) for _, part, region in truth.crossings]
    times = np.array([time for time, _, _ in truth.crossings])
    until = run.variation.horizon(GROWTH)
    off = float(np.abs(log.time - times)[log.time < until].max(initial=0.0)) / t.layout.period
    assert run.cost.energy_residual is not None
    assert run.cost.energy_residual < CLOSE
    return len(mine), max(off, _of_samples(t, truth, tables, int(np.sum(t.time < until))))


def _of_samples(t: Any, truth: Motion, tables: dict[str, Any], count: int) -> float:
    """The largest difference of the first samples, relative to the largest of its kind."""
    bodies = tables["inertia"]
    moves = [3 * i + k for i, body in enumerate(bodies) if "mass" in body for k in (1, 2)]
    size = 3 * len(bodies)
    pairs = [
        (t.angle, truth.samples[:, :size:3]),
        (t.velocity, truth.samples[:, size::3]),
        (t.sideways.displacement, truth.samples[:, moves]),
        (t.sideways.velocity, truth.samples[:, [size + i for i in moves]]),
    ]
    return max(float(np.abs(mine - other)[:count].max() / np.abs(other).max()) for mine, other in pairs)


@pytest.mark.parametrize("seed", range(12))
def test_random_drivelines_that_move_sideways(seed: int) -> None:
    _, error = compare(random_tables(seed), seed)
    assert error < CLOSE


@pytest.mark.long
@pytest.mark.parametrize("seed", range(12, 112))
def test_many_random_drivelines_that_move_sideways(seed: int) -> None:
    _, error = compare(random_tables(seed), seed)
    assert error < CLOSE


@pytest.mark.parametrize("seed", range(6))
def test_bearings_around_other_bodies_and_weights(seed: int) -> None:
    _, error = compare(nested_tables(seed), seed)
    assert error < CLOSE


@pytest.mark.long
@pytest.mark.parametrize("seed", range(6, 56))
def test_many_bearings_around_other_bodies_and_weights(seed: int) -> None:
    _, error = compare(nested_tables(seed), seed)
    assert error < CLOSE


def test_the_random_ones_are_what_they_are_for() -> None:
    """They meet corners, of meshes and of bearings."""
    kinds = {path.split(".")[0] for seed in range(12) for path in _with_corners(random_tables(seed))}
    assert {"mesh", "bearing", "coupling"} <= kinds


def test_bearings_around_bodies_open_and_close() -> None:
    """Of the nested ones, corners of bearings around bodies are met, and the housing takes no force of these."""
    tables = nested_tables(0)
    started(tables, 0)
    run = gr.simulate(gr.Model.from_tables(tables), cycles=CYCLES, discard=0, samples_per_cycle=SAMPLES)
    layout = run.trajectory.layout
    inner = {f"bearing.{b['name']}" for b in tables["bearing"] if "around" in b}
    met = {layout.component_paths[layout.clearance[k]] for k in run.trajectory.events.clearance.tolist()}
    assert inner & met


def _with_corners(tables: dict[str, Any]) -> list[str]:
    layout = assemble(gr.Model.from_tables(tables)).layout
    return [layout.component_paths[k] for k in layout.clearance]
