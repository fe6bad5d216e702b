"""Studies: the same as one run after the other, on any number of workers, whatever dies on the way."""

from __future__ import annotations

import os
import signal
import threading
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.engine.solvers import one_step
from gearrattle.errors import Cancelled, ModelError
from gearrattle.studies.case_runs import DONE, NO_MODEL, NOT_CONVERGED, OUTCOMES
from gearrattle.studies.study import prepare
from gearrattle.studies.study_file import read_study
from tests.studies.clusters import deadly
from tests.studies.drivelines import loudness, model, silly

GAP, TORQUE = "coupling.joint.clearance", "torque.0.mean"
AXES: dict[str, Any] = {GAP: [0.005, 0.01, 0.02], TORQUE: {"from": 0.2, "to": 1.2, "count": 4}}
SCATTER = {GAP: {"distribution": "uniform", "from": 0.01, "to": 0.02}}
OUTPUTS = ("verdict", "regime", "impacts per cycle", "TR rms", "crossings per cycle")


@pytest.fixture(scope="module")
def whole() -> xr.Dataset:
    return gr.study(model(), AXES, OUTPUTS, workers=1)


def test_every_case_is_that_of_a_run_of_its_own(whole: xr.Dataset) -> None:
    assert dict(whole.sizes) == {GAP: 3, TORQUE: 4, "part": 1, "inertia": 2}
    assert np.all(whole["outcome"] == DONE)
    for i, gap in enumerate(AXES[GAP]):
        for j, torque in enumerate(np.linspace(0.2, 1.2, 4)):
            run = gr.simulate(model().with_({GAP: gap, TORQUE: float(torque)}), audit=False)
            verdict = gr.criteria(run)
            case = whole.isel({GAP: i, TORQUE: j})
            assert case["verdict"].attrs["flag_meanings"].split()[int(case["verdict"])] == verdict.verdict
            assert float(case["impacts per cycle"].sel(part="joint")) == verdict.parts[0].impacts_per_cycle
            ratio = next(e.value for e in verdict.entries if (e.quantity, e.subject) == ("TR rms", "wheel"))
            assert float(case["TR rms"].sel(inertia="wheel")) == ratio


def test_cases_that_told_how_long_one_takes_are_not_computed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four cases of milliseconds, which cannot be computed together: all but the first were tried before."""
    from gearrattle.studies import case_runs

    alone = model().with_({"simulation.algorithm": "rk4"})

    computed: list[float] = []

    def counted(model: gr.Model, **how: Any) -> gr.Run:
        computed.append(float(model.torques[0].mean))
        return gr.simulate(model, **how)

    monkeypatch.setattr(case_runs, "simulate", counted)
    data = gr.study(alone, {TORQUE: AXES[TORQUE]}, ["TR rms"], scheduler="threads", workers=1)
    assert computed == [0.2]
    assert np.all(data["outcome"] == DONE)
    assert np.all(np.diff(data["TR rms"].sel(inertia="wheel")) != 0.0)
    prepared = prepare(alone, {TORQUE: AXES[TORQUE]}, ["TR rms"])
    assert sorted(prepared.outputs.known) == [(1,), (2,), (3,)]


@pytest.mark.slow
def test_any_number_of_workers_gives_the_same_bits(whole: xr.Dataset, tmp_path: Path) -> None:
    actual = gr.study(model(), AXES, OUTPUTS, workers=2, output=tmp_path / "out")
    assert actual.identical(whole)
    with xr.open_zarr(tmp_path / "out" / "results.zarr", consolidated=False) as plain:  # by others' means
        np.testing.assert_array_equal(plain["impacts per cycle"], whole["impacts per cycle"])
        assert plain["impacts per cycle"].dims == (GAP, TORQUE, "part")
        assert plain["impacts per cycle"].attrs["units"] == "1/cycle"
        assert plain.attrs["source"].startswith("gearrattle")
    assert gr.open_study(tmp_path / "out").equals(whole)


def test_samples_are_a_dimension_with_their_values() -> None:
    vary = {"coupling.joint.stiffness": {"distribution": "normal", "mean": 800.0, "deviation": 20.0}}
    actual = gr.study(model(), {TORQUE: [0.4, 0.8]}, ["contact share"], vary=vary, samples=5, seed=3)
    assert dict(actual.sizes) == {TORQUE: 2, "sample": 5, "part": 1}
    stiffness = float(actual["coupling.joint.stiffness"][3])
    run = gr.simulate(model().with_({TORQUE: 0.8, "coupling.joint.stiffness": stiffness}), audit=False)
    share = next(e.value for e in gr.criteria(run).entries if e.quantity == "contact share")
    assert float(actual["contact share"][1, 3, 0]) == share


def test_a_function_adds_its_own_outputs() -> None:
    actual = gr.study(model(), {TORQUE: [0.4, 0.8]}, [], function=loudness)
    run = gr.simulate(model().with_({TORQUE: 0.8}), audit=False)
    assert float(actual["largest speed"][1]) == loudness(run)["largest speed"]
    with pytest.raises(ModelError, match="mapping"):
        gr.study(model(), {TORQUE: [0.4]}, [], function=silly)  # type: ignore[arg-type]


def test_cases_that_fail_are_told_and_the_others_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A tolerance that no solver meets; as many cycles discarded as there are."""
    monkeypatch.setattr(one_step, "StepLimit", partial(one_step.StepLimit, most=20_000))  # of two million
    alone: dict[str, Any] = {"fixed": {"simulation.algorithm": "rkv"}, "workers": 1, "output": tmp_path / "s"}
    axes = {"simulation.tolerance": [1e-6, 1e-30], "coupling.joint.stiffness_ratio": [0.5, 0.0]}
    actual = gr.study(model(), axes, ["verdict"], **alone)
    assert actual["outcome"].values.tolist()[0] == [DONE, DONE]
    assert actual["outcome"].values.tolist()[1] == [NOT_CONVERGED, NOT_CONVERGED]
    assert actual["verdict"].values[1].tolist() == [-1, -1]
    assert "needs too many steps" in actual.attrs["failures"][0]
    discards = gr.study(model(), {"simulation.cycles": [12, 6], "simulation.discard": [5, 8]}, ["verdict"], workers=1)
    assert discards["outcome"].values.tolist() == [[DONE, DONE], [DONE, NO_MODEL]]
    assert "discard" in discards.attrs["failures"][0]
    again = gr.study(model(), axes, ["verdict"], **alone, resume=True, retry_failed=True)
    assert again.equals(actual)


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        (
            {"axes": {GAP: {"from": 0.01, "to": 0.02, "count": 10_000}, TORQUE: {"from": 0, "to": 1, "count": 1000}}},
            r"10000000 cases \(10000 x 1000\), more than the 1000000 allowed; on one core .* (hours|days)",
        ),
        ({"axes": AXES, "outputs": ["regimes"]}, "did you mean"),
        ({"axes": AXES, "outputs": []}, "at least one"),
        ({}, "needs an axis"),
        ({"axes": AXES, "samples": 3}, "something that scatters"),
        ({"axes": AXES, "vary": SCATTER, "samples": 2}, "twice"),
        ({"axes": AXES, "fixed": {"coupling.joint.stifness": 1.0}}, "did you mean"),
        ({"vary": SCATTER, "samples": 2, "method": "grid"}, 'method: found "grid"; must be "latin-hypercube" or'),
    ],
)
def test_what_is_wrong_is_refused_before_anything_runs(arguments: dict[str, Any], match: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=match):
        gr.study(model(), **arguments, output=tmp_path / "never")
    assert not (tmp_path / "never").exists()


def test_a_study_that_was_stopped_goes_on_to_the_same_bits(whole: xr.Dataset, tmp_path: Path) -> None:
    folder = tmp_path / "out"

    def stop(share: float) -> None:
        if share >= 0.5:  # within the second of three chunks
            raise Cancelled("enough")

    with pytest.raises(Cancelled):
        gr.study(model(), AXES, OUTPUTS, workers=1, output=folder, progress=stop)
    done = len(list((folder / "done").iterdir()))
    assert 0 < done < 12
    assert int((gr.open_study(folder)["outcome"] == DONE).sum()) >= done
    with pytest.raises(ModelError, match="holds a study already"):
        gr.study(model(), AXES, OUTPUTS, output=folder)
    with pytest.raises(ModelError, match="another study"):
        gr.study(model(), {**AXES, TORQUE: [0.3, 0.4, 0.5, 0.6]}, OUTPUTS, output=folder, resume=True)
    shares: list[float] = []
    actual = gr.study(model(), AXES, OUTPUTS, workers=1, output=folder, resume=True, progress=shares.append)
    assert actual.identical(whole)
    assert shares[0] >= done / 12 - 1e-9
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_a_damaged_chunk_is_noticed_and_computed_again(whole: xr.Dataset, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    gr.study(model(), AXES, OUTPUTS, workers=1, output=folder)
    pieces = [p for p in (folder / "results.zarr" / "impacts per cycle" / "c").rglob("*") if p.is_file()]
    pieces[1].write_bytes(pieces[1].read_bytes()[:-3] + b"abc")
    pieces[2].write_bytes(b"")
    sorted((folder / "done").iterdir())[-1].write_text("{", encoding="utf-8")
    assert gr.study(model(), AXES, OUTPUTS, workers=1, output=folder, resume=True).identical(whole)


@pytest.mark.long
def test_workers_may_be_killed_and_nothing_is_lost(whole: xr.Dataset, tmp_path: Path) -> None:
    killed: list[int] = []
    over = threading.Event()
    folder = tmp_path / "out"

    def hunt() -> None:
        rng = np.random.default_rng(5)
        before = -1
        while not over.is_set() and len(killed) < 2:
            time.sleep(float(rng.uniform(0.5, 2.0)))
            done = len(list((folder / "done").glob("*.json")))
            prey = _workers_of(os.getpid())
            if prey and done > before:  # a chunk that loses three workers alone is given up, on a slow machine too
                os.kill(int(rng.choice(prey)), signal.SIGKILL)
                killed.append(1)
                before = done

    longer = {**AXES, TORQUE: {"from": 0.2, "to": 1.2, "count": 31}}
    hunter = threading.Thread(target=hunt)
    hunter.start()
    try:
        actual = gr.study(model(), longer, OUTPUTS, workers=2, output=folder)
    finally:
        over.set()
        hunter.join()
    assert killed
    assert np.all(actual["outcome"] == DONE)
    part = actual.sel({TORQUE: whole[TORQUE].values}, method="nearest")
    np.testing.assert_array_equal(part["impacts per cycle"], whole["impacts per cycle"])


def _workers_of(parent: int) -> list[int]:
    actual = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            stat = (entry / "stat").read_text().rsplit(")", 1)[1].split()
            words = (entry / "cmdline").read_bytes()
        except OSError:
            continue
        if int(stat[1]) == parent and b"spawn_main" in words:
            actual.append(int(entry.name))
    return actual


@pytest.mark.long
def test_a_case_that_kills_its_worker_is_written_down_and_the_others_are_done(tmp_path: Path) -> None:
    actual = gr.study(
        model(), {TORQUE: [0.2, 0.4, 0.6, 0.8]}, ["verdict"], function=deadly, workers=2, output=tmp_path / "s"
    )
    outcome = [OUTCOMES[code] for code in actual["outcome"].values.tolist()]
    assert outcome == ["done", "done", "done", "worker lost"]


def test_an_estimate_costs_nothing() -> None:
    actual = prepare(model(), AXES, OUTPUTS)
    assert actual.plan.count == 12
    assert str(actual.estimate(2)).startswith("12 cases, about ")
    assert str(actual.estimate(2)).endswith("on 2 workers")


@pytest.mark.parametrize("path", sorted((Path(__file__).parents[2] / "examples" / "studies").glob("*.toml")))
def test_examples_can_be_computed(path: Path) -> None:
    asked = read_study(path)
    words = asked.prepare().estimate(1).words
    if asked.spec.kind == "grid":
        count = {"what_decides": 80, "one_at_a_time": 9, "gearbox_screening": 50, "cold_oil": 18}.get(path.stem, 64)
        assert words.startswith(f"{count} cases, about ")
    assert "on 1 worker" in words


def test_results_can_be_written_as_any_file(tmp_path: Path) -> None:
    """Encodings of the store would be taken for those of the file: old versions of xarray refuse zarr's strings."""
    data = gr.study(model(), {"torque.0.mean": [1.0, 2.0]}, ["regime"], workers=1)
    assert [name for name, variable in data.variables.items() if variable.encoding] == []
    data.to_netcdf(tmp_path / "study.nc", engine="h5netcdf")
    assert (
        xr.open_dataset(tmp_path / "study.nc", engine="h5netcdf")["part"].values.tolist()
        == data["part"].values.tolist()
    )
