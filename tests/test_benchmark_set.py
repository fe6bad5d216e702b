"""The benchmark set: its files are those of its problems, ``exact`` follows them, its checker finds planted faults."""

from __future__ import annotations

import ast
import csv
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.benchmark_set import right_hand_side
from benchmarks.benchmark_set.problems import PROBLEMS, Problem, free_flight, period_1_orbit
from benchmarks.benchmark_set.reference import reference
from benchmarks.benchmark_set.reference import text as reference_text
from benchmarks.benchmark_set.results import FOLDER, checker, problem_table, result_table, write
from benchmarks.benchmark_set.solvers import HOME, load, ours
from benchmarks.benchmark_set.statements import json_text, model_file, page, statement
from mpmath import mp, mpf

import gearrattle as gr

ALL = [make() for make in PROBLEMS]
IDS = [problem.name for problem in ALL]


def _read(name: str, file: str) -> str:
    return (HOME / name / file).read_text(encoding="utf-8")


def _reference(name: str) -> dict[str, Any]:
    return json.loads(_read(name, "reference.json"))


def test_folders_are_those_of_the_problems() -> None:
    assert sorted(path.name for path in HOME.iterdir()) == sorted(IDS)
    assert sum(path.stat().st_size for path in FOLDER.rglob("*") if path.suffix != ".pyc") < 1.6e6


@pytest.mark.parametrize("problem", ALL, ids=IDS)
def test_statement_model_and_pages_are_up_to_date(problem: Problem) -> None:
    stated = statement(problem)
    assert _read(problem.name, "problem.json") == json_text(stated)
    assert _read(problem.name, "model.toml") == model_file(problem)
    assert _read(problem.name, "rhs.py") == right_hand_side.text(stated)
    assert _read(problem.name, "README.md") == page(problem, stated, _reference(problem.name))


def test_the_tables_of_the_page_are_up_to_date() -> None:
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert problem_table() in text
    assert result_table() in text


@pytest.mark.parametrize("name", IDS)
def test_exact_follows(name: str, tmp_path: Path) -> None:
    """The third witness. Double rounding moves an event that begins at rest by some 1e-8 of a unit of time."""
    outcome = ours("exact", None)(name)
    verdict = checker().check(name, write(tmp_path, name, outcome))
    assert verdict["faults"] == []
    stored = _reference(name)
    assert verdict["matched"] == sum(float(event[0]) <= stored["horizon"] for event in stored["events"])
    growth = max(g for g, t in zip(stored["growth"], stored["times"], strict=True) if t <= stored["horizon"])
    assert verdict["state_error"] < 1e-12 * max(growth, 100.0)
    if name != "rest-in-contact":
        assert verdict["time_error"] < 1e-12 * stored["times"][-1] * max(growth, 100.0)


@pytest.mark.parametrize("name", IDS)
def test_right_hand_sides_agree_with_the_model(name: str) -> None:
    """Accelerations of ``exact`` at the samples, where no corner is near: the two statements are the same law."""
    module, run = load(name), gr.simulate(gr.load(HOME / name / "model.toml"), audit=False)
    count = module.TIMES.size
    states = np.hstack([run.data.angle.values, run.data.velocity.values])[:count]
    accelerations = run.data.acceleration.values[:count]
    n = module.INERTIA.size
    assert np.allclose(module.TIMES, run.data.time.values[:count], rtol=1e-14, atol=0)
    for t, y, a in zip(module.TIMES, states, accelerations, strict=True):
        if np.abs(module.events(t, y)).min() > 1e-9:
            size = np.abs(accelerations).max(axis=0) + 1e-30
            assert np.abs((module.rhs(t, y)[n:] - a) / size).max() < 1e-8


def test_jacobians_are_the_slopes_of_the_right_hand_sides() -> None:
    for name in ("clutch-stages", "gearbox-6"):
        module = load(name)
        y, index = module.START + 1e-3, module.region(0.0, module.START)
        step = np.eye(y.size)
        slopes = np.array([module.rhs(0.1, y + e, index) - module.rhs(0.1, y, index) for e in step]).T
        matrix = module.jacobian(0.1, y, index)
        assert np.abs(slopes - matrix).max() < 1e-9 * np.abs(matrix).max()


@pytest.mark.parametrize("make", [free_flight, period_1_orbit])
def test_both_methods_give_what_is_stored(make: Any) -> None:
    problem = make()
    assert _read(problem.name, "reference.json") == reference_text(reference(problem, statement(problem)))


@pytest.mark.long
@pytest.mark.parametrize("problem", ALL, ids=IDS)
def test_both_methods_give_all_that_is_stored(problem: Problem) -> None:
    assert _read(problem.name, "reference.json") == reference_text(reference(problem, statement(problem)))


def test_free_flight_in_closed_form() -> None:
    with mp.workdps(40):
        time, events = mp.pi / 4, _reference("free-flight")["events"]
        for i, event in enumerate(events):
            assert abs(mpf(event[0]) - time) < mpf(10) ** -27
            time += mpf(2) / 3 if i % 2 == 0 else mp.pi / 2


def test_the_orbit_repeats() -> None:
    stored = _reference("impact-orbit")
    states = np.array(stored["states"])
    assert np.abs(states[16:32] - states[:16]).max() < 1e-15
    with mp.workdps(40):
        assert abs(mpf(stored["events"][0][0]) - mpf("0.7")) < mpf(10) ** -29
        assert abs(mpf(stored["events"][1][0]) - mp.pi) < mpf(10) ** -28


def test_references_agree_to_thirty_digits_at_least() -> None:
    for name in IDS:
        assert min(_reference(name)["digits"].values()) >= 30
        assert all(len(re.sub(r"\D", "", t).lstrip("0")) >= 28 for t, *_ in _reference(name)["events"])


# The checker, on results with planted faults


def _perfect(name: str, folder: Path) -> list[Path]:
    """Write results that are the reference itself."""
    stored = _reference(name)
    files = [folder / f"{name}.csv", folder / f"{name}.events.csv"]
    for path, header, rows in (
        (
            files[0],
            ["time", *stored["columns"]],
            [(t, *y) for t, y in zip(stored["times"], stored["states"], strict=True)],
        ),
        (files[1], ["time", "element", "from_region", "to_region"], [event[:4] for event in stored["events"]]),
    ):
        with path.open("w", encoding="utf-8", newline="") as stream:
            csv.writer(stream).writerows([header, *rows])
    return files


def _change(path: Path, change: Any) -> None:
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join(change(lines)) + "\n", encoding="utf-8")


def _with_cell(lines: list[str], row: int, column: int, factor: float) -> list[str]:
    cells = lines[row].split(",")
    cells[column] = repr(float(cells[column]) * factor)
    return [*lines[:row], ",".join(cells), *lines[row + 1 :]]


def test_the_reference_itself_passes(tmp_path: Path) -> None:
    verdict = checker().check("rattling-pair", _perfect("rattling-pair", tmp_path))
    assert verdict["faults"] == []
    assert (verdict["matched"], verdict["missed"], verdict["invented"]) == (103, 0, 0)
    assert verdict["time_error"] < 1e-17
    assert verdict["state_error"] < 1e-12


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda lines: [*lines[:40], *lines[41:]], {"missed": 1, "invented": 0}),
        (lambda lines: [*lines[:40], *lines[42:]], {"missed": 2, "invented": 0}),
        (lambda lines: [*lines[:41], lines[40], *lines[41:]], {"missed": 0, "invented": 1}),
        (lambda lines: _with_cell(lines, 40, 0, 1.00001), {"missed": 0, "invented": 0}),
        (lambda lines: [line.replace("gear,0,1", "gear,0,-1") for line in lines], {"missed": 36, "invented": 36}),
    ],
    ids=["missed", "touch missed", "invented", "shifted", "wrong region"],
)
def test_faults_of_events(change: Any, expected: dict[str, int], tmp_path: Path) -> None:
    files = _perfect("rattling-pair", tmp_path)
    _change(files[1], change)
    verdict = checker().check("rattling-pair", files)
    assert {key: verdict[key] for key in expected} == expected
    if expected["missed"] + expected["invented"]:
        assert verdict["faults"]
        assert verdict["followed"] < verdict["horizon"]
    else:
        moved = 1e-5 * float(_reference("rattling-pair")["events"][39][0])
        assert verdict["time_error"] == pytest.approx(moved, rel=1e-6)


@pytest.mark.parametrize("column", [1, 2, 3, 4])
def test_a_wrong_state(column: int, tmp_path: Path) -> None:
    files = _perfect("rattling-pair", tmp_path)
    _change(files[0], lambda lines: _with_cell(lines, 100, column, 1.1))
    verdict = checker().check("rattling-pair", files)
    assert verdict["faults"]
    assert verdict["followed"] == pytest.approx(_reference("rattling-pair")["times"][99])


def test_missing_samples(tmp_path: Path) -> None:
    files = _perfect("rattling-pair", tmp_path)
    _change(files[0], lambda lines: lines[:100])
    verdict = checker().check("rattling-pair", files)
    assert verdict["missing_samples"] == 48
    assert verdict["followed"] == pytest.approx(_reference("rattling-pair")["times"][98])


def _spoiled(lines: list[str], row: int, old: str, new: str) -> list[str]:
    return [*lines[:row], re.sub(old, new, lines[row], count=1), *lines[row + 1 :]]


@pytest.mark.parametrize(
    ("file", "change", "words"),
    [
        (0, lambda lines: _spoiled(lines, 0, "angle.pinion", "angel.pinion"), "no column 'angle.pinion'"),
        (0, lambda lines: _spoiled(lines, 5, "^[^,]*", "x"), "line 6, column 'time': 'x' is no number"),
        (0, lambda lines: _spoiled(lines, 5, ",[^,]*,", ",nan,"), "'nan' is not finite"),
        (0, lambda lines: _spoiled(lines, 5, ",[^,]*,", ","), "line 6: 4 values where the header has 5"),
        (0, lambda lines: _spoiled(lines, 5, "^[^,]*", "0.0027"), "is no sample time"),
        (0, lambda lines: [*lines, lines[1]], "time goes back"),
        (0, lambda lines: lines[:0], "empty"),
        (1, lambda lines: _spoiled(lines, 5, "gear", "gaer"), "line 6: no element 'gaer'"),
        (1, lambda lines: _spoiled(lines, 5, "gear,.*,", "gear,7,"), "gear has no region 7"),
        (1, lambda lines: _spoiled(lines, 0, "to_region", "to"), "no column 'to_region'"),
    ],
)
def test_input_that_cannot_be_used(file: int, change: Any, words: str, tmp_path: Path, capsys: Any) -> None:
    files = _perfect("rattling-pair", tmp_path)
    _change(files[file], change)
    assert checker().main([str(tmp_path)]) == 2
    assert words in capsys.readouterr().err


def test_names_of_files_and_problems(tmp_path: Path, capsys: Any) -> None:
    check = checker()
    assert check.main([str(tmp_path)]) == 2
    assert "holds no .csv file" in capsys.readouterr().err
    files = _perfect("free-flight", tmp_path)
    other = files[0].rename(tmp_path / "mine.csv")
    assert check.main([str(other)]) == 2
    assert "--problem NAME" in capsys.readouterr().err
    assert check.main([str(other), "--problem", "free-fall"]) == 2
    assert "Known problems: chaotic-rattle" in capsys.readouterr().err
    assert check.main([str(other), "--problem", "free-flight"]) == 0
    assert check.main([str(tmp_path / "none.csv")]) == 2


def test_statistics_beyond_the_horizon(tmp_path: Path) -> None:
    """A long run from another start agrees in its averages; one of another load does not."""
    check = checker()
    problem, stored = check.read_problem("chaotic-rattle")
    model = gr.load(HOME / "chaotic-rattle" / "model.toml")
    verdicts = []
    for load_, start in ((7.54, 0.3), (6.0, 0.0)):
        changed = model.with_({"torque.0.mean": load_})
        run = gr.simulate(
            changed, cycles=2100, samples_per_cycle=16, discard=0, audit=False,
            initial={"angle": [start], "velocity": [0.0]},
        )  # fmt: skip
        columns = {"time": run.data.time.values, "angle.gear": run.data.angle.values[:, 0]}
        columns["velocity.gear"] = run.data.velocity.values[:, 0]
        events = list(run.events[["time", "clearance", "from_region", "to_region"]].itertuples(index=False, name=None))
        rows = check.compare_statistics(columns, events, problem, stored)
        assert len(rows) == 3
        verdicts.append([row[-1] for row in rows])
    assert all(verdicts[0])
    assert not all(verdicts[1])


def test_the_folder_stands_alone(tmp_path: Path) -> None:
    """Copied elsewhere, without gearrattle and SciPy, on all problems, within a minute."""
    shutil.copytree(FOLDER, tmp_path / "set", ignore=shutil.ignore_patterns("__pycache__"))
    results = tmp_path / "results"
    results.mkdir()
    for name in IDS:
        _perfect(name, results)
    program = (
        "import sys; sys.modules.update(dict.fromkeys(['gearrattle', 'scipy', 'pandas', 'mpmath', 'xarray'])); "
        "sys.argv = sys.argv[1:]; import runpy; runpy.run_path(sys.argv[0], run_name='__main__')"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "set" / "check.py"), str(results)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{len(IDS)} of {len(IDS)} problems followed" in done.stdout


def test_programs_import_numpy_alone() -> None:
    own = set(sys.stdlib_module_names) | {"numpy"}
    for path in [FOLDER / "check.py", *(HOME / name / "rhs.py" for name in IDS)]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert {name.split(".")[0] for name in names} <= own
