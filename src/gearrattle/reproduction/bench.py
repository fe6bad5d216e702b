"""Every run the page rests on, made once.

Sections say which runs they need (``Setup``); ``measure`` makes them all and hands over a ``Bench``, from which
sections read. A run that fails, or whose algorithm is missing, is a result with a status.

Takes setups; gives a Bench.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from gearrattle.calls.statics import equilibrium
from gearrattle.comparison.contest import Contender, Result, run_one
from gearrattle.reproduction.cases import SPEED, load_case
from gearrattle.results import Run
from gearrattle.solvers import SOLVERS

Progress = Callable[[float], None]
BUDGET = 30.0  # s, of a run
TOLERANCE = 1e-6
MISSING = "not available here"
_AWAY = 1e-12 * 0.16  # rad, of the clutch's half-width
_QUICK = 0.1
_FEWEST = 8


@dataclass(frozen=True)
class Scope:
    """How long runs are. ``cycles`` shortens the paper's lengths in a quick run."""

    quick: bool

    def cycles(self, full: int) -> int:
        """The length to run for one of ``full`` cycles."""
        return max(_FEWEST, round(full * _QUICK)) if self.quick else full

    def coherent(self, full: int) -> int:
        """The same where coherences need four segments: never too short for them."""
        return max(14, self.cycles(full)) if self.quick else full


@dataclass(frozen=True)
class Setup:
    """One run.

    Attributes:
        case, loaded, ratio: of ``load_case``.
        algorithm: its name.
        cycles: length in common periods.
        step: of a fixed step, in units of 1/omega as the paper has it; None where steps are chosen.
        tolerance: of those that choose.
        samples: output samples a cycle.
        nearby: whether the start is 1e-12 half-gaps away.
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

    def at(self, **changes: Any) -> Setup:
        """The same with some changes."""
        return replace(self, **changes)


@dataclass(frozen=True)
class Bench:
    """Results by their setups, and the scope they were made in."""

    scope: Scope
    results: Mapping[Setup, Result]

    def result(self, setup: Setup) -> Result:
        """How a run went."""
        return self.results[setup]

    def run(self, setup: Setup) -> Run | None:
        """A run, or None."""
        return self.results[setup].run


def available(algorithm: str) -> bool:
    """Whether an algorithm is on the shelf."""
    return algorithm in SOLVERS


def measure(scope: Scope, setups: Iterable[Setup], progress: Progress | None = None) -> Bench:
    """Make every run once.

    Args:
        scope: how long runs are.
        setups: which; repeated ones are made once.
        progress: called with the finished share; what it raises ends everything.
    """
    wanted = tuple(dict.fromkeys(setups))
    total = sum(setup.cycles for setup in wanted)
    done, furthest, results = 0, 0.0, {}

    def told(share: float) -> None:
        nonlocal furthest
        furthest = max(furthest, (done + share * length) / total)  # a run is warmed up, and short ones are repeated
        if progress is not None:
            progress(furthest)

    for setup in wanted:
        length = setup.cycles
        told(0.0)
        results[setup] = _made(setup, told)
        done += length
    return Bench(scope, results)


def _made(setup: Setup, progress: Progress) -> Result:
    contender = Contender(setup.algorithm, setup.algorithm)
    if not available(setup.algorithm):
        return Result(contender, MISSING, None, 0.0)
    model = load_case(setup.case, setup.ratio, loaded=setup.loaded)
    settings: dict[str, Any] = {
        "cycles": setup.cycles, "discard": setup.cycles // 2, "samples_per_cycle": setup.samples,
    }  # fmt: skip
    if setup.nearby:
        rest = equilibrium(model).angle.copy()
        rest[0] += _AWAY
        settings["initial"] = {"angle": rest.tolist(), "velocity": [0.0] * rest.size}
    if setup.step is not None:
        settings["step"] = setup.step / SPEED
    elif setup.algorithm != "exact":
        settings["tolerance"] = setup.tolerance
    return run_one(model, contender, settings, BUDGET, progress)
