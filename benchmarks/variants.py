"""Studies a second, as a user runs them: ``python -m benchmarks.variants`` (``make variants``).

The paper's case 3, rattling and loaded, and a pair of gears; 100 cycles each from its static equilibrium, one parameter
varied by a tenth, the default outputs. Real studies, ``gr.study``, in this process: one thread against two, and two
processes beside them. For every case: variants a second; processor time a variant; how much of it is Python, which
holds the interpreter; what the march alone takes of a motion whose regions are built, the floor. The same one variant
after the other, without the compiled loop (``engine.kernels.variants_march``): what the loop brings. Written to
``docs/reference/variants.md``.
"""

from __future__ import annotations

import os
import resource
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter, thread_time
from typing import Any

import numpy as np

import gearrattle as gr
from benchmarks.machine import machine
from gearrattle.assembly import assemble
from gearrattle.engine.kernels import variants_march
from gearrattle.engine.solvers import Task
from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.model.paths import value_at
from gearrattle.outcome import Outcome
from gearrattle.studies.case_runs import DONE, compute
from gearrattle.studies.plan import Plan
from gearrattle.studies.study import prepare

HERE = Path(__file__).resolve().parents[1]
PAGE = HERE / "docs" / "reference" / "variants.md"
CYCLES, ROUNDS = 100, 3
FEWER = 20  # variants without the loop: this part of those with it
PAIR = """
schema = 1
name = "a pair of gears"
inertia = [ { name = "pinion", J = 0.0105, drag = 0.01 },
            { name = "wheel", J = 0.0015, drag = 0.01, drag_torque = 1.0 } ]
[[mesh]]
name = "gear"
between = ["pinion", "wheel"]
radii = [0.05, 0.05]
stiffness = 7.2e6
damping = 45.0
backlash = 1e-4
[excitation]
speed = "1500 rpm"
[[torque]]
on = "pinion"
mean = 1.0
harmonics = [ { order = 2, amplitude = 20.0 } ]
"""
WAYS = ("threads", 1), ("threads", 2), ("local", 2)
CASES = {
    "a pair of gears": ("mesh.gear.backlash", 10_000),
    "case3_loaded": ("coupling.clutch.stiffness", 4000),
    "case3": ("mesh.gear.backlash", 2000),
}


def model_of(case: str) -> gr.Model:
    """Return one driveline with its settings."""
    loaded = gr.loads(PAIR) if case not in ("case3", "case3_loaded") else gr.load(HERE / f"examples/paper/{case}.toml")
    return loaded.with_({"simulation.cycles": CYCLES, "simulation.discard": CYCLES // 2})


def axis_of(model: gr.Model, path: str, count: int) -> dict[str, Any]:
    """Return an axis along which a value grows by a tenth."""
    value = value_at(model.to_tables(), path)
    return {path: {"from": value, "to": 1.1 * value, "count": count}}


def march_alone(model: gr.Model) -> tuple[float, int]:
    """Return the fastest march [s] with all regions built, and its crossings."""
    system = assemble(model).system
    task = Task(system, gr.equilibrium(model).angle, np.zeros(system.size), CYCLES, 1, None, None, audit=False)
    fastest = np.inf
    crossings = 0
    for _ in range(ROUNDS + 1):  # the first builds the regions
        run = ExactMarch(task)
        begin = thread_time()
        while run.advance() is not Outcome.DONE:
            pass
        fastest, crossings = min(fastest, thread_time() - begin), run.motion().crossings.time.size
    return fastest, crossings


def python_share(model: gr.Model, axis: dict[str, Any]) -> tuple[float, float]:
    """Return the processor time [s] of a variant in one thread, and what of it is Python."""
    prepared = prepare(model, axis)
    plan = Plan(prepared.plan.model, prepared.plan.axes, None, prepared.plan.count // 4)
    loop = variants_march.march_many
    least = np.inf
    inside = [0.0]

    def timed(*arguments: Any) -> Any:
        begin = thread_time()
        try:
            return loop(*arguments)
        finally:
            inside[0] += thread_time() - begin

    python = np.inf
    variants_march.march_many = timed
    try:
        for _ in range(ROUNDS):
            inside[0], begin = 0.0, thread_time()
            compute(plan, prepared.outputs, 1)
            taken = thread_time() - begin
            least, python = min(least, taken), min(python, taken - inside[0])
    finally:
        variants_march.march_many = loop
    return least / plan.cases_in(1), python / plan.cases_in(1)


def nothing(_run: gr.Run) -> dict[str, float]:
    """Return an output that needs a run of its own: the loop computes no such variants."""
    return {"nothing": 0.0}


def studied(model: gr.Model, axis: dict[str, Any], **options: Any) -> list[float]:
    """Return the least wall time [s] of a study on one thread, on two, and in two processes, taken in turn."""
    least = [np.inf] * len(WAYS)
    for _ in range(ROUNDS):
        for i, (scheduler, workers) in enumerate(WAYS):
            begin = perf_counter()
            dataset = gr.study(model, axis, workers=workers, scheduler=scheduler, **options)
            least[i] = min(least[i], perf_counter() - begin)
            assert np.all(dataset["outcome"] == DONE)
    return least


def rows() -> Iterator[tuple[str, str]]:
    """Yield a row of both tables for every case."""
    for case, (path, count) in CASES.items():
        model = model_of(case)
        axis, (march, crossings) = axis_of(model, path, count), march_alone(model)
        gr.study(model, axis_of(model, path, 32), workers=1)  # warm
        work, python = python_share(model, axis)
        looped = one, two, processes = studied(model, axis)
        few = count // FEWER
        singly = studied(model, axis_of(model, path, few), function=nothing)
        rates = [(count / fast, few / slow) for fast, slow in zip(looped, singly, strict=True)]
        yield (
            f"| {case} | {count} | {crossings} | {1e3 * march:.2f} | {1e3 * work:.2f} | {1e3 * python:.3f} "
            f"| {count / one:.0f} | {count / two:.0f} | {one / two:.2f} | {count / processes:.0f} |",
            f"| {case} | {few} | " + " | ".join(f"{slow:.0f} | {fast / slow:.1f}" for fast, slow in rates) + " |",
        )


def page() -> str:
    """Measure, and write the page."""
    load = os.getloadavg()[0]
    head = "| driveline | variants | crossings | march alone [ms] | a variant [ms] | of it Python [ms] "
    ways = "| 1 thread | 2 threads | gain | 2 processes |"
    singly = "| driveline | variants | 1 thread | loop | 2 threads | loop | 2 processes | loop |"
    with_loop, without = zip(*rows(), strict=True)
    table = "\n".join([head + ways, "|---" * 10 + "|", *with_loop])
    other = "\n".join([singly, "|---" * 8 + "|", *without])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return f"""# Variants a second

Written by `make variants` on {datetime.now(UTC):%Y-%m-%d}; do not edit. {machine()}, {os.cpu_count()} cores;
others kept {load:.1f} of them busy before it began. What others take is missing here: rates and gains are lower bounds.

Studies of {CYCLES} cycles a variant from the static equilibrium, the default outputs, `gr.study` from its call to its
Dataset: variants a second, the best of {ROUNDS} rounds, in each of which all three ways have their turn. *March alone*,
*a variant* and *Python* are processor time in one thread, the least; the march alone has all regions built. Processes
include their start.

{table}

Peak memory of the whole measurement: {peak:.0f} MB. Python holds the interpreter, so it alone bounds what threads
bring: with a share p of a variant, n threads are at most n / (1 + (n - 1) p) times as fast as one (G. M. Amdahl,
AFIPS Conf. Proc. 30 (1967) 483).

## One after the other

The same studies with a function of the user's as an output: each variant is then a model, a run and a verdict of its
own. Variants a second, and how many times as many the loop computes. Two processes take fewer variants here, so their
start weighs more.

{other}
"""


def main() -> None:
    """Measure and write."""
    text = page()
    PAGE.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
