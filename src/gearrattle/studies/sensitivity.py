"""What an output follows of all that scatters: rank correlation, rank regression, first-order shares of variance.

    Spearman          correlation of the ranks of one value and of the output
    rank regression   coefficients of the standardised ranks of the output on those of all values together (R. L. Iman,
                      W. J. Conover, The use of the rank transform in regression, Technometrics 21, 1979, pp. 499-509)
    first order       Var E[y | x_i] / Var y (I. M. Sobol', Mathematical Modelling and Computational Experiment 1, 1993,
                      pp. 407-414)

First-order shares are found from samples that were drawn for something else, along cosines of the rank of one value
(E. Plischke, How to compute variance-based sensitivity indicators with your spreadsheet software, Environmental
Modelling & Software 35, 2012, pp. 188-191). Cosines cos(pi k (r + 1/2) / n), k = 1 to M, are orthogonal over the ranks
r, so that their squared coefficients add up to the share R2 explained. Chance alone explains M/(n - 1); the adjusted
1 - (1 - R2) (n - 1)/(n - 1 - M) takes that away, and may fall below zero. What chance exceeds in one case of twenty
comes from the F-law of M and n - 1 - M degrees of freedom.

Takes plain arrays, or the Dataset of a study; gives coefficients.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.studies.layout import axes_in, numbers_of, output_in, scattered, subject_of
from gearrattle.studies.plan import SAMPLE

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

COSINES = 6
ENOUGH = 64  # samples, below which first-order shares are not told
_RARE = 0.05


def rank_correlations(x: Array, y: Array) -> Array:
    """Return (d,) Spearman's correlations of every column of x (n, d) with y (n,); NaN if y is constant."""
    ranks, of_y = _standard_ranks(x), _standard_ranks(y[:, None])
    return np.asarray((ranks.T @ of_y)[:, 0] / len(y))


def rank_regression(x: Array, y: Array) -> tuple[Array, float]:
    """Return (d,) coefficients of the standardised ranks, and the share of the ranks' variance they explain.

    Args:
        x: (n, d) values.
        y: (n,) output.

    Returns:
        NaN if y is constant, or if there are no more samples than coefficients.
    """
    n, d = x.shape
    if n <= d + 1 or np.ptp(y) == 0.0:
        return np.full(d, np.nan), float("nan")
    ranks, of_y = _standard_ranks(x), _standard_ranks(y[:, None])[:, 0]
    found = np.linalg.lstsq(ranks, of_y, rcond=None)[0]
    return np.asarray(found), 1.0 - float(np.mean((of_y - ranks @ found) ** 2))


def first_order(x: Array, y: Array, cosines: int = COSINES) -> Array:
    """Return (d,) first-order shares of the variance of y (n,), one for every column of x (n, d); adjusted.

    Args:
        x: (n, d) values, drawn independently of each other.
        y: (n,) output.
        cosines: of the rank of a value; more follow it in finer detail, and leave more to chance.
    """
    n = len(y)
    if n <= cosines + 1 or np.ptp(y) == 0.0:
        return np.full(x.shape[1], np.nan)
    ordered = (y - y.mean())[np.argsort(x, axis=0, kind="stable")]
    k = np.arange(1, cosines + 1)[:, None]
    basis = np.cos(np.pi * k * (np.arange(n) + 0.5) / n) * np.sqrt(2.0 / n)
    explained = np.sum((basis @ ordered) ** 2, axis=0) / np.sum((y - y.mean()) ** 2)
    return np.asarray(1.0 - (1.0 - explained) * (n - 1) / (n - 1 - cosines))


def chance_levels(n: int, cosines: int = COSINES) -> tuple[float, float]:
    """What a rank correlation, and a first-order share, of n samples exceed by chance in one case of twenty."""
    from scipy.stats import f, norm

    if n < 3:
        return float("nan"), float("nan")
    correlation = float(norm.ppf(1.0 - 0.5 * _RARE)) / np.sqrt(n - 1.0)
    left = n - 1 - cosines
    if left < 1:
        return correlation, float("nan")
    quantile = float(f.ppf(1.0 - _RARE, cosines, left))
    explained = cosines * quantile / (cosines * quantile + left)
    return correlation, 1.0 - (1.0 - explained) * (n - 1) / left


def sensitivities(data: xr.Dataset, output: str) -> xr.Dataset:
    """Return how an output follows each value that scatters.

    Args:
        data: what ``study`` returned, with samples; of a study with axes, one place of them: ``data.isel(...)``.
        output: name of an output; codes count as numbers.

    Returns:
        A Dataset along "value" (paths), and the output's subjects: ``spearman``, ``rank_regression``, ``first_order``
        (NaN below 64 samples); by subject ``explained``, the share of the ranks' variance that the regression explains,
        ``samples``, and ``chance_correlation`` and ``chance_first_order``, what chance exceeds in one case of twenty.
        NaN where an output is the same in all cases. Cases that failed are left out.

    Raises:
        ModelError: no samples, axes that have not been chosen from, no such output.
    """
    import xarray as xr

    values = numbers_of(output_in(data, output))
    paths = scattered(data)
    if SAMPLE not in values.dims or not paths:
        raise ModelError(Problem("data", "", "sensitivities need samples", "let values scatter: vary, samples"))
    if axes_in(data):
        axes = ", ".join(axes_in(data))
        remedy = f"choose one place: data.isel({{{axes_in(data)[0]!r}: 0}})"
        raise ModelError(Problem("data", axes, "sensitivities are of one place of the axes", remedy))
    x = np.column_stack([np.asarray(data[path].values, dtype=np.float64) for path in paths])
    subject = subject_of(data, output)
    each = values.transpose(subject, SAMPLE).values if subject else values.values[None, :]
    rows = [_row(x, y) for y in each]
    over = (subject,) if subject else ()
    names = ("spearman", "rank_regression", "first_order")
    found = {name: ((*over, "value"), np.array([row[0][i] for row in rows])) for i, name in enumerate(names)}
    figures = ("explained", "samples", "chance_correlation", "chance_first_order")
    told = {name: (over, np.array([row[1][i] for row in rows])) for i, name in enumerate(figures)}
    if not subject:
        found = {name: (dims, array[0]) for name, (dims, array) in found.items()}
        told = {name: (dims, array[0]) for name, (dims, array) in told.items()}
    coordinates = {"value": list(paths), **({subject: data[subject].values} if subject else {})}
    return xr.Dataset({**found, **told}, coordinates, {"output": output, "cosines": COSINES})


def _row(x: Array, y: Array) -> tuple[tuple[Array, Array, Array], tuple[float, int, float, float]]:
    """Coefficients of one subject, and what they are to be judged by."""
    there = np.isfinite(y)
    x, y = x[there], y[there]
    n = len(y)
    nothing = np.full(x.shape[1], np.nan)
    if n < 3:
        return (nothing, nothing, nothing), (float("nan"), n, float("nan"), float("nan"))
    regression, explained = rank_regression(x, y)
    shares = first_order(x, y) if n >= ENOUGH else nothing
    return (rank_correlations(x, y), regression, shares), (explained, n, *chance_levels(n))


def _standard_ranks(values: Array) -> Array:
    """Ranks of every column, mean 0 and deviation 1; NaN where all are equal."""
    from scipy.stats import rankdata

    ranks = np.asarray(rankdata(values, axis=0)) - 0.5 * (len(values) + 1)
    deviation = ranks.std(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(ranks / np.where(deviation > 0.0, deviation, np.nan))
