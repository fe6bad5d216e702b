"""Contenders of a comparison and their runs: warm, alone, within a budget, with failures as results."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from gearrattle.errors import ConvergenceError, ModelError, NotInstalled, Problem
from gearrattle.model import Model
from gearrattle.results import Run
from gearrattle.simulation.simulate import simulate

PAPER = ("rk2", "rk4", "rkf", "rkv", "adams", "gear", "bulirsch-stoer")
"""The seven algorithms of Padmanabhan et al. 1995, sec. 8, in the order of its Table 3."""

CEILING = "exact, 1e-12 away"
"""Label of the exact motion begun nearby, which no algorithm can be expected to beat."""

_SETTINGS = ("algorithm", "tolerance", "step")
AGAIN = 3
SHORT = 0.3
"""Runs that take less [s] are repeated so often; the fastest counts."""

Progress = Callable[[float], None]
Algorithms = str | Sequence[str] | Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Contender:
    """One algorithm with its settings: tolerance, step or initial state, where they differ from the comparison's."""

    label: str
    algorithm: str
    settings: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Result:
    """Run of a contender, or the reason why there is none.

    Attributes
    ----------
    status
        "done", or why there is no run, in words.
    wall_time
        of a run that came to an end, or until it was given up [s].
    """

    contender: Contender
    status: str
    run: Run | None
    wall_time: float


class _Spent(Exception):
    """The budget is used up."""


def contenders(algorithms: Algorithms) -> tuple[Contender, ...]:
    """Contenders from names, or from labels with settings that name the algorithm where it is not the label.

    A ModelError refuses an empty list, a label twice, and settings other than algorithm, tolerance and step.
    """
    if not isinstance(algorithms, Mapping):
        names = [algorithms] if isinstance(algorithms, str) else list(algorithms)
        contenders = tuple(Contender(name, name) for name in names)
    else:
        wrong = [problem for label, algorithm in algorithms.items() for problem in _wrong_settings(label, algorithm)]
        if wrong:
            raise ModelError(wrong)
        contenders = tuple(
            Contender(
                label, algorithm.get("algorithm", label), {k: v for k, v in algorithm.items() if k != "algorithm"}
            )
            for label, algorithm in algorithms.items()
        )
    if not contenders:
        raise ModelError(Problem("algorithms", "", "must name at least one"))
    labels = [contender.label for contender in contenders]
    twice = dict.fromkeys(label for label in labels if labels.count(label) > 1)
    remedy = 'a mapping lets one algorithm take part twice, such as {"coarse": {"algorithm": "rk4", "step": 1e-4}}'
    if twice:
        raise ModelError([Problem("algorithms", f'"{label}" twice', "every label once", remedy) for label in twice])
    return contenders


def _wrong_settings(label: str, settings: Any) -> Iterator[Problem]:
    """Problems of one entry of a mapping."""
    location = f"algorithms.{label}"
    if label == CEILING:
        yield Problem(location, "", "this label is taken by the exact motion from nearby", "choose another")
    if not isinstance(settings, Mapping):
        yield Problem(location, repr(settings), "must be a mapping of settings, {} for none")
        return
    for key in settings:
        if key not in _SETTINGS:
            yield Problem(location, f'"{key}"', f"settings are {', '.join(_SETTINGS)}", "all share the others")


def run_one(
    model: Model, contender: Contender, settings: Mapping[str, Any], budget: float, progress: Progress | None = None
) -> Result:
    """Run one contender: a cycle to warm up, then the run that counts.

    Parameters
    ----------
    budget
        longest time for the run that counts [s].
    progress
        called with the finished share; what it raises ends the comparison.

    Raises
    ------
    ModelError
        bad settings. An algorithm that is not installed is no error but a status.
    """
    arguments: dict[str, Any] = {**settings, **contender.settings, "algorithm": contender.algorithm, "audit": False}
    limit = float("inf")
    begin = time.perf_counter()

    def watch(share: float) -> None:
        if progress is not None:
            progress(share)
        if time.perf_counter() - begin > limit:
            raise _Spent

    # one cycle to warm up
    try:
        try:
            limit = budget
            simulate(model, **{**arguments, "cycles": 1, "discard": 0}, progress=watch)
        except (ConvergenceError, _Spent):
            pass  # the run that counts will say it better
        # the run that counts; a short one is repeated and the fastest kept
        run = None
        for _ in range(AGAIN):
            begin = time.perf_counter()
            again = simulate(model, **arguments, progress=watch)
            run = again if run is None or again.cost.wall_time < run.cost.wall_time else run
            if run.cost.wall_time > SHORT:
                break
    # failures as results
    except ConvergenceError as error:
        return Result(contender, str(error), None, time.perf_counter() - begin)
    except _Spent:
        return Result(contender, f"stopped after {budget:g} s", None, budget)
    except NotInstalled as error:
        return Result(contender, str(error), None, 0.0)
    return Result(contender, "done", run, budget if run is None else run.cost.wall_time)
