"""Tables of a run for pandas, and the text of its model that can be read again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import gearrattle as gr

MODEL = """
schema = 1
inertia = [ { name = "drive", J = 1.0 }, { name = "gear", J = 0.5, drag = 0.1 } ]
coupling = [ { name = "shaft", between = ["drive", "gear"], stiffness = 100.0, clearance = 0.01 },
             { name = "spring", between = ["drive", "ground"], stiffness = 50.0 } ]
excitation = { frequency = 1.0 }
torque = [ { on = "drive", signal = { file = "torque.csv", time = "t", value = "T", interpolation = "linear" } } ]
simulation = { initial = "zero", cycles = 2, discard = 0, samples_per_cycle = 16 }
"""


@pytest.fixture
def run(tmp_path: Path) -> gr.Run:
    (tmp_path / "torque.csv").write_text("t [s], T [N*m]\n0, 0\n0.5, 9\n0.5, -3\n4, 0\n", encoding="utf-8")
    (tmp_path / "model.toml").write_text(MODEL, encoding="utf-8")
    model = gr.load(tmp_path / "model.toml")
    (tmp_path / "torque.csv").unlink()
    return gr.simulate(model)


def test_tables_have_a_row_a_sample_or_a_crossing(run: gr.Run) -> None:
    bodies, elements, events = (run.to_dataframe(kind) for kind in ("bodies", "elements", "events"))
    names = [f"{quantity}.{body}" for quantity in ("angle", "velocity", "acceleration") for body in ("drive", "gear")]
    assert list(bodies.columns) == names
    torques = ["element_torque.shaft", "element_torque.spring"]
    assert list(elements.columns) == ["deflection.shaft", "force.shaft", "region.shaft", *torques]
    for table in (bodies, elements):
        assert table.index.name == "time"
        assert np.array_equal(table.index, run.data.time)
    assert np.array_equal(bodies["velocity.gear"], run.data.velocity.sel(inertia="gear"))
    assert np.array_equal(elements["element_torque.spring"], run.data.element_torque.sel(element="spring"))
    assert elements["region.shaft"].dtype.kind == "i"
    assert len(events) > 3
    pd.testing.assert_frame_equal(events, run.events)
    pd.testing.assert_frame_equal(run.to_dataframe(), bodies)


def test_tables_may_be_changed(run: gr.Run) -> None:
    for kind in ("bodies", "elements", "events"):
        table = run.to_dataframe(kind)
        table.iloc[:, -1] = 7
        assert not np.any(run.to_dataframe(kind).iloc[:, -1] == 7)


def test_columns_are_those_of_the_csv_file(run: gr.Run, tmp_path: Path) -> None:
    table = pd.read_csv(run.save(tmp_path / "run.csv"), index_col="time")
    bodies, elements = run.to_dataframe("bodies"), run.to_dataframe("elements")
    pd.testing.assert_frame_equal(table, bodies.join(elements[["deflection.shaft", "force.shaft"]]))


def test_along_a_sweep_the_speed_is_a_column(run: gr.Run) -> None:
    swept = gr.simulate(run.model.with_({"excitation.sweep": {"from": 6.0, "to": 9.0, "over": 1.0}}))
    assert next(iter(swept.to_dataframe().columns)) == "speed"
    assert "speed" not in swept.to_dataframe("elements")


def test_another_kind_is_refused(run: gr.Run) -> None:
    with pytest.raises(gr.ModelError, match=r'"bodies" or "elements" or "events" \(did you mean "events"'):
        run.to_dataframe("event")


def test_the_text_of_the_model_can_be_read_again(run: gr.Run, tmp_path: Path) -> None:
    """Without the file of its record, which is gone; from the run, from its file, and from a part of its data."""
    assert gr.loads(run.data.attrs["model"]) == run.model
    path = run.save(tmp_path / "run.nc")
    with xr.open_dataset(path) as opened:
        assert gr.loads(opened.attrs["model"]) == run.model
    assert gr.open_run(path).model == run.model
    run.data[["angle"]].to_netcdf(tmp_path / "part.nc")
    with xr.open_dataset(tmp_path / "part.nc") as opened:
        assert gr.loads(opened.attrs["model"]) == run.model


def test_points_too_many_for_a_text_stay_in_the_file(tmp_path: Path) -> None:
    time = np.linspace(0.0, 2.0, 60_001)
    signal = {"time": time.tolist(), "value": np.sin(time).tolist()}
    model = gr.Model.from_tables(
        {
            "schema": 1,
            "inertia": [{"name": "body", "J": 1.0}],
            "excitation": {"frequency": 1.0},
            "torque": [{"on": "body", "signal": signal}],
            "simulation": {"initial": "zero", "cycles": 1, "discard": 0, "samples_per_cycle": 8},
        }
    )
    run = gr.simulate(model)
    text = run.data.attrs["model"]
    assert len(text) < 1000
    with pytest.raises(gr.ModelError, match="beside this text") as caught:
        gr.loads(text)
    assert "gr.open_run" in str(caught.value)
    assert gr.open_run(run.save(tmp_path / "run.nc")).model == run.model


def test_a_saved_run_is_no_model_file(run: gr.Run, tmp_path: Path) -> None:
    path = str(run.save(tmp_path / "run.nc"))
    with pytest.raises(gr.ModelError, match="netCDF or HDF5 file") as caught:
        gr.load(path)
    assert f"gr.open_run({path!r}).model" in str(caught.value)
