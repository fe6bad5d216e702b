"""A ``Fit`` from the local minima of a least-squares problem: errors, intervals, open combinations and notes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.identification.data_problem import DataProblem
from gearrattle.measured.identification.fit_result import UNLIKELY, Fit, FittedParameter, LocalMinimum
from gearrattle.measured.identification.free_parameters import Parameters
from gearrattle.measured.identification.identifiability import (
    null_space,
    split,
    undetermined,
)
from gearrattle.measured.identification.multi_start import EXACT, Effort, Minimum, watched
from gearrattle.measured.identification.profile import LEVEL
from gearrattle.measured.identification.profile import profile as profile_of
from gearrattle.model import Model
from gearrattle.model.value_kinds import SEED, Count, argument_problems

Array = NDArray[np.float64]
Progress = Callable[[float], None]


@dataclass(frozen=True)
class Settings:
    """How values are searched and judged, whatever was measured; meanings as of ``fit``.

    A ModelError has all settings that no search can have.
    """

    bounds: Mapping[str, tuple[float | str, float | str]]
    factor: float
    starts: int
    seed: int
    prior: float | None
    profile: bool
    progress: Progress | None

    def __post_init__(self) -> None:
        problems = argument_problems({"starts": (Count(1), self.starts), "seed": (SEED, self.seed)})
        if self.prior is not None and not (self.prior > 0.0 and math.isfinite(self.prior)):
            problems.append(Problem("prior", f"{self.prior:g}", "must be a finite number greater than zero"))
        if problems:
            raise ModelError(problems)


@dataclass(frozen=True)
class Searched:
    """Result of a search."""

    minima: tuple[Minimum, ...]
    starts: int
    failed: int
    effort: Effort = EXACT


def estimates(
    model: Model,
    problem: DataProblem,
    parameters: Parameters,
    searched: Searched,
    settings: Settings,
    *,
    notes: Sequence[str],
) -> Fit:
    """Return the fit at the best minimum: errors, intervals, open combinations and notes."""
    # residuals, and the directions without information, at the best minimum
    minima = searched.minima
    best = minima[0]
    rows, jacobian = problem.data_residuals(best.x)
    null = null_space(jacobian)
    inside = best.at_bound == 0
    # degrees of freedom; errors that were assumed are scaled to chi-square per degree one
    rank = int(inside.sum()) - null_space(jacobian[:, inside]).shape[1]
    chi_square = float(rows @ rows)
    freedom = rows.size - problem.scales - rank
    scale = math.sqrt(chi_square / freedom) if problem.assumed and freedom > 0 else 1.0
    # covariance of the logarithms, and standard errors
    covariances = scale**2 * _covariance(problem, best, null)
    spread = np.sqrt(np.diag(covariances))
    # profile-likelihood intervals
    ends: list[tuple[float, float] | None] = [None] * best.x.size
    if settings.profile:
        rises = LEVEL * _widened(problem, best, spread, scale)
        progress = settings.progress
        ends = _profiles(problem, parameters, best.x, (spread, rises), effort=searched.effort, progress=progress)
    # the parameters, those on a bound named
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
    # combinations that the data leave open
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
        starts=searched.starts,
        undetermined=open_ones,
        chance=None if problem.assumed or freedom <= 0 else problem.chance(best.x, freedom),
        notes=(*_notes(problem, parameters, searched, (scale, freedom)), *problem.remarks(best.x, open_ones), *notes),
    )


def _covariance(problem: DataProblem, best: Minimum, null: Array) -> Array:
    """(P, P) covariance of the logarithms with parameters on a bound held there."""
    inside = best.at_bound == 0
    matrix = np.full((inside.size, inside.size), np.nan)
    matrix[np.ix_(inside, inside)] = problem.covariance(best.x, inside)
    if problem.prior is None:
        for p in np.flatnonzero(np.any(np.abs(null) > 1e-5, axis=1) & inside):
            matrix[p] = np.nan
            matrix[:, p] = np.nan
            matrix[p, p] = np.inf
    return matrix


def _widened(problem: DataProblem, best: Minimum, spread: Array, scale: float) -> Array:
    """Return (P,) how much larger the variance of a parameter is than independent residuals of size one make it.

    By so much chi-square rises more until it leaves the interval (J. T. Kent 1982, Biometrika 69, 19); ``scale``
    squared where one of both variances is not known.
    """
    inside = best.at_bound == 0
    alone = np.full(best.x.size, np.nan)
    alone[inside] = np.diag(problem.independent(best.x, inside))
    with np.errstate(invalid="ignore", divide="ignore"):
        widened = spread**2 / alone
    return np.where(np.isfinite(widened) & (widened > 0.0), widened, scale**2)


def _profiles(
    problem: DataProblem,
    parameters: Parameters,
    x: Array,
    errors: tuple[Array, Array],
    *,
    effort: Effort,
    progress: Progress | None,
) -> list[tuple[float, float] | None]:
    """Return the 95 % interval of every parameter, in SI; 0 or inf where the bound comes first."""
    spread, rises = errors
    intervals: list[tuple[float, float] | None] = []
    for p, start in enumerate(parameters.start.tolist()):
        if math.isinf(spread[p]):
            intervals.append((0.0, math.inf))
            continue
        residuals = watched(problem.residuals, progress, p / x.size)
        errors_of_one = float(spread[p]), float(rises[p])
        low, high = profile_of(residuals, x, p, parameters.box, errors_of_one, effort=effort)
        intervals.append((start * math.exp(low), math.inf if math.isinf(high) else start * math.exp(high)))
    return intervals


def _notes(problem: DataProblem, parameters: Parameters, searched: Searched, numbers: tuple[float, int]) -> list[str]:
    """Return notes for any data: assumed errors, large residuals, rival minima, bounds."""
    (scale, freedom) = numbers
    minima = searched.minima
    # standard errors that were assumed, or that the residuals exceed
    notes = []
    if problem.assumed:
        notes.append(f"standard errors assumed: {'; '.join(problem.assumed)}.")
        if freedom > 0:
            notes.append(f"as some were assumed, all are scaled by {scale:.3g} so that chi-square per degree is one.")
        else:
            notes.append("with as many parameters as data the residuals cannot tell whether that is right.")
    elif freedom > 0 and (chance := problem.chance(minima[0].x, freedom)) < UNLIKELY:
        notes.append(
            f"the residuals are larger than the standard errors allow (probability {chance:.1g}): a datum, its "
            "standard error or the model is wrong, and the standard errors of the parameters are too small."
        )
    # other minima that fit as well
    rivals = [m for m in minima[1:] if m.chi_square - minima[0].chi_square < LEVEL * scale**2]
    if rivals:
        notes.append(
            f"sets of parameters far from this one that fit as well (chi-square within {LEVEL * scale**2:.3g}): "
            f"{len(rivals)}; they are in minima, and the data do not tell them apart."
        )
    # searches that failed, and parameters on a bound
    if searched.failed:
        notes.append(f"{searched.failed} of the starts did not converge.")
    if any(m for m in minima[0].at_bound):
        paths = [path for path, at in zip(parameters.paths, minima[0].at_bound.tolist(), strict=True) if at]
        notes.append(f"on a bound: {', '.join(paths)}; widen it, unless it is known to hold.")
    return notes
