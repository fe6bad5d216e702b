"""Error of exact motions at their predictability horizon, against fifty digits: the effective rounding.

The largest error of any deflection up to the horizon [half-gaps], over the growth that defines the horizon, is the one
error at the worst instant that would have done as much.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

import gearrattle as gr
from gearrattle.engine.system.perturbation_growth import GROWTH
from tests.literature.paper_cases import paper_case
from tests.oracles.exact_mp import solve
from tests.oracles.fixed_point import fixed, to_float
from tests.oracles.random_drivelines import FAMILIES, random_problem

PAPER = ((1, False), (2, False), (3, False), (2, True), (3, True))
SAMPLES = 16
CYCLES = 24  # a motion that is predictable for longer is left out,
LONGEST = 14.0  # and so is one whose horizon lies farther: the oracle would take minutes


@dataclass(frozen=True)
class Measured:
    """One motion.

    Attributes
    ----------
    name
        of the driveline.
    cycles
        its predictability horizon [T].
    crossings
        up to there.
    error
        largest of any deflection up to there [half-gaps].
    passed
        where it first exceeds 1e-9, as a share of the horizon; infinite if beyond.
    """

    name: str
    cycles: float
    crossings: int
    error: float
    passed: float

    @property
    def rounding(self) -> float:
        """The effective rounding [half-gaps]."""
        return self.error / GROWTH


def measured(name: str, driveline: Any) -> Measured | None:
    """Return the error of one motion at its horizon; None where it has none within ``LONGEST`` cycles."""
    run = gr.simulate(gr.loads(driveline.toml()), cycles=CYCLES, discard=0, samples_per_cycle=SAMPLES, audit=False)
    t, horizon = run.trajectory, run.predictability_horizon
    cycles = horizon / t.layout.period
    if not cycles <= LONGEST:
        return None
    truth = solve(driveline, math.ceil(cycles - 1e-9), SAMPLES)
    last = round(cycles * SAMPLES)
    half_gaps = np.array([np.max(np.abs(corners)) for corners in t.layout.corners])
    size = np.where(half_gaps > 0.0, half_gaps, np.max(np.abs(t.deflection), axis=0))
    errors = [
        [to_float(fixed(Fraction(float(own))) - row[k]) for own, k in zip(mine, t.layout.clearance, strict=True)]
        for mine, row in zip(t.deflection[: last + 1], truth.deflection[: last + 1], strict=True)
    ]
    crossings = int(np.count_nonzero(t.events.time <= horizon))
    worst = np.max(np.abs(errors) / size, axis=1)
    passed = float(np.argmax(worst > 1e-9)) / last if np.any(worst > 1e-9) else math.inf
    return Measured(name, cycles, crossings, float(np.max(worst)), passed)


def motions(seeds: int) -> Iterator[Measured]:
    """Yield every chaotic motion of the paper's cases and of the random drivelines of all families."""
    drivelines = [(f"case {n}{', loaded' if loaded else ''}", paper_case(n, loaded)) for n, loaded in PAPER]
    for seed in range(seeds):
        drivelines += [(f"{family} {seed}", random_problem(family, seed).model) for family in FAMILIES]
    for name, driveline in drivelines:
        if (one := measured(name, driveline)) is not None:
            yield one
