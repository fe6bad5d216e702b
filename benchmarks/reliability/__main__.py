"""Run the attacks that are tests, and write docs/reference/reliability.md from all counts: ``make reliability``.

Fuzzing, kills and power cuts take long: they have commands of their own, which leave their counts beside this file.
``--page`` writes the page from the counts that are there.

Takes nothing; writes tests.json beside this file, and the page.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from datetime import date
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PAGE = ROOT / "docs" / "reference" / "reliability.md"
TESTS: Mapping[str, tuple[str, str]] = {
    "pipes and devices in place of files": ("tests/test_files.py", "no_regular_file"),
    "files that unpack to gigabytes": ("tests/test_files.py", "bomb"),
    "files outside of the folder of a model": (
        "tests/test_files.py",
        "folder_only or widen or toml_model or elsewhere",
    ),
    "bad values in study files and calls": ("tests/studies/test_bad_values.py", "refused or refuses"),
    "bad values in model files": ("tests/model/test_broken_files.py", ""),
    "measured files, cut off and overwritten": ("tests/measured/readers/test_damage.py", ""),
    "bombs for readers": ("tests/measured/readers/test_bombs.py", ""),
    "bad jobs, records and links in a workspace": ("tests/workbench/test_bad_jobs.py", ""),
    "earlier finds of damaged input": ("tests/fuzz/test_finds.py", ""),
}
"""Attack -> the tests that carry it out: a file, and which of it."""
COMMANDS = {
    "damaged input": "make fuzz",
    "kills": "python -m tests.reliability.kills",
    "power cuts": "python -m tests.reliability.power",
}
"""The first words of an attack -> how to run it again; the others are run by ``make reliability``."""
HEAD = """# Reliability under attack

Written by `make reliability` on {date} from the counts that each attack left; do not edit.

Promised, and attacked here:

- Any input ends with a value or with one error of `gearrattle.errors`, within two seconds of processor time and below 1 GB of memory; it
  prints nothing and leaves no file behind.
- The page of `gearrattle serve` answers any request by a value or by problems in words, never by an internal error; a bad record of a job
  breaks its own row at most.
- A file that is named in an input file is a regular file under an allowed folder; no other is opened.
- Values are checked before anything is written. What is written appears whole or not at all.
- A command that is killed leaves what an undisturbed one would have left of it, and begun again it ends with the same values.

A failure is an input with any other end. `damaged input` means generated files and requests: a sound one of each kind with tokens, numbers,
values of JSON or bytes changed, cut or repeated; nothing is simulated from it. Where atheris is installed, some inputs are chosen by the
code that they reach (*guided*). `kills` means INT, TERM or KILL at a random instant of a command; after each, every number and text of what
is there is compared bit for bit with that of an undisturbed command. Failures found earlier are mended and kept as tests
(`tests/fuzz/test_finds.py`); the counts of an attack begin anew when it has found one.

| attack | tried | of them guided | seconds | failures | date | again |
|---|---|---|---|---|---|---|
"""
TAIL = """
Not attacked: Windows and macOS, network file systems, object stores that fail halfway, several users in one folder, parts of asammdf, HDF5 and
SciPy that gearrattle does not call, and motions that are hard to compute (`tests/laws`, `tests/engine/solvers` attack those).
"""


def run_tests() -> None:
    """Run the tests of every attack and keep how many there were."""
    rows = []
    for attack, (path, which) in TESTS.items():
        with tempfile.TemporaryDirectory() as folder:
            report = Path(folder) / "report.xml"
            command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", f"--junitxml={report}", path]
            subprocess.run([*command, *(["-k", which] if which else [])], cwd=ROOT, check=False)
            suite = ElementTree.parse(report).getroot()[0].attrib
        tried = int(suite["tests"]) - int(suite["skipped"])
        failures = int(suite["failures"]) + int(suite["errors"])
        rows.append({"attack": attack, "tried": tried, "failures": failures})
    (HERE / "tests.json").write_text(json.dumps({"date": f"{date.today()}", "rows": rows}, indent=1) + "\n")


def page() -> str:
    """Return the page, from the counts beside this file."""
    lines = []
    for path in sorted(HERE.glob("*.json")):
        content = json.loads(path.read_text(encoding="utf-8"))
        lines += [_line(row, str(row.get("date", content["date"]))) for row in content["rows"]]
    return HEAD.format(date=date.today()) + "\n".join(lines) + "\n" + TAIL


def _line(row: Mapping[str, Any], day: str) -> str:
    attack = str(row["attack"])
    again = next((command for words, command in COMMANDS.items() if attack.startswith(words)), "make reliability")
    counts = (row["tried"], row.get("guided") or "", row.get("seconds", ""), row["failures"])
    return f"| {attack} | {' | '.join(map(str, counts))} | {day} | `{again}` |"


if __name__ == "__main__":
    if "--page" not in sys.argv[1:]:
        run_tests()
    PAGE.write_text(page(), encoding="utf-8")
