"""The shelf of schedulers: one contract, the same bits from each; refusals; full disks."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.errors import Cancelled, ModelError, NotInstalled
from gearrattle.studies.prepared import carry_out
from gearrattle.studies.schedulers import SCHEDULERS, opened
from gearrattle.studies.study import prepare
from gearrattle.studies.study_store import Store
from tests.studies import clusters
from tests.studies.drivelines import model

pytestmark = pytest.mark.slow

GAP, TORQUE = "coupling.joint.clearance", "torque.0.mean"
AXES: dict[str, Any] = {GAP: [0.005, 0.01, 0.02], TORQUE: {"from": 0.2, "to": 1.2, "count": 8}}
OUTPUTS = ("verdict", "impacts per cycle", "TR rms", "largest Lyapunov exponent")


@pytest.fixture(scope="module")
def whole() -> xr.Dataset:
    return gr.study(model(), AXES, OUTPUTS, workers=1)


@pytest.fixture(scope="module")
def flag(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    path = tmp_path_factory.mktemp("disk") / "full"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(clusters.FULL, str(path))
        yield path


@pytest.fixture(scope="module")
def addresses(flag: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, tuple[str, int | None]]]:
    """By name of the table: what to ask for. A key of the table that is missing here fails the tests over it."""
    pytest.importorskip("distributed")
    with clusters.dask(tmp_path_factory.mktemp("dask"), 2) as cluster:
        yield {"local": ("local", 2), "threads": ("threads", 4), "tcp://": (cluster.address, None)}


TABLE = sorted(set(SCHEDULERS) - {"tls://"})  # the same function as tcp://, and certificates
SOONEST = [pytest.param(name, marks=pytest.mark.long if name == "local" else ()) for name in TABLE]
"""Processes start slowly; what is the same for all schedulers the quick tests try on the others."""


@pytest.mark.parametrize("name", TABLE)
def test_every_scheduler_gives_the_bits_of_one_process(
    name: str, addresses: dict[str, tuple[str, int | None]], whole: xr.Dataset, tmp_path: Path
) -> None:
    address, workers = addresses[name]
    shares: list[float] = []
    actual = gr.study(
        model(), AXES, OUTPUTS, scheduler=address, workers=workers, output=tmp_path / "s", progress=shares.append
    )
    assert actual.identical(whole)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert sorted(path.name for path in (tmp_path / "s").iterdir()) == [".lock", "done", "results.zarr", "study.json"]


@pytest.mark.parametrize("name", SOONEST)
def test_every_scheduler_stops_when_told_and_goes_on(
    name: str, addresses: dict[str, tuple[str, int | None]], whole: xr.Dataset, tmp_path: Path
) -> None:
    address, workers = addresses[name]

    def stop(share: float) -> None:
        if share >= 0.2:
            raise Cancelled("enough")

    arguments: dict[str, Any] = {"scheduler": address, "workers": workers, "output": tmp_path / "s"}
    with pytest.raises(Cancelled):
        gr.study(model(), AXES, OUTPUTS, **arguments, progress=stop)
    assert not list((tmp_path / "s").glob(".handed-*"))
    assert len(list((tmp_path / "s" / "done").glob("*.json"))) > 0
    assert gr.study(model(), AXES, OUTPUTS, **arguments, resume=True).identical(whole)


@pytest.mark.parametrize("name", SOONEST)
def test_a_disk_that_fills_up_ends_the_study_and_it_goes_on(
    name: str, addresses: dict[str, tuple[str, int | None]], flag: Path, tmp_path: Path
) -> None:
    address, workers = addresses[name]
    arguments: dict[str, Any] = {"scheduler": address, "workers": workers, "output": tmp_path / "s"}
    actual = prepare(model(), AXES, OUTPUTS, function=clusters.filling)
    store = Store.open(tmp_path / "s", actual.plan, actual.outputs, resume=False)
    keep = Store.keep
    flag.touch()
    try:
        with pytest.raises(OSError, match="No space left"), opened(address, workers, 1) as compute:
            carry_out(store, compute)
    finally:
        Store.keep = keep  # type: ignore[method-assign]
    assert len(store.done()) < store.plan.chunks
    whole = gr.study(model(), AXES, OUTPUTS, function=clusters.filling, workers=1)
    assert gr.study(model(), AXES, OUTPUTS, function=clusters.filling, **arguments, resume=True).identical(whole)


@pytest.mark.parametrize("turn", [*range(2), *(pytest.param(i, marks=pytest.mark.long) for i in range(2, 60))])
def test_threads_share_what_is_remembered_and_nothing_else(turn: int, whole: xr.Dataset) -> None:
    """Eight threads on two cores, told to switch every few microseconds."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        assert gr.study(model(), AXES, OUTPUTS, scheduler="threads", workers=8).identical(whole)
    finally:
        sys.setswitchinterval(interval)


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"scheduler": "thread"}, "must be one of local, threads, tcp://HOST:PORT"),
        ({"scheduler": "tcp://"}, "must be one of"),
        ({"scheduler": "threads", "workers": 0}, "whole number from 1"),
        ({"scheduler": 3}, "distributed.Client"),
        ({"scheduler": "tcp://127.0.0.1:1", "workers": 2}, "own number of workers"),
    ],
)
def test_wrong_schedulers_are_refused_before_anything_is_written(
    arguments: dict[str, Any], match: str, tmp_path: Path
) -> None:
    if arguments["scheduler"] not in ("thread", "threads"):
        pytest.importorskip("distributed")
    with pytest.raises(ModelError, match=match):
        gr.study(model(), {TORQUE: [0.4, 0.8]}, ["verdict"], **arguments, output=tmp_path / "never")
    assert not (tmp_path / "never").exists()


def test_a_missing_library_is_told_with_its_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(NotInstalled, match=r'pip install "gearrattle\[studies\]"'):
        gr.study(model(), {TORQUE: [0.4, 0.8]}, ["verdict"], scheduler="tcp://127.0.0.1:8786")
