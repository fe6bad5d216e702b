"""The page about reliability says what was counted."""

from __future__ import annotations

import json

from benchmarks.reliability.__main__ import HERE, PAGE, page


def test_the_page_has_the_counts_that_the_attacks_left() -> None:
    rows = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("|")]
    assert rows == [line for line in page().splitlines() if line.startswith("|")]


def test_no_attack_fails() -> None:
    counts = [row for path in HERE.glob("*.json") for row in json.loads(path.read_text(encoding="utf-8"))["rows"]]
    assert sum(row["tried"] for row in counts) > 100_000
    assert [row["attack"] for row in counts if row["failures"]] == []
