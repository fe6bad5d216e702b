"""The runs of the reproduction; every run is made once.

Sections state the runs that they need (``Setup``); ``measure`` makes all of them and returns a ``Measurements``, which
the sections read. A run that fails, or whose algorithm is not installed, is a result with a status.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from gearrattle.analysis.statics import equilibrium
from gearrattle.comparison.contender_runs import AGAIN, SHORT, Contender, Result, run_one
from gearrattle.engine.solvers import SOLVERS
from gearrattle.reproduction.paper_cases import SPEED, load_case
from gearrattle.results import Run

Progress = Callable[[float], None]
BUDGET = 30.0  # s, time limit of a run
TOLERANCE = 1e-6
MISSING = "not available here"
_AWAY = 1e-12 * 0.16  # rad, 1e-12 times the half-width of the clutch
_QUICK = 0.1
TURN = 6.283185307179586
"""Length of a period in units of 1/omega: 2 pi."""
_STEP = {"rk2": 0.75e-6, "rk4": 2.5e-6}  # s a step
# s a cycle, at a tolerance of 1e-6
_CYCLE = {
    "exact": 2e-4,
    "rkf": 3e-3,
    "rkv": 3.4e-3,
    "rkv-events": 2e-3,
    "adams": 2.5e-3,
    "gear": 3e-3,
    "bulirsch-stoer": 5e-3,
}
_ORDER = {"rkf": 5, "rkv": 6, "bulirsch-stoer": 10}
_OVERHEAD = 0.03  # s
_FEWEST = 8


@dataclass(frozen=True)
class Scope:
    """Lengths of runs; ``cycles`` shortens those of the paper in a quick run."""

    quick: bool

    def cycles(self, full: int) -> int:
        """The length to run for one of ``full`` cycles."""
        return max(_FEWEST, round(full * _QUICK)) if self.quick else full

    def coherent(self, full: int) -> int:
        """The same where coherences need four segments: never too short for them."""
        return max(14, self.cycles(full)) if self.quick else full


@dataclass(frozen=True)
class Setup:
    """One run of a case, as ``load_case`` builds it.

    Attributes
    ----------
    cycles
        length in common periods.
    step
        length of fixed steps in units of 1/omega, as in the paper; None for variable steps.
    nearby
        whether the initial state is shifted by 1e-12 half-gaps.
    """

    case: int
    loaded: bool
    algorithm: str
    cycles: int
    ratio: float = 0.05
    step: float | None = None
    tolerance: float = TOLERANCE
    samples: int = 64
    nearby: bool = False
    repeats: int = 1

    def at(self, **changes: Any) -> Setup:
        """The same with some changes."""
        return replace(self, **changes)


@dataclass(frozen=True)
class Measurements:
    """Fastest run of every setup, wall times of all its runs [s], and the scope they were made in."""

    scope: Scope
    results: Mapping[Setup, Result]
    wall_times: Mapping[Setup, tuple[float, ...]]

    def result(self, setup: Setup) -> Result:
        """Status and run of a setup."""
        return self.results[setup]

    def times(self, setup: Setup) -> tuple[float, ...]:
        """Wall times of a setup's runs, one at least [s]."""
        return self.wall_times[setup]

    def run(self, setup: Setup) -> Run | None:
        """A run, or None."""
        return self.results[setup].run


def available(algorithm: str) -> bool:
    """Whether an algorithm is on the shelf."""
    return algorithm in SOLVERS


def seconds_of(setup: Setup) -> float:
    """Return about how long a setup takes on one core of 2026 [s]; only ratios matter, for the remaining time."""
    if setup.step is not None:
        run = setup.cycles * TURN / setup.step * _STEP[setup.algorithm]
    else:
        order = _ORDER.get(setup.algorithm)
        finer = 1.0 if order is None else (TOLERANCE / setup.tolerance) ** (1.0 / order)
        run = setup.cycles * _CYCLE.get(setup.algorithm, 0.0) * finer
    runs = AGAIN if run < SHORT else 1
    return setup.repeats * (_OVERHEAD + run * runs)


def measure(scope: Scope, setups: Iterable[Setup], progress: Progress | None = None) -> Measurements:
    """Make every run once, or as often as its setup says."""
    wanted = tuple(dict.fromkeys(setups))
    total = sum(seconds_of(setup) for setup in wanted)
    done = 0.0
    furthest = 0.0
    results: dict[Setup, Result] = {}
    times: dict[Setup, tuple[float, ...]] = {}

    def tick(share: float) -> None:
        nonlocal furthest
        furthest = max(furthest, (done + share * part) / total)  # a run is warmed up, and short ones are repeated
        if progress is not None:
            progress(furthest)

    for setup in wanted:
        part = seconds_of(setup) / setup.repeats
        made: list[Result] = []
        for _ in range(setup.repeats):
            tick(0.0)
            made.append(_made(setup, tick))
            done += part
        results[setup] = min(made, key=lambda result: result.wall_time)
        times[setup] = tuple(result.wall_time for result in made)
    return Measurements(scope, results, times)


def _made(setup: Setup, progress: Progress) -> Result:
    contender = Contender(setup.algorithm, setup.algorithm)
    if not available(setup.algorithm):
        return Result(contender, MISSING, None, 0.0)
    model = load_case(setup.case, setup.ratio, loaded=setup.loaded)
    settings: dict[str, Any] = {
        "cycles": setup.cycles,
        "discard": setup.cycles // 2,
        "samples_per_cycle": setup.samples,
    }
    if setup.nearby:
        rest = equilibrium(model).angle.copy()
        rest[0] += _AWAY
        settings["initial"] = {"angle": rest.tolist(), "velocity": [0.0] * rest.size}
    if setup.step is not None:
        settings["step"] = setup.step / SPEED
    elif setup.algorithm != "exact":
        settings["tolerance"] = setup.tolerance
    return run_one(model, contender, settings, BUDGET, progress)
