"""The posterior of the reaches of all sliders together, by sampling on a grid.

Behind a turn only the sum of all sliders is seen, in few samples: their reaches r_i have several minima, and a
curvature or a profile of one of them misleads. With preload, slopes and breaks projected out (columns Z) and heights as
they are, which the rest of the loop tells, the sum of squares is one of single reaches and of pairs,

    S(r) - S = sum_i (-2 g_i + K_ii) + 2 sum_{i<j} K_ij,     g_i = d_i' P y,   K_ij = d_i' P d_j,
    d_i(r_i) = H_i (e_i / r_i  less that of the least squares),     P off Z, y the residuals,

tables over grids of log r. Gibbs sampling (S. Geman and D. Geman, IEEE Transactions on Pattern Analysis and Machine
Intelligence 6, 1984, pp. 721-741) draws pairs from exp(-S / (2 tau s^2)) with a flat prior of log r, chains begun
everywhere and cooled (S. Kirkpatrick and others, Science 220, 1983, pp. 671-680). Conditional densities are averaged.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.measured.identification.loop_errors import Spread
from gearrattle.measured.identification.loop_jumps import quantiles
from gearrattle.measured.identification.loop_law import COAST, DRIVE, Regression, Shape, Slider, Solved, heights_of
from gearrattle.measured.identification.loop_polish import Polish
from gearrattle.measured.identification.loop_search import reach_bounds
from gearrattle.measured.identification.loop_slopes import slopes_in
from gearrattle.measured.identification.profile import LEVEL

Array = NDArray[np.float64]

# values of log r: over all the room, and about the least squares
_WIDE = 32
_FINE = 15
_ERRORS = 4.0  # standard errors to each side that have the fine values
_CHAINS = 48
_COOLING = 8
_KEPT = 14
_HOT = 30.0
_STARTS = 6
_OPEN = math.exp(-0.5 * LEVEL)  # of the highest density: a bound that dense is no end


@dataclass(frozen=True)
class Density:
    """Density of one reach, by the samples.

    Attributes
    ----------
    logs
        (K,) logarithms of reaches [rad].
    density
        (K,) of them, 1 at the highest.
    """

    logs: Array
    density: Array

    def ends(self, level: float = 0.95) -> tuple[float, float]:
        """Shortest and longest reach [rad] of the central interval; 0 or inf where the samples set no end."""
        open_low, open_high = (self.density[end] > _OPEN for end in (0, -1))
        if open_low or open_high:
            high = np.flatnonzero(self.density > _OPEN)
            low_log = self._falls(int(high[0]), -1)
            high_log = self._falls(int(high[-1]), 1)
        else:
            tail = 0.5 * (1.0 - level)
            low_log, high_log = np.log(self.at(np.array([tail, 1.0 - tail]))).tolist()
        return 0.0 if open_low else math.exp(low_log), math.inf if open_high else math.exp(high_log)

    def at(self, shares: Array) -> Array:
        """Quantiles of the reach for some shares of the density [rad]."""
        return np.asarray(np.exp(quantiles(self.logs, self.density, shares)), dtype=np.float64)

    def _falls(self, last: int, way: int) -> float:
        """Whether the density falls below the level of an open end."""
        beyond = last + way
        if not 0 <= beyond < self.logs.size:
            return float(self.logs[last])
        over = self.density[last]
        under = self.density[beyond]
        share = (over - _OPEN) / (over - under)
        return float(self.logs[last] + share * (self.logs[beyond] - self.logs[last]))


class Stretch(NamedTuple):
    """Ends of the interval of a slider's stick stiffness [N m/rad]; 0 and inf where there is none."""

    low: float
    high: float


def stretched(solution: Solved, slider: Slider, density: Density) -> Stretch:
    """Return the interval of a slider's stick stiffness from the density of its reach, at its height."""
    shorter, longer = density.ends()
    height = heights_of(solution)[slider]
    return Stretch(height / longer, height / shorter if shorter > 0.0 else math.inf)


@dataclass(frozen=True)
class _Tables:
    """Pairs of reaches over their grids, divided by the variance: single terms (R, K), pairs (R, R, K, K)."""

    sliders: tuple[Slider, ...]
    logs: Array
    single: Array
    pairs: Array

    def conditional(self, state: NDArray[np.int64], i: int) -> Array:
        """(chains, K) raised chi-square of reach i, the others as they are."""
        raised = np.tile(self.single[i], (state.shape[0], 1))
        for j in range(len(self.sliders)):
            if j != i:
                raised += 2.0 * self.pairs[j, i][state[:, j]]
        return raised

    def of_pair(self, state: NDArray[np.int64], i: int, j: int) -> Array:
        """(chains, K, K) raised chi-square of two reaches."""
        one = self.conditional(state, i)
        other = self.conditional(state, j)
        one -= 2.0 * self.pairs[j, i][state[:, j]]
        other -= 2.0 * self.pairs[i, j][state[:, i]]
        return np.asarray(one[:, :, None] + other[:, None, :] + 2.0 * self.pairs[i, j], dtype=np.float64)

    def whole(self, state: NDArray[np.int64]) -> Array:
        """(chains,) raised chi-square."""
        number = range(len(self.sliders))
        raised = sum(self.single[i][state[:, i]] for i in number)
        return np.asarray(raised + sum(2.0 * self.pairs[i, j][state[:, i], state[:, j]] for i, j in _pairs(number)))


def densities(polish: Polish, solution: Solved, known: Spread) -> tuple[dict[Slider, Density], list[Shape]]:
    """Return the density of every reach, and shapes from which a better minimum may be reached."""
    if not known.sliders:
        return {}, []
    # tables of the sum of squares over grids of log r, and random places of the chains
    tables = _tables(polish, solution, known)
    random = np.random.default_rng(0)
    number, size = tables.logs.shape
    state = random.integers(0, size, (_CHAINS, number))
    widths = np.log(np.gradient(tables.logs, axis=1))
    summed = np.zeros((number, size))
    starts: dict[tuple[int, ...], float] = {}
    # Gibbs sampling, first at a higher temperature
    for sweep in range(_COOLING + _KEPT):
        heat = _HOT ** max(0.0, 1.0 - sweep / _COOLING)
        # draw pairs of neighbouring sliders together
        for i, j in _close(tables.sliders):
            raised = -0.5 / heat * tables.of_pair(state, i, j) + widths[i][:, None] + widths[j]
            drawn = _draw(raised.reshape(_CHAINS, -1), random)
            state[:, i], state[:, j] = np.divmod(drawn, size)
        # draw every reach by itself, and add up its conditional density
        for i in range(number):
            logs = -0.5 / heat * tables.conditional(state, i)
            state[:, i] = _draw(logs + widths[i], random)
            if sweep >= _COOLING:
                share = np.exp(logs + widths[i] - np.max(logs + widths[i], axis=1, keepdims=True))
                summed[i] += np.sum(share / share.sum(axis=1, keepdims=True), axis=0)
        # keep the places of the chains as starts
        if sweep >= _COOLING:
            starts.update(zip(map(tuple, state.tolist()), tables.whole(state).tolist(), strict=True))
    # densities of the logarithms, and the best starts
    heights = summed / np.exp(widths)
    made = {s: Density(tables.logs[i], heights[i] / heights[i].max()) for i, s in enumerate(tables.sliders)}
    best = sorted(starts, key=lambda key: starts[key])[:_STARTS]
    return made, [_shape_at(solution.shape, tables.sliders, tables.logs[range(number), key]) for key in best]


def _draw(logs: Array, random: np.random.Generator) -> NDArray[np.int64]:
    """Draw one place of every row, by its weight."""
    below = np.cumsum(np.exp(logs - logs.max(axis=1, keepdims=True)), axis=1)
    places = np.sum(below < random.random((logs.shape[0], 1)) * below[:, -1:], axis=1)
    return np.asarray(np.minimum(places, logs.shape[1] - 1), dtype=np.int64)


def _pairs(number: range) -> list[tuple[int, int]]:
    return list(combinations(number, 2))


def _close(sliders: tuple[Slider, ...]) -> list[tuple[int, int]]:
    """Pairs of sliders that share a turn."""
    return [(i, j) for i, j in _pairs(range(len(sliders))) if {sliders[i][0], sliders[j][0]} != {DRIVE, COAST}]


def _tables(polish: Polish, solution: Solved, known: Spread) -> _Tables:
    # grids of log r: the whole range, and finer about the value found
    bounds = [math.log(bound) for bound in reach_bounds(polish.loop)]
    first = known.covariance.shape[0] - len(known.sliders)
    grids = []
    for n, slider in enumerate(known.sliders):
        here = min(max(math.log(solution.shape.reach_of(slider, math.nan)), bounds[0]), bounds[1])
        error = math.sqrt(known.covariance[first + n, first + n])
        wide = _ERRORS * min(error if math.isfinite(error) else 1.0, 0.5)
        fine = np.linspace(max(here - wide, bounds[0]), min(here + wide, bounds[1]), _FINE)
        grids.append(np.sort(np.concatenate([np.linspace(bounds[0], bounds[1], _WIDE), fine + 1e-9])))
    # points that stand for all samples, with kinks at every reach of the grids
    logs = np.array(grids)
    shapes = [_shape_at(solution.shape, known.sliders, column) for column in logs.T]
    points = polish.moments.regression(solution.shape, *shapes)
    # project out preload, slopes and breaks
    root = np.sqrt(points.weight)[:, None]
    table = points.table(solution.shape, solution.labels)
    bulk = [label[0] != "slider" for label in solution.labels]
    nuisance = root * np.hstack([table[:, bulk], slopes_in(points.loop, solution, ())])
    basis = np.linalg.svd(nuisance / np.maximum(np.linalg.norm(nuisance, axis=0), 1e-300), full_matrices=False)
    kept = basis[0][:, basis[1] > 1e-10 * basis[1][0]]
    # change of the torque by every reach of the grids, and the residuals
    moved = np.hstack([root * _moved(points, solution, s, row) for s, row in zip(known.sliders, logs, strict=True)])
    moved -= kept @ (kept.T @ moved)
    residual = root[:, 0] * (points.torque - table @ solution.coefficients)
    residual -= kept @ (kept.T @ residual)
    # sums of squares of single reaches and of pairs
    number, size = logs.shape
    gram = (moved.T @ moved / known.variance).reshape(number, size, number, size).transpose(0, 2, 1, 3)
    pull = (moved.T @ residual / known.variance).reshape(number, size)
    single = np.array([np.diagonal(gram[i, i]) for i in range(number)]) - 2.0 * pull
    return _Tables(known.sliders, logs, single, np.ascontiguousarray(gram))


def _shape_at(shape: Shape, sliders: tuple[Slider, ...], logs: Array) -> Shape:
    return shape.with_reaches(dict(zip(sliders, map(math.exp, logs.tolist()), strict=True)))


def _moved(points: Regression, solution: Solved, slider: Slider, logs: Array) -> Array:
    """(M, K) torque of a slider over its grid, less that of the least squares."""
    label = (("slider", *slider),)
    shapes = [solution.shape, *(solution.shape.with_reach(slider, math.exp(value)) for value in logs.tolist())]
    columns = np.hstack([points.table(shape, label) for shape in shapes])
    return np.asarray(heights_of(solution)[slider] * (columns[:, 1:] - columns[:, :1]), dtype=np.float64)
