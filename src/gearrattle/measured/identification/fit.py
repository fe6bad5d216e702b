"""``fit``: a rough model and data in, the model that fits them best out, with what the data leave open.

    minimise over x = ln(p / start), within bounds:  sum ((model(x) - datum) / standard error)^2

Logarithms keep parameters positive and make the answer independent of units. Takes a Model and data; gives a ``Fit``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gearrattle.assembly import left_out, refuse_motions
from gearrattle.errors import ModelError, Problem
from gearrattle.measured.identification.data_file import Data, read_data
from gearrattle.measured.identification.estimates import (
    FACTOR,
    STARTS,
    Progress,
    Searched,
    check_settings,
    estimates,
)
from gearrattle.measured.identification.fitted import Fit
from gearrattle.measured.identification.measured import State
from gearrattle.measured.identification.parameters import coefficients, free_parameters, unused
from gearrattle.measured.identification.problem import FitProblem, check_modes
from gearrattle.measured.identification.search import search
from gearrattle.measured.identification.search import starts as starts_of
from gearrattle.model import Model, check_model


def fit(
    model: Model,
    data: Data,
    free: Sequence[str],
    *,
    bounds: Mapping[str, tuple[float | str, float | str]] | None = None,
    factor: float = FACTOR,
    contact_ratio: Mapping[str, float] | None = None,
    region: Mapping[str, int] | None = None,
    starts: int = STARTS,
    seed: int = 0,
    prior: float | None = None,
    profile: bool = False,
    progress: Progress | None = None,
) -> Fit:
    """Find the parameters of a model that fit measured modes and frequency responses best.

    Parameters
    ----------
    model
        the rough start; what is not free keeps its value.
    data
        path of a data file (TOML), or its tables: ``{"mode": [{"number": 2, "frequency": "55 Hz"}]}``.
    free
        paths of the parameters to find, as ``Model.with_`` takes them; ``"inertia.*.J"`` frees all that match.
    bounds
        lowest and highest value by path, as in a model file.
    factor
        bounds of the others: start / factor and start * factor.
    contact_ratio
        as of ``modes``, for data that do not name their own state; every clearance is closed otherwise.
    region
        as of ``modes``, likewise.
    starts
        number of starts: the model itself, then a Latin hypercube in the bounds.
    seed
        of the hypercube; the same seed gives the same answer.
    prior
        standard deviation of every ln(parameter / start), as if the start had been measured; None: no prior.
    profile
        also find 95 % profile-likelihood intervals; takes some tens of local searches a parameter.
    progress
        called with the finished share; what it raises ends the fit.

    Returns
    -------
    Fit
        The fitted model, standard errors, residuals, all distinct minima, and what the data do not determine.

    Raises
    ------
    ModelError
        an unknown path or name, a value without unit, a mode the model does not have, bounds without the
        start, no free parameter.
    ConvergenceError
        no start converged.

    Examples
    --------
    >>> model = gr.example("case3")
    >>> second = gr.modes(model).frequencies[1] / (2.0 * np.pi)
    >>> start = model.with_({"coupling.clutch.stiffness": 1.2 * model.couplings[0].stiffness})
    >>> data = {"mode": [{"number": 2, "frequency": f"{second} Hz"}]}
    >>> fit = gr.identification.fit(start, data, ["coupling.clutch.stiffness"], starts=1)
    >>> round(fit.parameters[0].value / model.couplings[0].stiffness, 4)
    1.0
    """
    check_model(model)
    check_settings(starts, seed, prior)
    refuse_motions(model, "a fit")
    parameters = free_parameters(model, free, bounds or {}, factor)
    default = State(tuple(sorted((contact_ratio or {}).items())), tuple(sorted((region or {}).items())))
    measured = read_data(data, model, default)
    states = {
        state: coefficients(model, parameters, state)
        for state in dict.fromkeys([m.state for m in measured.modes] + [r.state for r in measured.responses])
    }
    idle = unused(parameters, list(states.values()))
    if idle:
        rule = "enters neither inertias nor slopes nor dampings of the states measured"
        remedy = "clearances count as closed: give data a region, or leave it out of free"
        raise ModelError(Problem(f"free: {path}", "", rule, remedy) for path in idle)
    names = tuple(inertia.name for inertia in model.inertias)
    problem = FitProblem(measured, names, states, len(parameters.paths), prior, model.units == "SI")
    check_modes(problem)
    points = starts_of(problem.residuals, parameters.box, starts, seed)
    minima, failed = search(problem.residuals, points, parameters.box, progress=progress)
    searched = Searched(minima, starts, failed)
    return estimates(model, problem, parameters, searched, notes=left_out(model), profile=profile, progress=progress)
