"""What a scheduler costs beside the cases: ``python -m benchmarks.scaling``.

Writes docs/reference/scaling.md. One study of the paper's case 1, shortened, is cut into chunks of 1, 2, 4, 8 cases
and computed by every scheduler; T = a + b chunks, fitted to the least of some repeats, gives what a case and what a
chunk cost. A loaded machine makes times longer, never shorter: so the least counts.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

import gearrattle as gr
from benchmarks.machine import machine
from gearrattle.studies import Prepared, carry_out, opened, prepare
from gearrattle.studies.store import Store

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "reference" / "scaling.md"
CASES, WORKERS, REPEATS = 192, 2, 3
SIZES = (1, 2, 4, 8)
SHORT = {"simulation.cycles": 30, "simulation.discard": 15, "simulation.samples_per_cycle": 32}
NAMES = ("one process", "local", "threads", "cluster")

HEAD = """\
# What many cases cost

Written by `make scaling` on {date}; do not edit. {machine}, {cores} cores; {load}

A study of {cases} cases of the paper's case 1 (30 cycles; {case:.2f} ms a case, warm, in a run of its own), two workers, cut into chunks of
several sizes; the least of {repeats} repeats, with the start of workers left out: what a whole study takes [s].

| scheduler | {sizes} | a chunk costs [ms] | a case costs [ms] | efficiency |
|---|{rule}---|---|---|
"""

TAIL = """
*A chunk costs*: slope of the time against the number of chunks, on both workers together; most of it is writing {arrays} arrays and the
marker. *A case costs*: what is left for no chunks, times workers, over cases. *Efficiency*: that of one process beside it. `threads` take
turns at everything that is not a compiled kernel. The store takes {storage:.0f} bytes a case in chunks of {largest} (and {per_chunk:.1f} kB
a chunk, of which the marker is {marker:.1f} kB); files: {files} a chunk.

## How long a study takes

$$ T = \\frac{{\\text{{cases}} \\times t_{{case}}}}{{\\text{{workers}} \\times \\text{{efficiency}}}}
   + \\text{{chunks}} \\times t_{{chunk}} $$

`--estimate` measures the time of a case. Chunks are cut so that one takes about five seconds, or holds 10 000 cases at most, so the second
term is small: two workers on a cluster, computing included, get through {rate:.0f} chunks a second or more, so its scheduler is enough for {most:.0f} workers
at least with chunks of five seconds; more was not tried. With
the figures above, an efficiency of {efficiency:.2f}, and 64 workers on a cluster (extrapolated, not measured):

| cases | chunks | core hours | on 2 workers | on 64 workers | store |
|---|---|---|---|---|---|
{rows}

A billion cases must be allowed (`most`), and points of distributions stand in memory, eight bytes each: vary in order, or in several studies
with seeds of their own. Markers are read one by one at every start: about {start:.1g} s for a million chunks' worth of names, more on a network
file system. Cases of the paper at full length take longer in proportion to their cycles.
"""


@contextlib.contextmanager
def _workers() -> Iterator[Any]:
    """A cluster of this machine."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(n_workers=WORKERS, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        yield client


def _taken(found: Prepared, address: Any, workers: int | None) -> float:
    """Seconds from the first chunk that is kept to the last, scaled to all: the start of workers is left out."""
    with tempfile.TemporaryDirectory() as name, opened(address, workers, 1) as compute:
        folder = Path(name) / "s"
        store = Store.open(folder, found.plan, found.outputs, resume=False)
        at: list[tuple[float, float]] = []

        def told(share: float) -> None:
            if not at or share > at[-1][0]:
                at.append((share, time.perf_counter()))

        carry_out(store, compute, progress=told)
    reached = [each for each in at if each[0] >= _WARM]
    (first, begun), (last, ended) = reached[0], reached[-1]
    return (ended - begun) / (last - first)


_WARM = 0.25  # share of a study after which every worker has compiled


def _storage(found: Prepared) -> tuple[float, float, float, int]:
    """Bytes a case, kB a chunk, kB a marker, files a chunk."""
    with tempfile.TemporaryDirectory() as name, opened("local", 1, 1) as compute:
        folder = Path(name) / "s"
        store = Store.open(folder, found.plan, found.outputs, resume=False)
        empty = {path for path in folder.rglob("*") if path.is_file()}
        carry_out(store, compute)
        new = [path for path in folder.rglob("*") if path.is_file() and path not in empty]
        total = sum(path.stat().st_size for path in new)
        markers = sum(path.stat().st_size for path in (folder / "done").iterdir())
    chunks = found.plan.chunks
    return total / found.plan.count, total / chunks / 1e3, markers / chunks / 1e3, len(new) // chunks


def measured() -> tuple[Prepared, dict[str, list[float]]]:
    """The study, and by scheduler the least time for every size of chunk [s]."""
    model = gr.load(ROOT / "examples" / "paper" / "case1.toml")
    axes = {"mesh.gear.backlash": {"from": "0.02 mm", "to": "0.2 mm", "count": CASES}}
    found = prepare(model, axes, fixed=SHORT)
    times = {name: [float("inf")] * len(SIZES) for name in NAMES}
    with _workers() as client:
        asked = {"one process": ("local", 1), "local": ("local", WORKERS), "threads": ("threads", WORKERS)}
        for _ in range(REPEATS):
            for i, size in enumerate(SIZES):
                cut = replace(found, plan=replace(found.plan, chunk_size=size))
                for name in NAMES:
                    took = _taken(cut, *asked.get(name, (client, None)))
                    times[name][i] = min(times[name][i], took)
    return found, times


def page(found: Prepared, times: dict[str, list[float]], load: float) -> str:
    """The page in words."""
    chunks = np.array([CASES / size for size in SIZES])
    fits = {name: np.polyfit(chunks, row, 1) for name, row in times.items()}
    alone = float(fits["one process"][1]) / CASES
    busy = (
        f"others kept {load:.1f} of them busy before it began: times are upper bounds, efficiencies may be off by tens of per cent."
        if load > 0.3
        else "idle but for this."
    )
    text = HEAD.format(
        date=datetime.now(UTC).date().isoformat(), machine=machine(), cores=os.cpu_count(), cases=CASES, load=busy,
        case=1e3 * found.seconds, repeats=REPEATS, sizes=" | ".join(f"{size} a chunk" for size in SIZES),
        rule="---|" * len(SIZES),
    )  # fmt: skip
    shares = {}
    for name, row in times.items():
        workers = 1 if name == "one process" else WORKERS
        case = float(fits[name][1]) * workers / CASES
        shares[name] = alone / case
        cells = " | ".join(f"{value:.2f}" for value in row)
        text += f"| {name} | {cells} | {1e3 * fits[name][0]:.1f} | {1e3 * case:.2f} | {shares[name]:.2f} |\n"
    largest = replace(found, plan=replace(found.plan, chunk_size=SIZES[-1]))
    storage, per_chunk, marker, files = _storage(largest)
    each = float(fits["cluster"][0])
    rows = "\n".join(_row(cases, alone, shares["cluster"], each, storage) for cases in (10**4, 10**6, 10**9))
    return text + TAIL.format(
        arrays=len(found.outputs.all) + 1, storage=storage, largest=SIZES[-1], per_chunk=per_chunk, marker=marker,
        files=files, rate=1.0 / each, most=5.0 / each, efficiency=shares["cluster"], rows=rows, start=_names(),
    )  # fmt: skip


def _row(cases: int, case: float, efficiency: float, chunk: float, storage: float) -> str:
    size = min(10_000, 1 << int(np.log2(5.0 / case)))
    chunks = -(-cases // size)
    spans = [cases * case / (workers * efficiency) + chunks * chunk * 2 / workers for workers in (2, 64)]
    cells = " | ".join(_span(each) for each in spans)
    kept = cases * storage
    unit, scale = next((u, s) for u, s in (("GB", 1e9), ("MB", 1e6)) if kept >= s or u == "MB")
    return (
        f"| 1e{round(np.log10(cases))} | {chunks} | {cases * case / 3600.0:.3g} | {cells} | {kept / scale:.2g} {unit} |"
    )


def _span(seconds: float) -> str:
    for unit, length in (("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:.3g} {unit}"
    return f"{seconds:.2g} s"


def _names() -> float:
    """Seconds to list a million markers, from 10 000."""
    with tempfile.TemporaryDirectory() as name:
        for i in range(10_000):
            (Path(name) / f"{i:07d}.json").touch()
        begun = time.perf_counter()
        sum(path.stem.isdigit() for path in Path(name).glob("*.json"))
        return 100.0 * (time.perf_counter() - begun)


def main() -> None:
    """Measure and write the page."""
    load = os.getloadavg()[0]
    text = page(*measured(), load)
    PAGE.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
