"""Files that are pipes, devices, links to elsewhere, or gigabytes in a few kilobytes are refused, quickly and small."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.errors import ModelError

CASE = Path(__file__).parents[1] / "examples" / "paper" / "case3.toml"
MODEL = """schema = 1
excitation.speed = 1.0
[[inertia]]
name = "a"
J = 1.0
[[coupling]]
name = "k"
between = ["a", "ground"]
stiffness = 4.0
[[torque]]
on = "a"
signal = {{ file = "{file}", time = "t", value = "T" }}
"""
RECORD = "t [s], T [N*m]\n0, 1\n1, 2\n2, 3\n3, 4\n"
SECRET = "correct horse battery staple"


@pytest.mark.parametrize("suffix", [".toml", ".csv", ".mat", ".h5", ".mf4", ".uff", ".wav", ".nc", ".npz"])
@pytest.mark.parametrize("kind", ["pipe", "device"])
@pytest.mark.parametrize("call", [gr.load, gr.read, gr.measured.look, gr.open_run])
def test_what_is_no_regular_file_is_refused_at_once(
    call: Callable[[Path], object], kind: str, suffix: str, tmp_path: Path
) -> None:
    path = tmp_path / f"record{suffix}"
    if kind == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to("/dev/zero")
    with pytest.raises(ModelError, match=f"is a {kind}; a regular file is needed"):
        call(path)


@pytest.mark.parametrize(
    "words",
    [
        *(f"{command} loop.toml" for command in ("check", "run", "metrics", "look", "study")),
        *(f"{command} {{file}}" for command in ("look", "metrics", "criteria", "validate model.toml")),
        *(f"{command} mapping.toml" for command in ("look", "metrics", "validate model.toml")),
        *(f"{command} signal.toml" for command in ("check", "run")),
        "check model.toml --root {file}",
    ],
)
@pytest.mark.parametrize("file", ["loop.csv", "loop.wav", "loop.nc"])
def test_a_symbolic_link_to_itself_is_named_as_such(
    words: str, file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """However it is named: on the command line, by a mapping, by a model, as the folder that is allowed."""
    monkeypatch.chdir(tmp_path)
    for name in (file, "loop.toml"):
        (tmp_path / name).symlink_to(name)
    (tmp_path / "record.csv").write_text(RECORD)
    (tmp_path / "model.toml").write_text(MODEL.format(file="record.csv"))
    (tmp_path / "signal.toml").write_text(MODEL.format(file=file))
    mapping = f'schema = 1\nfile = "{file}"\n[[channel]]\nname = "T"\nquantity = "torque"\n'
    (tmp_path / "mapping.toml").write_text(mapping)
    assert main(words.format(file=file).split()) == 2
    said = capsys.readouterr().err
    named = "--root" if "--root" in words else "loop.toml" if "loop.toml" in words else file
    assert f"{named}: " in said
    assert ("must be a folder" if "--root" in words else "is a symbolic link that leads back to itself") in said


@pytest.mark.parametrize("call", [gr.load, gr.read])
def test_a_root_that_links_to_itself_is_refused(call: Callable[..., object], tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "mapping.toml").write_text('schema = 1\nfile = "record.csv"\n')
    with pytest.raises(ModelError, match=r"root .*loop: is a symbolic link that leads back to itself"):
        call(tmp_path / "mapping.toml", root=tmp_path / "loop")


def test_a_model_names_files_of_its_own_folder_only(tmp_path: Path) -> None:
    inside, outside = tmp_path / "project" / "model", tmp_path / "elsewhere"
    inside.mkdir(parents=True)
    outside.mkdir()
    (outside / "record.csv").write_text(RECORD.replace("T [N*m]", SECRET))
    (inside / "record.csv").write_text(RECORD)
    (inside / "link.csv").symlink_to(outside / "record.csv")
    path = inside / "model.toml"
    path.write_text(MODEL.format(file="record.csv"))
    assert gr.load(path).torques[0].signal is not None
    for file in ("../../elsewhere/record.csv", str(outside / "record.csv"), "link.csv", "/etc/passwd", "/dev/zero"):
        path.write_text(MODEL.format(file=file))
        with pytest.raises(ModelError, match=r"lies outside of .*--root") as caught:
            gr.load(path)
        assert SECRET not in str(caught.value)
        assert "root:" not in str(caught.value)


def test_a_relative_path_of_an_input_file_widens_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    work, outside = tmp_path / "work", tmp_path / "elsewhere"
    (work / "sub").mkdir(parents=True)
    outside.mkdir()
    (outside / "record.csv").write_text(RECORD)
    model, mapping = work / "sub" / "model.toml", work / "sub" / "measurement.toml"
    model.write_text(MODEL.format(file="../../elsewhere/record.csv"))
    channel = '[[channel]]\nname = "T"\nquantity = "torque"\n'
    mapping.write_text(f'schema = 1\nfile = "../../elsewhere/record.csv"\n{channel}')
    monkeypatch.chdir(work)
    with pytest.raises(ModelError, match="lies outside"):
        gr.load("sub/model.toml")
    with pytest.raises(ModelError, match="lies outside"):
        gr.read("sub/measurement.toml")


def test_the_working_directory_and_a_root_widen_what_may_be_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "models").mkdir()
    (tmp_path / "records").mkdir()
    (tmp_path / "records" / "record.csv").write_text(RECORD)
    path = tmp_path / "models" / "model.toml"
    path.write_text(MODEL.format(file="../records/record.csv"))
    with pytest.raises(ModelError, match="lies outside"):
        gr.load(path)
    assert gr.load(path, root=tmp_path / "records").torques[0].signal is not None
    assert main(["check", str(path)]) == 2
    assert f'--root "{tmp_path / "records"}"' in capsys.readouterr().err
    assert main(["check", str(path), "--root", str(tmp_path / "records")]) == 0
    assert main(["--root", str(tmp_path), "check", str(path)]) == 0
    assert main(["check", str(path), f"--root={tmp_path / 'nothing'}"]) == 2
    assert "--root" in capsys.readouterr().err
    monkeypatch.chdir(tmp_path)
    assert gr.load("models/model.toml").torques[0].signal is not None
    monkeypatch.chdir(tmp_path / "models")
    with pytest.raises(ModelError, match="lies outside"):  # the root was for one call
        gr.load(path)


def test_a_mapping_names_files_of_its_own_folder_only(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "record.csv").write_text(RECORD)
    mapping = tmp_path / "in" / "measurement.toml"
    mapping.write_text('schema = 1\nfile = "../record.csv"\n[[channel]]\nname = "T"\nquantity = "torque"\n')
    with pytest.raises(ModelError, match="lies outside"):
        gr.read(mapping)
    assert gr.read(mapping, root=tmp_path).names == ("T",)


def test_a_study_names_a_toml_model_only(tmp_path: Path) -> None:
    (tmp_path / "link.toml").symlink_to("/etc/passwd")
    for name in ("/etc/passwd", "link.toml"):
        (tmp_path / "study.toml").write_text(f'model = "{name}"\n[axis]\n"mesh.gear.backlash" = [1e-4, 2e-4]\n')
        assert main(["study", str(tmp_path / "study.toml"), "--estimate"]) == 2


def external_link(path: Path) -> None:
    with h5py.File(path.with_name("other.h5"), "w") as other:
        other["x"] = np.arange(10.0)
    with h5py.File(path, "w") as file:
        file["time"] = np.arange(10.0)
        file["x"] = h5py.ExternalLink("other.h5", "/x")


def external_storage(path: Path) -> None:
    path.with_name("raw").write_bytes(SECRET.encode().ljust(80, b"."))
    with h5py.File(path, "w") as file:
        file["time"] = np.arange(10.0)
        file.create_dataset("x", (10,), "f8", external=[(str(path.with_name("raw")), 0, 80)])


def virtual_dataset(path: Path) -> None:
    external_link(path)
    layout = h5py.VirtualLayout((10,), "f8")
    layout[:] = h5py.VirtualSource(str(path.with_name("other.h5")), "x", (10,))
    with h5py.File(path, "w") as file:
        file["time"] = np.arange(10.0)
        file.create_virtual_dataset("x", layout)


@pytest.mark.parametrize("make", [external_link, external_storage, virtual_dataset])
def test_hdf5_that_points_elsewhere_is_refused(make: Callable[[Path], None], tmp_path: Path) -> None:
    make(tmp_path / "record.h5")
    with pytest.raises(ModelError, match="x: points to data in another file"):
        gr.read(tmp_path / "record.h5")


def test_hdf5_whose_groups_hold_each_other_is_read_once(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "record.h5", "w") as file:
        file["a/time"] = np.arange(10.0)
        file["a/x"] = np.arange(10.0)
        file["a/again"] = file["/"]
        file["a/soft"] = h5py.SoftLink("/a")
    assert gr.read(tmp_path / "record.h5").names == ("a/x",)


def hdf5_bomb(folder: Path) -> Path:
    with h5py.File(folder / "bomb.h5", "w") as file:
        for name in ("time", "x"):
            file.create_dataset(name, (600_000_000,), "f8", chunks=(1_000_000,), compression="gzip", fillvalue=1.0)
    return folder / "bomb.h5"


def mat_bomb(folder: Path) -> Path:
    """One compressed variable of two gigabytes."""
    size = 2**31 - 256
    body = struct.pack("<6I", 6, 8, 6, 0, 5, 8) + struct.pack("<2i", size // 8, 1) + struct.pack("<HH4s", 1, 1, b"x")
    body += struct.pack("<2I", 9, size)
    packing = zlib.compressobj(9)
    packed = packing.compress(struct.pack("<2I", 14, len(body) + size) + body)
    packed += b"".join(packing.compress(bytes(2**24)) for _ in range(size // 2**24)) + packing.flush()
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    (folder / "bomb.mat").write_bytes(head + struct.pack("<2I", 15, len(packed)) + packed)
    return folder / "bomb.mat"


def mdf_bomb(folder: Path) -> Path:
    """One channel of 500 million equal samples, in blocks that are compressed."""
    asammdf = pytest.importorskip("asammdf")
    count = 40_000
    with asammdf.MDF(version="4.10") as file:
        file.append(asammdf.Signal(np.zeros(count), np.arange(count) * 1e-3, name="x"))
        file.save(folder / "bomb.mf4", compression=2, overwrite=True)
    whole = bytearray((folder / "bomb.mf4").read_bytes())
    whole = whole.replace(struct.pack("<Q", count), struct.pack("<Q", 500_000_000))
    (folder / "bomb.mf4").write_bytes(whole)
    return folder / "bomb.mf4"


def npz_bomb(folder: Path) -> Path:
    with (
        zipfile.ZipFile(folder / "charts.npz", "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("0.npy", "w", force_zip64=True) as entry,
    ):
        np.lib.format.write_array_header_1_0(entry, {"descr": "<f8", "fortran_order": False, "shape": (260_000_000,)})
        for _ in range(130):
            entry.write(bytes(16_000_000))
    return folder / "charts.npz"


READ = "gearrattle.read(path)"
FIGURES = (
    "from gearrattle.report.plots.chart_files import read_charts; from pathlib import Path; read_charts(Path(path))"
)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the largest resident size is read from /proc")
@pytest.mark.parametrize(
    ("make", "code"),
    [
        (hdf5_bomb, READ),
        pytest.param(mat_bomb, READ, marks=pytest.mark.long),
        (mdf_bomb, READ),
        pytest.param(npz_bomb, FIGURES, marks=pytest.mark.long),
    ],
)
def test_a_bomb_is_refused_before_memory_is_taken(make: Callable[[Path], Path], code: str, tmp_path: Path) -> None:
    path = make(tmp_path)
    assert path.stat().st_size < 5_000_000
    program = (
        f"import gearrattle\npath = {str(path)!r}\ntry:\n    {code}\nexcept Exception as error:\n"
        "    print(type(error).__name__, error)\nprint(open('/proc/self/status').read().split('VmHWM:')[1].split()[0])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60)
    message, resident = done.stdout.splitlines()
    assert "at most 1 GB of a file are read" in message
    assert "GEARRATTLE_READ_LIMIT" in message
    assert int(resident) < 1_000_000  # kilobytes


def test_the_limit_can_be_raised_and_lowered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with h5py.File(tmp_path / "record.h5", "w") as file:
        file["time"], file["x"] = np.arange(1000.0), np.arange(1000.0)
    monkeypatch.setenv("GEARRATTLE_READ_LIMIT", "15e3")
    with pytest.raises(ModelError, match=r"would take 1.6e-05 GB"):
        gr.read(tmp_path / "record.h5")
    monkeypatch.setenv("GEARRATTLE_READ_LIMIT", "17e3")
    assert gr.read(tmp_path / "record.h5").names == ("x",)
    monkeypatch.setenv("GEARRATTLE_READ_LIMIT", "many")
    with pytest.raises(ModelError, match="must be a number of bytes"):
        gr.read(tmp_path / "record.h5")


def test_a_wav_shorter_than_its_header_says_is_refused(tmp_path: Path) -> None:
    samples = np.zeros(100, "<i2").tobytes()
    head = struct.pack("<4sI4s4sIHHIIHH", b"RIFF", 36 + 1_000_000_000, b"WAVE", b"fmt ", 16, 1, 1, 8000, 16000, 2, 16)
    (tmp_path / "x.wav").write_bytes(head + struct.pack("<4sI", b"data", 1_000_000_000) + samples)
    with pytest.raises(ModelError, match="truncated"):
        gr.read(tmp_path / "x.wav")


def test_the_arrays_of_a_run_are_read_only() -> None:
    run = gr.simulate(gr.load(CASE), cycles=2, discard=0, samples_per_cycle=16, audit=False)
    with pytest.raises(ValueError, match="read-only"):
        run.data["angle"].values[...] = 0.0
    changed = run.data.copy(deep=True)
    changed["angle"][...] = 0.0
    assert np.any(run.trajectory.angle != 0.0)


def test_a_damaged_run_is_refused_whatever_breaks(tmp_path: Path) -> None:
    run = gr.simulate(gr.load(CASE), cycles=2, discard=0, samples_per_cycle=16, audit=False)
    run.save(tmp_path / "run.nc")
    whole = (tmp_path / "run.nc").read_bytes()
    random = np.random.default_rng(5)
    refused = 0
    for _ in range(60):
        broken = bytearray(whole)
        for _ in range(int(random.integers(1, 40))):
            broken[int(random.integers(0, len(whole)))] = int(random.integers(256))
        (tmp_path / "broken.nc").write_bytes(bytes(broken))
        try:
            gr.open_run(tmp_path / "broken.nc")
        except ModelError as error:
            refused += str(tmp_path / "broken.nc") in str(error)
    assert refused > 30
