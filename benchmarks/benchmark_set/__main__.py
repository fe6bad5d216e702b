"""Write clearance-benchmarks/: ``python -m benchmarks.benchmark_set [references|solvers|pages] [NAME ...]``.

Without a word all three: references of the problems, what the solvers make of them, statements and pages. With names
only these problems; ``--solver TEXT`` only solvers whose name has that in it.
"""

from __future__ import annotations

import argparse
import json
from time import perf_counter

from benchmarks.benchmark_set import results, right_hand_side
from benchmarks.benchmark_set.problems import PROBLEMS, Problem
from benchmarks.benchmark_set.reference import reference, text
from benchmarks.benchmark_set.solvers import HOME
from benchmarks.benchmark_set.statements import json_text, model_file, page, statement

PARTS = ("references", "solvers", "pages")


def solve(problem: Problem) -> None:
    """Solve a problem by both methods and keep the reference."""
    began = perf_counter()
    data = reference(problem, statement(problem))
    (HOME / problem.name).mkdir(parents=True, exist_ok=True)
    (HOME / problem.name / "reference.json").write_text(text(data), encoding="utf-8")
    print(
        f"{problem.name}: {len(data['events'])} events, horizon {data['horizon']:.6g} of {data['times'][-1][:8]}, "
        f"digits {data['digits']}, {perf_counter() - began:.0f} s",
        flush=True,
    )


def write_statements(problem: Problem) -> None:
    """Write all of a problem but its reference."""
    stated = statement(problem)
    folder = HOME / problem.name
    data = json.loads((folder / "reference.json").read_text(encoding="utf-8"))
    for file, content in (
        ("problem.json", json_text(stated)),
        ("model.toml", model_file(problem)),
        ("rhs.py", right_hand_side.text(stated)),
        ("README.md", page(problem, stated, data)),
    ):
        (folder / file).write_text(content, encoding="utf-8")


def main() -> None:
    """Do the parts that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("words", nargs="*", help="references, solvers, pages; names of problems")
    parser.add_argument("--solver", default="")
    arguments = parser.parse_args()
    parts = [word for word in arguments.words if word in PARTS] or list(PARTS)
    names = [word for word in arguments.words if word not in PARTS]
    problems = [problem for problem in (make() for make in PROBLEMS) if not names or problem.name in names]
    for problem in problems if "references" in parts else ():
        solve(problem)
    for problem in problems:
        write_statements(problem)
    if "solvers" in parts:
        results.measure_all([problem.name for problem in problems], arguments.solver)
    if "pages" in parts:
        results.write_tables()


if __name__ == "__main__":
    main()
