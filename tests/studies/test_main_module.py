"""Studies begun where the main module cannot be imported again: standard input, a notebook cell, no guard."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
STUDY = """
import sys
import gearrattle as gr
from tests.studies.drivelines import model, loudness
{prefix}
found = gr.study(model(), {{"torque.0.mean": [0.1 * k for k in range(1, 17)]}}, {outputs}, {more})
print((found["outcome"] == 1).sum().item(), "done")
"""
OWN = "def own(run):\n    return {'largest speed': float(abs(run.trajectory.velocity).max())}\n"
PLAIN = '["TR rms"]'
LOCAL = 'scheduler="local", workers=2'


def ran(script: str, folder: Path, *, from_file: bool) -> subprocess.CompletedProcess[str]:
    """Run a script from a file or from standard input."""
    path = folder / "script.py"
    path.write_text(script, encoding="utf-8")
    words, text = ([sys.executable, str(path)], None) if from_file else ([sys.executable], script)
    env = {**os.environ, "PYTHONPATH": f"{ROOT / 'src'}:{ROOT}"}
    return subprocess.run(
        words, check=False, input=text, capture_output=True, text=True, timeout=120, cwd=ROOT, env=env
    )


@pytest.mark.parametrize(
    ("from_file", "more"),
    [
        (False, f"function=loudness, {LOCAL}"),
        pytest.param(True, LOCAL, marks=pytest.mark.long),
        pytest.param(True, f"function=loudness, {LOCAL}", marks=pytest.mark.long),
    ],
    ids=["standard input", "no guard", "no guard, function of a module"],
)
def test_processes_serve_where_the_main_module_is_not_needed(from_file: bool, more: str, tmp_path: Path) -> None:
    actual = ran(STUDY.format(prefix="", outputs=PLAIN, more=more), tmp_path, from_file=from_file)
    assert (actual.returncode, actual.stdout, actual.stderr) == (0, "16 done\n", "")


def test_a_function_from_standard_input_is_refused_at_once(tmp_path: Path) -> None:
    actual = ran(STUDY.format(prefix=OWN, outputs="[]", more=f"function=own, {LOCAL}"), tmp_path, from_file=False)
    assert actual.returncode == 1
    assert "ModelError: function: found own; stands in a main module that other processes cannot" in actual.stderr
    assert 'or take scheduler="threads"' in actual.stderr
    assert len(actual.stderr.splitlines()) < 20


@pytest.mark.parametrize("function", ["own", pytest.param("lambda run: own(run)", marks=pytest.mark.long)])
def test_threads_serve_such_a_function_where_nobody_says_otherwise(function: str, tmp_path: Path) -> None:
    script = STUDY.format(prefix=OWN, outputs="[]", more=f"function={function}, workers=2")
    actual = ran(script, tmp_path, from_file=False)
    assert (actual.returncode, actual.stdout, actual.stderr) == (0, "16 done\n", "")


@pytest.mark.long
def test_a_function_of_a_script_without_a_guard_ends_in_one_error(tmp_path: Path) -> None:
    prefix = OWN + "print('imported', file=sys.stderr)"
    actual = ran(STUDY.format(prefix=prefix, outputs="[]", more=f"function=own, {LOCAL}"), tmp_path, from_file=True)
    assert actual.returncode == 1
    assert actual.stderr.count("Traceback") == 1
    assert 'begin the study under if __name__ == "__main__":' in actual.stderr
    assert 2 <= actual.stderr.count("imported") <= 3  # by the script, and by two workers


@pytest.mark.long
def test_a_guarded_script_may_have_a_function_of_its_own(tmp_path: Path) -> None:
    text = STUDY.format(prefix=OWN, outputs="[]", more=f"function=own, {LOCAL}")
    head, call, tail = text.partition("found = ")
    guarded = f"{head}if __name__ == '__main__':\n    {call}{tail.replace(chr(10) + 'print', chr(10) + '    print')}"
    actual = ran(guarded, tmp_path, from_file=True)
    assert (actual.returncode, actual.stdout, actual.stderr) == (0, "16 done\n", "")


@pytest.mark.long
def test_workers_that_cannot_start_end_the_study(tmp_path: Path) -> None:
    prefix = "import os\nif os.environ.get('GEARRATTLE_STUDY_WORKER'): os._exit(1)\n" + OWN
    actual = ran(STUDY.format(prefix=prefix, outputs="[]", more=f"function=own, {LOCAL}"), tmp_path, from_file=True)
    assert actual.returncode == 1
    assert "ModelError: function: found own; stands in the main module" in actual.stderr
