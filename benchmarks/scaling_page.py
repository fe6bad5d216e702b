"""The page of ``benchmarks.scaling`` in words and tables.

Takes what was measured; gives Markdown.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from benchmarks.machine import machine
from gearrattle.studies.plan import Plan
from gearrattle.studies.prepared import CHUNK_SECONDS, MOST_IN_CHUNK, span

HEAD = """\
# What many cases cost

Written by `make scaling` on {date}; do not edit. {machine}, {cores} cores; {load}

Cases are the paper's case 3, loaded, over 100 cycles with the default outputs ({case:.2f} ms of processor time each).
Efficiency is the processor time that workers spent computing, over the time from their first chunk's begin to their
last one's end: what is missing to 1 is the scheduler, the store, waiting for work, and what others took of the cores.
Starting workers is left out; waiting for the last chunk of all is told apart.

## What a chunk costs

{empty} chunks of four cases of next to nothing (two cycles of a pair of gears), {workers} workers; computing them
is taken off.

| scheduler | a chunk, time of one worker [ms] | chunks a second | share of a chunk of {shortest:.2g} s | of 5 s |
|---|---|---|---|---|
{chunks}

Most of it is writing {arrays} arrays and a marker, at their final names only when whole.
"""

GROWTH = """
## How a study grows

Chunks as studies cut them by themselves. Strong: one study of {strong} cases in {chunks} chunks. Weak: {weak} cases a
worker.

| workers | {names} |
|---|{rule}
{rows}

In every cell: seconds, the efficiency, the share of waiting for the last chunk; strong / weak.
"""

TAIL = """
## How long a study takes

$$ T = \\frac{{\\text{{cases}} \\times t_{{case}}}}{{\\text{{workers}} \\times \\text{{efficiency}}}},
   \\qquad \\text{{workers}} \\le \\frac{{t_{{chunk}}}}{{t_{{deal}}}} $$

`--estimate` measures the time of a case. A chunk takes five seconds or holds {most} cases at most; studies too short
for that have up to 64 chunks of two seconds or so. A Dask scheduler with {workers} workers got through {rate:.0f}
chunks a second, computing and writing included, so $t_{{deal}}$ is {deal:.1f} ms at most: one scheduler is enough for
{enough} workers with chunks of five seconds, by this bound. More than {workers} were not tried. With {case:.2f} ms a
case and an efficiency of {efficiency:.2f} (extrapolated for 64 and 1000):

| cases | chunks | core hours | on {workers} workers | on 64 | on 1000 | store |
|---|---|---|---|---|---|---|
{rows}

The store takes {stored:.0f} bytes a case in chunks of 256, {files} files a chunk. A billion cases must be allowed
(`most`), and points of distributions stand in memory, eight bytes each: vary in order, or in several studies with
seeds of their own. Markers are read one by one at every start: about {names:.1g} s for a million chunks' worth of
names, more on a network file system. Prices: core hours times what an hour of a core costs where you are; the store
is small beside that.
"""


@dataclass(frozen=True)
class Taken:
    """A study that was carried out.

    Attributes
    ----------
    seconds
        from its first chunk's begin to its last one's end.
    there
        of all workers, from their first chunk's begin to their last one's end.
    busy
        of that, computing.
    waiting
        of all workers, from their last chunk's end to the study's.
    chunks
        how many.
    """

    seconds: float
    there: float
    busy: float
    waiting: float
    chunks: int

    @property
    def beside(self) -> float:
        """Return a worker's time beside computing [s a chunk]."""
        return (self.there - self.busy) / self.chunks

    @property
    def efficiency(self) -> float:
        """Return what of the workers' time was computing."""
        return self.busy / self.there

    @property
    def idle(self) -> float:
        """Return what of the whole time workers waited for the last chunk."""
        return self.waiting / (self.there + self.waiting)

    def told(self) -> str:
        """Return it for a cell."""
        return f"{self.seconds:.1f} ({self.efficiency:.3f}, {self.idle:.3f})"


@dataclass(frozen=True)
class Costs:
    """What chunks of next to nothing cost: workers at work, and by scheduler what they took."""

    workers: int
    taken: dict[str, Taken]


@dataclass(frozen=True)
class Growth:
    """Two studies on so many workers, the strong and the weak one: their plans; by scheduler what they took."""

    workers: int
    plans: tuple[Plan, ...]
    taken: tuple[dict[str, Taken], ...]

    def told(self) -> str:
        """Return a row of the table."""
        pairs = zip(*(costs.values() for costs in self.taken), strict=True)
        return f"| {self.workers} | {' | '.join(' / '.join(one.told() for one in pair) for pair in pairs)} |"


@dataclass(frozen=True)
class Measured:
    """Everything measured: load before, cores, chunks, growth; bytes a case, files a chunk, seconds to list names."""

    load: float
    cores: int
    costs: Costs
    growths: list[Growth]
    stored: float
    files: int
    names: float


def page(measured: Measured) -> str:
    """Write the page."""
    costs, strong = measured.costs, measured.growths[0].plans[0]
    case = min(way.busy for row in measured.growths for way in row.taken[0].values()) / strong.count
    shortest = strong.chunk_size * case
    busy = (
        f"others kept {measured.load:.1f} of them busy before it began" if measured.load > 0.3 else "idle but for this"
    )
    chunks = "\n".join(
        f"| {name} | {1e3 * way.beside:.1f} | {way.chunks / way.seconds:.0f} "
        f"| {100.0 * way.beside / shortest:.1f} % | {100.0 * way.beside / CHUNK_SECONDS:.1f} % |"
        for name, way in costs.taken.items()
    )
    text = HEAD.format(
        date=datetime.now(UTC).date().isoformat(),
        machine=machine(),
        cores=measured.cores,
        load=f"{busy}.",
        case=1e3 * case,
        workers=costs.workers,
        empty=512,
        chunks=chunks,
        shortest=shortest,
        arrays=5,
    )
    names = list(costs.taken)
    text += GROWTH.format(
        strong=strong.count,
        chunks=strong.chunks,
        weak=measured.growths[0].plans[1].count,
        names=" | ".join(names),
        rule="---|" * len(names),
        rows="\n".join(growth.told() for growth in measured.growths),
    )
    most = measured.growths[-1]
    efficiency = most.taken[0]["cluster"].efficiency
    rows = "\n".join(_row(10**n, case, efficiency, most.workers, measured.stored) for n in (4, 6, 9))
    deal = costs.taken["cluster"].seconds / costs.taken["cluster"].chunks
    return text + TAIL.format(
        most=MOST_IN_CHUNK,
        shortest=shortest,
        workers=costs.workers,
        rate=1.0 / deal,
        deal=1e3 * deal,
        enough=int(CHUNK_SECONDS / deal),
        case=1e3 * case,
        efficiency=efficiency,
        rows=rows,
        stored=measured.stored,
        files=measured.files,
        names=measured.names,
    )


def _row(cases: int, case: float, efficiency: float, workers: int, stored: float) -> str:
    size = min(MOST_IN_CHUNK, 1 << int(np.log2(CHUNK_SECONDS / case)))
    chunks = -(-cases // size)
    turns = [-(-chunks // count) for count in (workers, 64, 1000)]
    cells = " | ".join(span(min(size, cases) * turn * case / efficiency) for turn in turns)
    unit, scale = next((u, s) for u, s in (("GB", 1e9), ("MB", 1e6)) if cases * stored >= s or u == "MB")
    kept = f"{cases * stored / scale:.2g} {unit}"
    return f"| 1e{round(np.log10(cases))} | {chunks} | {cases * case / 3600.0:.3g} | {cells} | {kept} |"
