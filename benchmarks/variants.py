"""Variants of a driveline a second, on one thread and on two: ``python -m benchmarks.variants``.

The paper's case 3, rattling and loaded, 100 cycles each from its static equilibrium; clutch stiffness or gear backlash
varied by a tenth. Printed: variants a second; milliseconds of processor time a variant, of which the march; and
milliseconds a region. Assembly and equilibrium are not part of it: systems are varied as such.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from time import perf_counter, process_time

import numpy as np

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.outcome import Outcome
from gearrattle.solvers import Task
from gearrattle.solvers.batch import march_all
from gearrattle.solvers.exact import ExactMarch
from gearrattle.solvers.slots import fresh_slots
from gearrattle.system.building import Bench

HERE = Path(__file__).resolve().parents[1]
CYCLES, ROUNDS = 100, 3
CASES = {"case3_loaded": 200, "case3": 60}
PATHS = ("coupling.clutch.stiffness", "mesh.gear.backlash")


def variants(case: str, path: str, count: int) -> list[Task]:
    """Return tasks in which one parameter grows by a tenth in all."""
    model = gr.load(HERE / "examples" / "paper" / f"{case}.toml")
    start, tables = gr.equilibrium(model).angle, model.to_tables()
    kind, name, key = path.split(".")
    value = next(table[key] for table in tables[kind] if table["name"] == name)
    assert isinstance(value, float)
    systems = (assemble(model.with_({path: value * (1 + 0.1 * i / count)})) for i in range(count))
    return [Task(system, start, np.zeros(4), CYCLES, 1, None, None, audit=False) for system in systems]


def alone(task: Task) -> tuple[float, float]:
    """Return the fastest march [s] with all regions built, and the time [s] to work out a region of those met."""
    slots = fresh_slots(task.system)
    march = built = np.inf
    for _ in range(ROUNDS + 1):  # the first builds the regions
        run = ExactMarch(task, slots)
        begin = perf_counter()
        while run.advance() is not Outcome.DONE:
            pass
        march = min(march, perf_counter() - begin)
    bench = Bench(slots.flow)
    arrays = fresh_slots(task.system, slots.store.room()).packed._asdict()
    for _ in range(ROUNDS):
        begin = perf_counter()
        for pieces in slots.pieces:
            bench.work_out(pieces)
            bench.pack(arrays, 0, 0)
        built = min(built, (perf_counter() - begin) / len(slots.pieces))
    return march, built


def rates(tasks: list[Task], threads: int) -> Iterator[tuple[float, float]]:
    """Yield variants a second and processor time [s] a variant, round by round."""
    for _ in range(ROUNDS):
        begin, worked = perf_counter(), process_time()
        ended = list(march_all(tasks, lambda motion: motion.crossings.time.size, threads))
        assert all(one.outcome is Outcome.DONE for one in ended)
        yield len(tasks) / (perf_counter() - begin), (process_time() - worked) / len(tasks)


def main() -> None:
    """Measure, and print the best round of each."""
    head = ("case", "varied", "threads", "variants a second", "ms of a processor", "march alone, ms", "a region, ms")
    print("| " + " | ".join(head) + " |")
    print("|---" * len(head) + "|")
    for case, count in CASES.items():
        for path in PATHS:
            tasks = variants(case, path, count)
            march, region = alone(tasks[0])
            for threads in (1, 2):
                found = list(rates(tasks, threads))
                fastest, least = max(rate for rate, _ in found), min(work for _, work in found)
                print(
                    f"| {case} | {path} | {threads} | {fastest:.0f} | {1e3 * least:.2f} | {1e3 * march:.2f} | "
                    f"{1e3 * region:.3f} |"
                )


if __name__ == "__main__":
    main()
