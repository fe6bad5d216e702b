"""The interface of solvers: a solver starts on a task, works in slices, and hands over a motion.

A solver does not know models, files or units: it receives a piecewise system, initial angles and velocities, and an
output grid. The loop that calls it, shows progress and handles Ctrl-C is ``simulate.simulate`` for all solvers.
To add a solver: write its file with a function ``Task -> Marching``, add one line to the table in ``__init__``, and its
test page; the tests over the table then cover it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.variant_arrays import Crossings
from gearrattle.engine.system.crossings_in_order import Auxiliaries
from gearrattle.engine.system.energy_audit import EnergyAudit
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.outcome import Outcome

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Task:
    """A system to integrate, its initial state and its output grid."""

    system: PiecewiseSystem  # [SI]
    # angle, velocity: (n,) state at t = 0 [rad, rad/s]
    angle: Array
    velocity: Array
    cycles: int  # length of the run in periods
    samples_per_cycle: int  # output grid
    tolerance: float | None  # None for the solver's default
    step: float | None  # fixed step [s]; None for the solver's default
    audit: bool = True  # whether to audit the energy, where the solver can
    memory: Array | None = None  # (S,) memories of auxiliaries at t = 0 [SI]; None for none of them loaded
    # (C,) pieces of auxiliaries at t = 0; None for those that deflections and rates decide
    auxiliary_pieces: IntArray | None = None


@dataclass(frozen=True)
class Motion:
    """Result of a solver [SI]; see ``Trajectory`` for shapes. ``piece`` indexes each clearance's law.

    ``function_calls`` are evaluations by the algorithm, without those for output only. ``aside`` is the time [s] for
    notes, which is not part of the algorithm either.
    """

    angle: Array
    velocity: Array
    acceleration: Array
    deflection: Array
    force: Array
    piece: IntArray
    crossings: Crossings
    initial_piece: IntArray
    final_force_integral: Array
    steps: int
    function_calls: int
    average_step: float
    average_trial_step: float
    rejected_steps: int = 0
    jacobian_calls: int = 0
    smallest_step: float | None = None
    notes: tuple[str, ...] = ()
    energy: EnergyAudit | None = None
    aside: float = 0.0
    auxiliaries: Auxiliaries | None = None


@dataclass(frozen=True)
class Position:
    """Present time and deflections of a run."""

    time: float  # [s]
    deflection: Array  # (K,) of the clearances
    last_crossed: int | None  # the clearance that crossed last, if any
    fastest: int | None = None  # the element with the largest rate, which needs the shortest steps; None: not known


class Marching(Protocol):
    """A run under way."""

    def advance(self) -> Outcome:
        """Do a slice of work (a few milliseconds); SLICE_SPENT means there is more."""

    def fraction(self) -> float:
        """Part of the run that is done, 0 ... 1."""

    def position(self) -> Position:
        """Present position of the run, for a message about a failure."""

    def motion(self) -> Motion:
        """The motion, once ``advance`` has answered DONE."""


@runtime_checkable
class Extensible(Marching, Protocol):
    """A run that can be continued, with the same bits as a longer run from the beginning.

    A long run is computed in chunks of bounded size: ``advance`` until DONE, ``motion``, ``extend``, and so on. The
    last sample of a chunk is the first of the next; force integrals continue, logs and counts of steps start again.
    """

    def extend(self, cycles: int) -> None:
        """After DONE: drop the stored samples, and make room for some cycles more."""

    def snapshot(self) -> dict[str, Array | IntArray]:
        """After DONE: all that another process needs to go on; owns its arrays."""

    def restore(self, snapshot: Mapping[str, Array | IntArray], cycles: int) -> None:
        """Begin with a snapshot of a run on the same task, and make room for some cycles more."""


Solver = Callable[[Task], Marching]
