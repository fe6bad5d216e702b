"""Plurals, articles and lists in sentences."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import gearrattle as gr
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


def test_messages_of_the_package_say_an_acceleration_and_1_time() -> None:
    kinds = [with_article(kind) for kind in ("angle", "acceleration", "torque", "velocity", "inertia", "force")]
    assert kinds == ["an angle", "an acceleration", "a torque", "a velocity", "an inertia", "a force"]
    text = """
    schema = 1
    inertia = [{ name = "a", J = "1 rad" }]
    excitation = { speed = 8.0 }
    """
    with pytest.raises(gr.ModelError) as caught:
        gr.loads(text)
    assert " a inertia" not in str(caught.value)
    short = gr.simulate(gr.loads(text.replace('"1 rad"', "1.0")), cycles=1, discard=0, samples_per_cycle=8)
    assert "1 cycle, 0 crossings" in repr(short)


def test_no_message_joins_an_article_or_a_plural_to_what_the_helpers_are_for() -> None:
    """In f-strings "a {quantity}" and "{...cycles} cycles" are wrong for an angle and for one cycle."""
    source = Path(gr.__file__).parent
    article = r"\ba \{(\w+\.)*(quantity|measured|dimension\.name)\}"
    wrong = re.compile(article + r"|(?<!of )\{(\w+\.)*cycles\} cycles\b(?! of)")
    lines = [
        f"{path.relative_to(source)}: {line.strip()}"
        for path in sorted(source.rglob("*.py"))
        for line in path.read_text(encoding="utf-8").splitlines()
        if wrong.search(line) and "== 1" not in line and "!= 1" not in line and "> 1" not in line
    ]
    assert lines == []
