"""Plurals, articles and lists in sentences."""

from __future__ import annotations

import pytest

from gearrattle.wording import counted, listed, with_article


@pytest.mark.parametrize(
    ("words", "want"),
    [
        (counted(1, "impact"), "1 impact"), (counted(0, "impact"), "0 impacts"), (counted(1.0, "cycle"), "1 cycle"),
        (counted(2.875, "cycle"), "2.88 cycles"), (counted(0.9999, "cycle"), "1 cycle"),
        (counted(2, "entry", "entries"), "2 entries"),
        (with_article("acceleration"), "an acceleration"), (with_article("torque"), "a torque"),
        (with_article("unit"), "a unit"), (with_article("hour"), "an hour"), (with_article("Inertia"), "an Inertia"),
        (listed(["a"]), "a"), (listed(["a", "b"]), "a and b"), (listed(["a", "b", "c"]), "a, b and c"),
        (listed([]), ""),
    ],
)  # fmt: skip
def test_numbers_and_articles_agree_with_their_nouns(words: str, want: str) -> None:
    assert words == want
