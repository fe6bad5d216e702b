"""Run solvers on the problems, check what they write with ``check.py``, keep the verdicts, write the table of results."""

from __future__ import annotations

import csv
import importlib.util
import json
import signal
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any

import numpy as np

from benchmarks.benchmark_set.problems import PROBLEMS, Problem
from benchmarks.benchmark_set.solvers import HOME, Outcome, Solver, TooLong, load, solvers
from benchmarks.machine import machine

FOLDER = HOME.parent
RESULTS = FOLDER / "results.json"
LIMIT = 4.0
"""Processor time that a run may take [s]."""


def checker() -> ModuleType:
    """Import ``check.py``."""
    spec = importlib.util.spec_from_file_location("check", FOLDER / "check.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def write(folder: Path, name: str, outcome: Outcome) -> list[Path]:
    """Write samples and events as ``check.py`` reads them; return the files."""
    module = load(name)
    head = [f"# {key}: {value}" for key, value in (("rhs", outcome.rhs), ("steps", outcome.steps)) if value]
    head += [f"# seconds: {outcome.seconds:.3g}"] + ([f"# failed: {outcome.failed}"] if outcome.failed else [])
    columns = ["time", *(f"{kind}.{body}" for kind in ("angle", "velocity") for body in module.BODIES)]
    rows = [(t, *state) for t, state in zip(outcome.times, outcome.states, strict=True) if np.all(np.isfinite(state))]
    files = [folder / f"{name}.csv", folder / f"{name}.events.csv"]
    for path, header, lines in (
        (files[0], columns, rows),
        (files[1], ["time", "element", "from_region", "to_region"], outcome.events or []),
    ):
        with path.open("w", encoding="utf-8", newline="") as stream:
            stream.write("".join(f"{line}\n" for line in head))
            csv.writer(stream).writerows([header, *lines])
    return files


def measure(solver: Solver, name: str) -> dict[str, Any]:
    """Run and check. Of a run that takes too long counts what it has kept, of gearrattle's nothing."""

    def stop(*_: object) -> None:
        raise TooLong

    signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, LIMIT)
    try:
        outcome = solver.run(name)
    except TooLong:
        outcome = Outcome([0.0], [load(name).START], [], failed="more than its processor time")
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
    with TemporaryDirectory() as folder:
        verdict = checker().check(name, write(Path(folder), name, outcome))
    return {
        "solver": solver.name,
        "setting": solver.setting,
        "problem": name,
        "followed": verdict["followed"] / verdict["horizon"],
        "good": not verdict["faults"],
        "missed": verdict["missed"],
        "invented": verdict["invented"],
        "time_error": verdict["time_error"],
        "state_error": verdict["state_error"],
        "rhs": outcome.rhs,
        "steps": outcome.steps,
        "seconds": round(outcome.seconds, 3),
        "failed": outcome.failed,
    }


def _compiled(solver: Solver, row: dict[str, Any]) -> bool:
    return solver.package == "gearrattle" and row["failed"].startswith("more than")


def measure_all(names: list[str], only: str = "") -> None:
    """Measure and keep after every solver, so that a run that is ended loses little."""
    kept = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {"rows": []}
    for solver in solvers():
        if only and only not in solver.name:
            continue
        try:
            kept.setdefault("versions", {})[solver.package] = version(solver.package)
        except PackageNotFoundError:
            print("not installed, left out:", solver.package)
            continue
        rows = [measure(solver, name) for name in names]
        # what is compiled once has been compiled now
        rows = [measure(solver, row["problem"]) if _compiled(solver, row) else row for row in rows]
        key = {(row["solver"], row["setting"], row["problem"]) for row in rows}
        kept["rows"] = [r for r in kept["rows"] if (r["solver"], r["setting"], r["problem"]) not in key] + rows
        kept["date"] = datetime.now(UTC).date().isoformat()
        kept["machine"] = machine()
        lines = ",\n".join("  " + json.dumps(row) for row in kept["rows"])
        rest = {key: value for key, value in kept.items() if key != "rows"}
        text = json.dumps(rest)[:-1] + f', "rows": [\n{lines}\n]}}\n'
        RESULTS.write_text(text, encoding="utf-8")
        good = sum(row["good"] for row in rows)
        print(f"{solver.name}, {solver.setting}: {good} of {len(rows)}", flush=True)


def result_table() -> str:
    """The table of results: one line a solver; then what of the horizon it followed, problem by problem."""
    data = json.loads(RESULTS.read_text(encoding="utf-8"))
    names = sorted({row["problem"] for row in data["rows"]}, key=[p.name for p in _ordered()].index)
    lines = [
        f"{data['date']}; " + ", ".join(f"{k} {v}" for k, v in sorted(data["versions"].items())) + ". Seconds are of "
        f"{data['machine']}, Python right-hand sides but for gearrattle and heyoka.",
        "",
        "| solver | tolerance | problems followed | missed | invented | median state error | right-hand sides | steps | seconds |",
        "|---|---|--:|--:|--:|--:|--:|--:|--:|",
    ]
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for solver in solvers():
        rows = [r for r in data["rows"] if (r["solver"], r["setting"]) == (solver.name, solver.setting)]
        if rows:
            groups[solver.name, solver.setting] = sorted(rows, key=lambda row: names.index(row["problem"]))
    for (name, setting), rows in groups.items():
        total = {
            key: sum(row[key] for row in rows) for key in ("good", "missed", "invented", "rhs", "steps", "seconds")
        }
        median = float(np.median([row["state_error"] for row in rows]))
        lines.append(
            f"| {name} | {setting} | {total['good']} of {len(rows)} | {total['missed']} | {total['invented']} | "
            f"{median:.0e} | {total['rhs'] or ''} | {total['steps'] or ''} | {total['seconds']:.1f} |"
        )
    numbers = {name: i for i, name in enumerate(names, 1)}
    lines += [
        "",
        "What of the horizon was followed, in %; a dot: all of it. Problems: "
        + ", ".join(f"{i} {name}" for name, i in numbers.items())
        + ".",
        "",
        "| solver | tolerance | " + " | ".join(str(i) for i in numbers.values()) + " |",
        "|---|---|" + "--:|" * len(numbers),
    ]
    for (name, setting), rows in groups.items():
        shares = {row["problem"]: "." if row["good"] else f"{min(99, int(100 * row['followed']))}" for row in rows}
        lines.append(f"| {name} | {setting} | " + " | ".join(shares.get(name, "") for name in names) + " |")
    failures = sorted({(r["solver"], r["problem"], r["failed"]) for r in data["rows"] if r["failed"]})
    if failures:
        lines += ["", "Runs that ended early: " + "; ".join(f"{a} on {b} ({c})" for a, b, c in failures) + "."]
    return "\n".join(lines)


def _ordered() -> list[Problem]:
    return [make() for make in PROBLEMS]


def problem_table() -> str:
    """One line a problem: number, size, events, horizon, what it tests."""
    lines = [
        "| | problem | inertias | elements with corners | events | horizon of the time certified | tests |",
        "|--:|---|--:|--:|--:|--:|---|",
    ]
    for number, problem in enumerate(_ordered(), 1):
        stated, data = checker().read_problem(problem.name)
        gaps = sum(bool(e["corners"]) for e in stated["elements"])
        share = min(100.0, 100 * data["horizon"] / data["times"][-1])
        lines.append(
            f"| {number} | `{problem.name}`: {problem.title} | {len(stated['bodies'])} | "
            f"{gaps} | {len(data['events'])} | {share:.0f} % | {problem.tests} |"
        )
    return "\n".join(lines)


def write_tables() -> None:
    """Put the tables between their marks in the folder's page."""
    page = FOLDER / "README.md"
    text = page.read_text(encoding="utf-8")
    for name, table in (("problems", problem_table()), ("results", result_table())):
        begin = f"<!-- {name}: written by make benchmark-set -->"
        end = f"<!-- end of {name} -->"
        before, rest = text.split(begin)
        text = f"{before}{begin}\n{table}\n{end}{rest.split(end)[1]}"
    page.write_text(text, encoding="utf-8")
