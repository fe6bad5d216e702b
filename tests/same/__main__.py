"""``python -m tests.same BASE [KIND ...]``: every difference between what a commit and the tree at hand answer.

The commit is checked out and recorded twice beside the tree, under out/same, the first time it is asked for.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests.architecture.places import ROOT
from tests.same.differences import differences, read, unsteady

PLACE = ROOT / "out" / "same"
RECORDER = ROOT / "tests" / "same" / "record.py"
KINDS = ("harmonics", "run-up with all", "motion with all", "dimensionless")
"""Kinds of models that are recorded where none are named."""


def parts(kinds: Iterable[str]) -> list[tuple[str, ...]]:
    """Return the arguments of the recorder, a process each; the longest first."""
    return [*(("commands", kind) for kind in kinds), *(("calls", kind) for kind in kinds), ("motions",), ("refusals",)]


def record(tree: Path, folder: Path, kinds: Iterable[str]) -> None:
    """Record a tree, two parts at a time.

    Raises
    ------
    SystemExit
        a part did not end well; its output has been printed.
    """
    shutil.rmtree(folder, ignore_errors=True)
    unfinished = folder.with_name(f"{folder.name}.unfinished")
    shutil.rmtree(unfinished, ignore_errors=True)
    env = {**os.environ, "PYTHONPATH": f"{tree / 'src'}:{tree}", "PYTHONHASHSEED": "0", "COLUMNS": "100"}

    def record_part(words: tuple[str, ...]) -> None:
        command = [sys.executable, str(RECORDER), str(unfinished), *words]
        ended = subprocess.run(command, env=env, cwd=tree, capture_output=True, text=True, check=False)
        if ended.returncode:
            raise SystemExit(f"recording {' '.join(words)} of {tree} failed:\n{ended.stderr[-4000:]}")

    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        for _ in pool.map(record_part, parts(kinds)):
            print(".", end="", flush=True)
    print()
    unfinished.rename(folder)


def commit_of(name: str) -> str:
    """Return the full name of a commit."""
    return git("rev-parse", "--verify", f"{name}^{{commit}}").strip()


def git(*words: str) -> str:
    """Run git in the tree at hand."""
    return subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True, text=True).stdout


def recorded_base(commit: str, kinds: tuple[str, ...]) -> tuple[Path, Path]:
    """Return two records of a commit; made once for a recorder and these kinds."""
    key = hashlib.sha256(RECORDER.read_bytes() + repr(kinds).encode()).hexdigest()[:12]
    tree, records = PLACE / f"tree-{commit[:12]}", [PLACE / f"{commit[:12]}-{key}-{i}" for i in range(2)]
    for folder in records:
        if not folder.exists():
            if not tree.exists():
                git("worktree", "prune")
                git("worktree", "add", "--detach", str(tree), commit)
            print(f"recording {commit[:12]}", end=" ", flush=True)
            record(tree, folder, kinds)
    if tree.exists():
        git("worktree", "remove", "--force", str(tree))
    return records[0], records[1]


def main(name: str, kinds: tuple[str, ...]) -> int:
    """Print every difference; return 1 if there is any."""
    first, second = (read(folder) for folder in recorded_base(commit_of(name), kinds))
    print("recording the tree at hand", end=" ", flush=True)
    record(ROOT, PLACE / "head", kinds)
    head, ignored = read(PLACE / "head"), unsteady(first, second)
    count: Counter[str] = Counter()
    for key, difference in differences(first, head, ignored):
        count[key.split()[0]] += 1
        print(f"{key}\n    " + difference.replace("\n", "\n    "))
    compared = len(first.keys | head.keys)
    print(
        f"{sum(count.values())} differences in {compared} values, {len(ignored)} of them compared without numbers,"
        f" because two records of {name} differ there"
        + "".join(f"; {number} {part}" for part, number in count.most_common())
    )
    return 1 if count else 0


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("name the commit to compare with: make same BASE=<commit>")
    sys.exit(main(sys.argv[1], tuple(sys.argv[2:]) or KINDS))
