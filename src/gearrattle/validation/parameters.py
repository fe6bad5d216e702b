"""What uncertain parameters do to the simulated levels: a small seeded Monte Carlo of whole runs.

Each parameter is drawn from a log-normal distribution with the model's value as mean and the standard error handed in;
the standard deviation of ln(level) over the runs, less what the scatter of their cycles owes to chance, is the
uncertainty. Few runs tell it roughly: its own relative error is about 1 / sqrt(2 (runs - 1)).

Takes a run, standard errors and what makes levels of a run; gives uncertainties.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from gearrattle.calls.simulate import simulate
from gearrattle.errors import ModelError, Problem
from gearrattle.identification.fitted import Fit
from gearrattle.model.paths import value_at
from gearrattle.model.table import did_you_mean
from gearrattle.results import Run
from gearrattle.trajectory import Array

Errors = Mapping[str, float]


def standard_errors(run: Run, given: Errors | Fit) -> dict[str, tuple[float, float]]:
    """Return values and standard errors of parameters by path, SI.

    Raises:
        ModelError: no such path, no positive number there, an error that is not positive or as large as the value.
    """
    errors = {p.path: p.standard_error for p in given.parameters} if isinstance(given, Fit) else dict(given)
    tables, names, problems = run.model.to_tables(), run.model.path_names(), []
    found = {}
    for path, error in errors.items():
        if path not in names:
            remedy = did_you_mean(path, names)
            problems.append(Problem("parameters", path, "is no path of the model", remedy))
            continue
        value = value_at(tables, path)
        if not isinstance(value, int | float) or isinstance(value, bool) or not value > 0:
            problems.append(Problem(f"parameters: {path}", str(value), "must be a positive number in the model"))
        elif not 0.0 < error < value:
            rule = f"a standard error must lie between 0 and the value, {value:g}"
            problems.append(Problem(f"parameters: {path}", f"{error:g}", rule))
        else:
            found[path] = float(value), float(error)
    if problems:
        raise ModelError(problems)
    return found


def uncertainty(
    run: Run,
    errors: Mapping[str, tuple[float, float]],
    levels: Callable[[Run], Array],
    scatter: Array,
    how: tuple[int, int],
    *,
    progress: Callable[[float], None] | None = None,
) -> Array:
    """(2, C) standard deviations of ln(level) that the parameters cause.

    Args:
        run: the simulation, whose settings are kept.
        errors: values and standard errors by path.
        levels: gives the (2, C) levels of a run.
        scatter: (2, C) standard errors of ln(level) of one run.
        how: number of runs, two or more, and the seed.
        progress: called with the fraction done.
    """
    count, seed = how
    generator = np.random.default_rng(seed)
    rows = []
    for number in range(count):
        changed = {}
        for path, (value, error) in errors.items():
            width = math.sqrt(math.log1p((error / value) ** 2))
            changed[path] = value * math.exp(width * generator.standard_normal() - 0.5 * width**2)
        rows.append(levels(simulate(run.model.with_(changed), audit=False)))
        if progress is not None:
            progress((number + 1) / count)
    logs = np.log(np.maximum(np.array(rows), np.finfo(float).tiny))
    return np.asarray(np.sqrt(np.maximum(np.var(logs, axis=0, ddof=1) - scatter**2, 0.0)))
