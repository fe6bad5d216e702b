"""Metrics of a motion in chunks are those of the whole to rounding, where they add up; the others say why not."""

from __future__ import annotations

import json
import math
import re
import tracemalloc
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.quantities.metric_inputs import WHOLE
from gearrattle.quantities.quantity_table import METRICS
from gearrattle.signals.chunk_moments import Moments
from tests.architecture.places import EXAMPLES

FILES = (
    "paper/case1_loaded.toml",
    "paper/case3.toml",
    "manual_transmission.toml",
    "driveline_lash.toml",
    "clutch_friction.toml",
    "measured_flywheel.toml",
)
LONG = {"cycles": 12, "samples_per_cycle": 96, "discard": 5}
OF_THE_WHOLE = {
    "force exceeded 5 % of the time",
    "rms acceleration above the engine orders",
    "peak acceleration above the engine orders",
}


def model_of(file: str) -> gr.Model:
    return gr.load(EXAMPLES / file)


def compared(whole: pd.DataFrame, chunks: pd.DataFrame, tolerance: float) -> None:
    """Row by row; a value that is nothing but rounding beside others of its quantity counts as that."""
    assert chunks[["metric", "subject", "quantity", "unit"]].equals(whole[["metric", "subject", "quantity", "unit"]])
    largest = whole.value.abs().groupby(whole.quantity).transform("max")
    for (_, one), (_, other), scale in zip(whole.iterrows(), chunks.iterrows(), largest, strict=True):
        if one.quantity in OF_THE_WHOLE:
            assert math.isnan(other.value)
            assert other.note in (WHOLE, one.note)
            continue
        notes = [
            re.sub(r"about [\d.e+-]+ %", "about", row.note) for row in (one, other)
        ]  # an estimate of each chunk's own
        assert notes[0] == notes[1], one.quantity
        reported = f"{one.subject}: {one.quantity}"
        assert other.value == pytest.approx(one.value, rel=tolerance, abs=1e-9 * scale, nan_ok=True), reported


@pytest.mark.parametrize("chunk", [1, 7, pytest.param(11, marks=pytest.mark.long)])
@pytest.mark.parametrize("file", FILES)
def test_chunks_say_what_the_whole_says(file: str, chunk: int) -> None:
    """All but the three quantities that are of the whole, whatever the chunks, the discarded cycles across them."""
    model, how = model_of(file), LONG | ({"cycles": 10} if model_of(file).motions else {})  # a record has its end
    whole = gr.metrics(gr.simulate(model, **how, audit=False))
    chunks = gr.metrics(gr.stream(model, **how, chunk=chunk))
    compared(whole, chunks, 1e-9)


def test_there_are_impacts_across_chunks() -> None:
    """The comparison above is of something: contacts that begin in one chunk and end in another."""
    runs = list(gr.stream(model_of("paper/case3.toml"), **LONG, chunk=1, initial="static"))
    open_at_the_end = 0
    for run in runs[:-1]:
        from gearrattle.signals import find_impacts

        open_at_the_end += int(find_impacts(run.trajectory).censored.sum())
    assert open_at_the_end > 3


def test_the_audit_adds_up() -> None:
    model = model_of("paper/case3.toml")
    how = {"cycles": 8, "samples_per_cycle": 64, "discard": 2}
    whole = gr.metrics(gr.simulate(model, **how, audit=True), names=["contact_work"])
    chunks = gr.metrics(gr.stream(model, **how, chunk=3, audit=True), names=["contact_work"])
    compared(whole, chunks, 1e-6)  # of the quadrature, whose steps end with each chunk
    assert np.isfinite(chunks.value).all()
    bare = gr.metrics(gr.stream(model, **how, chunk=3), names=["contact_work"])
    assert bare.value.isna().all()
    assert "audit" in bare.note[0]


def test_moments_of_pieces_are_those_of_the_whole() -> None:
    """Far from zero, where sums of powers would cancel."""
    rng = np.random.default_rng(3)
    values = 1e6 + np.cumsum(rng.standard_normal((1001, 2)), axis=0) * [1.0, 1e-3]
    merged = None
    for begin, end in ((0, 10), (10, 11), (11, 700), (700, 1000)):
        piece = Moments.of(values[begin : end + 1])
        merged = piece if merged is None else merged.plus(piece)
    assert merged is not None
    weights = np.ones(1001)
    weights[[0, -1]] = 0.5
    for column in (0, 1):
        reported = merged.summary(column)
        exact = values[:, column].astype(np.longdouble)
        mean = np.sum(weights * exact) / 1000
        assert reported.mean == pytest.approx(float(mean), rel=1e-14)
        for power, actual in ((2, reported.second), (4, reported.fourth)):
            assert actual == pytest.approx(float(np.sum(weights * (exact - mean) ** power) / 1000), rel=1e-6)
        assert (reported.low, reported.high) == (values[:, column].min(), values[:, column].max())


def test_no_chunk_is_kept() -> None:
    """Four times the chunks, the same memory."""
    model = model_of("paper/case1_loaded.toml")
    used = []
    for cycles in (20, 80):
        tracemalloc.start()
        gr.metrics(gr.stream(model, cycles=cycles, discard=5, samples_per_cycle=64, chunk=5))
        used.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert used[1] < 1.3 * used[0]


def test_every_metric_says_how_it_merges() -> None:
    for metric in METRICS:
        assert metric.merging.startswith("exact")
        assert ("whole" in metric.merging) == (metric.name in ("force_statistics", "loose_gear_motion"))


def test_chunks_that_do_not_follow_are_refused() -> None:
    runs = list(gr.stream(model_of("paper/case1_loaded.toml"), cycles=6, discard=1, samples_per_cycle=32, chunk=2))
    with pytest.raises(gr.ModelError, match="must follow the chunk before"):
        gr.metrics([runs[0], runs[2]])
    with pytest.raises(gr.ModelError, match="at least one cycle must remain"):
        gr.metrics([])
    with pytest.raises(gr.ModelError, match="brings its own model"):
        gr.metrics(runs, model_of("paper/case1_loaded.toml"))


def test_the_folder_of_a_stream_is_measured(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = model_of("paper/case3.toml")
    for _ in gr.stream(model, cycles=9, discard=3, samples_per_cycle=64, chunk=2, store=tmp_path / "long"):
        pass
    assert (
        main(["metrics", str(tmp_path / "long"), "--json", "--name", "impact_intensity", "--name", "separation"]) == 0
    )
    rows = json.loads(capsys.readouterr().out)["metrics"]
    names = ["impact_intensity", "separation"]
    whole = gr.metrics(gr.simulate(model, cycles=9, discard=3, samples_per_cycle=64, audit=False), names=names)
    assert [row["value"] for row in rows] == pytest.approx(whole.value.tolist(), rel=1e-9, nan_ok=True)
    assert "in chunks" in rows[0]["window"]
