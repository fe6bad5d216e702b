"""What a step and a crossing of ``exact`` cost, and how far that is from the arithmetic: ``python -m benchmarks.cost``.

Writes docs/reference/cost.md. The march alone is timed (no model, no samples, no audit) on the paper's six cases, and
its time is split by least squares: steps and crossings occur in different proportions there.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from time import process_time

import numpy as np

import gearrattle as gr
from benchmarks.machine import machine
from benchmarks.midpoint import march, transmission
from gearrattle.assembly import assemble
from gearrattle.engine.kernels import march_arrays
from gearrattle.engine.solvers import Task
from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.outcome import Outcome

HERE = Path(__file__).resolve().parents[1]
PAGE = HERE / "docs" / "reference" / "cost.md"
CASES = ("case1_loaded", "case2_loaded", "case3_loaded", "case1", "case2", "case3")
CYCLES = 127
ROUNDS = 15
STEP = 0.001 / 150.0

HEAD = """\
# What a step and a crossing cost

Written by `make cost` on {date}; do not edit. Machine: {machine}. One thread.

The march alone on the paper's six cases over 127 cycles: processor time, the fastest of {rounds} runs. RK2 beside it, in the same process, is
the fastest plain fixed step that we could write (`benchmarks/midpoint.py`), at the paper's step: it resolves no corner and is off by
4e-6 to 1e-1 half gaps. At an equal error, {{doc}}`peers`. A step looks at all clearances and moves on by a table; a crossing is a window searched for its first root, the state
moved there, and the particular solution exchanged at the change of region.

"""

TAIL = """\

Split by least squares over the six cases: **{step:.0f} ns a step** and **{crossing:.0f} ns a crossing**, its change of region
({change:.0f} ns measured alone) and the searches that end without a crossing included. The arithmetic: {flops_step} floating-point operations
a step and {flops_crossing} a crossing for four inertias and {inputs} inputs; at sixteen a cycle (two fused products of four numbers) and
{clock:.1f} GHz that is {floor_step:.0f} ns and {floor_crossing:.0f} ns. The march is {far_step:.0f} and {far_crossing:.0f} times above that floor: its products are short
chains of dependent sums (7 to 13 terms), and every step ends in branches that depend on them.
"""


@dataclass(frozen=True)
class Row:
    """One case: fastest times [s] and counts."""

    case: str
    fixed: float
    exact: float
    steps: int
    crossings: int
    windows: int


def measure(case: str) -> tuple[Row, ExactMarch]:
    """Time the march and RK2 in turns."""
    model = gr.load(HERE / "examples" / "paper" / f"{case}.toml")
    system, start = assemble(model).system, gr.equilibrium(model).angle
    task = Task(system, start, np.zeros(4), CYCLES, 1, None, None, audit=False)
    plant, steps = transmission(model), round(CYCLES * 2 * np.pi / model.excitation.omega / STEP)
    fixed = exact = np.inf
    for _ in range(ROUNDS):
        state = np.concatenate([start, np.zeros(4)])
        begin = process_time()
        march(state, STEP, steps, plant)
        fixed = min(fixed, process_time() - begin)
        run = ExactMarch(task)
        begin = process_time()
        while run.advance() is not Outcome.DONE:
            pass
        exact = min(exact, process_time() - begin)
    counts = run.march.counts
    counted = (int(counts[i]) for i in (march_arrays.STEPS, march_arrays.EVENTS, march_arrays.EXPANSIONS))
    return Row(case, fixed, exact, *counted), run


def flops(run: ExactMarch) -> tuple[int, int]:
    """Floating-point operations of a step and of a crossing, by the sizes of the products."""
    size, regions = run.slots.size, run.slots.packed
    width, modes = int(regions.width.max()), int(regions.modes.max())
    k = size.clearances
    u = size.inputs
    order = march_arrays.ORDER + 1
    seen = 4 * k
    bound = 4 * -(-3 * k // 4)
    made = 4 * size.made(width)
    bounds = 2 * width * 8 * -(-modes // 4) + 2 * bound * modes
    step = 2 * seen * u + 4 * seen * width + bounds // 3 + 2 * made * width + 6 * (u - 1) // 2 + 60 * k
    window = 2 * order * width + 2 * 8 * u + 14 * order * 4
    move = (3 + order // 4 - 1) * 2 * made * width + 2 * order * made
    return step, window + move + 4 * made * u + bounds


def change_of_region(run: ExactMarch) -> float:
    """Time [s] of leaving a region's particular solution and entering another's."""
    from gearrattle.engine.kernels._jit import kernel, vectorised
    from gearrattle.engine.kernels.taylor_window import enter, leave

    @kernel
    def loop(count, particular, drift, kept, states, width, u, y, carried, out):  # type: ignore[no-untyped-def]
        for i in range(count):
            leave(particular, drift, states, i % 2, u, 0.0, y, carried, out)
            enter(particular, kept, states, width, 1 - i % 2, u, y, carried, out)

    regions, m = run.slots.packed, run.march
    arguments = (regions.particular, regions.drift, regions.kept, regions.states, int(regions.width[0]), m.u, m.y)
    best = np.inf
    for _ in range(ROUNDS):
        begin = process_time()
        vectorised(loop)(100_000, *arguments, m.carried, np.zeros(m.carried.size + m.y.size))
        best = min(best, process_time() - begin)
    return best / 100_000


def clock() -> float:
    """Clock [GHz] as the machine tells it; 3 where it does not."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return max(float(line.split(":")[1]) for line in lines if line.startswith("cpu MHz")) / 1e3
    except (OSError, ValueError):
        return 3.0


def main() -> None:
    """Measure, and write the page."""
    measured = [measure(case) for case in CASES]
    rows, run = [row for row, _ in measured], measured[-1][1]
    counts = np.array([[row.steps, row.crossings] for row in rows], dtype=float)
    times = np.array([row.exact for row in rows])
    step, crossing = np.linalg.lstsq(counts / times[:, None], np.ones(len(rows)), rcond=None)[0] * 1e9
    flops_step, flops_crossing = flops(run)
    ghz = clock()
    lines = [HEAD.format(date=datetime.now(UTC).date(), machine=machine(), rounds=ROUNDS)]
    lines += [
        "| case | RK2, ms | march, ms | ratio | steps | crossings | windows | ns a step, all in |",
        "|---" + "|--:" * 7 + "|",
    ]
    for row in rows:
        lines.append(
            f"| {row.case} | {1e3 * row.fixed:.1f} | {1e3 * row.exact:.2f} | {row.fixed / row.exact:.1f} | {row.steps} | "
            f"{row.crossings} | {row.windows} | {1e9 * row.exact / row.steps:.0f} |"
        )
    floor = np.array([flops_step, flops_crossing]) / (16 * ghz)
    lines.append(
        TAIL.format(
            step=step,
            crossing=crossing,
            change=1e9 * change_of_region(run),
            flops_step=flops_step,
            flops_crossing=flops_crossing,
            inputs=run.slots.size.inputs,
            clock=ghz,
            floor_step=floor[0],
            floor_crossing=floor[1],
            far_step=step / floor[0],
            far_crossing=crossing / floor[1],
        )
    )
    PAGE.write_text("\n".join(lines), encoding="utf-8")
    print(PAGE.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
