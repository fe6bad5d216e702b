"""A long motion in chunks is one long motion, bit by bit; interrupted, it goes on; its memory is that of a chunk."""

from __future__ import annotations

import tracemalloc
from dataclasses import fields
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.trajectory import EventLog
from tests.architecture.places import EXAMPLES

SAMPLED = ("time", "angle", "velocity", "acceleration", "deflection", "force", "region", "element_torque")
FILES = (
    "paper/case1_loaded.toml",
    "paper/case2.toml",
    "paper/case3.toml",
    "manual_transmission.toml",
    "driveline_lash.toml",
    "clutch_friction.toml",
)
LONG = {"cycles": 12, "samples_per_cycle": 12, "discard": 4}


@pytest.fixture(scope="module", params=FILES)
def whole(request: pytest.FixtureRequest) -> tuple[gr.Model, gr.Run]:
    model = gr.load(EXAMPLES / request.param)
    return model, gr.simulate(model, **LONG, audit=False)


@pytest.fixture(scope="module")
def rattle() -> gr.Model:
    return gr.load(EXAMPLES / "paper" / "case3.toml")


def joined(runs: list[gr.Run]) -> dict[str, np.ndarray]:
    """Return samples (each border once) and crossings of all chunks behind each other."""
    chunks = [run.trajectory for run in runs]
    sampled = {
        name: np.concatenate([getattr(t, name)[0 if i == 0 else 1 :] for i, t in enumerate(chunks)]) for name in SAMPLED
    }
    logs = {f.name: np.concatenate([getattr(t.events, f.name) for t in chunks]) for f in fields(EventLog)}
    return sampled | {f"events.{name}": column for name, column in logs.items()}


def same_bits(runs: list[gr.Run], whole: gr.Run) -> None:
    have, want = joined(runs), joined([whole])
    assert [name for name in want if have[name].tobytes() != want[name].tobytes()] == []


@pytest.mark.parametrize("chunk", [1, 7, pytest.param(11, marks=pytest.mark.long)])
def test_chunks_are_the_whole_to_the_last_bit(whole: tuple[gr.Model, gr.Run], chunk: int) -> None:
    model, run = whole
    chunks = list(gr.stream(model, **LONG, chunk=chunk))
    assert len(chunks) == -(-12 // chunk)
    same_bits(chunks, run)
    for one, after in pairwise(chunks):
        last, first = one.trajectory, after.trajectory
        assert last.time[-1] == first.time[0] == pytest.approx(first.first_cycle * first.layout.period, rel=1e-15)
        assert [n for n in SAMPLED if not np.array_equal(getattr(last, n)[-1], getattr(first, n)[0])] == []
        assert (first.initial_region == first.region[0]).all()
        assert len(first.events) == 0 or first.time[0] <= first.events.time[0]
    last = chunks[-1].trajectory
    assert last.final_force_integral.tobytes() == run.trajectory.final_force_integral.tobytes()
    for count in ("steps", "function_calls", "events"):
        assert sum(getattr(chunk.cost, count) for chunk in chunks) == getattr(run.cost, count)


def test_sampling_changes_neither_crossings_nor_states(rattle: gr.Model) -> None:
    coarse = list(gr.stream(rattle, cycles=20, samples_per_cycle=1, chunk=6))
    fine = list(gr.stream(rattle, cycles=20, samples_per_cycle=48, chunk=20))
    a, b = joined(coarse), joined(fine)
    assert a["events.time"].tobytes() == b["events.time"].tobytes()
    assert np.abs(a["deflection"] - b["deflection"][::48]).max() <= 1e-13


def test_every_chunk_balances_its_energy(rattle: gr.Model) -> None:
    residuals = [r.cost.energy_residual for r in gr.stream(rattle, cycles=9, samples_per_cycle=8, chunk=4, audit=True)]
    assert len(residuals) == 3
    assert max(residuals) < 1e-11
    assert all(r.cost.energy_residual is None for r in gr.stream(rattle, cycles=2, samples_per_cycle=8, chunk=1))


def test_discarded_cycles_are_spread_over_chunks(rattle: gr.Model) -> None:
    chunks = gr.stream(rattle, cycles=10, discard=6, samples_per_cycle=8, chunk=4)
    with pytest.raises(gr.ModelError, match="nothing is left to judge"):
        chunks.verdict()
    assert [run.trajectory.discard for run in chunks] == [4, 2, 0]
    window = chunks.verdict().window
    whole = gr.criteria(gr.simulate(rattle, cycles=10, discard=6, samples_per_cycle=8, audit=False))
    assert window == whole.window


@pytest.mark.parametrize("chunk", [7, *(pytest.param(chunk, marks=pytest.mark.long) for chunk in (3, 11))])
def test_the_verdict_on_chunks_is_that_on_the_whole(whole: tuple[gr.Model, gr.Run], chunk: int) -> None:
    model, run = whole
    chunks = gr.stream(model, **LONG, chunk=chunk)
    kept = list(chunks)
    have, want = chunks.verdict(), gr.criteria(run)
    assert (have.verdict, have.sentence, have.window) == (want.verdict, want.sentence, want.window)
    assert gr.criteria(kept).to_dict() == have.to_dict()
    for a, b in zip(have.parts, want.parts, strict=True):
        for field in fields(type(b)):
            x, y = getattr(a, field.name), getattr(b, field.name)
            assert x == (pytest.approx(y, rel=1e-9) if isinstance(y, float) else y), field.name
    assert np.allclose(have.spectra.density, want.spectra.density, rtol=1e-9, atol=0)


def test_chunks_out_of_order_are_not_judged(rattle: gr.Model) -> None:
    first, second, third = gr.stream(rattle, cycles=6, samples_per_cycle=8, chunk=2, discard=0)
    with pytest.raises(gr.ModelError, match=r"begins at cycle 4; must follow .* ends at cycle 2"):
        gr.criteria([first, third, second])


def test_what_progress_raises_ends_the_call_and_the_motion_goes_on(
    rattle: gr.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    reports: list[float] = []

    def twice_only(fraction: float) -> None:
        reports.append(fraction)
        if len(reports) in (3, 4):
            raise gr.Cancelled("enough")

    # progress is reported as often as of a long run
    monkeypatch.setattr("gearrattle.engine.solvers.exact._BUDGET", 200)
    chunks = gr.stream(rattle, cycles=60, samples_per_cycle=2, chunk=20, progress=twice_only)
    runs, stopped = [], 0
    while True:
        try:
            runs.append(next(chunks))
        except gr.Cancelled:
            stopped += 1
        except StopIteration:
            break
    assert stopped == 2
    assert reports == sorted(reports)
    assert 1 / 3 < reports[-1] < 1
    same_bits(runs, gr.simulate(rattle, cycles=60, samples_per_cycle=2, audit=False))


def test_memory_is_that_of_a_chunk(rattle: gr.Model) -> None:
    def peak(cycles: int) -> int:
        tracemalloc.start()
        for _ in gr.stream(rattle, cycles=cycles, samples_per_cycle=16, chunk=10):
            pass
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    peak(10)
    assert peak(60) < 1.3 * peak(20)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        ({"algorithm": "rk4"}, "rk4; cannot go on where it ended with this driveline, so it has no chunks"),
        ({"chunk": 0}, "must be a whole number from 1"),
        ({"chunk": 2.5}, "must be a whole number from 1"),
        ({"resume": True}, "store"),
        ({"cycles": 0}, "cycles"),
    ],
)
def test_bad_calls_are_refused(rattle: gr.Model, call: dict[str, object], words: str) -> None:
    with pytest.raises(gr.ModelError, match=words):
        gr.stream(rattle, **call)  # type: ignore[arg-type]


def test_a_chunk_tells_its_predictability_on_the_clock_of_the_whole(rattle: gr.Model) -> None:
    *_, last = gr.stream(rattle, cycles=120, samples_per_cycle=2, chunk=60, discard=0)
    assert last.trajectory.time[0] < last.predictability_horizon < last.trajectory.end
    assert last.lyapunov_exponents[0] > 0


def test_a_chunk_survives_its_file(rattle: gr.Model, tmp_path: Path) -> None:
    *_, last = gr.stream(rattle, cycles=6, samples_per_cycle=8, chunk=4, discard=1)
    last.save(tmp_path / "last.nc")
    again = gr.open_run(tmp_path / "last.nc")
    assert again.trajectory.first_cycle == 4
    assert again.data.identical(last.data)
    assert gr.criteria(again).to_dict() == gr.criteria(last).to_dict()
