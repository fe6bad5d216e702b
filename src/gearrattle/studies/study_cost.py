"""Cost of a study before it runs, and its remaining time while it runs.

Cases of one study can differ tenfold in cost: a rattling motion has more crossings than a quiet one. So the cost of a
case is measured over cases spread across the whole grid. Chunks are computed in an order that spreads the first ones,
however many, over the grid too (multiples of the golden section): the chunks done represent those that are left.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import ceil, prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import Cancelled
from gearrattle.results import Run
from gearrattle.simulation.simulate import simulate
from gearrattle.studies.case_batches import FEWEST, batched, can_follow, is_of_crossings
from gearrattle.studies.outputs import Outputs
from gearrattle.studies.plan import Plan, Samples

_TRIED = 0.5  # time of the cases for the estimate, if computed one by one [s]
MOST_TRIED = 32  # largest number of cases for the estimate
_TOO_LONG = 2.0  # time of one case from which on no further case is computed for the estimate [s]
_OPENING = 0.2  # measured time to create the files of a study [s]
_KEEPING = 0.02  # measured time to store a chunk [s]
_GOLDEN = 0.6180339887498949
_BELIEVED = 0.5  # finished share from which on only the measured pace counts, not the estimate
_ALMOST = 0.95  # largest finished share assumed for a chunk whose progress is unknown


def spread(count: int, most: int) -> Iterator[int]:
    """Yield up to ``most`` different numbers below ``count``, every beginning of which is spread over the range.

    Multiples of the golden section: they fall on every value of every axis of a grid, which steps of a power of two
    would not.
    """
    seen: set[int] = set()
    i = 0
    while len(seen) < min(most, count):
        at = int(i * _GOLDEN % 1.0 * count)
        i += 1
        if at not in seen:
            seen.add(at)
            yield at


def spread_indices(shape: tuple[int, ...], most: int) -> list[tuple[int, ...]]:
    """Return up to ``most`` places spread over a grid."""
    count = prod(shape)
    return [tuple(map(int, np.unravel_index(at, shape))) for at in spread(count, most)]


def seconds_alone(
    plan: Plan,
    outputs: Callable[[Run], Any],
    run: Run,
    seconds: float,
    known: dict[tuple[int, ...], dict[str, NDArray[Any]]] | None = None,
) -> float:
    """Return the time of a case by itself, outputs included [s]: the mean of cases spread over the grid.

    Outputs of the cases that are tried are put into ``known`` by place: the study need not repeat them.
    """
    outputs(run)
    begun = time.perf_counter()
    outputs(Run(run.trajectory, run.model))
    taken = [seconds + time.perf_counter() - begun]
    for index in spread_indices(plan.shape, MOST_TRIED)[1:] if taken[0] < _TOO_LONG else ():
        begun = time.perf_counter()
        try:
            values = outputs(simulate(plan.model.with_(plan.changes(index)), audit=False))
        except Cancelled:
            raise
        except Exception:  # a case may fail for any reason, as in the study, where it is reported
            continue
        taken.append(time.perf_counter() - begun)
        if known is not None:
            known[index] = values
        if sum(taken) > 2.0 * _TRIED:
            break
    return sum(taken) / len(taken)


def seconds_together(plan: Plan, outputs: Outputs, alone: float) -> float:
    """Return the time of a case computed together with others [s]; as long as alone where none can be."""
    count = min(max(FEWEST, int(_TRIED / alone)), MOST_TRIED, plan.count)
    if count < FEWEST or alone > _TOO_LONG or not can_follow(outputs, plan):
        return alone
    few = _few(plan, count)
    for _ in range(2):
        begun = time.perf_counter()
        done = batched(few, outputs, 0)[1]
        taken = time.perf_counter() - begun
        if taken < alone * done.size:  # else something was compiled meanwhile
            break
    return (taken + alone * float((~done).sum())) / done.size


def serial_share(plan: Plan, outputs: Outputs, seconds: float) -> float:
    """Return the share of a case's time in which threads wait for each other: all but the compiled loop.

    ``seconds`` is the time of a case computed together with others. The loop is timed without the outputs that need
    samples, which Python evaluates.
    """
    compiled = tuple(output for output in outputs.chosen if is_of_crossings(output))
    if len(compiled) == len(outputs.chosen) or not seconds > 0.0:
        return 0.0
    few = _few(plan, min(FEWEST, plan.count))
    if not compiled or plan.count < FEWEST or seconds > _TOO_LONG or not can_follow(outputs, plan):
        return 1.0
    begun = time.perf_counter()
    done = batched(few, Outputs(compiled), 0)[1]
    loop = (time.perf_counter() - begun) / done.size
    return float(np.clip(1.0 - loop / seconds, 0.0, 1.0)) if done.all() else 1.0


def _few(plan: Plan, count: int) -> Plan:
    """A plan of some cases spread over another one's grid, in one chunk."""
    cases = [plan.changes(index) for index in spread_indices(plan.shape, count)]
    if any(type(value) is not float for case in cases for value in case.values()):
        return Plan(plan.model, plan.axes, plan.samples, count)  # words cannot be samples: neighbours instead
    paths = tuple(cases[0])
    points = np.array([[case[path] for path in paths] for case in cases])
    return Plan(plan.model, (), Samples(paths, points), count)


@dataclass(frozen=True)
class Cost:
    """Cost of a study; its seconds include the start of the workers."""

    cases: int
    case_seconds: float
    workers: int
    seconds: float
    words: str

    def __str__(self) -> str:
        """Return the sentence."""
        return self.words

    def to_dict(self) -> dict[str, int | float | str]:
        """Return plain values by name."""
        return {
            "cases": self.cases,
            "case_seconds": self.case_seconds,
            "workers": self.workers,
            "seconds": self.seconds,
            "estimate": self.words,
        }


def keeping(chunks: int) -> float:
    """Return the time to open a study and to store its chunks [s]."""
    return _OPENING + _KEEPING * chunks


def rounds(chunks: int, workers: int) -> float:
    """Return the number of chunks that the busiest of some workers computes."""
    return float(ceil(chunks / max(1, min(workers, chunks))))


class Pace:
    """Remaining time of chunks, estimated from those that are done.

    Where a scheduler tells the shares of chunks under way, these are counted; where it does not, each is as old as the
    completion that freed its worker, and takes as long as those before it did.
    """

    def __init__(self, chunks: int, workers: int, seconds: float) -> None:
        """Start the clock."""
        self.chunks = chunks
        self.workers = max(1, min(workers, chunks))
        self._expected = seconds
        self._begun = time.monotonic()
        self._freed: deque[float] = deque([self._begun] * self.workers)
        self._taken: list[float] = []
        self.reached = 0

    def chunk_done(self) -> None:
        """Note that a chunk has been done."""
        now = time.monotonic()
        self.reached += 1
        self._taken.append(now - self._freed.popleft())
        self._freed.append(now)

    def under_way(self, shares: Mapping[int, float] | None) -> float:
        """Return the work done in the chunks under way, in chunks."""
        left = self.chunks - self.reached
        if shares is not None:
            return min(float(left), sum(shares.values()))
        now = time.monotonic()
        length = max(self._length(), 1e-9)
        busy = list(self._freed)[: min(self.workers, left)]
        return sum(min(_ALMOST, (now - freed) / length) for freed in busy)

    def remaining(self, shares: Mapping[int, float] | None) -> float:
        """Return how long the rest will take [s]."""
        done = self.reached + self.under_way(shares)
        left = self.chunks - done
        busy = min(self.workers, max(1, self.chunks - self.reached))
        length = self._length()
        if shares is not None and done > 0.0:
            length = (time.monotonic() - self._begun) / done * self.workers
        share = min(1.0, done / (_BELIEVED * max(1, self.chunks)))
        return left * (share * length + (1.0 - share) * self._expected) / busy

    def _length(self) -> float:
        """Time of a chunk [s]; those that workers did first may have waited for their start."""
        later = self._taken[self.workers :] or self._taken
        return sum(later) / len(later) if later else self._expected
