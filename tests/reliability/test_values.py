"""Values of results are compared bit for bit: one number, a sign of zero or a text more is noticed."""

from __future__ import annotations

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

import gearrattle as gr
from tests.reliability.values import (
    bits,
    compare,
    look_at_file,
    look_at_report,
    look_at_stream,
    look_at_study,
    values_of_file,
    values_of_run,
)
from tests.studies.drivelines import model

pytestmark = pytest.mark.compiled


def test_one_bit_a_sign_of_zero_and_a_text_are_noticed() -> None:
    assert bits(np.array([0.0, np.nan])) == bits(np.array([0.0, np.nan]))
    for other in ([-0.0, np.nan], [5e-324, np.nan], [0.0, 0.0], [0.0]):
        assert bits(np.array([0.0, np.nan])) != bits(np.array(other))
    assert bits(np.array(["a", None], dtype=object)) != bits(np.array(["b", None], dtype=object))
    with pytest.raises(AssertionError, match="other values: b"):
        compare({"a": 1, "b": 2}, {"a": 1})


def test_a_saved_motion_of_another_last_number_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "x.nc"
    run = gr.simulate(model(), cycles=6, samples_per_cycle=8)
    run.save(path)
    looked = look_at_file([values_of_file(path)])
    run.save(path)
    assert looked(path) == 1.0
    with h5py.File(path, "r+") as file:
        file["velocity"][-1, -1] = np.nextafter(file["velocity"][-1, -1], np.inf)
    with pytest.raises(AssertionError, match="other values: velocity"):
        looked(path)
    assert looked(tmp_path / "missing.nc") == 0.0


def test_a_report_without_a_file_or_of_other_values_is_noticed(tmp_path: Path) -> None:
    gr.run(model().with_({"simulation.cycles": 6})).save(tmp_path / "out")
    files = {path.relative_to(tmp_path / "out").as_posix() for path in (tmp_path / "out").rglob("*") if path.is_file()}
    values = values_of_file(tmp_path / "out" / "results.nc")
    assert look_at_report({"two bodies": (files, values)})(tmp_path / "out") == 1.0
    with pytest.raises(AssertionError, match="other values: angle"):
        look_at_report({"two bodies": (files, {**values, "angle": ()})})(tmp_path / "out")
    (tmp_path / "out" / "figures").rename(tmp_path / "elsewhere")
    with pytest.raises(AssertionError, match="missing"):
        look_at_report({"two bodies": (files, values)})(tmp_path / "out")


def test_a_stream_of_another_motion_is_noticed(tmp_path: Path) -> None:
    chunks = list(gr.stream(model(), store=tmp_path / "s", cycles=12, chunk=4, discard=2, samples_per_cycle=8))
    looked = look_at_stream([values_of_run(run) for run in gr.open_stream(tmp_path / "s")])
    assert looked(tmp_path / "s") == 1.0
    shutil.rmtree(tmp_path / "s")
    other = model().with_({"torque.0.mean": 0.41})
    list(gr.stream(other, store=tmp_path / "s", cycles=12, chunk=4, discard=2, samples_per_cycle=8))
    assert len(chunks) == 3
    with pytest.raises(AssertionError, match="other values"):
        looked(tmp_path / "s")


def test_a_study_of_another_value_in_a_case_that_is_done_is_noticed(tmp_path: Path) -> None:
    axes = {"torque.0.mean": [0.3, 0.6]}
    data = gr.study(model(), axes, ["TR rms"], output=tmp_path / "s", workers=1, scheduler="threads")
    assert look_at_study(gr.open_study(tmp_path / "s").load())(tmp_path / "s") == 1.0
    name = next(name for name in data.data_vars if data[name].dtype.kind == "f")
    other = gr.open_study(tmp_path / "s").load().copy(deep=True)
    other[name].values.flat[0] = np.nextafter(other[name].values.flat[0], np.inf)
    with pytest.raises(AssertionError, match="other values"):
        look_at_study(other)(tmp_path / "s")
    (tmp_path / "s" / "report.html").write_text("page")
    other = gr.open_study(tmp_path / "s").load().assign_coords({"torque.0.mean": [0.3, 0.7]})
    with pytest.raises(AssertionError, match=r"other values: torque\.0\.mean"):
        look_at_study(other)(tmp_path / "s")
