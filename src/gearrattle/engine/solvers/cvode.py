"""Variable-order multistep methods: SUNDIALS CVODE's Adams (orders 1-12) and BDF (1-5).

``adams`` and ``gear`` are what IMSL's Adams-Moulton and Gear routines of the 1995 paper are today. They step blindly
through corners: the right-hand side looks the pieces up at every call, and the error test alone notices a corner.
``gear-events`` holds the pieces, finds their corners by CVODE's root-finding and restarts there. Both read samples and
crossings from CVODE's own interpolant.

``adams`` iterates by fixed point, as IMSL's default does. Newton's method would make fewer calls and yet take longer on
the rattling case 3 (262 000 against 326 000 calls, 0.30 against 0.23 s for 127 cycles), and less of both on the loaded
one (168 000 against 481 000, 0.22 against 0.34 s), where damped contact limits the step.

Errors are controlled in units of an ordinary motion (``FieldProblem.size``), relative and absolute alike; reference
angles and force integrals do not feed back, and never shorten a step.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from gearrattle.engine.kernels import multistep as kernel
from gearrattle.engine.kernels._jit import vectorised
from gearrattle.engine.kernels.laws import Laws
from gearrattle.engine.kernels.multistep import ERROR_FAILS, EVENTS, SOLVE_FAILS, STEPS, TIME, Held, march_on
from gearrattle.engine.solvers import sundials
from gearrattle.engine.solvers.problem_for_c import Block, contiguous
from gearrattle.engine.solvers.samples_in_si import MOST_CHOSEN, StepLimit
from gearrattle.engine.solvers.solver import Marching, Motion, Position, Task
from gearrattle.engine.solvers.vector_field import FieldProblem
from gearrattle.outcome import Outcome

TOLERANCE = 1e-6
_SLICE = 0.02  # s: aim for the length of a slice
_FIRST_LOG = 4096  # crossings in the first log
_FIRST_BUDGET = 256  # steps in the first slice
_LARGEST_BUDGET = 2**20  # most steps per slice


class MultistepMarch:
    """A CVODE run under way (see ``solver.Marching``).

    task: what to integrate; ``step`` is the first step tried.
    method: ``sundials.ADAMS`` or ``sundials.BDF``.
    newton: whether to solve the implicit formula by Newton's method.
    events: whether to hold pieces and restart at their corners.
    """

    def __init__(self, task: Task, *, method: int, newton: bool, events: bool) -> None:
        self._march_on = vectorised(march_on)
        self.task = task
        self.problem = FieldProblem.of(task)
        plain = contiguous(self.problem.field)
        self.field = plain
        elements = len(plain.rows)
        laws = plain.laws
        lowest = plain.laws.first[:-1]
        ends = np.full(elements, np.inf)
        slopes = laws.stiffness[lowest], laws.damping[lowest], laws.offset[lowest]
        held = plain._replace(laws=Laws._make([np.arange(elements + 1), *slopes, -ends, ends]))
        self.block = Block.of(self.problem, held if events else None)
        self.held = Held(events, self.block.field, self.block.bounds, self.block.clearances)
        tolerance = TOLERANCE if task.tolerance is None else task.tolerance
        self.memory = sundials.Memory(
            self.block, method=method, newton=newton, roots=events, tolerance=tolerance, step=task.step
        )
        self._begin()
        self._budget = _FIRST_BUDGET
        self._limit = StepLimit(task.system, a_period=MOST_CHOSEN)
        self._newton = newton

    def _begin(self) -> None:
        """Lay out what the kernel works on: the state at t = 0 is the first sample."""
        # addresses of CVODE's functions
        memory = self.memory
        problem = self.problem
        elements = len(self.block.field.rows)
        samples = len(problem.sample_times)
        names = ["CVode", "CVodeGetDky", "CVodeGetIntegratorStats", "CVodeGetNumStepSolveFails"]
        names += ["CVodeGetNumJacEvals", "CVodeGetRootInfo", "CVodeReInit", "CVodeSetStopTime", "CVodeSetInitStep"]
        functions: list[int] = [sundials.address("cvode", name) for name in names]
        self.library = kernel.Library._make([memory.memory, memory.vector, memory.between, *functions, memory.newton])
        # the state at t = 0 is the first sample; room for samples and crossings
        counts = np.zeros(8, np.int64)
        numbers = np.zeros(6)
        counts[kernel.SAMPLE] = 1
        numbers[kernel.SMALLEST] = np.inf
        states = np.zeros((samples, self.block.states))
        states[0] = problem.initial
        self.march = kernel.March(
            z=memory.z,
            point=memory.point,
            counts=counts,
            numbers=numbers,
            current=np.zeros(8, np.int64),
            roots=np.zeros(2 * len(self.block.clearances), np.int32),
            piece=np.array(problem.start, dtype=np.int64),
            deflection=np.zeros(elements),
            times=problem.sample_times,
            states=states,
            event_time=np.zeros(_FIRST_LOG),
            event_element=np.zeros(_FIRST_LOG, np.int64),
            event_pieces=np.zeros((_FIRST_LOG, 2), np.int64),
            event_rate=np.zeros(_FIRST_LOG),
            event_integral=np.zeros(_FIRST_LOG),
        )
        # scratch, and the elements' states at the beginning
        waves = 2 * self.block.field.cycles.size
        self.scratch = [
            kernel.Scratch(np.zeros(self.block.states), np.zeros(waves), *(np.zeros(elements) for _ in range(4)))
            for _ in range(2)
        ]
        kernel.settle(self.field, self.block.size, self.held, self.march, self.scratch[0])

    def advance(self) -> Outcome:
        """Take one slice of steps; grow the log where the kernel asks for it."""
        begin = time.perf_counter()
        m = self.march
        most = 2 * int(sum(law.pieces for law in self.task.system.laws))
        outcome = Outcome(
            self._march_on(self.field, self.block.size, self.held, self.library, m, *self.scratch, most, self._budget)
        )
        if outcome is Outcome.LOG_FULL:
            doubled = {
                name: np.concatenate([a, np.zeros_like(a)]) for name, a in m._asdict().items() if "event" in name
            }
            self.march = m._replace(**doubled)
            return Outcome.SLICE_SPENT
        spent = time.perf_counter() - begin
        if outcome is Outcome.SLICE_SPENT:
            better = int(self._budget * np.clip(_SLICE / spent, 0.25, 2.0))
            self._budget = min(max(better, 1), _LARGEST_BUDGET)
            total = m.counts + m.current
            steps = int(total[STEPS] + total[ERROR_FAILS] + total[SOLVE_FAILS])
            if self._limit.is_exceeded(steps, float(m.numbers[TIME]) / self.task.system.inputs.period):
                return Outcome.NO_PROGRESS
        return outcome

    def fraction(self) -> float:
        """Samples stored, as a fraction of all."""
        return float(self.march.counts[0] / len(self.march.times))

    def position(self) -> Position:
        """Time, deflections (transmission errors left out) and the last clearance crossed."""
        count = int(self.march.counts[EVENTS])
        last = int(self.march.event_element[count - 1]) if count else None
        step = None if self._newton else self._limit.average
        return self.problem.position(float(self.march.numbers[TIME]), self.march.z * self.block.size, last, step)

    def motion(self) -> Motion:
        """Samples, crossings and CVODE's own counts; see ``kernels.multistep`` on rejected steps' sizes."""
        m = self.march
        total = m.counts + m.current
        steps = int(total[kernel.STEPS])
        count = int(m.counts[kernel.EVENTS])
        rejected = int(total[kernel.ERROR_FAILS] + total[kernel.SOLVE_FAILS])
        return self.problem.motion(
            m.states,
            self.problem.crossings(
                m.event_time[:count],
                m.event_element[:count],
                m.event_pieces[:count],
                m.event_rate[:count],
                m.event_integral[:count],
            ),
            steps=steps,
            function_calls=int(total[kernel.CALLS]),
            jacobian_calls=int(total[kernel.JACOBIANS]),
            rejected_steps=rejected,
            smallest_step=float(m.numbers[kernel.SMALLEST]),
            average_step=float(m.times[-1]) / max(steps, 1),
            average_trial_step=float(m.numbers[kernel.TRIED]) / max(steps + rejected, 1),
        )


def multistep(algorithm: str, method: int, *, newton: bool, events: bool = False) -> Callable[[Task], Marching]:
    """A solver from one of CVODE's methods.

    algorithm: its name, for the error where SUNDIALS is not installed.
    method, newton, events: see ``MultistepMarch``.
    """

    def start(task: Task) -> Marching:
        sundials.available(algorithm)
        return MultistepMarch(task, method=method, newton=newton, events=events)

    return start
