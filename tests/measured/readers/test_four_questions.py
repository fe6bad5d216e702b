"""Four questions to every reader: what is my axis, what is its unit, which values count, are they scaled?"""

from __future__ import annotations

import re

from gearrattle.measured.readers import ANSWERS, READERS
from tests.architecture.places import DOCS


def test_every_reader_answers_the_four_questions() -> None:
    assert list(ANSWERS) == list(READERS)
    assert all(all(answers) for answers in ANSWERS.values())


def test_the_manual_has_the_answers() -> None:
    """A row a reader; the message shows what must stand there."""
    text = (DOCS / "howto" / "measured-data.md").read_text(encoding="utf-8")
    rows = "\n".join(f"| {name} | {' | '.join(answers)} |" for name, answers in ANSWERS.items())
    head = "| format | axis | unit of the axis | values that count | scaling |\n|---|---|---|---|---|\n"
    (table,) = re.findall(re.escape(head) + r"((?:\|.*\n)+)", text)
    assert table == rows + "\n"
