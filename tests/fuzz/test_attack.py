"""What an attack counts as a find, and what a campaign tells: a faulty target of each kind is found out."""

from __future__ import annotations

import json
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from gearrattle.errors import ModelError, Problem
from tests.fuzz.attack import SECONDS, Attack
from tests.fuzz.mutations import mutated
from tests.fuzz.target import ROOT, LawError, Target, of_texts


def is_sound(path: Path) -> bool:
    return path.read_text(encoding="latin-1") == "1, 2, 3"


def leaving(path: Path) -> None:
    """Leave a temporary file."""
    if not is_sound(path):
        Path(tempfile.mkstemp(suffix=".zip")[1])


def leaving_beside(path: Path) -> None:
    """Leave a folder beside the input."""
    if not is_sound(path):
        path.with_name("left").mkdir()


def printing(path: Path) -> None:
    """Print."""
    if not is_sound(path):
        print("what a library tells")


def slow(path: Path) -> None:
    """Compute for longer than an input may take."""
    end = time.process_time() + 1.2 * SECONDS
    while not is_sound(path) and time.process_time() < end:
        pass


def breaking(path: Path) -> None:
    """Answer otherwise than the law says."""
    if not is_sound(path):
        raise LawError("500 to POST")


def failing(path: Path) -> None:
    """Fail by an error that is not one of ours."""
    if not is_sound(path):
        raise ZeroDivisionError


@pytest.mark.parametrize(
    ("run", "expected"),
    [
        (leaving, "left behind, .zip"),
        (leaving_beside, "left behind, a folder"),
        (printing, "prints"),
        (slow, "slow"),
        (breaking, "law, 500 to POST"),
        (failing, "ZeroDivisionError, elsewhere"),
    ],
)
def test_each_kind_of_fault_is_found(run: Callable[[Path], None], expected: str, tmp_path: Path) -> None:
    attack = Attack(Target("faulty", "x.csv", of_texts("1, 2, 3"), run, kind="text"), tmp_path)
    assert list(attack.run(3, seed=0).finds) == [expected]
    assert attack.result.tried == 3


def test_what_is_refused_is_no_find(tmp_path: Path) -> None:
    def refusing(path: Path) -> None:
        if not is_sound(path):
            raise ModelError(Problem("x.csv", "", "is damaged"))

    attack = Attack(Target("sound", "x.csv", of_texts("1, 2, 3"), refusing, kind="text"), tmp_path)
    assert attack.run(20, seed=0).finds == {}
    assert attack.result.refused > 10


def test_json_is_damaged_in_its_values_and_the_same_seed_gives_the_same_damage() -> None:
    whole = json.dumps({"text": "x = 1\n" * 30, "edits": [{"op": "set", "path": ["a", 0], "value": 1.5}]}).encode()
    damaged = [mutated(whole, random.Random(seed), kind="JSON") for seed in range(300)]
    assert damaged == [mutated(whole, random.Random(seed), kind="JSON") for seed in range(300)]
    values = []
    for data in damaged:
        try:
            values.append(json.loads(data))
        except (ValueError, RecursionError):
            continue
    assert 150 < len(values) < 300
    texts = json.dumps(values)
    assert all(word in texts for word in ("NaN", "Infinity", "\\ud800", "null", str(2**63)))


def campaign(folder: Path, *words: str) -> subprocess.Popen[str]:
    where = ("--counts", str(folder / "counts.json"), "--finds", str(folder / "finds"))
    command = [sys.executable, "-m", "tests.fuzz", *words, *where]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.slow
def test_a_campaign_tells_inputs_seconds_and_finds_of_each_target(tmp_path: Path) -> None:
    process = campaign(tmp_path, "CSV record", "mapping file", "--inputs", "20", "--seed", "7")
    lines = process.communicate()[0].splitlines()
    assert process.returncode == 0
    assert lines[0] == "2 targets, at most 20 inputs and 300 s each, seed 7"
    rows = {line[:48].strip(): line[48:].split() for line in lines[1:]}
    assert rows["target"] == ["inputs", "refused", "seconds", "finds"]
    assert [rows[name][0] for name in ("CSV record", "mapping file", "all")] == ["20", "20", "40"]
    counted = json.loads((tmp_path / "counts.json").read_text())["rows"]
    assert [(row["tried"], row["failures"], row["seed"]) for row in counted] == [(20, 0, 7)] * 2


@pytest.mark.slow
def test_a_campaign_that_is_interrupted_keeps_what_it_counted(tmp_path: Path) -> None:
    process = campaign(tmp_path, "CSV record", "mapping file", "--inputs", "1000000")
    assert process.stdout is not None
    assert "targets" in process.stdout.readline()
    time.sleep(8.0)
    process.send_signal(signal.SIGINT)
    lines, errors = process.communicate(timeout=30.0)
    assert process.returncode == 130
    assert "1 targets were not attacked" in errors
    assert "Traceback" not in errors
    (row,) = json.loads((tmp_path / "counts.json").read_text())["rows"]
    assert row["attack"] == "damaged input: CSV record"
    assert f"{row['tried']}" in lines
