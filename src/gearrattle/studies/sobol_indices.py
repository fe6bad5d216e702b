"""Sobol' indices of first, second and total order, from the samples of a Saltelli design, with bootstrap intervals.

    first order    S_i  = Var E[y | x_i] / Var y                the effect of x_i alone
    total order    ST_i = E Var[y | all but x_i] / Var y        with all its interactions
    second order   S_ij = Var E[y | x_i, x_j] / Var y - S_i - S_j

I. M. Sobol', Mathematics and Computers in Simulation 55, 2001, pp. 271-280; estimators of A. Saltelli and others,
Variance based sensitivity analysis of model output, Computer Physics Communications 181, 2010, pp. 259-270 (table 2,
lines b and f), by SALib. Base points are drawn again a thousand times for the intervals, +- z deviations. A base point
one of whose cases failed is left out whole.
"""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import sha256

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, NotInstalled, Problem
from gearrattle.studies.designs import PAIRS, block
from gearrattle.wording import counted

Array = NDArray[np.float64]

RESAMPLES = 1000
_FEWEST = 4
_FOUND = ("S1", "S1_conf", "ST", "ST_conf")
_MOST_RECENT = 256
_RECENT: dict[tuple[bytes, int, bool, float], dict[str, Array]] = {}
"""Indices of samples by their digest: sentence, tables, figures and numbers of a page ask for the same ones."""


@dataclass(frozen=True)
class Indices:
    """Indices of one output, and half the width of their intervals; NaN where they cannot be estimated.

    Attributes
    ----------
    first, first_half, total, total_half
        (d,).
    second, second_half
        (d, d) symmetric, NaN on the diagonal and where the design has no pairs.
    base_points
        that were whole.
    """

    first: Array
    first_half: Array
    total: Array
    total_half: Array
    second: Array
    second_half: Array
    base_points: int


def indices(y: Array, d: int, method: str, level: float = 0.95) -> Indices:
    """Return the indices of an output over a Saltelli design.

    Parameters
    ----------
    y
        (cases,) the output, in the order of the design; NaN where a case failed.
    method
        "saltelli" or "saltelli-pairs".

    Raises
    ------
    ModelError
        the cases are not whole blocks of the design.
    NotInstalled
        SALib is not here.
    """
    step = block(method, d)
    if not step or len(y) % step:
        rule = f"must be whole blocks of {counted(step, 'case')}" if step else "is no design of Saltelli's"
        raise ModelError(Problem("data", f"{len(y)} samples", rule, "give all samples of the study"))
    blocks = y.reshape(-1, step)
    blocks = blocks[np.isfinite(blocks).all(axis=1)]
    nothing = np.full(d, np.nan)
    pairs = np.full((d, d), np.nan)
    ends = blocks[:, [0, -1]]
    if len(blocks) < _FEWEST or np.ptp(ends) <= 1e-12 * np.abs(ends).max():
        return Indices(nothing, nothing, nothing, nothing, pairs, pairs, len(blocks))
    estimates = _analyzed(blocks.ravel(), d, method == PAIRS, level)
    second, second_half = (_symmetric(estimates[key]) if key in estimates else pairs for key in ("S2", "S2_conf"))
    first, around, total, about = (np.array(estimates[key], dtype=np.float64) for key in _FOUND)
    return Indices(first, around, total, about, second, second_half, len(blocks))


def _analyzed(y: Array, d: int, pairs: bool, level: float) -> dict[str, Array]:
    """Sobol' indices of some samples by SALib, cached, as a page asks for them more than once.

    NotInstalled: SALib is not here.
    """
    key = sha256(y.tobytes()).digest(), d, pairs, level
    if key not in _RECENT:
        while len(_RECENT) >= _MOST_RECENT:
            _RECENT.pop(next(iter(_RECENT)), None)
        _RECENT[key] = _by_salib(y, d, pairs, level)
    return _RECENT[key]


def _by_salib(y: Array, d: int, pairs: bool, level: float) -> dict[str, Array]:
    try:
        from SALib.analyze.sobol import analyze
    except ImportError:
        rule = "Sobol' indices need SALib, which is not installed"
        raise NotInstalled.of("studies", "data", "", rule) from None
    cube = {"num_vars": d, "names": [f"x{i}" for i in range(d)], "bounds": [[0.0, 1.0]] * d}
    drawn = np.random.default_rng(0)  # a generator: SALib takes a seed of 0 for none
    estimates = analyze(cube, y, pairs, num_resamples=RESAMPLES, conf_level=level, seed=drawn)
    return {key: np.asarray(estimates[key]) for key in estimates}


def _symmetric(upper: Array) -> Array:
    return np.where(np.isfinite(upper), upper, upper.T)
