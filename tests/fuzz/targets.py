"""What is attacked: every function that takes a file, with small sound files to begin with.

The law of a reader: it answers, or raises an error of ours. Nothing is simulated: numbers that make motions hard are
attacked elsewhere (``tests/laws``). What is saved and judged is in ``saved``, the workbench in ``workbench``.

Takes nothing; gives targets by name.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from unittest.mock import patch

import h5py
import numpy as np
from scipy.io import savemat

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.measured.identification.data_file import read_data
from gearrattle.measured.identification.measured_modes import State
from gearrattle.recording import Channel, Recording
from gearrattle.report.plots.chart import Band, Bars, Chart, Line, Panel, Rule
from gearrattle.report.plots.chart_files import packed_charts, read_charts
from gearrattle.report.result_charts import charts_of
from gearrattle.report.sound.transfer_path import sound_path
from gearrattle.studies.study_file import read_study
from tests.fuzz import saved, workbench
from tests.fuzz.target import NO_MOTION, ROOT, SMALL, Target, of_texts, small_run

MODELS = tuple(path for path in sorted((ROOT / "examples").glob("*.toml")) if path.stat().st_size < 3000)
STUDIES = tuple(sorted((ROOT / "examples" / "studies").glob("*.toml")))
DRIVEN = """schema = 1
excitation = { speed = 80.0 }
inertia = [ { name = "engine", J = 0.2 } ]
coupling = [ { name = "k", between = ["engine", "ground"], stiffness = 4.0 } ]
torque = [ { on = "engine", signal = { file = "t.csv", time = "t", value = "n" } } ]
"""
TORQUE = "t [s], n [N*m]\n0, 1\n0.1, 2\n0.2, 3\n0.3, 1\n"
MAPPING = """schema = 1
file = "record.csv"
time = "t"
start = "0.1 s"
end = "0.9 s"
rate = "80 Hz"
[[channel]]
name = "n"
quantity = "velocity"
of = "flywheel"
unit = "rpm"
gaps = "bridge"
detrend = "mean"
filter = { kind = "lowpass", cutoff = "10 Hz", order = 2 }
[[channel]]
name = "load"
source = "T"
quantity = "torque"
unit = "N*m"
scale = 2.0
offset = 1.0
[[channel]]
name = "speed"
source = "n"
quantity = "velocity"
measured = "pulses"
tacho = { pulses_per_turn = 60, threshold = 0.5, hysteresis = 0.1 }
"""
DATA = """schema = 1
[[mode]]
number = 1
frequency = "20 Hz"
relative_error = 0.01
shape = { engine = 1.0, wheel = -0.9 }
contact_ratio = { joint = 1.0 }
[[response]]
file = "hub.csv"
torque_on = "engine"
at = "wheel"
relative_error = 0.05
"""


RESPONSE = """frequency [Hz], real [rad/s^2/(N*m)], imag [rad/s^2/(N*m)], error [rad/s^2/(N*m)]
5, 0.1, 0.2, 0.01
10, 0.2, 0.1, 0.01
20, -0.1, 0.3, 0.01
"""


def recording() -> Recording:
    time = 0.25 + np.arange(40) / 1000.0
    channels = (
        Channel("n", "velocity", "flywheel", "rad/s", np.sin(time)),
        Channel("T", "torque", "hub", "N*m", np.cos(time)),
    )
    return Recording(time, channels, "rig")


def _written(suffix: str) -> Callable[[Path], list[bytes]]:
    def seeds(folder: Path) -> list[bytes]:
        gr.write(recording(), folder / f"seed{suffix}")
        return [(folder / f"seed{suffix}").read_bytes()]

    return seeds


def _mat(folder: Path) -> list[bytes]:
    values = {"t": np.arange(20.0), "n": np.ones(20), "s": {"a": np.arange(20), "b": "text"}}
    savemat(folder / "v5.mat", values, do_compression=True)
    savemat(folder / "v4.mat", {"t": np.arange(20.0), "n": np.ones(20)}, format="4")
    return [*_written(".mat")(folder), (folder / "v5.mat").read_bytes(), (folder / "v4.mat").read_bytes()]


def _hdf5(folder: Path) -> list[bytes]:
    with h5py.File(folder / "groups.h5", "w") as file:
        file["a/time"] = np.arange(20.0)
        file["a/x"] = np.arange(20, dtype="i2")
        file.create_dataset("a/y", data=np.arange(20.0), chunks=(5,), compression="gzip")
        file["a/again"] = h5py.SoftLink("/a")
        file["a/x"].attrs["units"] = "N*m"
    return [*_written(".h5")(folder), (folder / "groups.h5").read_bytes()]


def _csv(folder: Path) -> list[bytes]:
    texts = ("t [s], n [rpm]\n0, 1\n0.1, 2\n0.2, 3\n", "# note\nt;n\n[s];[1/min]\n0,0;1,5\n0,1;2,5\n0,2;3,5\n")
    return [*_written(".csv")(folder), *(text.encode() for text in texts)]


def _charts(_: Path) -> list[bytes]:
    x = np.linspace(0.0, 1.0, 30)
    lines, bars = (Line(x, x**2, "gear"),), (Bars(x, x[1:], "bars"),)
    panel = Panel("gear", "mm", lines=lines, bars=bars, bands=(Band(0.0, None, "#ff0000"),), rules=(Rule(0.5),))
    return [packed_charts([Chart("gear", "a chart", "caption", (panel,))])]


def _saved(folder: Path) -> list[bytes]:
    small_run().save(folder / "seed.nc")
    return [(folder / "seed.nc").read_bytes()]


def _densities(folder: Path) -> list[bytes]:
    spectrum = gr.spectra(recording(), "n", resolution="100 Hz")
    gr.save(spectrum, folder / "seed.nc")
    return [(folder / "seed.nc").read_bytes()]


def _study(folder: Path) -> None:
    gr.study(gr.loads(SMALL), {"torque.0.mean": [0.3, 0.6]}, output=folder / "kept", workers=1, scheduler="threads")


def _of(make: Callable[[Path], object], name: str) -> Callable[[Path], list[bytes]]:
    """Contents of one file of a folder that is made."""

    def seeds(folder: Path) -> list[bytes]:
        make(folder)
        return [(folder / "kept" / name).read_bytes()]

    return seeds


def read_model(path: Path) -> None:
    """Load a model, write and read it again, and make its equations."""
    model = gr.load(path)
    if not (model.torques or model.motions):
        assert gr.loads(model.to_toml()) == model
    assemble(model)


@contextmanager
def without_motion() -> Iterator[None]:
    """Have everything of a study prepared but its runs."""
    names = ("study.simulate", "outputs.simulate", "start_coordinates.prepare", "optimization._run_twice")
    with ExitStack() as stack:
        for name in names:
            stack.enter_context(patch(f"gearrattle.studies.{name}", side_effect=NO_MOTION))
        yield


def _models(folder: Path) -> None:
    for path in (*(ROOT / "examples").rglob("*.toml"), *(ROOT / "examples").rglob("*.csv")):
        target = folder / path.relative_to(ROOT / "examples")
        target.parent.mkdir(exist_ok=True)
        shutil.copy(path, target)


def _read(path: Path) -> object:
    return gr.read(path)


def _targets() -> Iterator[Target]:
    yield Target("model file", "m.toml", of_texts(*MODELS, SMALL), read_model, kind="text", around=_models)
    yield Target(
        "study file",
        "studies/s.toml",
        of_texts(*STUDIES),
        lambda path: read_study(path).prepare(),
        kind="text",
        around=_models,
        while_open=without_motion,
    )
    yield Target(
        "mapping file",
        "m.toml",
        of_texts(MAPPING),
        _read,
        kind="text",
        around=lambda folder: (folder / "record.csv").write_text(
            "t [s], n [rpm], T [N*m]\n" + "".join(f"{k / 100}, {k % 2}, {k}\n" for k in range(100))
        ),
    )
    yield Target(
        "data file",
        "d.toml",
        of_texts(DATA),
        lambda path: read_data(path, gr.loads(SMALL), State()),
        kind="text",
        around=lambda folder: (folder / "hub.csv").write_text(RESPONSE),
    )
    yield Target(
        "response, CSV",
        "hub.csv",
        of_texts(RESPONSE),
        lambda path: read_data(path.with_name("d.toml"), gr.loads(SMALL), State()),
        kind="text",
        around=lambda folder: (folder / "d.toml").write_text(DATA),
    )
    yield Target("CSV record", "r.csv", _csv, _read, kind="text")
    yield Target(
        "torque of a model, CSV",
        "t.csv",
        of_texts(TORQUE),
        lambda path: gr.load(path.with_name("m.toml")),
        kind="text",
        around=lambda folder: (folder / "m.toml").write_text(DRIVEN),
    )
    yield Target("loop, CSV", "l.csv", of_texts(ROOT / "examples" / "measured" / "damper_loop.csv"), _loop, kind="text")
    yield Target("UFF record", "r.uff", _written(".uff"), _read, kind="text")
    yield Target("WAV record", "r.wav", _written(".wav"), _read)
    yield Target("WAV impulse response", "i.wav", _written(".wav"), lambda path: sound_path(path, 48e3))
    yield Target("MAT record", "r.mat", _mat, _read)
    yield Target("HDF5 record", "r.h5", _hdf5, _read)
    if find_spec("asammdf") is not None:
        yield Target("MDF record", "r.mf4", _written(".mf4"), _read)
    yield Target("stored charts, npz", "charts.npz", _charts, read_charts)
    yield Target("saved run", "r.nc", _saved, gr.open_run)
    yield Target("saved run as record", "r.nc", _saved, _read)
    yield Target("saved spectra as figures", "r.nc", _densities, charts_of)
    for name in ("state.npz", "chunk-000001.nc"):
        yield Target(
            f"stream, {name}",
            f"kept/{name}",
            _of(saved.save_stream, name),
            lambda path: list(gr.open_stream(path.parent)),
            around=saved.save_stream,
        )
    for name in (
        "results.zarr/zarr.json",
        "results.zarr/outcome/zarr.json",
        "results.zarr/verdict/c/0",
        "study.json",
        "done/0000000.json",
    ):
        yield Target(
            f"study folder, {name}",
            f"kept/{name}",
            _of(_study, name),
            partial(_opened, depth=name.count("/")),
            kind="JSON" if name.endswith("json") else "bytes",
            around=_study,
        )


def _opened(path: Path, depth: int) -> object:
    return gr.open_study(path.parents[depth])


def _loop(path: Path) -> object:
    from gearrattle.measured.identification.loop_data import read_loop

    return read_loop(path)


TARGETS: dict[str, Target] = {target.name: target for target in (*_targets(), *saved.targets(), *workbench.targets())}
"""By name."""
