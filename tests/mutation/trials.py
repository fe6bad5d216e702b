"""Which tests run a line of a kernel as plain Python, and whether they notice a mutant of it.

Each mutant is tried in a copy of the source: the quickest tests that run its line, up to ``SECONDS`` of them. A test
that fails, or takes much longer than before, has noticed it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

from coverage import CoverageData

from tests.architecture.places import ROOT
from tests.mutation.mutants import Mutant

KERNELS = Path("gearrattle") / "engine" / "kernels"
SECONDS = 20.0
"""Of tests a mutant is tried with, by the time they took without it."""
_PATIENCE = 120.0  # seconds of a trial: a mutant may well loop for ever
_START = 10.0  # of a process


@dataclass(frozen=True)
class Covering:
    """The tests that run each line.

    Attributes
    ----------
    lines
        by file name and number of the line the tests that run it, quickest first.
    seconds
        by test how long it took.
    """

    lines: dict[tuple[str, int], list[str]]
    seconds: dict[str, float]

    def of(self, mutant: Mutant) -> list[str]:
        """The quickest tests of a mutant's line, together up to ``SECONDS``; at least one, where there is any."""
        chosen: list[str] = []
        total = 0.0
        for test in self.lines.get((mutant.file, mutant.line), []):
            total += self.seconds.get(test, 0.0)
            if chosen and total > SECONDS:
                break
            chosen.append(test)
        return chosen


def _environment(source: Path) -> dict[str, str]:
    path = os.pathsep.join((str(source), str(ROOT)))
    return {**os.environ, "PYTHONPATH": path, "NUMBA_DISABLE_JIT": "1", "PYTHONDONTWRITEBYTECODE": "1"}


def _pytest(source: Path, *arguments: str) -> list[str]:
    return [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", f"--rootdir={ROOT}", *arguments]


def covering(folder: Path, tests: Sequence[str]) -> Covering:
    """Run tests once, as plain Python, and note which lines each of them runs.

    Parameters
    ----------
    folder
        for what is measured.
    tests
        files and folders.

    Raises
    ------
    RuntimeError
        a test fails without any mutant.
    """
    data, results = folder / "coverage", folder / "results.xml"
    environment = {**_environment(ROOT / "src"), "COVERAGE_FILE": str(data)}
    arguments = (
        "-n",
        "auto",
        "-m",
        "not long",
        "--cov=gearrattle.engine.kernels",
        "--cov-context=test",
        "--cov-report=",
    )
    command = _pytest(ROOT / "src", *arguments, f"--junitxml={results}", *tests)
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stdout[-2000:])
    cases = ET.parse(results).iter("testcase")
    seconds = {f"{case.get('classname')}::{case.get('name')}": float(case.get("time") or 0.0) for case in cases}
    recorded = CoverageData(str(data))
    recorded.read()
    lines: dict[tuple[str, int], list[str]] = {}
    times: dict[str, float] = {}
    for file in recorded.measured_files():
        for line, contexts in recorded.contexts_by_lineno(file).items():
            tests = {context.partition("|")[0] for context in contexts if "::" in context}
            times |= {test: seconds.get(_in_results(test), 0.0) for test in tests}
            lines[Path(file).name, line] = sorted(tests, key=lambda test: (times[test], test))
    return Covering(lines, times)


def _in_results(test: str) -> str:
    """The name of a test as the results write it."""
    file, _, name = test.partition("::")
    return f"{file.removesuffix('.py').replace('/', '.')}::{name}"


def copied(folder: Path) -> Path:
    """A copy of the source to spoil."""
    return Path(shutil.copytree(ROOT / "src", folder / "src", ignore=shutil.ignore_patterns("__pycache__")))


def is_noticed(mutant: Mutant, tests: list[str], source: Path) -> bool:
    """Whether one of some tests fails or hangs with a mutant put into a copy of the source."""
    file = source / KERNELS / mutant.file
    whole = file.read_text(encoding="utf-8")
    file.write_text(mutant.text, encoding="utf-8")
    try:
        command = _pytest(source, "-x", "-p", "no:xdist", *tests)
        done = subprocess.run(
            command, cwd=ROOT, env=_environment(source), capture_output=True, timeout=_PATIENCE, check=False
        )
    except subprocess.TimeoutExpired:
        return True
    finally:
        file.write_text(whole, encoding="utf-8")
    return done.returncode != 0
