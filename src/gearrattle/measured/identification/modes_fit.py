"""``fit_modes``: the parameters of a rough model that fit measured modes and frequency responses best.

    minimise over x = ln(p / start), within bounds:  sum ((model(x) - datum) / standard error)^2

Logarithms keep parameters positive and make the answer independent of units.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gearrattle.assembly import left_out, refuse_motions
from gearrattle.errors import ModelError, Problem
from gearrattle.measured.identification.data_file import Data, read_data
from gearrattle.measured.identification.estimates import SearchResult, Settings, estimates
from gearrattle.measured.identification.fit_result import Fit
from gearrattle.measured.identification.free_parameters import coefficients, free_parameters, unused
from gearrattle.measured.identification.measured_modes import State
from gearrattle.measured.identification.modal_problem import FitProblem, check_modes
from gearrattle.measured.identification.multi_start import search
from gearrattle.measured.identification.multi_start import starts as starts_of
from gearrattle.model import Model


def fit_modes(
    model: Model,
    data: Data,
    free: Sequence[str],
    settings: Settings,
    *,
    contact_ratio: Mapping[str, float] | None = None,
    region: Mapping[str, int] | None = None,
) -> Fit:
    """Find the parameters of a model that fit measured modes and frequency responses best; arguments as of ``fit``.

    Raises
    ------
    ModelError
        an unknown path or name, a value without unit, a mode the model does not have, bounds without the
        start, no free parameter.
    ConvergenceError
        no start converged.
    """
    # look up the free parameters
    refuse_motions(model, "a fit")
    parameters = free_parameters(model, free, settings.bounds, settings.factor)
    # the data, and the coefficients of every state in which they were measured
    default = State(tuple(sorted((contact_ratio or {}).items())), tuple(sorted((region or {}).items())))
    measured = read_data(data, model, default)
    states = {
        state: coefficients(model, parameters, state)
        for state in dict.fromkeys([m.state for m in measured.modes] + [r.state for r in measured.responses])
    }
    # refuse parameters that no coefficient contains
    idle = unused(parameters, list(states.values()))
    if idle:
        rule = "enters neither inertias nor slopes nor dampings of the states measured"
        remedy = "clearances count as closed: give data a region, or leave it out of free"
        raise ModelError(Problem(f"free: {path}", "", rule, remedy) for path in idle)
    # least squares from many starts
    names = tuple(inertia.name for inertia in model.inertias)
    problem = FitProblem(measured, names, states, len(parameters.paths), settings.prior, model.units == "SI")
    check_modes(problem)
    points = starts_of(problem.residuals, parameters.box, settings.starts, settings.seed)
    minima, failed = search(problem.residuals, points, parameters.box, progress=settings.progress)
    searched = SearchResult(minima, settings.starts, failed)
    return estimates(model, problem, parameters, searched, settings, notes=left_out(model))
