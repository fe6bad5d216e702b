"""Tables 3 and 4, fixed steps: exactly the number of steps that the paper prints.

``simulate`` runs whole periods, but 800 and 850 units of 1/omega (and 819.2 and 857.6 for RK4) are not whole periods.
Here the solver of the algorithm is called with the number of steps.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gearrattle.analysis.statics import equilibrium
from gearrattle.assembly import assemble
from gearrattle.engine.kernels.step_loop import CALLS, EVENTS, NOW, STEP
from gearrattle.engine.solvers.one_step import StepMarch
from gearrattle.engine.solvers.solver import Task
from gearrattle.engine.solvers.tableaus import CLASSICAL, MIDPOINT
from gearrattle.outcome import Outcome
from gearrattle.reproduction.paper_cases import SPEED, load_case

RUNS = 3
_SLICE = 5_000  # steps between two looks at whether to stop
TABLEAUS = {"rk2": MIDPOINT, "rk4": CLASSICAL}


@dataclass(frozen=True)
class Counted:
    """Steps, calls and crossings over a span of time [1/omega], and the processor time of every run [s]."""

    steps: int
    calls: int
    crossings: int
    span: float
    seconds: tuple[float, ...]


def count_steps(
    case: int, algorithm: str, step: float, steps: int, *, loaded: bool, tick: Callable[[float], None]
) -> Counted:
    """Take so many steps, each in units of 1/omega, from static rest, several times over."""
    model = load_case(case, loaded=loaded)
    rest = equilibrium(model).angle
    cycles = math.ceil(steps * step / (2.0 * math.pi)) + 1
    task = Task(assemble(model).system, rest, np.zeros(rest.size), cycles, 1, None, step / SPEED, audit=False)
    seconds = []
    for run in range(RUNS):
        march = StepMarch(task, TABLEAUS[algorithm], fixed=True, held=False)
        begin = time.thread_time()
        while (left := steps - int(march.stepper.counts[STEP])) > 0:
            outcome = march.advance(min(left, _SLICE))
            assert outcome is Outcome.SLICE_SPENT, outcome
            tick((run + 1.0 - left / steps) / RUNS)
        seconds.append(time.thread_time() - begin)
    s = march.stepper
    counts = (int(s.counts[STEP]), int(s.counts[CALLS]), int(s.counts[EVENTS]))
    return Counted(*counts, SPEED * float(s.clock[NOW]), tuple(seconds))
