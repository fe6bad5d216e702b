"""Histories thinned: whatever the window, extremes stay, and every impact is drawn or counted in one that is."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gearrattle as gr
from gearrattle.trajectory import Array
from gearrattle.workbench import traces
from gearrattle.workbench.traces import BLOCK, Hits, InMemory, RunFile, Trace, packed, write_index


class Indexed(InMemory):
    """Samples in memory with the index that a long run has beside it."""

    def extremes(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        values = self.read(name, 0, self.count // BLOCK * BLOCK).reshape(-1, BLOCK)
        inside = np.sort(np.stack([values.argmin(axis=1), values.argmax(axis=1)], axis=1), axis=1)
        return inside + BLOCK * np.arange(len(values))[:, None], np.take_along_axis(values, inside, axis=1)


def spiky(seed: int, count: int) -> Array:
    """A random walk with single samples far off it."""
    rng = np.random.default_rng(seed)
    values = np.cumsum(rng.normal(size=count))
    values[rng.integers(0, count, 12)] += rng.normal(size=12) * 1e3
    return values


def source(values: Array, kind: type[InMemory] = InMemory) -> InMemory:
    return kind(np.arange(values.size) * 0.5, {"x": (Trace("x", "", "", ""), values)})


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    count=st.integers(3, 30_000),
    edges=st.tuples(st.floats(0, 1), st.floats(0, 1)).filter(lambda pair: abs(pair[0] - pair[1]) > 1e-3),
    points=st.integers(16, 3000),
    index=st.booleans(),
)
def test_every_extreme_of_a_window_stays(
    seed: int, count: int, edges: tuple[float, float], points: int, index: bool
) -> None:
    values = spiky(seed, count)
    made = source(values, Indexed if index else InMemory)
    begin, end = sorted(edge * 0.5 * (count - 1) for edge in edges)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(traces, "LONG", 500)
        time, thinned = made.trace("x", begin, end, points)
    inside = values[(made._time >= begin) & (made._time <= end)]
    assert time.size == thinned.size <= points
    assert np.all(np.diff(time) > 0)
    assert np.array_equal(values[np.rint(time / 0.5).astype(int)], thinned)
    if inside.size:
        assert thinned.min() <= inside.min()
        assert thinned.max() >= inside.max()


@pytest.mark.parametrize("seed", range(5))
def test_every_bucket_keeps_its_extremes(seed: int) -> None:
    """Of windows that divide the whole, each has the extremes of its samples among what the whole keeps."""
    values, points = spiky(seed, 64 * BLOCK * 8), 4 * 32 + 2
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(traces, "LONG", 500)
        time, thinned = source(values, Indexed).trace("x", 0.0, 0.5 * values.size, points)
    position = np.rint(time / 0.5).astype(int)
    for part in range(8):
        low, high = part * values.size // 8, (part + 1) * values.size // 8
        kept = thinned[(position >= low) & (position < high)]
        assert kept.min() == values[low:high].min()
        assert kept.max() == values[low:high].max()


@cache
def run() -> gr.Run:
    return gr.simulate(gr.example("case3"), cycles=40, discard=10, samples_per_cycle=128)


def test_a_saved_run_reads_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    motion = run()
    motion.save(tmp_path / "run.nc")
    monkeypatch.setattr(traces, "LONG", 1000)
    index = tmp_path / "traces"
    index.mkdir()
    write_index(RunFile(tmp_path / "run.nc"), index)
    saved, memory = RunFile(tmp_path / "run.nc", index), InMemory.of_run(motion)
    assert [trace.name for trace in saved.channels()] == [trace.name for trace in memory.channels()]
    end = motion.trajectory.time[-1]
    for trace in saved.channels():
        assert np.array_equal(saved.read(trace.name, 5, 900), memory.read(trace.name, 5, 900))
        values = memory.read(trace.name, 0, memory.count)
        _, thinned = saved.trace(trace.name, 0.0, end, 400)
        assert (thinned.min(), thinned.max()) == (values.min(), values.max())
    with pytest.raises(gr.ModelError, match="is no channel"):
        saved.read("angle.nobody", 0, 1)


@settings(max_examples=40, deadline=None)
@given(shares=st.tuples(st.floats(0, 1), st.floats(0, 1)), most=st.integers(16, 400))
def test_every_impact_is_drawn_or_counted_in_one_that_is(shares: tuple[float, float], most: int) -> None:
    """Beside pandas: run.events, crossings outward."""
    motion = run()
    hits = Hits.of_run(motion)
    begin, end = sorted(share * motion.trajectory.end for share in shares)
    marks = hits.within(begin, end, most)
    events = motion.events
    entered = events[events.to_region.abs() > events.from_region.abs()]
    inside = entered[(entered.time >= begin) & (entered.time <= end)]
    assert marks.count.sum() == len(inside)
    assert np.all(np.diff(marks.time) >= 0)
    assert np.isin(marks.time, inside.time).all()
    for k, clearance in enumerate(hits.clearances):
        own = inside[inside.clearance == clearance["name"]]
        drawn = marks.clearance == k
        assert drawn.sum() <= most
        assert marks.count[drawn].sum() == len(own)
        if len(own):
            assert np.abs(marks.velocity[drawn]).max() == own.velocity.abs().max()


def test_arrays_are_packed_as_the_page_reads_them() -> None:
    content = np.frombuffer(packed([(np.array([1.0, 2.0]), np.array([3.0, 4.0])), (np.zeros(0), np.zeros(0))]), "<f8")
    assert content.tolist() == [2, 2, 0, 1, 2, 3, 4]
