"""A saved run of which somebody changed values: it is refused where it is opened, by the name of what was changed."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.errors import ModelError
from tests.compositions.kinds import KINDS

EXAMPLES = Path(__file__).parents[1] / "examples"
Change = Callable[[Any], object]


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return a run of gaps, and one with friction."""
    folder = tmp_path_factory.mktemp("runs")
    models = {"gaps": gr.example("case3"), "friction": gr.load(EXAMPLES / "clutch_friction.toml")}
    for name, model in models.items():
        gr.simulate(model, cycles=3, discard=1, samples_per_cycle=32).save(folder / f"{name}.nc")
    return {name: folder / f"{name}.nc" for name in models}


def names_of(path: Path) -> list[str]:
    """Return the names of the variables of a run; those of dimensions alone hold nothing."""
    names: list[str] = []
    with h5py.File(path) as file:
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        return [name for name in names if not str(file[name].attrs.get("NAME", "")).startswith("b'This is")]


def made(name: str, make: Callable[[Any], Any]) -> Change:
    """Return a change that puts another array in the place of one."""

    def change(file: Any) -> None:
        stored = file[name][...]
        new = make(stored)
        if new.shape == stored.shape and new.dtype == stored.dtype:
            file[name][...] = new
            return
        del file[name]
        file[name] = new

    return change


def changes(path: Path) -> list[tuple[str, Change]]:
    """Return changes of every variable: gone, of another shape or type, with other numbers, in another order."""
    rows: list[tuple[str, Change]] = []
    for name in names_of(path):
        makes: list[Callable[[Any], Any]] = [lambda x: x[:-1], lambda x: x[..., None], lambda x: np.full(x.shape, b"x")]
        with h5py.File(path) as file:
            kind = file[name].dtype.kind
        if kind == "f":
            makes += [lambda x, v=v: np.full_like(x, v) for v in (np.nan, np.inf, -1.0, 0.0, 1e300)]
            makes += [lambda x: x[::-1].copy(), lambda x: x.astype(complex), lambda x: x[:0]]
        if kind == "i":
            makes += [lambda x, v=v: np.full_like(x, v) for v in (-100, -1, 0, 1, 100)]
        rows += [(name, made(name, make)) for make in makes]
    with h5py.File(path) as file:
        keys = [key for key in file.attrs if key != "_NCProperties"]
    values = ("x", "{}", "null", "[1]", '{"algorithm": 5}', np.nan, -1, 0, 1e300, 3.5, np.zeros((2, 2)))
    rows += [(key, lambda file, key=key, v=v: file.attrs.__setitem__(key, v)) for key in keys for v in values]
    return rows


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["gaps", "friction"])
def test_what_is_opened_can_be_judged(kind: str, saved: dict[str, Path], tmp_path: Path) -> None:
    """Whatever was changed: it is refused by its name, or what is left is a motion that can be judged."""
    path = tmp_path / "r.nc"
    refused = 0
    rows = changes(saved[kind])
    for number, (name, change) in enumerate(rows):
        shutil.copy(saved[kind], path)
        with h5py.File(path, "r+") as file:
            change(file)
        try:
            run = gr.open_run(path)
        except ModelError:
            refused += 1
            continue
        assert gr.criteria(run).notes is not None, name
        if number % 8 == 0:
            with contextlib.suppress(ModelError):
                gr.metrics(run)
    assert refused > 0.6 * len(rows)


@pytest.mark.parametrize(
    ("name", "make", "message"),
    [
        ("angle", lambda x: np.full_like(x, np.nan), "angle: found nan; must be finite numbers"),
        ("time", lambda x: 2.0 * x, "time: found .* at sample 1; must be"),
        ("region", lambda x: x + 9, "region: found .*; regions of"),
        ("events/clearance", lambda x: x + 9, "events/clearance: found .*; must be less than 3"),
        ("events/time", lambda x: x[::-1].copy(), "events/time: found .* must ascend"),
        ("events/to_region", lambda x: x * 0, "events: found from region .*; must lead from region"),
        ("inertia", lambda x: x[::-1].copy(), "inertia: found .*; must be the names of the model"),
    ],
)
def test_the_message_names_what_was_changed(
    name: str, make: Callable[[Any], Any], message: str, saved: dict[str, Path], tmp_path: Path
) -> None:
    path = tmp_path / "r.nc"
    shutil.copy(saved["gaps"], path)
    with h5py.File(path, "r+") as file:
        made(name, make)(file)
    with pytest.raises(ModelError, match=message):
        gr.open_run(path)


@pytest.mark.parametrize("command", ["criteria", "metrics", "figures", "listen", "spectra --channel velocity.hub"])
def test_commands_refuse_a_changed_run(
    command: str, saved: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "r.nc"
    shutil.copy(saved["gaps"], path)
    with h5py.File(path, "r+") as file:
        file["events/clearance"][...] = 7
    first, *others = command.split()
    output = ["-o", str(tmp_path / "o")] if first == "figures" else []
    assert main([first, str(path), *others, *output]) == 2
    assert "events/clearance" in capsys.readouterr().err


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("algorithm", "kind"),
    [*(("exact", kind) for kind in KINDS), *(("rk4", kind) for kind in ("harmonics", "stages", "planetary set"))],
)
def test_what_was_saved_unchanged_is_opened(algorithm: str, kind: str, tmp_path: Path) -> None:
    model = KINDS[kind].make()
    run = gr.simulate(model, algorithm=algorithm, cycles=4, discard=1, samples_per_cycle=16)
    run.save(tmp_path / "run.nc")
    opened = gr.open_run(tmp_path / "run.nc")
    np.testing.assert_array_equal(opened.data.velocity, run.data.velocity)


@pytest.mark.compiled
@pytest.mark.parametrize("kind", KINDS)
def test_what_was_stored_unchanged_is_opened(kind: str, tmp_path: Path) -> None:
    """All of the first chunk is start-up, and the last is shorter."""
    model = KINDS[kind].make()
    settings = {"cycles": 5, "discard": 3, "samples_per_cycle": 16}
    chunks = [run.trajectory.end for run in gr.stream(model, chunk=2, store=tmp_path / "store", **settings)]
    assert [run.trajectory.end for run in gr.open_stream(tmp_path / "store")] == chunks
