"""Write the data of clearance-benchmarks/: ``python -m benchmarks.benchmark_set [NAME ...]``, then its table of results.

With names only these problems are made again. ``--table`` measures nothing but writes the table anew from the last
results; ``--solvers`` measures only.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

from benchmarks.benchmark_set import right_hand_side
from benchmarks.benchmark_set.problems import PROBLEMS
from benchmarks.benchmark_set.reference import reference, text
from benchmarks.benchmark_set.statements import json_text, model_file, page, statement

HOME = Path(__file__).resolve().parents[2] / "clearance-benchmarks" / "problems"


def write(names: list[str]) -> None:
    """Solve the problems by both methods and write their folders."""
    for make in PROBLEMS:
        problem = make()
        if names and problem.name not in names:
            continue
        began = perf_counter()
        stated = statement(problem)
        data = reference(problem, stated)
        folder = HOME / problem.name
        folder.mkdir(parents=True, exist_ok=True)
        for file, content in (
            ("problem.json", json_text(stated)),
            ("reference.json", text(data)),
            ("model.toml", model_file(problem.driveline, problem)),
            ("rhs.py", right_hand_side.text(stated)),
            ("README.md", page(problem, stated, data)),
        ):
            (folder / file).write_text(content, encoding="utf-8")
        print(
            f"{problem.name}: {len(data['events'])} events, horizon {data['horizon']:.6g} of {data['times'][-1][:8]}, "
            f"digits {data['digits']}, {perf_counter() - began:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    write(sys.argv[1:])
