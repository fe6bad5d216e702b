"""Random drivelines with dry friction and clipped contact damping, and how the program is held against fifty digits."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np

import gearrattle as gr
from tests.oracles.compare import ABSOLUTE, GROWING, HORIZON, Outcome, judge, scales
from tests.oracles.driveline import Coupling, Driveline, Stage
from tests.oracles.fixed_point import to_float
from tests.oracles.random_drivelines import Problem, log_uniform, random_problem, text
from tests.oracles.stick_slip import Motion, growth, solve

FAMILIES = (
    "chain",
    "tree",
    "loop",
    "staged",
    "mesh",
    "undamped",
    "free-flight",
    "half-order",
    "two-trains",
    "everything",
    "stiff",
    "static",
)


def dressed_problem(family: str, seed: int) -> Problem:
    """Return a driveline of ``random_drivelines`` with friction in most couplings and some damping clipped."""
    rng = random.Random(f"dressed {family}/{seed}")
    problem = random_problem(family, seed)
    model = problem.model
    couplings = tuple(_with_friction(rng, c) for c in model.couplings)
    meshes = tuple(
        replace(m, contact_damping="clipped") if m.backlash is not None and rng.random() < 0.6 else m
        for m in model.meshes
    )
    return replace(problem, model=replace(model, couplings=couplings, meshes=meshes))


def _with_friction(rng, coupling: Coupling) -> Coupling:
    if coupling.stages is not None:
        coast = None if coupling.coast_stages is None else _stages(rng, coupling.coast_stages)
        return replace(coupling, stages=_stages(rng, coupling.stages), coast_stages=coast)
    free = coupling.clearance is not None and float(coupling.stiffness_ratio) == 0.0
    if free and float(coupling.damping_ratio) == 0.0 and rng.random() < 0.5:
        coupling = replace(coupling, contact_damping="clipped")
    if rng.random() < 0.7:
        return replace(coupling, hysteresis=_loop(rng), stick_stiffness=_stick(rng, float(coupling.stiffness)))
    return coupling


def _stages(rng, stages: tuple[Stage, ...]) -> tuple[Stage, ...]:
    height, made = 0.0, []
    for stage in stages:
        height += 0.0 if rng.random() < 0.3 else float(_loop(rng))
        stick = _stick(rng, max(float(stage.stiffness), 0.5))
        made.append(replace(stage, hysteresis=text(height, 8) if height else "0", stick_stiffness=stick))
    return tuple(made)


def _loop(rng) -> str:
    return text(log_uniform(rng, 0.02, 0.8))


def _stick(rng, slope: float) -> str:
    return text(slope * log_uniform(rng, 2.0, 60.0))


def hold(problem: Problem) -> tuple[Outcome, Motion]:
    """Simulate, solve to fifty digits, and return what was measured; fails with every fault.

    As ``compare.assert_exact_inside_horizon``: shorter by half until it is predictable.
    """
    model, cycles, per_cycle = problem.model, problem.cycles, problem.samples_per_cycle
    while True:
        exact = solve(model, cycles, per_cycle)
        scale = scales(model, exact)
        run = gr.simulate(gr.loads(model.toml()), cycles=cycles, samples_per_cycle=per_cycle, discard=0)
        outcome = judge(model, run, exact, scale, np.full(len(exact.time), ABSOLUTE))
        faults = [*outcome.faults, *switch_faults(run, exact)]
        if not faults:
            return outcome, exact
        grown = growth(model, cycles, per_cycle, exact, np.array([scale.deflection, scale.rate]))
        tolerance = np.maximum(ABSOLUTE, GROWING * grown)
        if tolerance[-1] > HORIZON and cycles > 1:
            cycles //= 2
            continue
        outcome = judge(model, run, exact, scale, tolerance)
        faults = [*outcome.faults, *switch_faults(run, exact)]
        assert not faults, "\n".join([f"{model.name}, {cycles} cycles", *faults, "", model.toml()])
        return outcome, exact


def logged(run: gr.Run) -> list[tuple[float, str, str]]:
    """Time, name and what follows of everything a slider or limiter did by itself."""
    return [(time, *_renamed(name, word)) for time, name, word in run.switches.itertuples(index=False)]


def _renamed(name: str, word: str) -> tuple[str, str]:
    element, kind = name.split(".", 1)
    if kind in ("push", "pull"):
        return f"{element}.contact", {"limits": "double" if kind == "push" else "nothing"}.get(word, "spring")
    return name, word


_WORDS = {"slip1": "slips forward", "slip-1": "slips backward"}


def switch_faults(run: gr.Run, exact: Motion) -> list[str]:
    """Switches missing, invented, or late by more than 1e-7 of the run."""
    faults, late = [], 1e-7 * to_float(exact.time[-1])
    want = [(to_float(s.time), s.name, _WORDS.get(s.to, s.to)) for s in exact.switches]
    want = [(time, name, "sticks" if word.startswith("stick") else word) for time, name, word in want]
    actual = logged(run)
    for name in sorted({name for _, name, _ in [*want, *actual]}):
        mine, theirs = ([(t, word) for t, n, word in rows if n == name] for rows in (actual, want))
        if [word for _, word in mine] != [word for _, word in theirs]:
            faults.append(f"{name}: {len(mine)} switches, exact {len(theirs)}: {mine[:6]} ..., exact {theirs[:6]}")
        elif any(abs(a[0] - b[0]) > late for a, b in zip(mine, theirs, strict=True)):
            faults.append(f"{name}: a switch is late")
    return faults


__all__ = ["FAMILIES", "Driveline", "dressed_problem", "hold", "logged", "switch_faults"]
