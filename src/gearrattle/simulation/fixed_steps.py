"""Fixed steps against the stability regions of their methods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gearrattle.analysis.stiffness import RegionStiffness
from gearrattle.assembly import assemble
from gearrattle.engine.solvers import SOLVERS
from gearrattle.engine.solvers.one_step import FixedStep
from gearrattle.engine.solvers.step_stability import largest_stable_step
from gearrattle.model import Model
from gearrattle.simulation.simulate import needs_exact, prepare


@dataclass(frozen=True)
class StepLimit:
    """The step of a fixed-step algorithm, and how it treats the modes of all regions.

    Attributes
    ----------
    step
        the step a run of the model would take [s].
    product
        step times the largest eigenvalue of all regions, in magnitude.
    growth
        largest factor by which a step multiplies a mode; above 1 the run invents motion.
    labels
        region of the mode with the largest growth.
    largest_step
        largest step that makes no mode grow in any region [s].
    """

    algorithm: str
    step: float
    product: float
    growth: float
    labels: dict[str, int]
    largest_step: float


def step_limits(
    model: Model, regions: Sequence[RegionStiffness], step: float | str | None = None
) -> tuple[StepLimit, ...]:
    """Return one limit for every fixed-step algorithm, none for a driveline that only ``exact`` takes; ``step`` in s,
    with a unit, or None for the file's, else the algorithm's own. ModelError for bad settings, or without a static
    equilibrium.
    """
    if needs_exact(assemble(model)):
        return ()
    values = [np.hstack([r.eigenvalues.elastic, r.eigenvalues.rigid]) for r in regions]
    every = np.hstack(values)
    limits = []
    for name, solver in SOLVERS.items():
        if not isinstance(solver, FixedStep):
            continue
        taken = solver.step_of(prepare(model, {"algorithm": name, "step": step}, False).task)
        growth = [float(solver.tableau.growth(taken * value).max()) for value in values]
        worst = int(np.argmax(growth))
        limit = largest_stable_step(solver.tableau, every)
        fastest = float(np.abs(every).max())
        limits.append(StepLimit(name, taken, taken * fastest, growth[worst], regions[worst].labels, limit))
    return tuple(limits)
