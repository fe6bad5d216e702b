"""Uncertainty of simulated levels due to uncertain parameters: a small Monte Carlo study of whole runs, with a seed.

Each parameter is drawn from a log-normal distribution, whose mean is the model's value and whose standard deviation is
the given standard error. The variance of ln(level) over the runs, less the variance due to the scatter of cycles within
a run, is the square of the uncertainty. With few runs this is a rough estimate, with a relative error of about
1 / sqrt(2 (runs - 1)). Parameters of a Fit are drawn with its correlations, others independently. The levels of a
channel are peak to peak and rms; C is the number of channels.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.identification.fit_result import Fit
from gearrattle.model import Model
from gearrattle.model.paths import paths_at, value_at
from gearrattle.model.table import did_you_mean
from gearrattle.results import Run
from gearrattle.simulation.simulate import simulate
from gearrattle.trajectory import Array

Errors = Mapping[str, float]


def standard_errors(model: Model, source: Errors | Fit) -> dict[str, tuple[float, float]]:
    """Return values and standard errors of parameters by path, SI; of a pattern all that match have the same error.

    A ModelError refuses a path that does not exist, a value that is not a positive number, and an error that is not
    between 0 and the value.
    """
    # standard errors by path
    stated = {p.path: p.standard_error for p in source.parameters} if isinstance(source, Fit) else dict(source)
    tables = model.to_tables()
    errors = {path: error for named, error in stated.items() for path in paths_at(tables, named)}
    names = model.paths()
    problems = []
    values = {}
    # refuse unknown paths, and errors or values that are not positive
    for path, error in errors.items():
        if path not in names:
            remedy = did_you_mean(path, names)
            problems.append(Problem("parameters", path, "is not a path of the model", remedy))
            continue
        value = value_at(tables, path)
        if not isinstance(value, int | float) or isinstance(value, bool) or not value > 0:
            problems.append(Problem(f"parameters: {path}", str(value), "must be a positive number in the model"))
        elif not 0.0 < error < value:
            rule = f"a standard error must lie between 0 and the value, {value:g}"
            problems.append(Problem(f"parameters: {path}", f"{error:g}", rule))
        else:
            values[path] = float(value), float(error)
    if problems:
        raise ModelError(problems)
    return values


@dataclass(frozen=True)
class Drawn:
    """Runs with randomly drawn parameters.

    Attributes
    ----------
    errors
        values and standard errors by path, SI.
    correlation
        (P, P) of the logarithms of the parameters.
    standard
        (N, P) drawn deviations, in standard errors of the logarithms.
    logs
        (N, 2, C) logarithms of the levels.
    """

    errors: Mapping[str, tuple[float, float]]
    correlation: Array
    standard: Array
    logs: Array

    def uncertainty(self, scatter: Array) -> Array:
        """(2, C) standard deviations of ln(level) by the parameters, the errors (2, C) of one run taken off."""
        return np.asarray(np.sqrt(np.maximum(np.var(self.logs, axis=0, ddof=1) - scatter**2, 0.0)))


def correlations(errors: Mapping[str, tuple[float, float]], source: Errors | Fit) -> Array:
    """(P, P) correlations of the parameters: those of a Fit; the identity if only standard errors are given."""
    if not isinstance(source, Fit):
        return np.eye(len(errors))
    at = [[parameter.path for parameter in source.parameters].index(path) for path in errors]
    covariance = source.covariance[np.ix_(at, at)]
    size = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(size, size)
    known = np.isfinite(correlation)
    return np.asarray(np.where(known, np.clip(correlation, -1.0, 1.0), np.eye(len(at))))


def repeated(
    run: Run,
    errors: Mapping[str, tuple[float, float]],
    correlation: Array,
    levels: Callable[[Run], Array],
    *,
    runs: int,
    seed: int,
    progress: Callable[[float], None] | None = None,
) -> Drawn:
    """Repeat a run with randomly drawn parameters.

    Parameters
    ----------
    correlation
        (P, P) of their logarithms.
    levels
        returns the (2, C) levels of a run.
    runs
        number of runs, two or more.
    """
    size, axes = np.linalg.eigh(correlation)  # a square root that exists for singular correlations too
    root = (axes * np.sqrt(np.maximum(size, 0.0))) @ axes.T
    standard = np.random.default_rng(seed).standard_normal((runs, len(errors))) @ root
    rows = []
    for number, drawn in enumerate(standard.tolist(), start=1):
        changed = {}
        for (path, (value, error)), deviation in zip(errors.items(), drawn, strict=True):
            width = math.sqrt(math.log1p((error / value) ** 2))
            changed[path] = value * math.exp(width * deviation - 0.5 * width**2)
        rows.append(levels(simulate(run.model.with_(changed), audit=False)))
        if progress is not None:
            progress(number / runs)
    return Drawn(errors, correlation, standard, np.log(np.maximum(np.array(rows), np.finfo(float).tiny)))
