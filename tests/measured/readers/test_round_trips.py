"""What is written is read back: to the last bit, names, units, quantities and subjects included."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.measured.readers import READERS, WRITERS, format_of
from gearrattle.recording import Channel, Recording
from tests.measured.readers.rig import rig

SUFFIXES = {
    "csv": ".csv",
    "mat": ".mat",
    "hdf5": ".h5",
    "netcdf3": ".nc3",
    "mdf4": ".mf4",
    "tdms": ".tdms",
    "uff": ".uff",
    "wav": ".wav",
    "xlsx": ".xlsx",
}


def test_the_table_is_complete() -> None:
    assert set(SUFFIXES) == set(WRITERS) == set(READERS) - {"run", "lvm"}
    assert [name for name, reader in READERS.items() if name != reader.NAME] == []


@pytest.mark.parametrize("name", SUFFIXES)
def test_values_come_back_to_the_last_bit(name: str, tmp_path: Path) -> None:
    before = rig()
    path = tmp_path / f"record{SUFFIXES[name]}"
    gr.write(before, path)
    assert format_of(path) == name
    after = gr.read(path)
    for one, other in zip(before.channels, after.channels, strict=True):
        # openpyxl writes 16 digits
        np.testing.assert_allclose(one.values, other.values, rtol=1e-15 if name == "xlsx" else 0.0, atol=0.0)
    first = 0.0 if name == "wav" else 0.25
    np.testing.assert_allclose(after.time, before.time - 0.25 + first, rtol=0, atol=2e-16)
    if name != "wav":
        reported = [(c.name, c.quantity, c.subject, c.unit) for c in before.channels]
        assert [(c.name, c.quantity, c.subject, c.unit) for c in after.channels] == reported
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("name", SUFFIXES)
def test_the_content_tells_the_format_not_the_ending(name: str, tmp_path: Path) -> None:
    path = tmp_path / "record.xyz"
    gr.write(rig(), path, format=name)
    assert gr.read(path).channels[1].values[5] == pytest.approx(rig().channels[1].values[5], rel=1e-15)


@pytest.mark.parametrize("name", ["csv", "mat", "hdf5", "netcdf3", "mdf4", "tdms", "xlsx"])
def test_times_need_not_be_uniform(name: str, tmp_path: Path) -> None:
    time = np.cumsum(np.random.default_rng(1).uniform(1e-4, 1e-2, 50))
    before = Recording(time, (Channel("n", "speed", "", "rad/s", np.sqrt(time)),), "can")
    path = tmp_path / f"record{SUFFIXES[name]}"
    gr.write(before, path)
    np.testing.assert_allclose(gr.read(path).time, time, rtol=1e-15 if name == "xlsx" else 0.0, atol=0.0)


@pytest.mark.parametrize("name", ["uff", "wav"])
def test_formats_of_uniform_samples_refuse_others(name: str, tmp_path: Path) -> None:
    """And leave nothing behind; a file that was there stays."""
    path = tmp_path / f"record{SUFFIXES[name]}"
    path.write_text("precious")
    uneven = Recording(np.array([0.0, 1.0, 3.0]), (Channel("n", "speed", "", "rad/s", np.ones(3)),), "x")
    with pytest.raises(ModelError, match=rf"record{SUFFIXES[name]}: found samples that are not uniform.*rate = "):
        gr.write(uneven, path)
    assert path.read_text() == "precious"
    assert len(list(tmp_path.iterdir())) == 1


def test_what_a_format_cannot_name_is_refused(tmp_path: Path) -> None:
    def named(*names: str) -> Recording:
        return Recording(np.arange(4.0), tuple(Channel(n, "speed", "", "rad/s", np.ones(4)) for n in names), "x")

    with pytest.raises(ModelError, match=r"a,b.*commas"):
        gr.write(named("a,b"), tmp_path / "x.csv")
    with pytest.raises(ModelError, match=r"a_b.*taken"):
        gr.write(named("a-b", "a_b"), tmp_path / "x.mat")
    with pytest.raises(ModelError, match="dataset"):
        gr.write(named("time"), tmp_path / "x.h5")
    with pytest.raises(ModelError, match=r"\.xyz.*ending tells the format"):
        gr.write(named("n"), tmp_path / "x.xyz")
    with pytest.raises(ModelError, match=r'wave.*one of.*did you mean "wav"'):
        gr.write(named("n"), tmp_path / "x.wav", format="wave")
    with pytest.raises(ModelError, match="needs a channel"):
        gr.write(named(), tmp_path / "x.csv")
    assert list(tmp_path.iterdir()) == []


def test_a_recording_as_a_dataset_and_back_through_netcdf(tmp_path: Path) -> None:
    """Labelled by xarray, written by its own netCDF, read as HDF5 by its dimension scale."""
    before = rig()
    before.to_dataset().to_netcdf(tmp_path / "x.nc", engine="h5netcdf")
    after = gr.read(tmp_path / "x.nc")
    np.testing.assert_array_equal(after.time, before.time)
    assert [(c.name, c.quantity, c.subject, c.unit) for c in after.channels] == [
        (c.name, c.quantity, c.subject, c.unit) for c in before.channels
    ]
    np.testing.assert_array_equal(after["T-shaft"].values, before["T-shaft"].values)


def test_a_saved_run_is_a_recording_of_it(tmp_path: Path) -> None:
    """Angles of bodies, forces along the line of action in N, torques of couplings in N m."""
    model = gr.load(Path(__file__).parents[3] / "examples" / "paper" / "case3.toml")
    run = gr.simulate(model, cycles=2, discard=0, samples_per_cycle=64)
    run.save(tmp_path / "run.nc")
    actual = gr.read(tmp_path / "run.nc")
    np.testing.assert_array_equal(actual.time, run.data.time.values)
    hub = actual.find("velocity", "hub")
    assert hub is not None
    np.testing.assert_array_equal(hub.values, run.data.velocity.sel(inertia="hub").values)
    for name in run.data.clearance.values:
        mesh = name in {m.name for m in model.meshes}
        force = actual[f"force.{name}"]
        assert (force.unit, actual[f"deflection.{name}"].unit) == (("N", "m") if mesh else ("N*m", "rad"))
        np.testing.assert_array_equal(force.values, run.data.force.sel(clearance=name).values)
    assert any("simulated" in note for note in actual.notes)
    with pytest.raises(ModelError, match="ending tells the format"):
        gr.write(actual, tmp_path / "again.nc")
