"""``fit``: a rough model and data in, the model that fits them best out, with what the data leave open.

    minimise over x = ln(p / start), within bounds:  sum ((model(x) - datum) / standard error)^2

Logarithms keep parameters positive and make the answer independent of units. Takes a Model and data; gives a ``Fit``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import left_out, refuse_motions
from gearrattle.errors import ModelError, Problem
from gearrattle.measured.identification.data_file import Data, read_data
from gearrattle.measured.identification.fitted import RIVAL, Fit, FittedParameter, LocalMinimum
from gearrattle.measured.identification.identifiability import Combination, covariance, null_space, split, undetermined
from gearrattle.measured.identification.measured import State
from gearrattle.measured.identification.parameters import Parameters, coefficients, free_parameters, unused
from gearrattle.measured.identification.problem import FitProblem, check_modes
from gearrattle.measured.identification.profile import profile as profile_of
from gearrattle.measured.identification.search import Minimum, search
from gearrattle.model import Model, check_model
from gearrattle.model.quantity import SEED, Count, argument_problems

Array = NDArray[np.float64]
Progress = Callable[[float], None]

FACTOR = 3.0
STARTS = 16


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
    _check_settings(starts, seed, prior)
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
    minima, failed = search(problem.residuals, parameters.box, starts, seed, progress)
    return _estimates(model, problem, parameters, (minima, starts, failed), profile=profile, progress=progress)


def _check_settings(starts: int, seed: int, prior: float | None) -> None:
    problems = argument_problems({"starts": (Count(1), starts), "seed": (SEED, seed)})
    if prior is not None and not (prior > 0.0 and math.isfinite(prior)):
        problems.append(Problem("prior", f"{prior:g}", "must be a finite number greater than zero"))
    if problems:
        raise ModelError(problems)


def _estimates(
    model: Model,
    problem: FitProblem,
    parameters: Parameters,
    searched: tuple[tuple[Minimum, ...], int, int],
    *,
    profile: bool,
    progress: Progress | None,
) -> Fit:
    """Judge the best minimum and put it in words."""
    minima, starts, failed = searched
    best = minima[0]
    rows, jacobian = problem.data_residuals(best.x)
    null = null_space(jacobian)
    inside = best.at_bound == 0
    rank = int(inside.sum()) - null_space(jacobian[:, inside]).shape[1]
    chi_square = float(rows @ rows)
    freedom = rows.size - problem.scales - rank
    scale = math.sqrt(chi_square / freedom) if problem.data.assumed and freedom > 0 else 1.0
    covariances = scale**2 * _covariance(problem, best, null)
    spread = np.sqrt(np.diag(covariances))
    ends: list[tuple[float, float] | None] = [None] * problem.count
    if profile:
        ends = _profiles(problem, parameters, best.x, (spread, scale), progress)
    values = parameters.values(best.x)
    words = {-1: "lower", 0: "", 1: "upper"}
    table = [
        FittedParameter(
            path,
            float(parameters.start[p]),
            float(values[p]),
            float(values[p] * spread[p]),
            float(parameters.lower[p]),
            float(parameters.upper[p]),
            words[int(best.at_bound[p])],
            ends[p],
        )
        for p, path in enumerate(parameters.paths)
    ]
    open_ones = undetermined(parameters.paths, jacobian, split(problem.data_residuals, best.x, null), scale)
    return Fit(
        model=parameters.fitted(model, best.x),
        parameters=tuple(table),
        residuals=problem.residuals_of(best.x),
        chi_square=chi_square,
        degrees_of_freedom=freedom,
        covariance=covariances,
        minima=tuple(
            LocalMinimum(
                m.chi_square, dict(zip(parameters.paths, parameters.values(m.x).tolist(), strict=True)), m.times
            )
            for m in minima
        ),
        starts=starts,
        undetermined=open_ones,
        notes=(*_notes(problem, parameters, minima, (scale, freedom, failed), open_ones), *left_out(model)),
    )


def _covariance(problem: FitProblem, best: Minimum, null: Array) -> Array:
    """(P, P) covariance of the logarithms with parameters on a bound held there."""
    inside = best.at_bound == 0
    jacobian = problem.residuals(best.x)[1][:, inside]
    matrix = np.full((problem.count, problem.count), np.nan)
    matrix[np.ix_(inside, inside)] = covariance(jacobian, null_space(jacobian))
    if problem.prior is None:
        for p in np.flatnonzero(np.any(np.abs(null) > 1e-5, axis=1) & inside):
            matrix[p], matrix[:, p] = np.nan, np.nan
            matrix[p, p] = np.inf
    return matrix


def _profiles(
    problem: FitProblem, parameters: Parameters, x: Array, errors: tuple[Array, float], progress: Progress | None
) -> list[tuple[float, float] | None]:
    """Return the 95 % interval of every parameter, in SI; 0 or inf where the bound comes first."""

    def residuals(y: Array) -> tuple[Array, Array]:
        if progress is not None:
            progress(share)
        return problem.residuals(y)

    spread, scale = errors
    intervals: list[tuple[float, float] | None] = []
    for p, start in enumerate(parameters.start.tolist()):
        share = p / problem.count
        if math.isinf(spread[p]):
            intervals.append((0.0, math.inf))
            continue
        low, high = profile_of(residuals, x, p, parameters.box, errors=(float(spread[p]), scale))
        intervals.append((start * math.exp(low), math.inf if math.isinf(high) else start * math.exp(high)))
    return intervals


def _notes(
    problem: FitProblem,
    parameters: Parameters,
    minima: tuple[Minimum, ...],
    numbers: tuple[float, int, int],
    open_ones: tuple[Combination, ...],
) -> list[str]:
    scale, freedom, failed = numbers
    notes = []
    if problem.data.assumed:
        notes.append(f"standard errors assumed: {'; '.join(problem.data.assumed)}.")
        if freedom > 0:
            notes.append(f"as some were assumed, all are scaled by {scale:.3g} so that chi-square per degree is one.")
        else:
            notes.append("with as many parameters as data the residuals cannot tell whether that is right.")
    if freedom > 0 and not problem.data.assumed:
        from scipy.stats import chi2

        rows = problem.data_residuals(minima[0].x)[0]
        chance = float(chi2.sf(rows @ rows, freedom))
        if chance < 0.01:
            notes.append(
                f"the residuals are larger than the standard errors allow (probability {chance:.1g}): a datum, its "
                "standard error or the model is wrong, and the standard errors of the parameters are too small."
            )
    rivals = [m for m in minima[1:] if m.chi_square - minima[0].chi_square < RIVAL * scale**2]
    if rivals:
        notes.append(
            f"sets of parameters far from this one that fit as well (chi-square within {RIVAL * scale**2:.3g}): "
            f"{len(rivals)}; they are in minima, and the data do not tell them apart."
        )
    if failed:
        notes.append(f"{failed} of the starts did not converge.")
    if any(m for m in minima[0].at_bound):
        paths = [path for path, at in zip(parameters.paths, minima[0].at_bound.tolist(), strict=True) if at]
        notes.append(f"on a bound: {', '.join(paths)}; widen it, unless it is known to hold.")
    if not problem.data.responses and any(_is_scale(c) for c in open_ones):
        notes.append(
            "frequencies and shapes fix no absolute inertia or stiffness: leave one known inertia out of free, or add "
            "a frequency response, whose unit holds a torque. What is open keeps the start's value."
        )
    return notes


def _is_scale(combination: Combination) -> bool:
    """Whether a combination is a common factor of several parameters."""
    powers = combination.exponents.values()
    return combination.structural and len(powers) > 1 and set(powers) == {1.0}
