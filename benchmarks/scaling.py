"""What a scheduler costs beside the cases: ``python -m benchmarks.scaling``.

Writes docs/reference/scaling.md: what a chunk costs (chunks of next to nothing), how one study grows with workers
(strong) and how studies grow with them (weak), both at the chunk size that studies choose by themselves. Workers note
the processor time that computing took them: what is left of the time they were there is what all else costs. So others
on the machine, who slow both down, spoil little; the fastest of some repeats counts, taken in turn.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import gearrattle as gr
from benchmarks.scaling_page import Costs, Growth, Measured, Taken, page
from benchmarks.scaling_work import folder_of, noted
from benchmarks.variants import PAIR, axis_of, model_of
from gearrattle.studies.plan import Plan
from gearrattle.studies.prepared import Prepared, carry_out
from gearrattle.studies.schedulers import opened
from gearrattle.studies.study import prepare
from gearrattle.studies.study_store import Store

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "reference" / "scaling.md"
NAMES = ("threads", "local", "cluster")
SECONDS = 24.0
REPEATS = 2
EMPTY = 512  # of one worker, of a study whose growth is measured; chunks of next to nothing
_FEW, _WEAK = 4, 5.0  # cases of a chunk of next to nothing; seconds a worker, of studies that grow with them


@contextlib.contextmanager
def _cluster(workers: int) -> Iterator[Any]:
    """A Dask cluster of this machine, its client."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        yield client


def _taken(prepared: Prepared, scheduler: Any) -> Taken:
    """Have a study computed, and see what its workers were busy with once they had begun."""
    with tempfile.TemporaryDirectory() as name:
        store = Store.open(Path(name) / "s", prepared.plan, prepared.outputs, noted, resume=False)
        folder_of(store).mkdir()
        carry_out(store, scheduler)
        notes = [json.loads(file.read_text(encoding="utf-8")) for file in folder_of(store).iterdir()]
    workers = {note[0] for note in notes}
    begun = {worker: min(note[1] for note in notes if note[0] == worker) for worker in workers}
    ended = {worker: max(note[2] for note in notes if note[0] == worker) for worker in workers}
    return Taken(
        seconds=max(ended.values()) - min(begun.values()),
        busy=sum(note[3] for note in notes),
        chunks=len(notes),
        there=sum(ended[worker] - begun[worker] for worker in workers),
        waiting=sum(max(ended.values()) - ended[worker] for worker in workers),
    )


@contextlib.contextmanager
def _schedulers(workers: int) -> Iterator[dict[str, Any]]:
    """One of each kind."""
    with (
        opened("threads", workers, workers) as threads,
        opened("local", workers, workers) as local,
        _cluster(workers) as client,
        opened(client, None, workers) as cluster,
    ):
        yield dict(zip(NAMES, (threads, local, cluster), strict=True))


def costs_of_chunks(workers: int) -> Costs:
    """What a chunk costs, by scheduler: that of one with next to nothing to compute, on so many workers."""
    model = gr.loads(PAIR).with_({"simulation.cycles": 2, "simulation.discard": 1})
    prepared = prepare(model, axis_of(model, "mesh.gear.backlash", EMPTY * _FEW))
    prepared = replace(prepared, plan=replace(prepared.plan, chunk_size=_FEW))
    with _schedulers(workers) as ways:
        return Costs(workers, _least(ways, prepared))


def _least(ways: dict[str, Any], prepared: Prepared) -> dict[str, Taken]:
    """The fastest of some repeats, by scheduler."""
    taken = [{name: _taken(prepared, way) for name, way in ways.items()} for _ in range(REPEATS)]
    return {name: min((costs[name] for costs in taken), key=lambda one: one.seconds) for name in ways}


def growths(counts: list[int]) -> list[Growth]:
    """How studies grow with workers, in strength and in weakness."""
    model = model_of("case3_loaded")
    few = prepare(model, axis_of(model, "coupling.clutch.stiffness", 512))

    def study(seconds: float) -> Prepared:
        return prepare(model, axis_of(model, "coupling.clutch.stiffness", int(seconds / few.seconds)))

    strong, growth_rows = study(SECONDS), []
    for workers in counts:
        weak = study(_WEAK * workers)
        with _schedulers(workers) as ways:
            growth_rows.append(Growth(workers, (strong.plan, weak.plan), (_least(ways, strong), _least(ways, weak))))
        print(growth_rows[-1].told(), file=sys.stderr, flush=True)
    return growth_rows


def _stored(prepared: Prepared) -> tuple[float, int]:
    """Bytes a case in the store, and files a chunk."""
    with tempfile.TemporaryDirectory() as name, opened("threads", 1, 1) as scheduler:
        folder = Path(name) / "s"
        store = Store.open(folder, prepared.plan, prepared.outputs, resume=False)
        empty = {path for path in folder.rglob("*") if path.is_file()}
        carry_out(store, scheduler)
        new = [path for path in folder.rglob("*") if path.is_file() and path not in empty]
        return sum(path.stat().st_size for path in new) / prepared.plan.count, len(new) // prepared.plan.chunks


def _names() -> float:
    """Seconds to list a million markers, from 10 000."""
    with tempfile.TemporaryDirectory() as name:
        for i in range(10_000):
            (Path(name) / f"{i:07d}.json").touch()
        begun = time.perf_counter()
        sum(path.stem.isdigit() for path in Path(name).glob("*.json"))
        return 100.0 * (time.perf_counter() - begun)


def measured() -> Measured:
    """Measure everything."""
    load, cores = os.getloadavg()[0], len(os.sched_getaffinity(0))
    counts = [2**i for i in range(cores.bit_length()) if 2**i <= cores]
    model = model_of("case3_loaded")
    typical = prepare(model, axis_of(model, "coupling.clutch.stiffness", 2048))
    gr.study(model, axis_of(model, "coupling.clutch.stiffness", 32), workers=1)  # warm
    stored, files = _stored(Prepared(Plan(model, typical.plan.axes, None, 256), typical.outputs, typical.seconds))
    return Measured(load, cores, costs_of_chunks(counts[-1]), growths(counts), stored, files, _names())


def main() -> None:
    """Measure and write the page."""
    text = page(measured())
    PAGE.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
