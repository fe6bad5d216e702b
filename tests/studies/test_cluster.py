"""A Dask cluster whose workers and scheduler are killed: nothing is lost, and the bits are those of one process."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.errors import Cancelled, ModelError, SchedulerLost
from gearrattle.studies.case_runs import OUTCOMES
from gearrattle.studies.schedulers import hand_over
from gearrattle.studies.schedulers.hand_over import Handed
from gearrattle.studies.storage import Folder, Storage
from tests.studies import clusters
from tests.studies.clusters import deadly, slow
from tests.studies.drivelines import model

distributed = pytest.importorskip("distributed")

GAP, TORQUE = "coupling.joint.clearance", "torque.0.mean"
AXES: dict[str, Any] = {GAP: [0.005, 0.01, 0.02], TORQUE: {"from": 0.2, "to": 1.2, "count": 31}}
OUTPUTS = ("verdict", "impacts per cycle", "TR rms")


@pytest.fixture(scope="module")
def whole() -> xr.Dataset:
    return gr.study(model(), AXES, OUTPUTS, workers=1, function=slow)


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A worker in this process, as a user hands it in."""
    scratch = str(tmp_path_factory.mktemp("dask"))
    options = {"dashboard_address": None, "local_directory": scratch, "silence_logs": 50, "processes": False}
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, **options) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.mark.long
@pytest.mark.parametrize("seed", range(23))
def test_workers_may_be_killed_and_nothing_is_lost(seed: int, whole: xr.Dataset, tmp_path: Path) -> None:
    """At any moment, while they start as well; another is hired for each."""
    killed: list[int] = []
    over = threading.Event()
    rng = np.random.default_rng(seed)
    (tmp_path / "dask").mkdir()
    with clusters.dask(tmp_path / "dask", 2) as cluster:

        def hunt() -> None:
            while not (tmp_path / "s" / "done").exists() and not over.wait(0.01):
                pass
            while not over.wait(float(rng.uniform(0.1, 2.5))) and len(killed) < (4 if seed else 2):
                prey = cluster.workers.pop(int(rng.integers(2)))
                prey.kill()
                killed.append(prey.wait())
                cluster.hire()

        hunter = threading.Thread(target=hunt)
        hunter.start()
        try:
            arguments: dict[str, Any] = {"scheduler": cluster.address, "output": tmp_path / "s"}
            actual = gr.study(model(), AXES, OUTPUTS, function=slow, **arguments)
        finally:
            over.set()
            hunter.join()
    assert killed
    assert actual.identical(whole)
    assert sorted(path.name for path in (tmp_path / "s").iterdir()) == [".lock", "done", "results.zarr", "study.json"]
    assert {path.suffix for path in (tmp_path / "s" / "done").iterdir()} == {".json"}


@pytest.mark.long
@pytest.mark.parametrize("seed", range(21))
def test_a_killed_scheduler_ends_the_study_and_it_goes_on(seed: int, whole: xr.Dataset, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)
    (tmp_path / "dask").mkdir()
    share = float(rng.uniform(0.05, 0.9))
    with clusters.dask(tmp_path / "dask", 2) as cluster:

        def kill(reached: float) -> None:
            if reached >= share:
                cluster.scheduler.kill()

        arguments: dict[str, Any] = {"function": slow, "scheduler": cluster.address, "output": tmp_path / "s"}
        with pytest.raises(SchedulerLost, match=f"scheduler at {cluster.address} has gone"):
            gr.study(model(), AXES, OUTPUTS, **arguments, progress=kill)
    # Workers write what they compute themselves: what was under way may be there too, even all of it.
    assert share * 0.99 <= float((gr.open_study(tmp_path / "s")["outcome"] == 1).mean())
    again = gr.study(model(), AXES, OUTPUTS, function=slow, workers=1, output=tmp_path / "s", resume=True)
    assert again.identical(whole)


@pytest.mark.long
@pytest.mark.parametrize("threads", [1, 3])
def test_a_case_that_kills_its_worker_is_written_down_and_the_others_are_done(threads: int, tmp_path: Path) -> None:
    """Of nine cases one kills: once among others, then ``PATIENCE`` times alone, and no more."""
    options = {"dashboard_address": None, "local_directory": str(tmp_path / "dask"), "silence_logs": 50}
    axes = {TORQUE: [0.2, 0.3, 0.4, 0.5, 0.8, 0.9, 1.0, 1.1, 1.2]}
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=threads, **options) as cluster,
        distributed.Client(cluster) as client,
    ):
        actual = gr.study(model(), axes, ["verdict"], function=deadly, scheduler=client, output=tmp_path / "s")
        lost = [event for _, event in client.get_events("all") if event.get("action") == "remove-worker"]
    outcome = [OUTCOMES[code] for code in actual["outcome"].values.tolist()]
    assert outcome == ["done"] * 4 + ["worker lost"] + ["done"] * 4
    assert len(lost) == 4


def test_a_folder_that_workers_do_not_see_is_told(client: Any, tmp_path: Path) -> None:
    """Another view of the disk, by handing over a path that leads nowhere."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(hand_over, "Handed", _moved)
        with pytest.raises(ModelError, match=r"cannot see the study's folder /nowhere.*all workers share"):
            gr.study(model(), {TORQUE: [0.4, 0.8]}, ["verdict"], scheduler=client, output=tmp_path / "s")


def _moved(_storage: Storage, name: str, digest: str) -> Handed:
    return Handed(Folder(Path("/nowhere/at/all")), name, digest)


def test_a_cluster_without_workers_is_told_and_may_be_left(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(import_module("gearrattle.studies.schedulers.cluster"), "_PATIENCE_ALONE", 0.5)
    reports: list[float] = []

    def enough(_: float) -> None:
        reports.append(time.monotonic())
        if reports[-1] - reports[0] > 6.0:
            raise Cancelled("enough")

    options = {"dashboard_address": None, "silence_logs": 50}
    with (
        distributed.LocalCluster(n_workers=0, **options) as cluster,
        distributed.Client(cluster) as alone,
        pytest.warns(RuntimeWarning, match="has no workers: the study waits"),
        pytest.raises(Cancelled),
    ):
        gr.study(model(), {TORQUE: [0.2, 0.4]}, ["verdict"], scheduler=alone, output=tmp_path / "s", progress=enough)


def test_nobody_at_an_address_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    module = import_module("gearrattle.studies.schedulers.cluster")  # the shelf has a function of its name
    monkeypatch.setattr(module, "_PATIENCE_CONNECTING", 1.0)
    with pytest.raises(ModelError, match=re.escape("found tcp://127.0.0.1:9; no scheduler answers")):
        gr.study(model(), {TORQUE: [0.4]}, ["verdict"], scheduler="tcp://127.0.0.1:9", output=tmp_path / "never")
    assert not (tmp_path / "never").exists()
