"""Costs of the sweep, apart: a window without crossings, a crossing, a whole period; and of a region's tables."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.growth.plant import CONTACT, SHAPES, SIZES, task
from gearrattle.engine.kernels import march_arrays
from gearrattle.engine.solvers import Task, scheme_choice
from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.solvers.region_slots import Shelf
from gearrattle.engine.solvers.window_solver import SweepMarch, plan_of
from gearrattle.engine.system.law import Stage, staged
from gearrattle.outcome import Outcome

CYCLES = 20
ROUNDS = 5
MOST_FOR_TABLES = 16
"""Inertias; beyond, one period through tables takes minutes."""

REGIONS_TIMED = 32


def fastest(task: Task, march: Any = SweepMarch, rounds: int = ROUNDS) -> tuple[float, Any]:
    """Seconds of the fastest of some runs, the layout of the system left out, and the last of the runs."""
    best, run = np.inf, None
    for _ in range(rounds):
        run = march(task)
        begin = time.perf_counter()
        while (outcome := run.advance()) is not Outcome.DONE:
            if outcome is not Outcome.SLICE_SPENT:
                raise RuntimeError(outcome.name)
        best = min(best, time.perf_counter() - begin)
    return best, run


def linear(task: Task) -> Task:
    """The same train with every gap closed for good: no crossing, the same windows."""
    contact = [Stage(CONTACT, 0.5, None)]
    laws = tuple(staged(contact, contact) for _ in task.system.laws)
    return replace(task, system=replace(task.system, laws=laws))


def swept(shape: str, n: int) -> dict[str, Any]:
    """Costs of the sweep."""
    problem = task(shape, n, CYCLES, samples=1)
    begin = time.perf_counter()
    plan = plan_of(problem.system)
    setup = time.perf_counter() - begin
    calm_seconds, calm = fastest(linear(problem))
    window = calm_seconds / int(calm.sweep.counts[march_arrays.STEPS])
    seconds, run = fastest(problem)
    crossings, windows = int(run.sweep.counts[march_arrays.EVENTS]), int(run.sweep.counts[march_arrays.STEPS])
    audited, _ = fastest(task(shape, n, 4, samples=1, audit=True), rounds=2)
    return {
        "shape": shape,
        "n": n,
        "clearances": len(problem.system.clearances),
        "windows": plan.driveline.windows,
        "near": int(np.diff(plan.driveline.near.inertia_start).max()),
        "crossings": crossings / CYCLES,
        "window_us": 1e6 * window,
        "crossing_us": 1e6 * (seconds - windows * window) / crossings,
        "cycle_ms": 1e3 * seconds / CYCLES,
        "audited_cycle_ms": 1e3 * audited / 4,
        "setup_ms": 1e3 * setup,
        "chosen": "sweep" if scheme_choice.is_large(problem.system) else "tables",
    }


def met(run: ExactMarch) -> set[tuple[int, ...]]:
    """The regions a run came through, as pieces of the clearances."""
    crossings, pieces = run.motion().crossings, [int(p) for p in run.initial]
    visited = {tuple(pieces)}
    for clearance, piece in zip(crossings.clearance, crossings.to_piece, strict=True):
        pieces[clearance] = int(piece)
        visited.add(tuple(pieces))
    return visited


def tabled(shape: str, n: int) -> dict[str, Any]:
    """Costs of tables: a region's, of a run that has to build them as it goes, and of the same run again."""
    problem = task(shape, n, CYCLES, samples=1)
    first, run = fastest(problem, ExactMarch, rounds=1)
    again, _ = fastest(problem, ExactMarch, rounds=2)
    regions = met(run)
    slots, begin = Shelf(run.flow).slots, time.perf_counter()
    for region in sorted(regions)[:REGIONS_TIMED]:
        pieces = [0] * len(problem.system.laws)
        for k, piece in zip(problem.system.clearances, region, strict=True):
            pieces[k] = piece
        slots.slot_of(tuple(pieces))
    built = time.perf_counter() - begin
    held = sum(array.nbytes for array in slots.packed if hasattr(array, "nbytes"))
    return {
        "shape": shape,
        "n": n,
        "possible": scheme_choice.regions_of(problem.system),
        "regions": len(regions),
        "region_ms": 1e3 * built / len(slots.pieces),
        "region_kb": held / 1024 / len(slots.pieces),
        "first_cycle_ms": 1e3 * first / CYCLES,
        "again_cycle_ms": 1e3 * again / CYCLES,
    }


def warm_up() -> None:
    """Compile."""
    for march in (SweepMarch, ExactMarch):
        fastest(task("chain", 5, 1, audit=True), march, rounds=1)


def measure(say: Any = print) -> dict[str, Any]:
    """Measure everything."""
    warm_up()
    sweeps, tables = [], []
    for shape in SHAPES:
        for n in SIZES:
            sweeps.append(swept(shape, n))
            say({key: value if isinstance(value, str) else round(value, 3) for key, value in sweeps[-1].items()})
            if n <= MOST_FOR_TABLES:
                tables.append(tabled(shape, n))
                say({key: value if isinstance(value, str) else round(value, 3) for key, value in tables[-1].items()})
    return {"cycles": CYCLES, "rounds": ROUNDS, "sweep": sweeps, "tables": tables}
