"""``fit_loop`` against SciPy's ``least_squares`` from several starts: ``python -m benchmarks.loops`` (``make loops``).

Both fit the same law to loops of known dampers (``tests/measured/identification/loops_made.py``). ``least_squares``
is told the numbers of stages, which ``fit_loop`` finds. Its unknowns are all coefficients, the widths of stages and
the logarithms of reaches, with the derivatives of ``loop_slopes`` and bounds; half of its starts have their breaks
where the smoothed loop is most curved, the others anywhere (Latin hypercube, as the reaches of all). Starts run over
means of cells, the best of them then over every sample. Its intervals are those of the curvature. Written to
``docs/reference/loops.md``.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import OptimizeResult, least_squares
from scipy.stats import qmc
from tests.measured.identification.loops_made import damper, numbers, sampled

import gearrattle as gr
from benchmarks.machine import machine
from gearrattle.measured.identification.loop_data import Loop, read_loop
from gearrattle.measured.identification.loop_law import Regression, Shape, Solved, _merged
from gearrattle.measured.identification.loop_search import LEAST, LONGEST, REACH, SHORTEST
from gearrattle.measured.identification.loop_slopes import slopes_in
from gearrattle.measured.identification.loop_values import values_of

Array = NDArray[np.float64]

PAGE = Path(__file__).resolve().parents[1] / "docs" / "reference" / "loops.md"
CELLS, NOISE = 300, 0.02
KINDS = ("stiffness", "until", "hysteresis", "stick_stiffness")
REACHED = 0.5  # variances above the lowest sum of squares
ROWS = (
    "sum of squares within 0.5 variances of the lowest of all",
    "sum of squares above the lowest [variances]",
    "slopes [%]",
    "ends of stages [%]",
    "heights of loops [%]",
    "stick stiffnesses [%]",
    "95 % intervals of ends that hold the true end",
    "processor time of a loop [s]",
)
HEAD = """# Fitting loops: `fit_loop` against `scipy.optimize.least_squares`

Written by `make loops`; do not edit. {machine}.

The same law, fitted by `gr.identification.fit_loop` and by SciPy's trust-region least squares in breaks, reaches and
coefficients together. Half of the starts of `least_squares` have their breaks where the smoothed loop is most curved,
the others at points of a Latin hypercube. It is told the numbers of stages and whether the first ones differ;
`fit_loop` finds them. The loops are those of {{doc}}`../theory/identification`: three cycles, white noise of 2 % of
full scale. Cells give median and worst over all loops; errors are in per cent of the true value, sums of squares in
variances of a residual.

The torque jumps at a break on the way back, where friction is let go, so the sum of squares jumps whenever a break
passes a sample. Steps along derivatives do not see these jumps and stop beside them, and the curvature gives intervals
of the wrong width. Between the jumps there are many minima, in the breaks and in the reaches of sliders that share a
turn. So `fit_loop` searches breaks by trial over the samples, and reaches by sampling their joint density.
"""
RANGE_OF_REACHES = 3e-3, 0.06  # of the loop's range, for starts


class Fitted(NamedTuple):
    """A fit: values and 95 % intervals of the ends of stages by name, the sum of squares left, processor time [s]."""

    values: dict[str, float]
    ends: dict[str, tuple[float, float]]
    left: float
    seconds: float


class Law:
    """The law as a function of one vector: coefficients, widths of stages, logarithms of reaches, all scaled.

    Args of the constructor:
        loop: all samples.
        regression: those that count.
        stages: numbers of drive-side and coast-side stages.
        parted: whether the first stages differ.
    """

    def __init__(self, loop: Loop, regression: Regression, stages: tuple[int, int], parted: bool) -> None:
        self.regression = regression
        self.parted = parted
        self.drive = stages[0] - 1
        self.low, self.high = loop.ends
        self.span, self.widths = self.high - self.low, sum(stages) - 2
        shape = self.shape(np.full(self.widths, 0.1 * self.span), np.empty(0))
        self.labels, self.sliders = regression.labels(shape, frozenset()), tuple(shape.sliders())
        self.coefficients, self.root = len(self.labels), np.sqrt(regression.weight)
        per_angle = np.array([kind == "slope" for kind, _, _ in self.labels])
        self.size = loop.full_scale / np.where(per_angle, self.span, 1.0)
        self._latest: tuple[bytes, Array, Array] | None = None

    def shape(self, widths: Array, logs: Array) -> Shape:
        """Return the shape of some widths [rad] and logarithms of reaches."""
        drive, coast = np.cumsum(widths[: self.drive]), np.cumsum(widths[self.drive :])
        breaks = [np.minimum(b, end).tolist() for b, end in ((drive, self.high), (coast, -self.low))]
        shape = Shape(tuple(breaks[0]), tuple(breaks[1]), self.parted, "")
        for slider, log in zip(self.sliders if logs.size else (), logs.tolist(), strict=True):
            shape = shape.with_reach(slider, math.exp(log))
        return shape

    def solved(self, x: Array) -> Solved:
        """Return the law of a vector."""
        first = self.coefficients
        shape = self.shape(x[first : first + self.widths] * self.span, x[first + self.widths :])
        return Solved(shape, self.labels, x[:first] * self.size, 0.0)

    def start(self, widths: Array, logs: Array) -> Array:
        """Return the vector of a shape, its coefficients by linear least squares."""
        solved = self.regression.solve(self.shape(widths, logs))
        return np.concatenate([solved.coefficients / self.size, widths / self.span, logs])

    def summed(self) -> Array:
        """Return (W, W) what makes breaks of widths."""
        matrix = np.tril(np.ones((self.widths, self.widths)))
        matrix[self.drive :, : self.drive] = 0.0
        return matrix

    def rows(self, x: Array) -> tuple[Array, Array]:
        """Return residuals and their derivatives."""
        if self._latest is None or self._latest[0] != x.tobytes():
            law = self.solved(x)
            table = self.regression.table(law.shape, law.labels)
            slopes = slopes_in(self.regression.loop, law, self.sliders)
            widths = slopes[:, : self.widths] @ self.summed() * self.span
            made = np.hstack([table * self.size, widths, slopes[:, self.widths :]])
            residuals = table @ law.coefficients - self.regression.torque
            self._latest = x.tobytes(), residuals * self.root, made * self.root[:, None]
        return self._latest[1], self._latest[2]

    def fit(self, start: Array) -> OptimizeResult:
        """Return what SciPy's trust-region method finds from a start."""
        first, reaches = self.coefficients, len(self.sliders)
        logs = math.log(SHORTEST * self.span), math.log(LONGEST * self.span)
        low = np.r_[-np.inf, np.zeros(first - 1), np.full(self.widths, LEAST), np.full(reaches, logs[0])]
        high = np.r_[np.full(first, np.inf), np.ones(self.widths), np.full(reaches, logs[1])]
        return least_squares(
            lambda x: self.rows(x)[0],
            np.clip(start, low + 1e-6, high - 1e-6),
            lambda x: self.rows(x)[1],
            (low, high),
            "trf",
            x_scale="jac",
            max_nfev=60,
        )


def curved(loop: Loop, stages: tuple[int, int]) -> Array:
    """Return the widths of stages that end where the smoothed middle of a loop is most curved [rad]."""
    low, high = loop.ends
    grid, middle = np.linspace(low, high, 401), np.zeros(401)
    for rows in (loop.way > 0.0, loop.way < 0.0):
        order = np.argsort(loop.deflection[rows])
        smooth = gaussian_filter1d(loop.torque[rows][order], max(1.0, rows.sum() / 150.0))
        middle += np.interp(grid, loop.deflection[rows][order], smooth)
    curvature, apart = np.abs(np.gradient(np.gradient(gaussian_filter1d(middle, 6.0)))), 0.06 * (high - low)
    widths = []
    for number, way, end in ((stages[0], 1.0, high), (stages[1], -1.0, -low)):
        outward, breaks = way * grid, []
        left = np.where((outward > apart) & (outward < end - apart), curvature + 1e-12, 0.0)
        for _ in range(number - 1):
            breaks.append(float(outward[np.argmax(left)]))
            left = np.where(np.abs(outward - breaks[-1]) < apart, 0.0, left)
        widths.append(np.diff(np.sort(breaks), prepend=0.0))
    return np.concatenate(widths)


def by_least_squares(loop: Loop, stages: tuple[int, int], parted: bool, starts: int, best: int) -> Fitted:
    """Fit by ``least_squares`` from several starts over cells, and from the best of them over all samples."""
    begun = time.process_time()
    low, high = loop.ends
    points, count = _merged(loop, CELLS)
    coarse = Law(
        loop, Regression.over(points, count, float(loop.torque @ loop.torque), REACH * (high - low)), stages, parted
    )
    shares = qmc.LatinHypercube(coarse.widths + len(coarse.sliders), rng=np.random.default_rng(0)).random(starts)
    ends, logs = [], np.log(np.multiply(RANGE_OF_REACHES, high - low))
    likely = curved(loop, stages)
    for k, row in enumerate(shares):
        places = row[: coarse.widths]
        widths = likely * np.exp(0.15 * (places - 0.5))
        if k % 2:
            sides = (places[: coarse.drive], high), (places[coarse.drive :], -low)
            widths = np.concatenate([np.diff(np.sort(side) * end, prepend=0.0) for side, end in sides])
        start = coarse.start(np.maximum(widths, LEAST * (high - low)), logs[0] + row[coarse.widths :] * np.ptp(logs))
        ends.append(coarse.fit(start))
    ends.sort(key=lambda ended: ended.cost)
    fine = Law(loop, Regression(loop, 0, REACH * (high - low)), stages, parted)
    best_fit = min((fine.fit(ended.x) for ended in ends[:best]), key=lambda ended: ended.cost)
    left, free = 2.0 * best_fit.cost, loop.torque.size - best_fit.x.size
    inverse = np.linalg.pinv(best_fit.jac.T @ best_fit.jac, rcond=1e-12, hermitian=True) * left / free
    part = slice(fine.coefficients, fine.coefficients + fine.widths)
    errors = 1.96 * fine.span * np.sqrt(np.diag(fine.summed() @ inverse[part, part] @ fine.summed().T))
    values = values_of(fine.solved(best_fit.x), frozenset())
    names = [name for name in values if name.endswith("until")]
    around = {name: (values[name] - e, values[name] + e) for name, e in zip(names, errors.tolist(), strict=True)}
    return Fitted(values, around, left, time.process_time() - begun)


def by_fit_loop(data: tuple[Array, Array]) -> Fitted:
    """Fit by the package."""
    begun = time.process_time()
    fit = gr.identification.fit_loop(data)
    ends = {name: ends for name, ends in fit.intervals.items() if name.endswith("until")}
    return Fitted(dict(fit.values), ends, float(fit.residuals @ fit.residuals), time.process_time() - begun)


def compared(seeds: Sequence[int], samples: int, tries: Sequence[tuple[int, int]]) -> list[str]:
    """Fit loops with all methods; return the rows of a table."""
    fits: list[list[Fitted]] = []
    truths, variances = [], []
    for seed in seeds:
        table, low, high = damper(seed)
        data, stages = (
            sampled(table, low, high, noise=NOISE, seed=1000 + seed, samples=samples),
            (len(table["stages"]), len(table["coast_stages"])),
        )
        parted = table["stages"][0]["stiffness"] != table["coast_stages"][0]["stiffness"]
        loop = read_loop(data)
        fits.append([by_fit_loop(data), *(by_least_squares(loop, stages, parted, *attempt) for attempt in tries)])
        truths.append(numbers(table))
        variances.append(fits[-1][0].left / loop.torque.size)
        print(
            samples,
            seed,
            *(f"{fit.left / variances[-1] - loop.torque.size:.2f} {fit.seconds:.1f} s;" for fit in fits[-1]),
            flush=True,
        )
    methods = list(zip(*fits, strict=True))
    lowest = [min(fit.left for fit in row) for row in fits]
    heads = ["`fit_loop`", *(f"`least_squares`, {starts} starts" for starts, _ in tries)]
    columns = []
    for column in methods:
        above = [(fit.left - least) / v for fit, least, v in zip(column, lowest, variances, strict=True)]
        reached = f"{sum(value < REACHED for value in above)} of {len(above)}"
        errors = [both(off(column, truths, kind)) for kind in KINDS]
        columns.append([reached, both(above), *errors, held(column, truths), both([fit.seconds for fit in column])])
    lines = [
        f"| {len(seeds)} loops, {samples} samples a cycle | {' | '.join(heads)} |",
        "|---" * (len(heads) + 1) + "|",
    ]
    return lines + [
        f"| {words} | {' | '.join(row)} |" for words, row in zip(ROWS, zip(*columns, strict=True), strict=True)
    ]


def both(values: Sequence[float]) -> str:
    """Return median and largest."""
    return f"{np.median(values):.2g}, {np.max(values):.3g}"


def off(fits: Sequence[Fitted], truths: Sequence[dict[str, float]], kind: str) -> list[float]:
    """Return the errors of a kind of numbers [% of the true value]."""
    return [
        abs(fit.values[name] / value - 1.0) * 100.0
        for fit, truth in zip(fits, truths, strict=True)
        for name, value in truth.items()
        if name.endswith(f".{kind}") and name in fit.values
    ]


def held(fits: Sequence[Fitted], truths: Sequence[dict[str, float]]) -> str:
    """Return how many intervals of ends of stages hold the true end."""
    pairs = [(truth[name], ends) for fit, truth in zip(fits, truths, strict=True) for name, ends in fit.ends.items()]
    return f"{np.mean([low <= true <= high for true, (low, high) in pairs]):.0%} of {len(pairs)}"


def main() -> None:
    """Measure, and write the page."""
    tables = [compared(range(25), 4000, ((24, 4), (96, 8))), compared(range(4), 120_000, ((24, 4),))]
    lines = [line for table in tables for line in ("", *table)]
    PAGE.write_text(HEAD.format(machine=machine()) + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
