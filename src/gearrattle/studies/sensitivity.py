"""Sensitivity of an output to values that scatter: rank correlation, rank regression, first-order shares of variance.

    Spearman          correlation of the ranks of one value and of the output
    rank regression   coefficients of the standardised ranks of the output on those of all values together (R. L. Iman,
                      W. J. Conover, The use of the rank transform in regression, Technometrics 21, 1979, pp. 499-509)
    first order       Var E[y | x_i] / Var y (I. M. Sobol', Mathematical Modelling and Computational Experiment 1, 1993,
                      pp. 407-414)

First-order shares are estimated from samples of any independent design, along cosines of the rank of one value
(E. Plischke, How to compute variance-based sensitivity indicators with your spreadsheet software, Environmental
Modelling & Software 35, 2012, pp. 188-191). Cosines cos(pi k (r + 1/2) / n), k = 1 to M, are orthogonal over the ranks
r, so that their squared coefficients add up to the share R2 explained. Chance alone explains M/(n - 1); the adjusted
1 - (1 - R2) (n - 1)/(n - 1 - M) takes that away, and may fall below zero. What chance exceeds in one case of twenty
comes from the F-law of M and n - 1 - M degrees of freedom.

Other designs give more: Sobol' indices of first, second and total order (``indices``), or the output at both ends of
every value (``swings``). ``sensitivities`` returns what the design allows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.result import KIND
from gearrattle.studies.dataset_layout import (
    axes_in,
    numbers_of,
    output_in,
    sampled_in,
    sampling_of,
    subject_of,
    units_of,
)
from gearrattle.studies.designs import DESIGNS, ONE_AT_A_TIME, PAIRS, SALTELLI
from gearrattle.studies.one_at_a_time import swings
from gearrattle.studies.plan import SAMPLE
from gearrattle.studies.sobol_indices import indices

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

COSINES = 6
ENOUGH = 64  # samples; with fewer, first-order shares are not reported
_RARE = 0.05


def rank_correlations(x: Array, y: Array) -> Array:
    """Return (d,) Spearman's correlations of every column of x (n, d) with y (n,); NaN if y is constant."""
    ranks = _standard_ranks(x)
    of_y = _standard_ranks(y[:, None])
    return np.asarray((ranks.T @ of_y)[:, 0] / len(y))


def rank_regression(x: Array, y: Array) -> tuple[Array, float]:
    """Return (d,) coefficients of the standardised ranks, and the share of the ranks' variance they explain.

    x are (n, d) values, y (n,) the output. NaN if y is constant, or if there are no more samples than coefficients.
    """
    n, d = x.shape
    if n <= d + 1 or np.ptp(y) == 0.0:
        return np.full(d, np.nan), float("nan")
    ranks = _standard_ranks(x)
    of_y = _standard_ranks(y[:, None])[:, 0]
    coefficients = np.linalg.lstsq(ranks, of_y, rcond=None)[0]
    return np.asarray(coefficients), 1.0 - float(np.mean((of_y - ranks @ coefficients) ** 2))


def first_order(x: Array, y: Array, cosines: int = COSINES) -> Array:
    """Return (d,) first-order shares of the variance of y (n,), one for every column of x (n, d); adjusted.

    The columns are drawn independently of each other. More cosines of the rank of a value resolve finer detail, and
    leave more to chance.
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
    """Levels that a rank correlation, and a first-order share, of n samples exceed by chance in one case of twenty."""
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
    """Return how an output follows each value that scatters: what the design of the samples allows.

    Parameters
    ----------
    data
        what ``study`` returned, with samples; of a study with axes, one place of them: ``data.isel(...)``.
    output
        name of an output; codes count as numbers.

    Returns
    -------
    xr.Dataset
        A Dataset along "value" (paths), and the output's subjects. From independent samples: ``spearman``,
        ``rank_regression``, ``first_order`` (NaN below 64 samples); by subject ``explained``, the share of the ranks'
        variance that the regression explains, ``samples``, and ``chance_correlation`` and ``chance_first_order``, what
        chance exceeds in one case of twenty. From Saltelli's the same, over their independent half, but
        ``first_order``, ``total_order`` and, along "value" and "with_value", ``second_order`` are Sobol' indices, with
        ``..._half_width`` of their 95 % intervals, and ``base_points`` that were whole. From one value at a time:
        ``base``, ``low``, ``high`` and ``swing``, what the output is, and ``low_value``, ``high_value``,
        ``base_value``, what the values are. Coordinates ``label`` and ``unit`` name the values in words,
        ``output_unit`` is the output's; ``attrs["sampling"]`` tells the design. NaN where an output is the same in
        all cases. Cases that failed are left out.

    Raises
    ------
    ModelError
        no samples, axes that have not been chosen from, no such output.
    NotInstalled
        Sobol' indices need SALib, and it is not here.

    Examples
    --------
    >>> vary = {"mesh.gear.backlash": {"distribution": "uniform", "from": "0.05 mm", "to": "0.2 mm"}}
    >>> data = gr.study(gr.example("case3"), outputs=["largest impact energy"], vary=vary, samples=16, workers=1)
    >>> sorted(gr.studies.sensitivities(data, "largest impact energy").data_vars)[:3]
    ['chance_correlation', 'chance_first_order', 'explained']
    """
    import xarray as xr

    # samples of the output at one place of the axes
    values = numbers_of(output_in(data, output))
    paths = sampled_in(data)
    method = sampling_of(data)
    if SAMPLE not in values.dims or not paths:
        raise ModelError(Problem("data", "", "sensitivities need samples", "let values scatter: vary, samples"))
    if axes_in(data):
        axes = ", ".join(axes_in(data))
        remedy = f"choose one place: data.isel({{{axes_in(data)[0]!r}: 0}})"
        raise ModelError(Problem("data", axes, "sensitivities are of one place of the axes", remedy))
    # measures of the design, subject by subject
    x = np.column_stack([np.asarray(data[path].values, dtype=np.float64) for path in paths])
    subject = subject_of(data, output)
    responses = values.transpose(subject, SAMPLE).values if subject else values.values[None, :]
    analyse = _TOLD.get(method, _ranked)
    rows = [analyse(x, y, method) for y in responses]
    # Dataset over values and subjects
    variables = {
        name: ((*((subject,) if subject else ()), *over), np.array([row[name][1] for row in rows]))
        if subject
        else (over, np.asarray(rows[0][name][1]))
        for name, (over, _) in rows[0].items()
    }
    coordinates: dict[str, Any] = {"value": list(paths), **({subject: values[subject].values} if subject else {})}
    coordinates["label"] = ("value", [str(data[path].attrs.get("long_name", path)) for path in paths])
    coordinates["unit"] = ("value", [str(data[path].attrs.get("units", "")) for path in paths])
    if method == PAIRS:
        coordinates[_WITH] = list(paths)
    units = list(units_of(data, output).values())
    coordinates["output_unit"] = (subject, units) if subject else units[0]
    attributes = {"output": output, "subject": subject, "cosines": COSINES, "sampling": method}
    return xr.Dataset(variables, coordinates, {KIND: "sensitivities", **attributes})


Row = dict[str, tuple[tuple[str, ...], Any]]
_WITH = "with_value"


def _ranked(x: Array, y: Array, _method: str) -> Row:
    """Coefficients from independent samples."""
    coefficients, figures = _row(x, y)
    names = ("spearman", "rank_regression", "first_order")
    row: Row = {name: (("value",), array) for name, array in zip(names, coefficients, strict=True)}
    figure_names = ("explained", "samples", "chance_correlation", "chance_first_order")
    return row | {name: ((), figure) for name, figure in zip(figure_names, figures, strict=True)}


def _sobol(x: Array, y: Array, method: str) -> Row:
    """Sobol' indices, and rank coefficients of the samples that are independent."""
    d = x.shape[1]
    estimates = indices(y, d, method)
    apart = DESIGNS[method].independent(d, len(y))
    row = _ranked(x[apart], y[apart], method) | {
        "first_order": (("value",), estimates.first),
        "first_order_half_width": (("value",), estimates.first_half),
        "total_order": (("value",), estimates.total),
        "total_order_half_width": (("value",), estimates.total_half),
        "base_points": ((), estimates.base_points),
    }
    del row["chance_first_order"]
    if method == PAIRS:
        over = ("value", _WITH)
        row |= {"second_order": (over, estimates.second), "second_order_half_width": (over, estimates.second_half)}
    return row


def _swung(x: Array, y: Array, _method: str) -> Row:
    """Output at both ends of every value."""
    d = x.shape[1]
    swing = swings(y, d)
    places = np.arange(d)
    columns = {
        "low": swing.low,
        "high": swing.high,
        "swing": swing.swing,
        "base_value": x[0],
        "low_value": x[2 * places + 1, places],
        "high_value": x[2 * places + 2, places],
    }
    return {"base": ((), swing.base), **{name: (("value",), column) for name, column in columns.items()}}


_TOLD: Mapping[str, Callable[[Array, Array, str], Row]] = {SALTELLI: _sobol, PAIRS: _sobol, ONE_AT_A_TIME: _swung}
"""By design: how an output follows each value."""


def _row(x: Array, y: Array) -> tuple[tuple[Array, Array, Array], tuple[float, int, float, float]]:
    """Coefficients of one subject, and their chance levels."""
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
