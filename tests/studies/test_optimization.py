"""Optimisation: fronts known in closed form are found, the search goes on to the same bits, its front is certified."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.errors import Cancelled, ModelError, NotInstalled
from gearrattle.model.paths import value_at
from gearrattle.studies.nsga2 import Evolution, front_of, hypervolume
from gearrattle.studies.optimization import prepare
from tests.studies.drivelines import TOML, model

STIFFNESS = "coupling.joint.stiffness"
WHEEL = "inertia.wheel.J"
ENGINE = "inertia.engine.J"
RANGES = {STIFFNESS: (500.0, 1000.0), WHEEL: (0.01, 0.03), ENGINE: (0.1, 0.3)}
SHORT = {"simulation.cycles": 2, "simulation.discard": 1, "simulation.samples_per_cycle": 8}
SMALL: dict[str, Any] = {"population": 8, "generations": 3, "fixed": SHORT, "seed": 3}


def zdt(run: gr.Run) -> dict[str, float]:
    """ZDT1 (Zitzler, Deb, Thiele 2000) over three values of the driveline: its front is f2 = 1 - sqrt(f1)."""
    tables = run.model.to_tables()
    x = [(value_at(tables, path) - low) / (high - low) for path, (low, high) in RANGES.items()]
    g = 1.0 + 9.0 * (x[1] + x[2]) / 2.0
    return {"f1": x[0], "f2": g * (1.0 - float(np.sqrt(max(x[0], 0.0) / g)))}


def distance(run: gr.Run) -> dict[str, float]:
    """Of the stiffness from 620: fails below 520."""
    stiffness = value_at(run.model.to_tables(), STIFFNESS)
    if stiffness < 520.0:
        raise RuntimeError("too soft")
    return {"distance": (stiffness - 620.0) ** 2}


def zdt1(points: np.ndarray) -> np.ndarray:
    g = 1.0 + 9.0 * points[:, 1:].mean(axis=1)
    return np.column_stack([points[:, 0], g * (1.0 - np.sqrt(points[:, 0] / g))])


@pytest.fixture(scope="module")
def search() -> xr.Dataset:
    return gr.optimize(
        model(),
        RANGES,
        {"f1": "min", "f2": "min"},
        constraints={"f1": {"below": 0.9}},
        function=zdt,
        workers=1,
        **SMALL,
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))])
def test_a_front_known_in_closed_form_is_found(seed: int) -> None:
    """Its hypervolume to (1.1, 1.1) is 1.21 - 1/3; 2000 points reach all but one hundredth of it."""
    search = Evolution(np.random.default_rng(seed).random((40, 3)), 2, seed)
    reports = []
    for _ in range(50):
        values = zdt1(search.ask())
        search.tell(values, np.zeros(len(values)))
        reports.append(values)
    every = np.vstack(reports)
    front = every[front_of(every)]
    exact = 1.21 - 1.0 / 3.0
    assert 0.99 * exact < hypervolume(front, np.array([1.1, 1.1])) < exact
    assert np.all(front[:, 1] >= 1.0 - np.sqrt(front[:, 0]) - 1e-12)


def test_told_the_same_it_asks_the_same() -> None:
    def asked() -> np.ndarray:
        search = Evolution(np.random.default_rng(1).random((8, 2)), 2, 5)
        proposed = []
        for _ in range(6):
            points = search.ask()
            search.tell(zdt1(points), np.maximum(points[:, 1] - 0.5, 0.0))
            proposed.append(points)
        return np.vstack(proposed)

    np.testing.assert_array_equal(asked(), asked())


def test_the_front_is_what_nothing_beats() -> None:
    rng = np.random.default_rng(0)
    values = rng.integers(0, 6, (60, 3)).astype(float)
    values[7, 1] = np.nan
    on = front_of(values)
    for i in range(60):
        beaten = any(np.all(values[j] <= values[i]) and np.any(values[j] < values[i]) for j in range(60))
        twin = any(np.array_equal(values[j], values[i]) for j in range(i))
        assert on[i] == (not beaten and not twin and bool(np.isfinite(values[i]).all()))


@pytest.mark.parametrize("m", [1, 2, 3, 4])
def test_a_hypervolume_is_the_share_of_points_that_the_front_beats(m: int) -> None:
    """Against counting: 40000 random points of the unit box, within four deviations."""
    rng = np.random.default_rng(m)
    values = rng.random((12, m))
    points = rng.random((40_000, m))
    share = float(np.mean((points[:, None, :] >= values[None, :, :]).all(axis=2).any(axis=1)))
    exact = hypervolume(values[front_of(values)], np.ones(m))
    assert abs(exact - share) < 4.0 * np.sqrt(max(share * (1.0 - share), 1e-9) / 40_000) + 1e-12


def test_hypervolume_agrees_with_pymoo() -> None:
    from pymoo.indicators.hv import HV

    values = np.random.default_rng(3).random((20, 3))
    assert hypervolume(values[front_of(values)], np.ones(3)) == pytest.approx(float(HV(ref_point=np.ones(3))(values)))


def test_everything_computed_is_told(search: xr.Dataset) -> None:
    assert search.sizes["design"] == 24
    assert search["born"].values.tolist() == sorted(search["born"].values.tolist())
    assert search[STIFFNESS].values[0] == value_at(model().to_tables(), STIFFNESS)  # the model itself comes first
    values, feasible = search["value"].values, search["violation"].values == 0.0
    np.testing.assert_array_equal(values[:, 0], search["f1"].values)
    np.testing.assert_array_equal(feasible, search["f1"].values <= 0.9)
    expected = np.zeros(24, dtype=bool)
    expected[feasible] = front_of(values[feasible])
    np.testing.assert_array_equal(search["front"].values == 1, expected)
    for path, (low, high) in RANGES.items():
        assert np.all((search[path].values >= low) & (search[path].values <= high))
    assert np.all(np.diff(search["hypervolume"].values) >= 0.0)
    assert 0.0 < float(search["hypervolume"][-1]) < 1.0
    last = search["best"].values[-1]
    np.testing.assert_array_equal(last, values[feasible].min(axis=0))


def test_every_member_of_the_front_is_computed_again_by_itself(search: xr.Dataset) -> None:
    on = search["front"].values == 1
    assert np.all(search["certified"].values[on] == 1)
    assert np.all(search["certified"].values[~on] == -1)
    np.testing.assert_allclose(search["exact"].values[on], search["value"].values[on], rtol=1e-6)
    assert np.isnan(search["exact"].values[~on]).all()


def test_a_search_by_a_coarse_algorithm_is_not_certified() -> None:
    """Midpoint steps at the default step against exact runs: impacts differ by more than a part in a million."""
    coarse = gr.optimize(
        model(),
        {STIFFNESS: (500.0, 1000.0)},
        {"wheel: TR rms": "min"},
        population=4,
        generations=1,
        fixed={"simulation.algorithm": "rk2"},
        workers=1,
    )
    assert coarse["certified"].values[int(coarse.attrs["best"])] == 0


@pytest.mark.slow
def test_the_drag_that_just_holds_a_loose_gear(tmp_path: Path) -> None:
    """A gear is lifted off its flank where I theta'' passes its drag torque: two bodies, a rigid motion, closed form.

    Held together the bodies have the acceleration T / (J_e + J_w) at most; the wheel's drag holds it on its flank while
    J_w T / (J_e + J_w) <= T_drag. On a stiff joint, within two per cent.
    """
    toml = TOML.replace("drag = 0.05", "drag = 0.0").replace("amplitude = 6.0", "amplitude = 4.0")
    driveline = gr.loads(toml, "two.toml").with_({"coupling.joint.stiffness": 4e4, "coupling.joint.damping": 8.0})
    engine = 0.2
    torque = 4.0
    drag = 0.4
    exact = engine * drag / (torque - drag)  # J_w T / (J_e + J_w) = T_drag
    best = gr.optimize(
        driveline,
        {WHEEL: (0.01, 0.04)},
        {"mass": "max"},
        constraints={"joint: regime": {"below": 0.5}},
        function=wheel_inertia,
        population=16,
        generations=8,
        seed=1,
        fixed={"simulation.cycles": 30, "simulation.discard": 15},
        output=tmp_path / "o",
        workers=1,
    )
    reached = float(best[WHEEL][int(best.attrs["best"])])
    assert reached == pytest.approx(exact, rel=0.02)
    assert reached == gr.load(tmp_path / "o" / "best.toml").inertias[1].J
    heavier = gr.simulate(driveline.with_({WHEEL: 1.04 * exact, "simulation.cycles": 30, "simulation.discard": 15}))
    assert gr.criteria(heavier).verdict != "quiet"


def wheel_inertia(run: gr.Run) -> dict[str, float]:
    return {"mass": run.model.inertias[1].J}


def test_limits_may_be_functions_of_the_model(tmp_path: Path) -> None:
    search = gr.optimize(
        model(),
        {STIFFNESS: (500.0, 1000.0)},
        {"distance": "min"},
        function=distance,
        constraints={"mean stiffness": {"of": lambda m: value_at(m.to_tables(), STIFFNESS), "above": 700.0}},
        output=tmp_path / "o",
        workers=1,
        population=8,
        generations=6,
        fixed=SHORT,
        seed=2,
    )
    best = int(search.attrs["best"])
    assert 700.0 <= float(search[STIFFNESS][best]) < 712.0
    failed = np.isnan(search["violation"].values)
    assert np.all(failed == (search[STIFFNESS].values < 520.0))
    assert len(search.attrs["failures"]) == int(failed.sum())
    assert (tmp_path / "o" / "front" / "001.toml").read_text() == (tmp_path / "o" / "best.toml").read_text()


def test_where_nothing_is_feasible_that_is_told(tmp_path: Path) -> None:
    search = gr.optimize(
        model(),
        {STIFFNESS: (500.0, 1000.0)},
        {"f1": "min"},
        constraints={"f2": {"below": -1.0, "above": -2.0}},
        function=zdt,
        output=tmp_path / "o",
        workers=1,
        population=4,
        generations=1,
        fixed=SHORT,
    )
    assert search.attrs["best"] == -1
    assert not (search["front"] == 1).any()
    assert not (tmp_path / "o" / "best.toml").exists()


@pytest.mark.slow
@pytest.mark.parametrize("folder", ["folder", "memory"])
def test_a_search_that_was_stopped_goes_on_to_the_same_bits(search: xr.Dataset, tmp_path: Path, folder: str) -> None:
    address = str(tmp_path / "o") if folder == "folder" else f"memory://{tmp_path.name}/o"
    arguments: dict[str, Any] = {
        "constraints": {"f1": {"below": 0.9}},
        "function": zdt,
        "output": address,
        "workers": 1,
        **SMALL,
    }

    def stop(share: float) -> None:
        if share > 0.5:
            raise Cancelled("enough")

    goals = {"f1": "min", "f2": "min"}
    with pytest.raises(Cancelled):
        gr.optimize(model(), RANGES, goals, progress=stop, **arguments)
    with pytest.raises(ModelError, match="holds a study already"):
        gr.optimize(model(), RANGES, goals, **arguments)
    with pytest.raises(ModelError, match="another study: seed differ"):
        gr.optimize(model(), RANGES, goals, resume=True, **{**arguments, "seed": 4})
    again = gr.optimize(model(), RANGES, goals, resume=True, **arguments)
    assert again.equals(search)
    assert gr.open_study(address).equals(search)
    longer = gr.optimize(model(), RANGES, goals, resume=True, **{**arguments, "generations": 4})
    assert longer.sizes["design"] == 32
    np.testing.assert_array_equal(longer["value"].values[:24], search["value"].values)


@pytest.mark.parametrize("scheduler", [pytest.param("local", marks=pytest.mark.long), "threads"])
def test_any_scheduler_gives_the_same_bits(search: xr.Dataset, scheduler: str) -> None:
    again = gr.optimize(
        model(),
        RANGES,
        {"f1": "min", "f2": "min"},
        constraints={"f1": {"below": 0.9}},
        function=zdt,
        workers=2,
        scheduler=scheduler,
        **SMALL,
    )
    assert again.equals(search)


@pytest.mark.long
def test_killed_within_a_generation_it_goes_on_to_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.toml").write_text(TOML, encoding="utf-8")
    study = (
        'kind = "optimization"\nmodel = "two.toml"\npopulation = 8\ngenerations = 2\n'
        '[variable]\n"coupling.joint.stiffness" = { from = 500.0, to = 1000.0 }\n'
        '"inertia.wheel.J" = { from = 0.01, to = 0.03, spacing = "log" }\n'
        '[objective]\n"joint: largest impact energy" = "min"\n"wheel: TR rms" = "min"\n'
    )
    (tmp_path / "study.toml").write_text(study, encoding="utf-8")
    words = ["study", "study.toml", "--workers", "1", "-o"]
    command = [sys.executable, "-m", "gearrattle", *words, "cut"]
    killed = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 120.0
    second = tmp_path / "cut" / "generations" / "0001" / "done"
    while killed.poll() is None and not list(second.glob("*.json")) and time.monotonic() < deadline:
        time.sleep(0.005)
    killed.kill()
    killed.wait()
    assert not (tmp_path / "cut" / "report.html").exists()
    assert main([*words, "cut", "--resume"]) == 0
    assert main([*words, "whole"]) == 0
    assert gr.open_study(tmp_path / "cut").identical(gr.open_study(tmp_path / "whole"))
    assert (tmp_path / "cut" / "best.toml").read_text() == (tmp_path / "whole" / "best.toml").read_text()


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"variables": {}}, "needs at least one"),
        ({"variables": {"coupling.joint.stifness": (1.0, 2.0)}}, "did you mean"),
        ({"variables": {STIFFNESS: (2.0, 1.0)}}, "must lie below to"),
        ({"variables": {STIFFNESS: (-1.0, 1.0)}}, "stiffness"),
        ({"variables": {STIFFNESS: {"from": 0.0, "to": 1.0, "spacing": "log"}}}, "positive"),
        ({"objectives": {"joint: largest impuls": "min"}}, "did you mean|no such output"),
        ({"objectives": {"TR rms": "min"}}, 'name one: "engine: TR rms"'),
        ({"objectives": {"verdict": "small"}}, '"min" or "max"'),
        ({"constraints": {"verdict": {"under": 1.0}}}, "below, above or both"),
        ({"constraints": {"verdict": {"below": 1.0, "above": 2.0}}}, "nothing between"),
        ({"constraints": {"a": {"below": 1.0, "of": 3}}}, "must be a function"),
        ({"population": 2}, "whole number from 4"),
        ({"generations": 0}, "whole number from 1"),
    ],
)
def test_what_is_wrong_is_refused_before_anything_runs(arguments: dict[str, Any], match: str, tmp_path: Path) -> None:
    inputs = {"variables": {STIFFNESS: (500.0, 1000.0)}, "objectives": {"verdict": "min"}, **arguments}
    with pytest.raises(ModelError, match=match):
        gr.optimize(model(), **inputs, output=tmp_path / "never")
    assert not (tmp_path / "never").exists()


def test_without_the_library_the_command_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pymoo.algorithms.moo.nsga2", None)
    with pytest.raises(NotInstalled, match=r"gearrattle\[optimization\]"):
        prepare(model(), {STIFFNESS: (500.0, 1000.0)}, {"verdict": "min"})


def test_the_command_writes_page_and_models(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "two.toml").write_text(TOML, encoding="utf-8")
    study = (
        'kind = "optimization"\nmodel = "two.toml"\npopulation = 8\ngenerations = 3\n'
        '[variable]\n"coupling.joint.stiffness" = { from = 500.0, to = 1000.0 }\n'
        '[objective]\n"joint: largest impact energy" = "min"\n"wheel: TR rms" = "min"\n'
        '[constraint]\n"joint: impacts per cycle" = { below = 10.0 }\n'
    )
    (tmp_path / "study.toml").write_text(study, encoding="utf-8")
    assert main(["study", str(tmp_path / "study.toml"), "-o", str(tmp_path / "o")]) == 0
    printed = capsys.readouterr().out
    assert "24 designs" in printed
    page = (tmp_path / "o" / "report.html").read_text(encoding="utf-8")
    assert "Nearest to the best of every objective" in page
    assert "joint: impacts per cycle at most 10" in page
    assert {path.name for path in (tmp_path / "o" / "figures").iterdir()} >= {"front.svg", "growth.svg"}
    for path in (tmp_path / "o" / "figures").glob("*.svg"):
        assert b"nan" not in path.read_bytes()
    members = sorted((tmp_path / "o" / "front").glob("*.toml"))
    assert len(members) == int((gr.open_study(tmp_path / "o")["front"] == 1).sum())
    gr.load(members[0])
