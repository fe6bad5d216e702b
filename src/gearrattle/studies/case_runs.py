"""Computation of one chunk of a study: every case is simulated by the settings of its model, and its outputs kept.

Cases that allow it are computed together (``studies.case_batches``), the others one by one. A case that fails has no
values; its message says why, and the others go on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import Cancelled, ConvergenceError, ModelError
from gearrattle.model import Model
from gearrattle.simulation.simulate import simulate
from gearrattle.studies.case_batches import batched, is_of_crossings
from gearrattle.studies.outputs import Outputs
from gearrattle.studies.plan import Plan

MISSING, DONE, NO_MODEL, NOT_CONVERGED, FAILED, WORKER_LOST = range(6)
OUTCOMES = ("missing", "done", "no such model", "did not converge", "failed", "worker lost")
"""Outcomes of a case."""


@dataclass(frozen=True)
class Computed:
    """Results of a chunk.

    Attributes
    ----------
    values
        by output: the chunk's box, and the output's subjects.
    outcome
        the box, codes of ``OUTCOMES``.
    messages
        of the cases that failed, by where they lie in the box.
    """

    values: dict[str, NDArray[Any]]
    outcome: NDArray[np.int8]
    messages: dict[tuple[int, ...], str]


def compute(plan: Plan, outputs: Outputs, chunk: int, progress: Callable[[float], None] | None = None) -> Computed:
    """Compute every case of a chunk.

    ``progress`` is called now and then, and after every case computed alone, with the finished share; what it raises
    ends the work.
    """
    # cases computed together
    computed = empty(plan, outputs, chunk)
    values, done = batched(plan, outputs, chunk, progress)
    for name, kept in values.items():
        computed.values[name][...] = kept.reshape(computed.values[name].shape)
    computed.outcome.flat[np.flatnonzero(done)] = DONE
    box = plan.box(chunk)
    # the others one by one
    for i, (at, changes) in enumerate(plan.cases(chunk) if not done.all() else ()):
        if done[i]:
            continue
        try:
            # results known before, else a simulation
            of_case = outputs.known.get(tuple(i + part.start for i, part in zip(at, box, strict=True)))
            if of_case is None:
                model = plan.model.with_(changes) if changes else plan.model
                of_case = outputs.of(simulate(model, samples_per_cycle=_samples_for(model, outputs), audit=False))
            for name, value in of_case.items():
                computed.values[name][at] = value
            computed.outcome[at] = DONE
        except Cancelled:
            raise
        except Exception as error:  # a case's failure is a result: any error at all is reported, and the study goes on
            computed.outcome[at] = code_of(error)
            computed.messages[at] = " ".join(f"{error}".split()) or type(error).__name__
        if progress is not None:
            progress((i + 1) / computed.outcome.size)
    return computed


def _samples_for(model: Model, outputs: Outputs) -> int | None:
    """Return how many samples per cycle a case needs: one where exact crossings suffice, None for the model's own."""
    is_exact = model.simulation.algorithm == "exact" and outputs.function is None
    return 1 if is_exact and all(map(is_of_crossings, outputs.chosen)) else None


def empty(plan: Plan, outputs: Outputs, chunk: int, outcome: int = MISSING) -> Computed:
    """A chunk without results, all of its cases of one outcome."""
    box = tuple(part.stop - part.start for part in plan.box(chunk))
    values = {
        output.name: np.full((*box, len(output.subjects)) if output.dimension else box, output.nothing, output.dtype)
        for output in outputs.all
    }
    return Computed(values, np.full(box, outcome, dtype=np.int8), {})


def code_of(error: Exception) -> int:
    """Return the outcome code of a case that raised this."""
    if isinstance(error, ModelError):
        return NO_MODEL
    return NOT_CONVERGED if isinstance(error, ConvergenceError) else FAILED
