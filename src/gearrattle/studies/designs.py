"""Designs of experiments: the points of the unit cube at which a study with random parameter values is computed.

    latin-hypercube, sobol, random    points independent of each other, for probabilities and rank correlations
    saltelli                          two samples A and B of n points, and A with one column from B: n (d + 2) points
    saltelli-pairs                    as well as these, B with one column from A: n (2 d + 2) points
    one-at-a-time                     the model itself, then every value at its lower and at its upper end: 2 d + 1

d is the number of values that vary. The points of ``saltelli`` give Sobol' indices of first and total order, those of
``saltelli-pairs`` the indices of second order as well
(A. Saltelli, Making best use of model evaluations to compute sensitivity indices, Computer Physics Communications 145,
2002, pp. 280-297); SALib makes them, from a scrambled sequence of Sobol', block by block: A, AB_1 to AB_d (BA_1 to
BA_d), B.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, NotInstalled, Problem
from gearrattle.model.table import shown
from gearrattle.model.value_kinds import Choice, Count, argument_problems

Array = NDArray[np.float64]

SALTELLI = "saltelli"
PAIRS = "saltelli-pairs"
ONE_AT_A_TIME = "one-at-a-time"


@dataclass(frozen=True)
class Design:
    """Method that chooses points; a function of the number d of varied values and the number of samples.

    Attributes
    ----------
    shares
        function (d, samples, seed) that returns the points, (cases, d) in 0 to 1; NaN stands for the model's own value.
    cases
        function (d, samples) that returns the number of cases.
    takes_samples
        whether the number of samples can be chosen.
    needs_power_of_two
        whether the number of samples must be a power of two.
    independent
        function (d, cases) that returns the indices of the cases that form an independent sample.
    """

    shares: Callable[[int, int, int], Array]
    cases: Callable[[int, int], int]
    takes_samples: bool = True
    needs_power_of_two: bool = False
    independent: Callable[[int, int], NDArray[np.intp]] = lambda _, cases: np.arange(cases)


def block(method: str, d: int) -> int:
    """Number of cases for every sample in a design of Saltelli with d values; 0 for other methods."""
    return {SALTELLI: d + 2, PAIRS: 2 * d + 2}.get(method, 0)


def _latin(d: int, count: int, seed: int) -> Array:
    from scipy.stats import qmc

    return np.asarray(qmc.LatinHypercube(d, rng=np.random.default_rng(seed)).random(count))


def _sobol(d: int, count: int, seed: int) -> Array:
    from scipy.stats import qmc

    sampler = qmc.Sobol(d, scramble=True, rng=np.random.default_rng(seed))
    return np.asarray(sampler.random_base2(max(0, int(np.ceil(np.log2(count)))))[:count])


def _random(d: int, count: int, seed: int) -> Array:
    return np.random.default_rng(seed).random((count, d))


def _saltelli(d: int, count: int, seed: int, *, pairs: bool) -> Array:
    try:
        from SALib.sample.sobol import sample
    except ImportError:
        rule = "needs SALib, which is not installed"
        raise NotInstalled.of("studies", "method", PAIRS if pairs else SALTELLI, rule) from None
    cube = {"num_vars": d, "names": [f"x{i}" for i in range(d)], "bounds": [[0.0, 1.0]] * d}
    return np.asarray(sample(cube, count, calc_second_order=pairs, seed=np.random.default_rng(seed)))


def _one_at_a_time(d: int, _count: int, _seed: int) -> Array:
    shares = np.full((2 * d + 1, d), np.nan)
    for i in range(d):
        shares[2 * i + 1, i] = 0.0
        shares[2 * i + 2, i] = 1.0
    return shares


def _ends(step: int, cases: int) -> NDArray[np.intp]:
    """Indices of the samples A and B: the first and the last case of every block of ``step`` cases."""
    first = np.arange(0, cases - step + 1, step)
    return np.sort(np.concatenate([first, first + step - 1]))


DESIGNS: Mapping[str, Design] = {
    "latin-hypercube": Design(_latin, lambda _, n: n),
    "sobol": Design(_sobol, lambda _, n: n),
    "random": Design(_random, lambda _, n: n),
    SALTELLI: Design(
        lambda d, n, seed: _saltelli(d, n, seed, pairs=False),
        lambda d, n: n * (d + 2),
        needs_power_of_two=True,
        independent=lambda d, cases: _ends(d + 2, cases),
    ),
    PAIRS: Design(
        lambda d, n, seed: _saltelli(d, n, seed, pairs=True),
        lambda d, n: n * (2 * d + 2),
        needs_power_of_two=True,
        independent=lambda d, cases: _ends(2 * d + 2, cases),
    ),
    ONE_AT_A_TIME: Design(
        _one_at_a_time, lambda d, _: 2 * d + 1, takes_samples=False, independent=lambda _, __: np.arange(0)
    ),
}
"""Name of a method -> design."""


SAMPLES = Count()
"""Number of points drawn."""
METHODS = tuple(name for name, design in DESIGNS.items() if design.takes_samples and not design.needs_power_of_two)
"""Methods whose points are independent of each other."""
METHOD = Choice(METHODS)


def design_of(method: str, samples: int, varied: int) -> Design:
    """Return the design of a method, checked for a number of samples and a number ``varied`` of values that vary.

    A ModelError lists every problem: an unknown method, a number of samples that the method does not take.
    """
    problems = argument_problems({"samples": (SAMPLES, samples)})
    is_count = not problems  # samples is an integer >= 0
    unknown = argument_problems({"method": (Choice(tuple(DESIGNS)), method)})
    problems += unknown
    design = DESIGNS["random" if unknown else method]
    if design.takes_samples and bool(varied) != bool(samples):
        rule = "what scatters needs a number of samples, and samples something that scatters"
        problems.append(Problem("samples", shown(samples), rule))
    elif not design.takes_samples and (samples or not varied):
        rule = f"{method} takes no number: it has the model and two cases for every value that scatters"
        problems.append(Problem("samples", shown(samples), rule, "leave it out" if samples else "let values scatter"))
    elif design.needs_power_of_two and is_count and samples & (samples - 1):
        lower = 1 << (samples.bit_length() - 1)
        rule = "must be a power of two, so that Sobol's sequence is balanced"
        problems.append(Problem("samples", shown(samples), rule, f"{lower} or {2 * lower}"))
    if problems:
        raise ModelError(problems)
    return design
