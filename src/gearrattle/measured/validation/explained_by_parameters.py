"""The part of a disagreement that uncertain parameters explain, and those that its levels cannot separate.

Each of the runs with drawn parameters gives the logarithms of the levels; least squares over the runs give the effect
g of one standard error of every parameter, with its own error from what the line leaves. A motion that rattles has no
gradient worth following beyond its predictability horizon, so the slope is that of averages over cycles.

With d = ln(measured / simulated) of the rms of every channel, G the effects on them, R the correlations of the
parameters as stated and V the covariance of d from all other sources, the line of largest posterior probability is

    x = R G' (G R G' + V)^-1 d,      S = R - R G' (G R G' + V)^-1 G R       [standard errors of the parameters]

(A. Tarantola, Inverse Problem Theory, 2005, eq. 3.37-38, for a linear model and Gaussian errors). The correlations of S
say which parameters the levels leave exchangeable. V holds the scatter of both records with its correlation between
channels, the other sources of each budget, and the errors of G. Peak to peak is not used: it is of the same cycles.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearrattle.measured.validation.block_bootstrap import Draws
from gearrattle.measured.validation.cycles import Cycles
from gearrattle.measured.validation.effects import Effect, Explained, Parameter
from gearrattle.measured.validation.level_agreement import MEASURES, mean_squares
from gearrattle.measured.validation.parameter_uncertainty import Drawn
from gearrattle.measured.validation.validation_records import Level, Pair
from gearrattle.trajectory import Array
from gearrattle.wording import counted

SPARE = 3
"""Runs more than parameters that the effects need."""
_SEEN = 2.0  # of its own errors, from which on an effect counts as seen
_FLOOR = 1e-6  # relative: smallest error of a level
_APART = ("measured scatter", "simulated scatter", "parameters")  # sources of a budget that are counted elsewhere
_RMS = MEASURES.index("rms")


def explained(
    drawn: Drawn, pairs: Sequence[Pair], cycles: tuple[Cycles, Cycles], draws: tuple[Draws, Draws]
) -> Explained | None:
    """Return the part of the differences that parameters explain; None where runs are too few for their effects."""
    # effects of the parameters on the levels, and the differences of the levels
    slopes, errors = effects(drawn)
    ratio = np.array([[_log(pair.levels[m]) for pair in pairs] for m in range(len(MEASURES))])
    used = np.flatnonzero(np.isfinite(ratio[_RMS]))
    if not np.isfinite(slopes).all() or not used.size:
        return None
    # parameters of largest posterior probability, and their covariance
    g = slopes[:, _RMS, used].T
    d = ratio[_RMS, used]
    v = _covariance(pairs, cycles, draws)[np.ix_(used, used)] + np.diag(np.sum(errors[:, _RMS, used] ** 2, axis=0))
    shift, spread = update(g, d, v, drawn.correlation)
    # squared differences before and after
    left = d - g @ shift
    squares = float(d @ np.linalg.solve(v, d)), float(left @ np.linalg.solve(v, left))
    names = tuple(pairs[c].name for c in used.tolist())
    # effects of every parameter on every level
    parameters = []
    for p, (path, (value, error)) in enumerate(drawn.errors.items()):
        channel_effects = tuple(
            _effect(pair, m, float(slopes[p, m, c]), float(errors[p, m, c]), float(ratio[m, c]))
            for c, pair in enumerate(pairs)
            for m in range(len(MEASURES))
        )
        parameters.append(Parameter(path, value, error, float(shift[p]), float(np.sqrt(spread[p, p])), channel_effects))
    return Explained(
        tuple(parameters),
        _rows(drawn.correlation),
        _rows(correlation(spread)),
        names,
        tuple((100.0 * d).tolist()),
        tuple((100.0 * left).tolist()),
        squares,
        len(drawn.logs),
    )


def effects(drawn: Drawn) -> tuple[Array, Array]:
    """(P, 2, C) change of ln(level) by one standard error of each parameter, and its error; NaN of too few runs."""
    count, free = drawn.standard.shape
    shape = (free, *drawn.logs.shape[1:])
    if count < free + SPARE:
        return np.full(shape, np.nan), np.full(shape, np.nan)
    design = np.column_stack([np.ones(count), drawn.standard])
    flat = drawn.logs.reshape(count, -1)
    coefficients = np.linalg.lstsq(design, flat, rcond=None)[0]
    left = flat - design @ coefficients
    variance = np.sum(left**2, axis=0) / (count - free - 1)
    unit = np.diag(np.linalg.pinv(design.T @ design))
    return coefficients[1:].reshape(shape), np.sqrt(unit[1:, None] * variance).reshape(shape)


def update(effect: Array, difference: Array, covariance: Array, correlation: Array) -> tuple[Array, Array]:
    """Return (P,) shifts and (P, P) covariance of the parameters after the levels, in stated standard errors.

    Parameters
    ----------
    effect
        (C, P) on every level.
    difference
        (C,) ln(measured / simulated).
    covariance
        (C, C) of it without the parameters, positive definite.
    correlation
        (P, P) as stated.
    """
    across = correlation @ effect.T
    gain = np.linalg.solve(effect @ across + covariance, across.T).T
    spread = correlation - gain @ across.T
    return np.asarray(gain @ difference), np.asarray(0.5 * (spread + spread.T))


def correlation(covariance: Array) -> Array:
    """Return (P, P) correlations."""
    size = np.sqrt(np.diag(covariance))
    return np.asarray(np.clip(covariance / np.outer(size, size), -1.0, 1.0))


def sentences(explanation: Explained) -> list[str]:
    """Return sentences: the parameter that explains most, and parameters that the levels cannot separate."""
    # the parameter that alone explains a channel soonest
    texts = []
    seen = [
        (abs(effect.needed), parameter, effect)
        for parameter in explanation.parameters
        for effect in parameter.effects
        if effect.measure == "rms" and np.isfinite(effect.needed)
    ]
    for channel in explanation.channels:
        of = [entry for entry in seen if entry[2].channel == channel]
        if of:
            needed, parameter, _ = min(of, key=lambda entry: entry[0])
            texts.append(
                f"{channel}: of the parameters alone {parameter.path} explains the rms soonest, {needed:.2g} of its "
                "standard errors away."
            )
    # all parameters together
    texts.append(
        f"Together the parameters take the squared differences of {counted(len(explanation.channels), 'channel')} from "
        f"{explanation.chi_square[0]:.3g} to {explanation.chi_square[1]:.3g} standard errors squared, moved by "
        f"{max((abs(p.shift) for p in explanation.parameters), default=0.0):.2g} of their own at most."
    )
    # pairs of parameters that the levels leave exchangeable
    names = [parameter.path for parameter in explanation.parameters]
    for i, row in enumerate(explanation.estimated):
        for j, value in enumerate(row[:i]):
            if abs(value) > 0.9:
                texts.append(
                    f"{names[j]} and {names[i]} cannot be told apart by these levels (correlation {value:.2f})."
                )
    return texts


def _effect(pair: Pair, measure: int, slope: float, error: float, ratio: float) -> Effect:
    level = pair.levels[measure]
    share = 100.0 * level.simulated / level.measured if level.measured > 0.0 else float("nan")
    needed = ratio / slope if abs(slope) > _SEEN * error and slope else float("nan")
    return Effect(pair.name, level.measure, share * slope, share * error, needed)


def _covariance(pairs: Sequence[Pair], cycles: tuple[Cycles, Cycles], draws: tuple[Draws, Draws]) -> Array:
    """(C, C) covariance of ln(measured / simulated) of the rms, except for the parameters."""
    total = np.zeros((len(pairs), len(pairs)))
    tiny = np.finfo(float).tiny
    for cycle, how in zip(cycles, draws, strict=True):
        replicates = 0.5 * np.log(np.maximum(how.means(mean_squares(cycle)), tiny))
        away = replicates - replicates.mean(axis=0)
        total += away.T @ away / len(away) / (1.0 - how.block / how.weights.shape[1])
    return total + np.diag([_others(pair.levels[_RMS]) ** 2 + _FLOOR**2 for pair in pairs])


def _others(level: Level) -> float:
    """Contribution of the other sources of a budget, of the logarithm."""
    values = [term.value for term in level.budget if term.source not in _APART and np.isfinite(term.value)]
    ratio = level.simulated / level.measured if level.measured > 0.0 else 0.0
    return float(np.sqrt(np.sum(np.square(values)))) / (100.0 * ratio) if ratio > 0.0 else 0.0


def _log(level: Level) -> float:
    both = level.measured > 0.0 and level.simulated > 0.0
    return float(np.log(level.measured / level.simulated)) if both else float("nan")


def _rows(values: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in values.tolist())
