"""Kernels compiled side by side: other processes compile what a first run will call later.

numba compiles one kernel at a time in a process. So when a kernel of ``PLAN`` is missing in the cache, other processes,
one per further core but three at most, begin to compile the plan into the same cache (``compiled_ahead``). Each asks
this process before every kernel, so none is compiled twice: a kernel that this process has called is refused, and this
process waits for a kernel that another one is compiling, then loads it. The plan begins with the kernel that takes
longest, and then goes from the end of a run to its start: this process goes the other way.

With one core, without a cache, or after the other processes have ended, this process compiles all kernels.
"""

from __future__ import annotations

import os
import threading
import time
from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable
    from multiprocessing.connection import Connection

PLAN = (
    "march.march_on",
    "extremes.time_above",
    "extremes.reaches",
    "extremes.moments",
    "extremes.extremes",
    "tallies.add_crossings",
    "flow_gradient.gradient_segments",
    "sampling.quantities_at",
    "quadrature.integrate_moments",
    "sample_notes.store_noted_samples",
    "region_stages.pack",
    "region_stages.build_region",
    "region_stages.limit_states",
    "variant_common.lay_out",
    "strips.fill_forced",
    "strips.fill_series",
    "strips.fill_powers",
    "strips.fill_tables",
    "strips.fill_bounds",
    "strips.fill_in_turn",
    "strips.fill",
    "strips.finest_level",
    "deflection_bounds.finish_bounds",
    "deflection_bounds.gather",
    "deflection_bounds.weigh",
    "block_diagonal.block_diagonalise",
    "deflection_bounds.triangular_form",
    "region_rates.turn_back",
    "region_rates.transpose_states",
    "region_rates.split_off",
    "region_rates.generate",
    "particular_solutions.split_inputs",
    "region_rates.look",
    "particular_solutions.typical_size",
    "region_rates.accelerate",
    "particular_solutions.enter_stiffest_pieces",
    "state_scaling.scale",
    "rigid_response.respond_rigidly",
)
"""Module and name of the kernels of every run with the exact algorithm, in the order in which they are compiled."""

Task = tuple[str, tuple[bool, ...]]
"""A kernel, and for every argument whether it is None, on which the compiled code depends."""

_LOOK = 0.1  # s: between two checks of the other process, so that a thread can be ended in between
_MOST = 3  # processes: more would not help, because the longest kernel takes as long as all others
_PATIENCE = 100.0  # s: longest wait for another process, which may be stopped; every kernel takes less


def task_of(function: Callable[..., Any], arguments: tuple[Any, ...]) -> Task:
    """Name of the function and types of its arguments, which decide what is compiled."""
    name = f"{function.__module__.rpartition('.')[2]}.{function.__name__}"
    return name, tuple(argument is None for argument in arguments)


class Ahead:
    """Kernels that this process has compiled or loaded, and those that other processes compile for it.

    module: has ``compile_ahead(connection)``, which the other processes call.
    processes: the other processes; empty before they are needed.
    """

    def __init__(self, module: str) -> None:
        self._module = module
        self.processes: list[Any] = []
        self._is_begun = False
        self._taken: set[Task] = set()
        self._theirs: dict[Connection, Task] = {}
        self._changed = threading.Condition()

    def begin(self, name: str) -> None:
        """Start the other processes if a kernel that must be compiled is in the plan; once only."""
        if self._is_begun or name not in PLAN:
            return
        self._is_begun = True
        from gearrattle.processes import may_start_others  # imported here: not needed while the cache has all kernels

        if not may_start_others():
            return
        try:
            for _ in range(min(_cores() - 1, _MOST)):
                self._start()
        except (OSError, RuntimeError, ValueError):
            return  # no memory, handles or interpreter: go on with the processes that have started

    def _start(self) -> None:
        """Start a process, and a thread that answers it."""
        from gearrattle.processes import WorkersWithoutMain

        context: Any = WorkersWithoutMain()
        here, there = context.Pipe()
        process = context.Process(target=_work, args=(there, self._module), daemon=True)
        process.start()
        there.close()
        self.processes.append(process)
        threading.Thread(target=self._answer, args=(here,), name="compiled ahead", daemon=True).start()

    def take(self, task: Task) -> None:
        """Reserve a kernel for this process to compile or to load; wait while another process compiles it."""
        with self._changed:
            end = time.monotonic() + _PATIENCE
            while task in self._theirs.values() and time.monotonic() < end:
                self._changed.wait(_LOOK)
            self._taken.add(task)

    def _answer(self, connection: Connection) -> None:
        """Answer a process whether it may compile what it asks for, until it ends."""
        try:
            while True:
                task = connection.recv()
                is_free = self._lend(connection, task)
                connection.send(is_free)
        except (EOFError, OSError):
            pass
        finally:
            self._lend(connection, None)
            connection.close()

    def _lend(self, connection: Connection, task: Task | None) -> bool:
        """Record that a process has compiled its kernel, and return whether it may compile the requested one."""
        with self._changed:
            self._theirs.pop(connection, None)
            is_free = task is not None and task not in self._taken
            if task is not None and is_free:
                self._taken.add(task)
                self._theirs[connection] = task
            self._changed.notify_all()
        return is_free


def _work(connection: Connection, module: str) -> None:
    """Compile the kernels of the plan that the process at the other end of the pipe has not reserved.

    An error here ends this process without a message: the other one compiles the kernel itself, and reports the error.
    """
    with suppress(Exception):
        import_module(module).compile_ahead(connection)


def _cores() -> int:
    """The number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
